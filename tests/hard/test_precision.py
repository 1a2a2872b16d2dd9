"""Single against double precision, and the renderer's limits."""

import cv2
import numpy as np
import pytest

import planner
import render
from planner import ViewingSpace
from render.precision import LONGEST_PX
from scenes import InvalidInput
from validation.hard import scenes_for
from validation.hard.precision import SAFE, error_of_single, paper_in
from validation.report.precision_figure import draw

POSES = ViewingSpace(6, (0, 90)).poses


def test_in_double_precision_it_is_the_planners_model(task1):
    lights = np.broadcast_to([15.0, 315.0], POSES.shape)
    expected = planner.variances(task1, POSES, [15.0, 315.0], "paper", "image")
    found = paper_in(np.float64, task1, POSES, lights)
    assert (np.isfinite(found) == np.isfinite(expected)).all()
    finite = np.isfinite(expected)
    assert finite.sum() > 300
    assert found[finite] == pytest.approx(expected[finite], rel=1e-9)


def test_single_precision_is_safe_but_where_the_contrast_vanishes(task1):
    """On Task1 the sensor's pose costs 2e-5 at most; a light that makes two faces equally bright costs digits."""
    moving_sensor = error_of_single(task1, POSES, np.broadcast_to([15.0, 315.0], POSES.shape))
    moving_light = error_of_single(task1, np.broadcast_to([30.0, 135.0], POSES.shape), POSES)
    assert np.nanmax(moving_sensor) < 2e-4 < SAFE
    assert np.nanmedian(moving_light) < 1e-5
    assert np.nanmax(moving_light) > 1e-4


def test_figure(tmp_path):
    draw(tmp_path / "map.png", step_deg=10)
    assert cv2.imread(str(tmp_path / "map.png")).std() > 10  # margin: drawn, a blank picture has 0


def test_a_focal_length_beyond_single_precision_is_refused():
    scene = scenes_for.task1(camera={"distance": 1e6, "focal_px": 1.01 * LONGEST_PX}, light={"distance": 1e6})
    with pytest.raises(InvalidInput, match=r"camera\.focal_px must be at most 83886 px to be rendered"):
        render.image(scene, (30, 135), (15, 315))
