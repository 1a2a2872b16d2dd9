"""What a map says of each direction is what a close look at that setting says."""

import numpy as np
import pytest

import planner
import scenes
from planner import ViewingSpace

SPACE = ViewingSpace(15, (0, 90))


@pytest.mark.parametrize(("name", "held"), [("task1", "light"), ("task1", "sensor"), ("wedge", "light")])
def test_status_is_that_of_the_prediction(name, held):
    scene = scenes.load(name)
    pose = getattr(scene.settings[0], held)
    found = planner.pose_map(scene, **{held: pose}, space=SPACE)
    other = "sensor" if held == "light" else "light"
    told = [planner.predict(scene, **{held: pose, other: tuple(each)}).status for each in SPACE.poses]
    assert found.status.tolist() == told
    assert len(set(told)) >= 2


def test_a_reason_wherever_nothing_can_be_measured(task1):
    found = planner.pose_map(task1, light=(15, 315), space=SPACE)
    lost = ~np.isfinite(found.variance)
    assert lost.any()
    assert not set(found.status[lost]) & {"ok", "clutter"}
    assert set(found.status[~lost]) == {"ok", "clutter"}
    assert np.array_equal(found.variance, planner.variance_map(task1, light=(15, 315), space=SPACE))


def test_nothing_is_clutter_where_bias_is_not_asked(task1):
    found = planner.pose_map(task1, light=(15, 315), space=SPACE, biased=False)
    assert "clutter" not in found.status
