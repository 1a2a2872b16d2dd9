"""A scene changed by a program: checked as its file is."""

import re

import pytest

import scenes
from scenes import InvalidInput, Pose


@pytest.mark.parametrize("name", ["task1", "bracket_mm", "two_lights", "printed_label", "calibrated_rig", "shaft"])
def test_a_scene_with_no_changes_is_the_same_scene(name):
    scene = scenes.load(name)
    assert scene.with_() == scene


def test_keys_change_by_tables_and_by_their_names(task1):
    one = task1.with_(noise={"sigma": 2.5}, camera={"lens": {"aperture_radius": 0.2}})
    other = task1.with_(**{"noise.sigma": 2.5, "camera.lens.aperture_radius": 0.2})
    assert one == other != task1
    assert (one.noise.sigma, one.camera.lens.aperture_radius) == (2.5, 0.2)
    assert one.camera.model_copy(update={"lens": task1.camera.lens}) == task1.camera
    lit = scenes.load("two_lights").with_(**{"lights[1].distance": 33.0})
    assert [light.distance for light in lit.lights][1] == 33.0
    assert task1.with_(**{"settings[2].sensor": (31, 90)}).settings[2].sensor == Pose(31, 90)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"noise": {"sigm": 2.0}}, "noise.sigm must be a known key, got 2.0"),
        ({"noise": {"sigma": -1}}, "noise.sigma must be at least 0, got -1"),
        ({"noise.sigma": float("nan")}, "noise.sigma must be a finite number, got nan"),
        ({"noise": 2}, "noise must be a table of keys, got 2"),
        ({"nose": {}}, "nose must be a known key"),
        ({"noise..sigma": 1}, "key must be one as camera.blur_px or lights[1].distance, got 'noise..sigma'"),
        ({"settings[99].light": (1, 2)}, "settings[99].light must be one of what the scene has"),
        ({"light": {"kind": "ring"}}, "light.distance must be given, got nothing"),
        ({"camera": {"distance": 0.1}}, "sensor must be outside the object"),
    ],
)
def test_what_a_file_may_not_say_a_program_may_not_either(task1, changes, message):
    with pytest.raises(InvalidInput, match=re.escape(message)):
        task1.with_(**changes)


def test_what_follows_from_a_data_sheet_follows_anew():
    bracket = scenes.load("bracket_mm")
    longer = bracket.with_(camera={"focal_length_mm": 30.0})
    away = bracket.camera.distance  # mm
    assert longer.camera.focal_px / bracket.camera.focal_px == pytest.approx(30 * (away - 25) / (25 * (away - 30)))
    with pytest.raises(InvalidInput, match=r"camera.focal_px must be .*, as focal_length_mm says, got 8000"):
        bracket.with_(camera={"focal_length_mm": 30.0, "focal_px": 8000.0})


def test_uncertainties_stay_unless_said_anew(task1):
    known = task1.with_(**{"light.distance": {"value": 90.0, "sd": 1.0}})
    assert [(each.key, each.sd) for each in known.with_(**{"light.distance": 80.0}).uncertain] == [
        ("light.distance", 1)
    ]
    anew = known.with_(light={"distance": {"value": 70.0, "sd": 3.0}})
    assert [(each.key, each.sd) for each in anew.uncertain] == [("light.distance", 3)]
    assert anew.light.distance == 70.0


@pytest.mark.parametrize(
    ("part", "update", "message"),
    [
        ("noise", {"sigma": -1.0}, "sigma must be at least 0, got -1"),
        ("noise", {"sigm": 1.0}, "sigm must be a key of Noise, got 1.0"),
        ("camera", {"width": 0}, "width must be at least 1, got 0"),
        ("camera", {"blur_px": float("inf")}, "blur_px must be a finite number, got inf"),
        ("light", {"distance": "far"}, "distance must be a number, got 'far'"),
    ],
)
def test_a_copy_takes_no_value_that_cannot_be(task1, part, update, message):
    with pytest.raises(InvalidInput, match=message):
        getattr(task1, part).model_copy(update=update)
    assert getattr(task1, part).model_copy(update={}) == getattr(task1, part)
