"""One exposure: what makes a picture, what is refused, and that it travels."""

import pickle
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from scenes import InvalidInput, Picture, Pose
from scenes.load import from_document
from scenes.picture import mounted, several
from tests.oracle import block_image


def test_from_poses_pairs_or_a_picture(task1):
    picture = Picture.of(task1, (30, 135), (15, 315))
    assert picture == Picture.of(task1, Pose(30, 135), [Pose(15, 315)]) == Picture.of(task1, [30, 135], ((15, 315),))
    assert Picture.of(picture) is picture
    assert (picture.light, picture.lights) == (Pose(15, 315), (Pose(15, 315),))
    assert picture.unlit() == Picture.of(task1, (30, 135))
    assert picture.unlit().light is None
    assert several((15, 315)) == ((15, 315),)
    assert several(np.array([15, 315]))[0].tolist() == [15, 315]


def test_of_several_lights_the_first_is_the_light():
    scene = scenes.load("two_lights")
    picture = Picture.of(scene, (30, 135), [(15, 315), (20, 30)][: len(scene.free)])
    assert len(picture.lights) == 2
    assert picture.light is picture.lights[0] != picture.lights[1]
    assert picture.unlit().lights == ()
    assert picture.row["scene"] == "two_lights"


def test_what_is_no_picture(task1):
    with pytest.raises(InvalidInput, match=r"light must be 1 pose\(s\), one for each free light, got 2"):
        Picture.of(task1, (30, 135), [(15, 315), (20, 30)])
    with pytest.raises(InvalidInput, match=r"sensor: pose must be a pair .*, got None"):
        Picture.of(task1)
    with pytest.raises(InvalidInput, match=r"light: polar_deg must be between 0 and 180, got 200"):
        Picture.of(task1, (30, 135), (200, 0))
    for ask in (planner.predict, render.image):
        with pytest.raises(InvalidInput, match="light must be a pose, got nothing"):
            ask(Picture.of(task1, (30, 135)))


def test_a_picture_stands_for_scene_and_poses(task1):
    picture = Picture.of(task1, (30, 135), (15, 315))
    image = block_image(task1, (30, 135), (15, 315))
    for ask in (measure.distance, measure.propagate):
        ours, theirs = ask(image, picture), ask(image, task1, (30, 135), (15, 315))
        assert str(ours.status) == "ok"
        assert (ours.variance_px2, ours.value_px) == (theirs.variance_px2, theirs.value_px)
    assert planner.predict(picture).variance_px2 == planner.predict(task1, (30, 135), (15, 315)).variance_px2
    assert (measure.region_of_interest(picture) == measure.region_of_interest(task1, (30, 135), (15, 315))).all()


def test_a_picture_is_the_same_in_another_process(task1):
    """Texts have another hash there: what was kept of a picture must be found by one that has travelled."""
    code = """
import pickle, sys, scenes
picture = scenes.Picture.of(scenes.load("task1"), (30, 135), (15, 315))
hash(picture)
sys.stdout.buffer.write(pickle.dumps(picture))
"""
    made = subprocess.run([sys.executable, "-c", code], env={"PYTHONHASHSEED": "1", **paths()}, capture_output=True)
    travelled, here = pickle.loads(made.stdout), Picture.of(task1, (30, 135), (15, 315))
    assert travelled == here
    assert hash(travelled) == hash(here)


def paths():
    return {"PYTHONPATH": ":".join(path for path in sys.path if path)}


def test_lights_of_a_scene_in_one_line(task1):
    """What is wrong with `[[lights]]`, by its key."""
    document = task1.model_dump(mode="json", exclude={"settings", "same_scale", "light"})
    point = {"distance": 100.0}
    wrong = {
        r"light or lights must be given, not both, got none": {},
        r"light or lights must be given, not both, got both": {"light": point, "lights": [point]},
        r"light.intensity must be more than 0 once, got 0": {"light": {**point, "intensity": 0.0}},
        r"lights\[0\]: inner_radius must be less than outer_radius, got 5 and 4": {
            "lights": [{"kind": "ring", **point, "inner_radius": 5.0, "outer_radius": 4.0}]
        },
        r"lights\[1\]: pose must be given for mount 'fixed' and for no other, got none": {
            "lights": [point, {**point, "mount": "fixed"}]
        },
        r"lights\[0\]: offset must be left out but for mount 'camera'": {"lights": [{**point, "offset": [1.0, 0.0]}]},
        r"lights must be at most 16, got 17": {"lights": [point] * 17},
        r"lights\[0\].pose must be outside the object": {
            "lights": [{"distance": 1.0, "mount": "fixed", "pose": [0, 0]}]
        },
    }
    for message, lights in wrong.items():
        with pytest.raises(InvalidInput, match=message):
            from_document(Path("here.toml"), {**document, **lights})


def test_a_light_that_is_not_free_stands_where_the_sensors_or_it_is_said_to():
    """Opposite: 180 degrees less the polar angle, half a turn of azimuth; of any number of sensors in any order."""
    sensors = np.array([[[10.0, 20.0], [35.0, 200.0], [90.0, 359.0]], [[0.0, 0.0], [120.0, 180.0], [60.0, 95.0]]])
    opposite = SimpleNamespace(mount="camera", faces_sensor=True, pose=None)
    wanted = [[[170, 200], [145, 20], [90, 179]], [[180, 180], [60, 0], [120, 275]]]
    assert mounted(opposite, sensors).tolist() == wanted
    assert mounted(opposite, sensors[0, 1]).tolist() == wanted[0][1]
    assert mounted(SimpleNamespace(mount="camera", faces_sensor=False, pose=None), sensors) is sensors
    assert mounted(SimpleNamespace(mount="fixed", faces_sensor=True, pose=Pose(12, 34)), sensors).tolist() == [12, 34]
