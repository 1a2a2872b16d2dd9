"""Forms and chains: rendered, measured, decided, planned, budgeted, handed on; a reduced proof of the laws of forms."""

import csv
import json
from xml.etree import ElementTree

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.models.form_law import form_law
from imaging.pictures import Pictures
from scenes.files.written import edited
from tests import toleranced
from tests.commands import ice
from tests.proofs import form, form_poses
from tests.proofs.kinds import pictures
from validation.inspection import inspect
from validation.report.inspection_files import About, records

pytestmark = pytest.mark.render
POSE = (30, 135), (15, 315)
POSES = ("--sensor", "10,300", "--light", "5,40")
_SMALL = {"width": 480, "height": 384, "focal_px": 1800.0}
_EDGE = {"edge": "e7"}
ASKED = [
    {"name": "front", "kind": "straightness", "features": [_EDGE], "tolerance": 0.05},
    {"name": "line", "kind": "profile", "features": [_EDGE], "tolerance": 0.1},
    {"name": "there", "kind": "width", "features": [_EDGE, {"edge": "e4"}], "tolerance": 0.05},
    {"name": "back", "kind": "width", "features": [{"edge": "e4"}, _EDGE], "tolerance": 0.05},
    {"name": "mean", "kind": "mean", "of": ["there", "back"], "tolerance": 0.05},
    {"name": "larger", "kind": "largest", "of": ["there", "back"], "tolerance": 0.05},
]


@pytest.fixture(scope="module")
def block():
    return scenes.load("task1").with_(task=None, settings=[], measurands=ASKED)


@pytest.fixture(scope="module")
def proven(tmp_path_factory):
    return {case.name: case for case in form.cases(tmp_path_factory.mktemp("plate"))}


@pytest.mark.parametrize(
    "name",
    ["straightness, no form", "straightness, 1.7 waves", "profile of an edge, no form", "roundness, no form",
     "roundness, 3 waves", "profile of a bore, 2 waves"],
)  # fmt: skip
def test_zones_follow_their_law(proven, name):
    """Of 100 parts: mean, quantile and decisions as told; zones from which nothing is taken off are refused."""
    row = form.row(proven[name], 100, np.random.default_rng(11))
    assert row.follows(6), str(row)
    assert row.is_decided(6), str(row)
    assert abs(row.off) < 1.0 < row.untouched
    assert row.untouched * np.sqrt(row.count) > 10  # negative control, standard errors


def test_a_block_quickly(block):
    """Plan, picture, value, budget, decision: the estimator of lines does not matter, for forms are of points."""
    found = planner.plan(block, step_deg=30, refined=False)
    assert found.limiting in {each["name"] for each in ASKED}
    picture = scenes.Picture.of(block, *POSE)
    image = render.expose(render.image(picture), block.noise, np.random.default_rng(1), 1)[0]
    by = {name: measure.measure(image, picture, estimator=name) for name in ("gradient", "isophote")}
    assert by["gradient"].value[0] == by["isophote"].value[0]
    seen = by["gradient"]
    (points,) = seen.forms["front"]
    law = form_law(Pictures.of(picture), block.quantities[0])
    assert (points.points.size, points.law.noise.mean) == (len(law.covariance), pytest.approx(law.noise.mean, rel=0.05))
    made = inspect(seen)
    zones = {zone.zone.name: zone for zone in made.zones}
    assert {name: zone.decision for name, zone in zones.items()} == {"front": "pass", "line": "pass"}
    assert zones["front"].facts["low"] == 0.0 < zones["front"].facts["at_most"] < 0.05
    rows = {row.requirement.name: row for row in made.rows}
    assert [rows[name].decision for name in ("front", "line", "mean", "larger")] == [None, None, "pass", "pass"]
    assert rows["mean"].value == pytest.approx((rows["there"].value + rows["back"].value) / 2)
    assert rows["larger"].value == max(rows["there"].value, rows["back"].value)
    assert made.decision == "pass"
    lines = records(made, About("", ("picture.png",)))
    assert [each["characteristic"] for each in lines] == [
        each["name"] for each in ASKED
    ]  # a form has one line, its zone's
    assert [each["lower"] for each in lines if each["characteristic"] in zones] == [0.0, 0.0]


def test_what_is_not_known_of_the_camera(block):
    """A part that may lie elsewhere is off its nominal line, twice as far as it lies; it is as straight as before."""
    shaky = block.with_(uncertainty={"part_shift": {"sd": 0.01}})
    budgets = [{m.name: m for m in planner.budget(scene, *POSE)} for scene in (block, shaky)]
    parts = {row.source: row.contribution for row in budgets[1]["line"].contributions}
    assert parts["part_shift.y"] == pytest.approx(0.02, rel=1e-3)  # across the edge, which runs along x
    assert parts["part_shift.x"] < 1e-6
    assert budgets[1]["front"].u == pytest.approx(budgets[0]["front"].u, rel=1e-3)
    bent = block.with_(camera={"lens": {"distortion": [{"value": 0.0, "sd": 0.01}, 0.0, 0.0]}})
    told = {
        row.source: row.contribution
        for m in planner.budget(bent, *POSE)
        for row in m.contributions
        if m.name == "front"
    }
    assert max(u for name, u in told.items() if name.startswith("camera.lens")) > 1e-4  # a lens that may bend edges


def test_through_all_commands(tmp_path):
    """A plate's bores and edges from its scene file to inspection, budget and plan."""
    asked = [
        {"name": "bore", "kind": "roundness", "features": [{"circle": "c4"}], "tolerance": 0.1},
        {"name": "end", "kind": "profile", "features": [{"circle": "c8"}], "tolerance": 0.2},
        {"name": "front", "kind": "straightness", "features": [{"edge": "e5"}], "tolerance": 0.1},
        {"name": "B", "kind": "diameter", "features": [{"circle": "c4"}], "tolerance": 0.1},
        {"name": "C", "kind": "diameter", "features": [{"circle": "c6"}], "tolerance": 0.1},
        {"name": "mean", "kind": "mean", "of": ["B", "C"], "tolerance": 0.1},
        {"name": "difference", "kind": "sum", "of": ["B"], "minus": ["C"], "tolerance": 0.1},
        {"name": "smaller", "kind": "smallest", "of": ["B", "C"], "tolerance": 0.1},
    ]
    scene = toleranced.scene(tmp_path, ("back",), **_SMALL)
    data = scene.model_dump(mode="json", exclude_defaults=True, exclude={"name"})
    data["object"]["file"], data["measurands"] = "toleranced.ply", asked
    (tmp_path / "plate.toml").write_text(edited("", data))
    done = ice("render", "plate.toml", *POSES, "-o", "plate.png", "--noise-seed", 3, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    done = ice("measure", "plate.png", "plate.toml", *POSES, "--inspection", "out", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    values = {each["name"]: each for each in told["measurands"]}
    for name, true in (("B", 8.0), ("C", 7.0), ("mean", 7.5), ("difference", 1.0), ("smaller", 7.0)):
        assert abs(values[name]["value"] - true) < 5 * values[name]["u"]  # margin: 5 standard uncertainties
        assert values[name]["decision"] == "pass"
    zones = {each["name"]: each for each in told["zones"]}
    assert {name: each["decision"] for name, each in zones.items()} == dict.fromkeys(("bore", "end", "front"), "pass")
    assert all(0 <= each["low"] <= each["value"] < each["at_most"] < each["high"] for each in zones.values())
    rows = list(csv.DictReader((tmp_path / "out/inspection.csv").read_text().splitlines()))
    assert [row["characteristic"] for row in rows if row["lower"] == "0.0"] == ["bore", "end", "front"]
    assert [row["characteristic"] for row in rows] == [each["name"] for each in asked]
    results = ElementTree.parse(tmp_path / "out/inspection.qif").getroot()
    assert (
        sum(each.text == "PASS" for each in results.iter("{http://qifstandards.org/xsd/qif3}CharacteristicStatusEnum"))
        == 8
    )
    told = json.loads(ice("predict", "plate.toml", *POSES, "--json", cwd=tmp_path).stdout)["settings"][0]["measurands"]
    by_noise = {each["name"]: each["noise_zone"] for each in told if "noise_zone" in each}
    assert set(by_noise) == set(zones)
    assert all(zones[name]["value"] + 4 * zones[name]["u"] < each["at_most"] * 2 for name, each in by_noise.items())
    assert "points of a perfect feature seem to need" in ice("predict", "plate.toml", *POSES, cwd=tmp_path).stdout
    shown = " ".join(ice("show", "plate.toml", cwd=tmp_path).stdout.split())
    assert "difference sum B, less C" in shown
    told = json.loads(ice("budget", "plate.toml", *POSES, "--json", cwd=tmp_path).stdout)
    risks = {each["name"]: each["capability"]["specific_risk"] for each in told["measurands"]}
    assert risks["bore"] is None is not risks["mean"]
    plan = json.loads(ice("plan", "plate.toml", "--step", 45, "--no-check", "--json", cwd=tmp_path).stdout)
    assert {each["name"] for each in plan["measurands"]} == {each["name"] for each in asked}


def test_forms_at_random_poses(tmp_path):
    """A reduced proof: one rendered picture, a bore, an edge and the larger of two bores."""
    scene, rng = form_poses.scene(tmp_path), np.random.default_rng(1)
    some = ("roundness c2", "straightness e8", "B", "C", "largest")
    asked = [each.model_dump(exclude_none=True) for each in scene.measurands if each.name in some]
    (picture,) = pictures(scene.with_(measurands=asked), 1, rng)
    rows = list(form_poses.rows(picture, 40, rng, 1))
    assert [row.name for row in rows] == ["roundness c2", "straightness e8", "largest"]
    assert all(row.is_told(3 * len(rows)) for row in rows), [str(row) for row in rows]
