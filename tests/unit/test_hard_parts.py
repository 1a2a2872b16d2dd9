"""The references of the hard cases: a point's place and its camera, against the planner's own projection."""

import numpy as np
import pytest

from imaging.geometry.projection import project_ideal
from scenes import Pose
from validation.hard import precise

SENSOR, LIGHT = (37.0, 112.0), (21.0, 301.0)


def test_a_point_is_imaged_from_the_cameras_distance(task1):
    """Not from the light's, which is another one; px from the image's middle."""
    camera = task1.camera.model_copy(update={"distance": 83.0})
    inputs = precise.Inputs.of(task1.model_copy(update={"camera": camera}), SENSOR, LIGHT)
    middle = (np.array([camera.width, camera.height]) - 1) / 2
    seen = project_ideal(task1.solid.vertices, np.array(SENSOR), camera) - middle
    found = [[float(x) for x in precise.image_of(v, inputs, precise.mpf(camera.focal_px))] for v in inputs.vertices]
    assert np.array(found) == pytest.approx(seen, rel=1e-9, abs=1e-9)
    assert [float(x) for x in inputs.distances] == [83.0, 100.0]
    assert Pose(*map(float, inputs.sensor)) == Pose(*SENSOR)
