"""The image of a circular edge beside points of the oracle's own pinhole, seen all around from above."""

import numpy as np
import pytest

import scenes
from imaging.features.circles import rim
from imaging.features.rim_sides import _coaxial, steady, to_curve
from imaging.pictures import Pictures
from scenes import Circle
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


@pytest.mark.parametrize(
    ("along", "aside", "radius", "hole", "expected"),
    [
        (-4.0, 0.0, 2.0, True, True),
        (4.0, 0.0, 2.0, True, True),
        (-4.0, 0.0, 1.02, True, True),
        (-4.0, 0.0, 2.98, True, True),
        (-4.0, 0.0, 0.98, True, False),
        (-4.0, 0.0, 3.02, True, False),
        (-4.0, 1.9e-3, 2.0, True, True),
        (-4.0, 2.1e-3, 2.0, True, False),
        (-2.1e-3, 0.0, 2.0, True, True),
        (-1.9e-3, 0.0, 2.0, True, False),
        (-4.0, 0.0, 2.0, False, False),
    ],
)
def test_which_rims_are_of_one_wall(along, aside, radius, hole, expected):
    """On one axis within a thousandth of the radius, apart along it, no half of the radius wider or narrower."""
    axis, beside, at = np.array([0.0, 0.6, 0.8]), np.array([0.0, -0.8, 0.6]), np.array([3.0, -1.0, 2.0])
    circle = Circle("c1", at, axis, 2.0, 0, (), True)
    other = Circle("c2", at + along * axis + aside * beside, -axis, radius, 1, (), hole)
    assert _coaxial(circle, other) == expected
    assert not _coaxial(circle, circle)


def test_distance_from_the_pieces_of_a_curve():
    """To a closed polygon's pieces that are shown, by brute force; to an open one's all."""
    rng = np.random.default_rng(8)
    points, curve = rng.uniform(-5, 5, (6, 2)), rng.uniform(-5, 5, (5, 2))
    shown = np.array([True, False, True, False, True])
    share = np.linspace(0, 1, 20001)[:, None]
    lines = [a + share * (b - a) for a, b in zip(curve, np.roll(curve, -1, 0), strict=True)]
    each = np.array([np.linalg.norm(points[:, None] - line, axis=-1).min(1) for line in lines])
    np.testing.assert_allclose(to_curve(points, curve), each[:-1].min(0), atol=1e-6)
    np.testing.assert_allclose(to_curve(points, curve, shown), each[shown].min(0), atol=1e-6)
    assert np.isinf(to_curve(points, curve, np.zeros(5, bool))).all()


def test_places_are_even_up_to_what_jumps_within_reach():
    """Of 12 places on a rim, each of another length: the contrast halves at one, shading moves another too far."""
    arc = np.array([1.0, 1.2, 0.9, 1.1, 1.3, 0.8, 1.0, 1.4, 0.7, 1.1, 0.9, 1.2])
    squared, none = np.full(12, 900.0), np.zeros(12)
    assert steady(squared, none, arc, 2.0).all()
    half = np.where(np.arange(12) < 6, 900.0, 225.0)  # falls from 5 to 6, rises from 11 to 0
    assert _near(half, none, arc, 0.0) == {5, 6, 11, 0}
    assert _near(half, none, arc, 1.35) == {4, 5, 6, 10, 11, 0, 1}
    assert _near(half, none, arc, 2.15) == set(range(12)) - {3}
    assert _near(np.where(np.arange(12) < 6, 900.0, 900 * 0.82**2), none, arc, 0.0) == set()
    assert _near(np.where(np.arange(12) < 6, 900.0, 900 * 0.78**2), none, arc, 0.0) == {5, 6, 11, 0}
    for sign in (1.0, -1.0):
        bent = np.where(np.arange(12) == 3, 0.081 * sign, 0.0)
        assert _near(squared, bent, arc, 0.0) == {2, 3, 4}
        assert _near(squared, 0.98 * bent, arc, 0.0) == set()


def _near(squared, shift, arc, far) -> set[int]:
    """Places that are not even."""
    return set(np.flatnonzero(~steady(squared, shift, arc, far)).tolist())
