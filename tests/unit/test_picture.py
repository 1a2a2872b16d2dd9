"""One exposure: what makes a picture, what is refused, and that it travels."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

import measure
import planner
import render
from scenes import InvalidInput, Picture, Pose
from scenes.picture import several
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
