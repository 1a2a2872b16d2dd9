"""A camera that is turned about its axis sees the same, turned the other way."""

import numpy as np
import pytest

import planner
from imaging.geometry.projection import (
    camera_frame,
    depth,
    frame,
    from_axis,
    light_position,
    rays,
    sensor_position,
)  # fmt: skip
from scenes import Ring

POSE = np.array([40.0, 120.0])


def rolled(scene, roll, **changes):
    return scene.model_copy(update={"camera": scene.camera.model_copy(update={"roll_deg": roll, **changes})})


def test_projection_turns(task1):
    """Against a rotation of the image that is written out: right towards down."""
    turn = np.radians(25.0)
    back = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    plain, turned = (from_axis(task1.solid.vertices, POSE, rolled(task1, roll).camera) for roll in (0.0, 25.0))
    np.testing.assert_allclose(turned, plain @ back.T, atol=1e-9)
    assert np.abs(turned - plain).max() > 10


@pytest.mark.parametrize("roll", [0.0, 25.0, -80.0])
def test_rays_are_the_projection_back(task1, roll):
    """Every point of the ray of an image point is seen there; its end is as deep as the focal length is long."""
    camera, at = rolled(task1, roll).camera, np.array([[-133.0, 71.0], [20.0, 118.0], [0.0, 0.0]])
    poses = np.array([POSE, (0.0, 30.0), (117.0, -50.0)])
    for share in (0.003, 0.11):
        points = sensor_position(camera, poses) + share * rays(at, poses, camera)
        seen = np.array([from_axis(p[None], pose, camera)[0] for p, pose in zip(points, poses, strict=True)])
        deep = [depth(p[None], pose, camera)[0] for p, pose in zip(points, poses, strict=True)]
        np.testing.assert_allclose(seen, at, atol=1e-8)
        np.testing.assert_allclose(deep, share * camera.focal_px, rtol=1e-9)


def test_axes_stay_a_right_handed_frame(task1):
    axes = np.stack(camera_frame(rolled(task1, 70.0).camera, POSE))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert camera_frame(task1.camera, POSE).right.tolist() == frame(POSE).right.tolist()


def test_a_light_at_the_camera_turns_with_it(task1):
    light = Ring(kind="ring", inner_radius=1.0, outer_radius=2.0, distance=80.0, mount="camera", offset=(3.0, 0.0))
    at = [light_position(rolled(task1, roll).camera, light, POSE) for roll in (0.0, 90.0)]
    axes = frame(POSE)
    np.testing.assert_allclose(at[1] - at[0], 3.0 * (axes.down - axes.right), atol=1e-9)


def test_a_square_image_turned_by_a_right_angle_predicts_the_same(task1):
    """Rolled by 90 degrees the pixels are the same pixels, so the variance is the same number."""
    square = {"width": 241, "height": 241}
    found = [planner.predict(rolled(task1, roll, **square), (30, 135), (15, 315)) for roll in (0.0, 90.0, 33.0)]
    assert found[1].variance_px2 == pytest.approx(found[0].variance_px2, rel=1e-6)
    # margin: another roll, other pixels: their phase is 2.4 %
    assert found[2].variance_px2 == pytest.approx(found[0].variance_px2, rel=0.05)
