"""Projection against an explicit pinhole, and poses at the poles."""

import numpy as np
import pytest

from imaging.geometry.projection import depth, direction, facing, frame, from_axis, project
from tests.oracle import axes as axes_of


@pytest.mark.parametrize("pose", [(0, 0), (0, 130), (30, 90), (90, 200), (180, 45), (1e-9, 12)])
def test_frame_is_orthonormal_and_right_handed(pose):
    axes = np.stack(frame(np.array(pose, float)))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-15)  # margin: one rounding of 1 is 2.2e-16
    assert np.linalg.det(axes) == pytest.approx(1)


def test_vertical_is_up_in_the_image(task1):
    foot, head = project(np.array([[0.0, 0, 0], [0, 0, 1]]), np.array([60.0, 20.0]), task1.camera)
    assert head[1] < foot[1]  # margin: the order is said
    assert head[0] == pytest.approx(foot[0])


def test_projection_against_similar_triangles(task1):
    """Sensor on the x axis, 100 cm away: a point at depth 90 cm, 2 cm to the right (y) and 3 cm up."""
    (image,) = project(np.array([[10.0, 2.0, 3.0]]), np.array([90.0, 0.0]), task1.camera)
    assert image == pytest.approx([127.5 + 800 * 2 / 90, 119.5 - 800 * 3 / 90])


def test_behind_the_sensor_is_nan(task1):
    assert np.isnan(project(np.array([[150.0, 0, 0]]), np.array([90.0, 0.0]), task1.camera)).all()


def test_depth_and_facing(task1):
    pose = np.array([30.0, 90.0])
    assert depth(np.zeros((1, 3)), pose, task1.camera) == pytest.approx(100.0)
    seen = facing(task1.solid, 100 * direction(pose))
    names = ("top", "bottom", "front", "back", "left", "right")
    assert [name for name, s in zip(names, seen, strict=True) if s] == ["top", "back"]


@pytest.mark.parametrize("behind", [0.0, 0.5, 0.999, 30.0])
def test_beside_and_behind_the_sensor_is_nan(behind, task1):
    """Just before it is seen; in its plane, or behind it, not."""
    sensor, camera = np.array([30.0, 135.0]), task1.camera
    out = axes_of(sensor)[0]
    eye = np.array(camera.look_at) + camera.distance * out
    points = np.array([eye + behind * out, eye - 0.5 * out])
    points[0] += 1e-9 * (behind == 0) * out
    assert np.isnan(from_axis(points, sensor, camera)).tolist() == [[True, True], [False, False]]
    assert project(points, sensor, camera)[0] == pytest.approx([np.nan, np.nan], nan_ok=True)
