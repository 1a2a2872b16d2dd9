"""Geometric tolerances and features between others: rendered, measured, decided, planned, budgeted, validated."""

import json

import numpy as np
import pytest
from scipy import stats

import measure
import planner
import render
import scenes
from scenes.files.written import edited
from tests import toleranced
from tests.commands import ice
from tests.proofs import kinds
from validation.budgets import capability
from validation.inspection import expanded, inspect
from validation.report.inspection_files import About, records
from validation.zones import measured_zones

pytestmark = pytest.mark.render
NAMES = ("in edges", "slot to plate", "right", "bolts", "slot")
POSES = ("--sensor", "20,300", "--light", "30,350")
_TINY = {"width": 240, "height": 192, "focal_px": 900.0}
_SMALL = {"width": 480, "height": 384, "focal_px": 1800.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The plate's scene as a file, another whose true place is off by 0.09 mm in x and y, and a picture."""
    made = tmp_path_factory.mktemp("toleranced")
    scene = toleranced.scene(made, NAMES, 40, **_TINY)
    data = scene.model_dump(mode="json", exclude_defaults=True, exclude={"name"})
    data["object"]["file"] = "toleranced.ply"
    data["settings"] = [{"sensor": [20, 300], "light": [30, 350]}]
    (made / "plate.toml").write_text(edited("", data))
    data["measurands"] = [
        each | ({"nominal": [30.09, 32.09]} if each["name"] == "in edges" else {}) for each in data["measurands"]
    ]
    (made / "off.toml").write_text(edited("", data))
    done = ice("render", "plate.toml", *POSES, "-o", "plate.png", "--noise-seed", 3, cwd=made)
    assert done.returncode == 0, done.stderr
    return made


def _measured(folder, scene):
    done = ice("measure", "plate.png", scene, *POSES, "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def _parts(told):
    """Of the zone's two numbers."""
    return [each for each in told["measurands"] if each["kind"] == "true_position"]


def test_measured_values_are_the_plates(folder):
    """Within 5 combined standard uncertainties; single numbers are decided, those of a zone with it."""
    told = _measured(folder, "plate.toml")
    for each in told["measurands"]:
        true = toleranced.VALUES[each["name"]]
        assert abs(each["value"] - true) < 5 * each["u"], each["name"]  # margin: 5 standard uncertainties
        assert each["status"] == "ok"
    decisions = {each["name"]: each["decision"] for each in told["measurands"]}
    assert (decisions["in edges.x"], decisions["in edges.y"], decisions["right"]) == (None, None, "pass")
    assert decisions["slot to plate"] == "fail"  # the slot is 2 mm off the plate's middle, and is drawn in it
    (zone,) = told["zones"]
    assert (zone["name"], zone["parts"], zone["size"]) == ("in edges", ["in edges.x", "in edges.y"], 0.2)
    assert (zone["decision"], zone["status"]) == ("pass", "ok")
    x, y = (each["value"] - each["nominal"] for each in _parts(told))
    assert zone["value"] == pytest.approx(2 * np.hypot(x, y))
    assert zone["low"] < zone["at_most"] < zone["high"] < 0.2


def test_two_components_within_their_limits_leave_the_zone(folder):
    """Each is off by 0.09 of 0.1 mm; the circle's diameter is 0.25 of 0.2."""
    told = _measured(folder, "off.toml")
    for each in _parts(told):
        assert abs(each["value"] - each["nominal"]) + 2 * each["u"] < each["tolerance"]["plus"]
    (zone,) = told["zones"]
    assert zone["value"] == pytest.approx(2 * np.hypot(0.09, 0.09), abs=5 * zone["u"])
    assert zone["decision"] == "fail"
    table = ice("measure", "plate.png", "off.toml", *POSES, cwd=folder).stdout
    row = next(line for line in table.splitlines() if line.strip().startswith("in edges ") and "true_position" in line)
    assert "fail" in row
    assert "<=" in row


def test_planned_and_budgeted(folder):
    """By tolerance, the worst number of all named; no risk is said of a number that a zone decides."""
    done = ice("plan", "plate.toml", "--step", 45, "--no-check", "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    plan = json.loads(done.stdout)
    scene = scenes.load(folder / "plate.toml")
    limits = {quantity.name: quantity.tolerance.half for quantity in scene.quantities}
    assert limits["in edges.x"] == 0.1  # half of the zone's diameter
    assert {each["name"] for each in plan["measurands"]} == set(limits)
    assert plan["limiting"] in limits
    done = ice("budget", "plate.toml", "--sensor", "20,300", "--light", "30,350", "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    rows = {each["name"]: each for each in json.loads(done.stdout)["measurands"]}
    assert set(rows) == set(limits)
    assert rows["in edges.x"]["capability"]["specific_risk"] is None
    assert rows["right"]["capability"]["specific_risk"] is not None


def test_shown_and_validated(folder):
    """`ice show` names what lies between; a run judges each number, its page names all."""
    shown = ice("show", "plate.toml", cwd=folder).stdout
    assert "centre line of e10 and e12" in " ".join(shown.split())
    done = ice("validate", "plate.toml", "--renders", 60, "--workers", 1, "--out", "run", cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    page = (folder / "run/report.html").read_text()
    result = json.loads((folder / "run/result.json").read_text())
    names = [each["name"] for each in result["settings"][0]["measurands"]]
    assert names == [name for name in toleranced.VALUES if name in names]
    assert len(names) == 7
    assert all(name in page for name in names)


def test_all_kinds_scatter_as_propagated(tmp_path):
    """One of the proof's pictures: variances inside the Sidak 1 %, means at the plate's; a wrong one is refused."""
    rng = np.random.default_rng(2)
    scene = toleranced.scene(tmp_path, **_SMALL)
    picture = kinds.pictures(scene, 1, rng)[0]
    rows, zones = kinds.rows(picture, 120, rng, seed=1000)
    assert sum(row.counts for row in rows) == len(rows) == len(toleranced.VALUES)
    assert all(row.holds(len(rows)) for row in rows), [str(row) for row in rows if not row.holds(len(rows))]
    assert all(row.is_true for row in rows), [str(row) for row in rows if not row.is_true]
    assert not any(row.holds(len(rows), 3.0) for row in rows)  # negative control
    assert len(zones) == 6
    assert all(zone.p > 0.01 / len(zones) > zone.p_normal for zone in zones)


def test_centres_of_slots_and_patterns_are_measured_and_decided(tmp_path):
    """Their values the plate's within 5 standard uncertainties, as scattered as propagated; budgeted and decided as
    those of corners and bores."""
    scene = toleranced.scene(tmp_path, ("slot",), 40, **_TINY)
    slot, pattern = {"midpoint": [{"circle": "c8"}, {"circle": "c10"}]}, {"pitch_circle": ["c2", "c6", "c4"]}
    rows = (
        ("place", "true_position", [slot, {"circle": "c2"}, {"circle": "c6"}]),
        ("apart", "distance", [slot, pattern]),
    )
    scene = scene.with_(
        measurands=[{"name": name, "kind": kind, "features": each, "tolerance": 0.3} for name, kind, each in rows]
    )
    picture = scenes.Picture.of(scene, (20, 300), (30, 350))
    clean = render.image(picture, quality=render.Quality(seed=3))
    told = measure.propagate(clean, picture).measurands
    found = measure.measure(render.expose(clean, scene.noise, np.random.default_rng(4), 120), picture)
    low, high = stats.chi2.ppf([0.0005, 0.9995], 119) / 119
    ratios = found.value.var(0, ddof=1) / np.diag(told.covariance)
    assert ((low < ratios) & (ratios < high)).all(), ratios  # margin: chance, an interval of 99.9 %
    assert not ((low < ratios / 2) & (ratios / 2 < high)).any()
    one = measure.measure(clean, picture)
    made, known = inspect(one), planner.budget(picture)
    assert [row.requirement.name for row in made.rows] == ["place.x", "place.y", "apart"]
    assert made.rows[2].decision == made.decision == "pass"
    (zone,) = measured_zones(one, expanded(one))
    assert (zone.zone.name, zone.decision) == ("place", "pass")
    assert [each.name for each in known.measurands] == [row.requirement.name for row in made.rows]
    assert np.abs(one.value - np.array([22.0, 10.0, 18.0 - toleranced.CENTRE[1]])).max() < 0.03  # a tenth of the zone


def test_a_zone_that_grows_with_its_bore(tmp_path):
    """A true place 0.25 mm beside the bore's, as a diameter: beyond 0.2, but its diameter of 8 is 0.1 above the least.

    Decided, on the inspection's page, in its CSV and in QIF as in the command's JSON."""
    bores = [{"circle": name} for name in ("c4", "c2", "c6")]
    rows = [
        {"name": "bore", "kind": "diameter", "features": bores[:1], "tolerance": 0.1},
        {"name": "place", "kind": "true_position", "features": bores, "tolerance": 0.2, "nominal": [22.1, 24.075]},
    ]
    plate = toleranced.scene(tmp_path, ("bolts",), 40, **_TINY).with_(measurands=rows)
    picture = scenes.Picture.of(plate, (20, 300), (30, 350))
    clean = render.image(picture, quality=render.Quality(seed=3))
    rows[1]["maximum_material"] = "bore"
    grown = picture.with_scene(plate.with_(measurands=rows))
    found = [inspect(measure.measure(clean, each)) for each in (picture, grown)]
    assert [each.zones[0].decision for each in found] == [each.decision for each in found] == ["fail", "pass"]
    plain, told = (each.zones[0].facts for each in found)
    assert told["value"] == pytest.approx(plain["value"], rel=1e-12)
    assert told["maximum_material"]["bonus"] == pytest.approx(0.1, abs=0.02)  # a fifth of it: by the rim's pixels
    assert told["size"] == pytest.approx(0.2 + told["maximum_material"]["bonus"])
    assert plain["maximum_material"] is None
    last = records(found[1], About("SN1", ("picture.png",)))[-1]
    assert (last["upper"], last["decision"]) == (told["size"], "pass")
    size = found[1].zones[0].size
    alone = size.covariance[:2, :2]
    assert size.covariance[2, 2] > 0
    assert found[0].zones[0].size.covariance == pytest.approx(alone)


def test_a_block_quickly(task1):
    """Plan, picture, value, zone and budget of a corner in its datum system, a turn and a line of the block."""
    corner, front, left = {"vertex": "v7", "edges": ["e7", "e9"]}, {"edge": "e4"}, {"edge": "e11"}
    block = task1.model_dump(exclude={"task", "settings", "same_scale"}) | {"measurands": [
        {"name": "place", "kind": "true_position", "features": [corner, front, left], "tolerance": 0.2},
        {"name": "upright", "kind": "perpendicularity", "features": [{"edge": "e9"}, front], "tolerance": 0.1},
        {"name": "along", "kind": "parallelism", "features": [{"edge": "e7"}, front], "tolerance": 0.1},
    ]}  # fmt: skip
    scene = scenes.Scene.model_validate(block)
    found = planner.plan(scene, step_deg=15, refined=False)
    told = {each.name: each for each in found.prediction.measurands}
    ratios = {name: each.variance_object**0.5 / 0.1 for name, each in told.items()}
    assert found.prediction.worst_ratio == pytest.approx(max(ratios.values()))
    assert found.limiting == max(ratios, key=ratios.get)
    picture = scenes.Picture.of(scene, found.sensor, found.light)
    clean = render.image(picture)
    seen = measure.measure(render.expose(clean, scene.noise, np.random.default_rng(1), 1)[0], picture)
    (zone,) = measured_zones(seen, expanded(seen))
    away = seen.value[:2] - [-12.5, -7.5]  # e4 runs towards -x, and -y is to its left
    assert zone.size.value == pytest.approx(2 * np.linalg.norm(away), rel=1e-6)
    assert zone.decision == "pass"
    budget = planner.budget(picture)
    risks = {each.name: capability(budget, m)["specific_risk"] for m, each in enumerate(budget.measurands)}
    assert (risks["place.x"], risks["place.y"]) == (None, None)
    assert risks["upright"] < 1e-6
