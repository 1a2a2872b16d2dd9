"""Distances and angles of points and lines that move: by plain geometry, and their moves by differences."""

import math

import numpy as np
import pytest

from scenes.measurands.evaluated import Line, Point, between, between_lines, from_line

PLANES = pytest.mark.parametrize("plane", [None, (0.0, 0.6, -0.8)], ids=["image", "plane"])
STEP = 1e-6


def places(plane, rng, count):
    """Points of the image, or of a plane; and how each moves with three parameters, some of them shared."""
    frame = np.eye(2) if plane is None else np.array([[1.0, 0, 0], np.cross(plane, [1.0, 0, 0])])
    at = rng.normal(0, 5, (count, 2)) @ frame
    return [Point(p, {k: rng.normal(size=2) @ frame for k in range(3) if k != i}) for i, p in enumerate(at)]


def moved(point, k, by):
    return Point(point.at + by * point.moves.get(k, np.zeros_like(point.at)), {})


def check_moves(make, points):
    """Derivatives by each parameter against central differences."""
    found = make(*points)
    for k in range(3):
        ahead, behind = (float(make(*(moved(p, k, by) for p in points)).value) for by in (STEP, -STEP))
        assert found.gradient[k] == pytest.approx((ahead - behind) / (2 * STEP), rel=1e-6, abs=1e-7)
    return float(found.value)


@PLANES
def test_distance_of_two_points(plane, rng):
    for _ in range(3):
        points = places(plane, rng, 2)
        assert check_moves(between, points) == pytest.approx(math.dist(points[0].at, points[1].at))


@PLANES
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_distance_from_a_line(plane, side, rng):
    """Positive to the left of the line, or to the right: by the area of the triangle."""
    normal = None if plane is None else np.array(plane)
    for _ in range(3):
        point, start, stop = places(plane, rng, 3)
        found = check_moves(lambda p, a, b: from_line(p, Line(a, b), normal, side), (point, start, stop))
        along, away = stop.at - start.at, point.at - start.at
        twice = along[0] * away[1] - along[1] * away[0] if plane is None else np.cross(along, away) @ normal
        assert found == pytest.approx(side * twice / np.linalg.norm(along))


@PLANES
@pytest.mark.parametrize("signs", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_angle_of_two_lines(plane, signs, rng):
    """Each along or against its edge, degrees."""
    normal = None if plane is None else np.array(plane)

    def angle(a, b, c, d):
        return between_lines([Line(a, b), Line(c, d)], signs, normal)

    for _ in range(3):
        points = places(plane, rng, 4)
        one, two = (sign * (b.at - a.at) for sign, (a, b) in zip(signs, (points[:2], points[2:]), strict=True))
        cosine = one @ two / np.linalg.norm(one) / np.linalg.norm(two)
        assert check_moves(angle, points) == pytest.approx(math.degrees(math.acos(cosine)))


def test_many_pictures_at_a_time(rng):
    """Each as by itself; a side for each."""
    sets = [places(None, rng, 3) for _ in range(4)]
    sides = np.array([1.0, -1.0, -1.0, 1.0])
    stacked = [
        Point(np.stack([s[i].at for s in sets]), {k: np.stack([s[i].moves[k] for s in sets]) for k in sets[0][i].moves})
        for i in range(3)
    ]
    whole = from_line(stacked[0], Line(*stacked[1:]), None, sides)
    for i, (point, start, stop) in enumerate(sets):
        each = from_line(point, Line(start, stop), None, sides[i])
        assert whole.value[i] == pytest.approx(each.value)
        assert {k: move[i] for k, move in whole.gradient.items()} == pytest.approx(each.gradient)
