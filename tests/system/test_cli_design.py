"""`ice catalogue` and `ice design` as they are called: exit statuses, one line of bad input, files that come back."""

from __future__ import annotations

import json

import pytest

import planner
import scenes
from tests.commands import ice
from tests.docs.test_json import PARTS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("design")
    (made / "parts.toml").write_text(PARTS.replace("quantum_efficiency = 60\n", ""))
    return made


ASKED = ("design", "calibrated_rig", "--catalogue", "parts.toml", "--own-light", "--lens-blur", "2", "--json")


def test_the_sample_is_right_and_a_wrong_catalogue_is_not(folder):
    assert ice("catalogue", "check", "sample").returncode == 0
    (folder / "wrong.toml").write_text(PARTS)
    done = ice("catalogue", "check", "wrong.toml", cwd=folder)
    assert done.returncode == 1
    assert 'sensors "two": quantum_efficiency must be a ratio of at most 1, got 60' in done.stdout


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("catalogue", "mend", "sample"), "catalogue must be followed by check, got 'mend'"),
        (("catalogue", "check", "none.toml"), "none.toml must be a readable file, got No such file"),
        ((*ASKED, "--k", "0"), "k must be above 0, got 0"),
        ((*ASKED, "--k", "2", "--false-acceptance", "0.1"), "--k must be left out with --false-acceptance, got 2"),
        ((*ASKED, "--false-acceptance", "0.1"), "uncertainty.process_sd must be given"),
        ((*ASKED, "--picture", "x.gif"), "--picture must end in .png, .svg, got 'x.gif'"),
        ((*ASKED, "--prove", "2"), "--renders must be given with --prove, got 0"),
        ((*ASKED, "--farthest", "-1"), "--farthest must be at least 0, got -1"),
        (ASKED[:5], "lens_blur_um (--lens-blur) must be given for lenses without an MTF"),
        (
            ("design", "task1", "--catalogue", "parts.toml"),
            "tolerance must be given for a measurand at least, got none",
        ),
    ],
)
def test_bad_input_is_one_line(folder, words, text):
    done = ice(*words, cwd=folder)
    assert done.returncode == 2
    assert text in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_station_is_written_as_a_scene(folder):
    done = ice(*ASKED, "--k", "2", "--write", "station.toml", "--picture", "front.svg", cwd=folder)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    best = told["best"]
    scene = scenes.load(folder / "station.toml")
    assert (scene.camera.width, scene.camera.focal_length_mm) == (1280, 25.0)
    predicted = planner.predict(scene, best["sensor"], best["light"])
    assert predicted.measurands[0].variance_object ** 0.5 < best["measurands"][0]["U"]
    assert best["u_over_t"] <= 0.5
    assert told["searched"]["left_out"]["sensors"] == {"incomplete": 1}
    assert "<svg" in (folder / "front.svg").read_text()


def test_what_nothing_meets_ends_with_1(folder):
    done = ice(*ASKED, "--k", "1e6", cwd=folder)
    assert done.returncode == 1
    told = json.loads(done.stdout)
    assert not told["reached"]
    assert told["best"] is None or told["best"]["ratio"] > 1
    assert sum(told["searched"]["pairs_left_out"].values()) >= 1


def test_a_budget_leaves_out_what_is_dearer(folder):
    priced = PARTS.replace('"one"', '"one"\nprice = 500').replace('"25 mm"', '"25 mm"\nprice = 90')
    (folder / "priced.toml").write_text(priced)
    words = (
        "design",
        "calibrated_rig",
        "--catalogue",
        "priced.toml",
        "--own-light",
        "--lens-blur",
        "2",
        "--k",
        "2",
        "--json",
    )
    cheap, dear = (json.loads(ice(*words, "--budget", budget, cwd=folder).stdout) for budget in ("600", "580"))
    assert (cheap["best"]["cost"], cheap["cost"]) == (590, "price")
    assert dear["searched"]["pairs_left_out"] == {"budget": 1}


@pytest.mark.render
def test_a_station_is_borne_out_by_rendering(folder):
    told = json.loads(ice(*ASKED, "--k", "2", "--renders", "20", cwd=folder).stdout)
    proof = told["proofs"][0]
    assert told["signed"]
    assert proof["holds"]
    assert proof["verdict"].startswith("agree")
    assert proof["statuses"] == ["ok"]
