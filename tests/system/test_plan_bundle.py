"""``ice plan --views --together``."""

import json

import pytest

import planner
import scenes
from tests.commands import ice

SMALL = ("plan", "task1", "--views", "2", "--together", "known", "--step", "30")


def test_json_is_the_plan():
    """A length in space: one picture leaves it open, two tell it."""
    told = json.loads(ice(*SMALL, "--json").stdout)
    one, two = told["views"]
    assert (one["is_plan"], one["lost"], one["impossible"], one["minimised"]) == (False, ["distance"], True, None)
    assert one["measurands"][0]["reason"] == "one picture leaves open where v3, v6 are"
    assert (two["is_plan"], two["count"], two["lost"]) == (True, 2, [])
    pictures = [scenes.Picture.of(scenes.load("task1"), pose["sensor"], pose["light"]) for pose in two["poses"]]
    predicted = planner.predict_bundle(pictures, "known")
    assert two["measurands"][0]["u"] == pytest.approx(predicted.u[0])
    assert two["measurands"][0]["U"] == pytest.approx(planner.bundle_budget(pictures, "known")["distance"].U)
    assert two["minimised"] == pytest.approx(predicted.u[0] ** 2)
    assert two["gap"] == pytest.approx(two["searched"] / two["bound"] - 1)


def test_table_says_what_one_picture_leaves_open():
    said = ice(*SMALL)
    assert said.returncode == 0
    words = " ".join(said.stdout.split())
    assert "no plan" in words
    assert "One picture does not tell distance (no others of the grid tell all): one picture leaves open" in words
    alone = ice("plan", "task1", "--views", "1", "--together", "known", "--step", "30")
    assert alone.returncode == 1


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--together", "known"], "--views must be given with --together, got nothing beside 'known'"),
        (["--views", "2", "--together", "sure"], "--together must be one of known, uncertain, unknown, got 'sure'"),
        (["--views", "99", "--together", "known"], "--views must be 1 to 12, got 99"),
        (["--views", "2", "--together", "known", "--check", "3"], "--check must be left out with --together, got 3"),
        (
            ["--views", "2", "--together", "known", "--views-share", "light"],
            "--views-share must be left out with --together, got light",
        ),
        (
            ["--views", "2", "--together", "known", "--objective", "image"],
            "objective must be object for several pictures, got 'image'",
        ),
        (["--views", "2", "--together", "known", "--write"], "--write must be left out with --together, got True"),
    ],
)
def test_bad_input_is_one_line(arguments, line):
    said = ice("plan", "task1", *arguments)
    assert (said.returncode, said.stdout) == (2, "")
    assert line in said.stderr
