"""A drawing's requirements at the command line: rendered, measured, decided, validated, planned."""

import json

import pytest
from rich.console import Console

import planner
import scenes
import validation
from scenes.load import BUNDLED
from tests.commands import ice
from validation.report import export, plan_table

pytestmark = pytest.mark.render
POSES = ("--sensor", "30,80", "--light", "35,335")
NAMES = ["hole to corner", "bore", "length", "square", "hole from front"]


@pytest.fixture(scope="module")
def image(tmp_path_factory):
    file = tmp_path_factory.mktemp("image") / "plate.png"
    done = ice("render", "plate", *POSES, "-o", file, "--noise-seed", 4)
    assert done.returncode == 0, done.stderr
    return file


def test_measure_all_as_json(image):
    done = ice("measure", image, "plate", *POSES, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert [each["name"] for each in document["measurands"]] == NAMES
    for each, true in zip(document["measurands"], (8.0623, 4, 12, 90, 4), strict=True):
        assert abs(each["value"] - true) < 5 * each["sigma"]  # margin: 5 standard deviations
        assert (each["status"], each["decision"]) == ("ok", "pass")
        assert each["unit"] == ("degrees" if each["kind"] == "angle" else "cm")
        assert each["tolerance"]["plus"] == (0.3 if each["kind"] == "angle" else 0.02)
        assert each["nominal"] == pytest.approx(true, abs=1e-4)  # margin: `true` is written with four decimals here
    joint = document["covariance"]
    assert joint[1][1] == pytest.approx(document["measurands"][1]["sigma"] ** 2)
    assert joint[0][1] == joint[1][0] != 0


def test_the_table_and_a_part_that_fails(image, tmp_path):
    """The same picture against a drawing that asks for a length of 12.1."""
    text = (BUNDLED / "plate.toml").read_text().replace("plate.ply", str(BUNDLED / "plate.ply"))
    (tmp_path / "long.toml").write_text(text.replace('kind = "width"', 'kind = "width"\nnominal = 12.1'))
    done = ice("measure", image, tmp_path / "long.toml", *POSES)
    assert done.returncode == 0, done.stderr
    rows = {line.split()[0]: line for line in done.stdout.splitlines() if line.strip()}
    assert "fail" in rows["length"]
    assert "12.1" in rows["length"]
    assert "pass" in rows["bore"]
    assert "ISO" in done.stdout


def test_an_inspection_of_two_pictures(image, tmp_path):
    """The second picture is the first one again: each value is told once, and the files say so."""
    done = ice("measure", image, "plate", *POSES, "--also", f"{image} 30,80 35,335", "--inspection", tmp_path / "out",
               "--serial", "7", "--json")  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)["measurands"]
    assert [(row["name"], row["decision"], row["picture"]) for row in rows] == [(name, "pass", 1) for name in NAMES]
    assert all(1.9 * row["u"] < row["U"] for row in rows)  # margin: k is 1.96
    written = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert written == [f"inspection{end}" for end in (".csv", ".html", ".qif", "_1.svg", "_2.svg")]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--inspection", "out"), "--light must be given with --inspection, got nothing"),
        (("--light", "35,335", "--serial", "7"), "--serial must be used with --inspection, got '7' alone"),
        (("--light", "35,335", "--as-measured", "--inspection", "out"), "--as-measured must be left out with --insp"),
        (
            ("--light", "35,335", "--also", "other.png"),
            '--also must be "FILE P,A P,A": a picture, its sensor and light',
        ),
    ],
)
def test_what_an_inspection_needs(image, tmp_path, options, said):
    done = ice("measure", image, "plate", "--sensor", "30,80", *options, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(said)
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_measured_is_said(image):
    """From behind, nothing of the top is seen: no values, exit status 1."""
    done = ice("measure", image, "plate", "--sensor", "120,80", "--light", "35,335", "--json")
    assert done.returncode == 1
    document = json.loads(done.stdout)
    assert {each["value"] for each in document["measurands"]} == {None}
    assert {each["decision"] for each in document["measurands"]} == {"undecided"}
    assert document["covariance"][0][0] is None


def test_validate_judges_each(tmp_path):
    scene = scenes.load("plate")
    scene = scene.model_copy(update={"settings": scene.settings[:2]})
    found = validation.run(scene, 60, seed=3, out=tmp_path, workers=1)
    document = found.to_json()
    assert document["verdict"].startswith("agree")
    assert (document["judgement"]["rows"], document["judgement"]["not_proven"]) == (10, {})
    for setting in document["settings"]:
        assert [each["name"] for each in setting["measurands"]] == NAMES
        for each in setting["measurands"]:
            assert {"kind", "unit", "value", "predicted", "empirical", "n", "failed", "ratio", "ratio_interval", "bias",
                    "u", "u_bias", "correction", "bound", "status"} <= each.keys()  # fmt: skip
            assert each["ratio"] == pytest.approx(each["empirical"] / each["predicted"])
            assert each["bound"] < each["predicted"]  # margin: a bound is below any variance, by its kind
            assert (each["n"], each["failed"]) == (60, 0)
    assert len(export.write_measurands(found, tmp_path / "all.csv").read_text().splitlines()) == 11


def test_plan_names_what_limits_it():
    done = ice("plan", "plate", *POSES, "--no-check", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    ratios = {each["name"]: each["ratio"] for each in document["measurands"]}
    assert document["limiting"] == max(ratios, key=ratios.get)
    assert document["variance"] == pytest.approx(document["worst_ratio"] ** 2) == max(ratios.values()) ** 2
    added = planner.plan(scenes.load("plate"), over="sum", sensor=(30, 80), light=(35, 335))
    assert added.variance == pytest.approx(sum(value**2 for value in ratios.values()))
    shown = Console(width=200)
    with shown.capture() as text:
        shown.print(plan_table.report(added, None, None, 1.0))
    assert f"Limited by {added.limiting}" in text.get()
    bad = ice("plan", "plate", "--objective", "image")
    assert (bad.returncode, bad.stderr.count("\n")) == (2, 1)
    assert "objective must be object for 5 measurands, got 'image'" in bad.stderr
