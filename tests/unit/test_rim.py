"""The image of a circular edge: a conic through points of the oracle's own pinhole, seen all around from above."""

import numpy as np
import pytest

import scenes
from planner.features.circles import RIM_POINTS, ellipse_centre, rim
from planner.imaging.pictures import Pictures
from tests.oracle import pinhole

POSES = [(30.0, 135.0), (10.0, 20.0), (50.0, 300.0)]


@pytest.fixture(scope="module")
def plate():
    return scenes.load("plate")


def upper(plate):
    return max(plate.solid.circles, key=lambda circle: circle.centre[2])


def dense(plate, pose, count):
    """Points of the upper rim, which is horizontal, as a pinhole shows them."""
    circle = upper(plate)
    t = 2 * np.pi * np.arange(count) / count
    ring = circle.centre + circle.radius * np.column_stack([np.cos(t), np.sin(t), 0 * t])
    return pinhole(ring - np.array(plate.camera.look_at), pose, plate.camera)


@pytest.mark.parametrize("pose", POSES)
def test_centre_of_the_conic(plate, pose):
    x, y = (dense(plate, pose, 400) - 120).T
    conic = np.linalg.svd(np.column_stack([x * x, x * y, y * y, x, y, np.ones_like(x)]))[2][-1]
    a, b, c, d, e, _ = conic
    centre = np.linalg.solve([[2 * a, b], [b, 2 * c]], [-d, -e]) + 120
    assert ellipse_centre(plate, upper(plate), np.array(pose)) == pytest.approx(centre, abs=1e-6)


@pytest.mark.parametrize("pose", POSES)
def test_arc_and_design(plate, pose):
    """Lengths add up to the perimeter; shifts and strains act along the normals of densely spaced points."""
    found = rim(Pictures.of(plate, np.array(pose), np.array([15.0, 200.0])), upper(plate))
    points = dense(plate, pose, 20_000)
    perimeter = np.linalg.norm(points - np.roll(points, 1, 0), axis=1).sum()
    assert found.arc.sum() == pytest.approx(perimeter, rel=1e-4)
    unit = np.hypot(found.design[..., 0], found.design[..., 1])
    assert unit == pytest.approx(np.ones(RIM_POINTS), abs=1e-12)
    middle = ellipse_centre(plate, upper(plate), np.array(pose))
    x, y = points.T - middle[:, None]
    tangent = np.roll(points, -1, 0) - np.roll(points, 1, 0)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.linalg.norm(tangent, axis=1)[:, None]
    columns = np.stack([normal[:, 0], normal[:, 1], normal[:, 0] * x, normal[:, 1] * y,
                        normal[:, 0] * y + normal[:, 1] * x], -1)  # fmt: skip
    turn = np.arctan2(found.design[:, 1], found.design[:, 0])
    place = [np.abs(np.angle(np.exp(1j * (np.arctan2(*normal.T[::-1]) - t)))).argmin() for t in turn]
    flipped = [np.abs(np.angle(np.exp(1j * (np.arctan2(*-normal.T[::-1]) - t)))).argmin() for t in turn]
    same = np.abs(found.design - columns[place]).max() < np.abs(found.design + columns[flipped]).max()
    expected = columns[place] if same else -columns[flipped]
    assert found.design == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("pose", POSES)
def test_the_rim_of_a_hole_is_seen_all_around_from_above(plate, pose):
    """The plane face is lit and seen on one side; on the other the wall, or what lies past the rim, is darker."""
    found = rim(Pictures.of(plate, np.array(pose), np.array([15.0, 200.0])), upper(plate))
    assert found.counted.all()
    assert (found.squared > 20.0**2).all()
    below = rim(Pictures.of(plate, np.array([150.0, 20.0]), np.array([15.0, 200.0])), upper(plate))
    assert below.counted.mean() < 0.5
