"""The image of a circular edge beside points of the oracle's own pinhole, seen all around from above."""

import numpy as np
import pytest

import scenes
from imaging.features.circles import rim
from imaging.pictures import Pictures
from tests.oracle import pinhole

POSES = [(30.0, 135.0), (10.0, 20.0), (50.0, 300.0)]


@pytest.fixture(scope="module")
def plate():
    return scenes.load("plate")


def upper(plate):
    return max(plate.solid.circles, key=lambda circle: circle.centre[2])


def dense(plate, pose, count, more=0.0):
    """Points of the upper rim, which is horizontal, as a pinhole shows them."""
    circle = upper(plate)
    t = 2 * np.pi * np.arange(count) / count
    ring = circle.centre + (circle.radius + more) * np.column_stack([np.cos(t), np.sin(t), 0 * t])
    return pinhole(ring - np.array(plate.camera.look_at), pose, plate.camera)


@pytest.mark.parametrize("pose", POSES)
def test_arc_and_design(plate, pose):
    """Lengths add up to the perimeter; a larger radius moves every point outwards by what the pinhole says."""
    found = rim(Pictures.of(plate, np.array(pose), np.array([15.0, 200.0])), upper(plate))
    points = dense(plate, pose, 20_000)
    perimeter = np.linalg.norm(points - np.roll(points, 1, 0), axis=1).sum()
    assert found.arc.sum() == pytest.approx(perimeter, rel=1e-4)
    tangent = np.roll(points, -1, 0) - np.roll(points, 1, 0)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.linalg.norm(tangent, axis=1)[:, None]
    away = dense(plate, pose, 20_000, 1e-4) - points
    expected = np.abs((away * normal).sum(1)) / 1e-4
    grown = np.abs(found.design[..., 2]).ravel()
    assert grown.min() == pytest.approx(expected.min(), rel=1e-2)
    assert grown.max() == pytest.approx(expected.max(), rel=1e-2)


@pytest.mark.parametrize("pose", POSES)
def test_the_rim_of_a_hole_is_seen_all_around_from_above(plate, pose):
    """The plane face is lit and seen on one side; on the other the wall, or what lies past the rim, is darker."""
    found = rim(Pictures.of(plate, np.array(pose), np.array([15.0, 200.0])), upper(plate))
    assert (found.squared > 20.0**2).all()
    below = rim(Pictures.of(plate, np.array([150.0, 20.0]), np.array([15.0, 200.0])), upper(plate))
    assert (below.squared > 0).mean() < 0.5  # margin: a share: one half of the rim has the wall behind it
