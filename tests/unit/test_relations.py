"""Distances and angles between measured features: their variances by central differences and drawn errors."""

from types import SimpleNamespace

import numpy as np
import pytest

from measure.features.relations import line_angle, point_distance
from measure.photo.quadrilateral import _values
from scenes import InvalidInput


def test_distance_of_points(rng):
    """Gradient by central differences, of many points at once."""
    first, second = rng.normal(size=(2, 4, 2)) * 9
    roots = rng.normal(size=(2, 4, 2, 2))
    a, b = roots.swapaxes(-1, -2) @ roots
    value, variance = point_distance(first, a, second, b)
    for k in range(4):
        gradient = [
            (np.linalg.norm(second[k] - first[k] + h) - np.linalg.norm(second[k] - first[k] - h)) / 2e-6
            for h in 1e-6 * np.eye(2)
        ]
        assert value[k] == pytest.approx(np.linalg.norm(first[k] - second[k]))
        assert variance[k] == pytest.approx(gradient @ (a[k] + b[k]) @ gradient, rel=1e-6)
    assert point_distance(first[0], a[0], first[0], b[0]) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ((np.zeros(3), np.eye(2)), "first must be of numbers to 1e"),
        ((np.array([1.1e9, 0]), np.eye(2)), "first must be of numbers to 1e"),
        ((np.zeros(2), np.eye(3)), "first_covariance must be of numbers to 1e"),
        ((np.zeros(2), 1.1e18 * np.eye(2)), "first_covariance must be of numbers to 1e"),
        ((np.zeros((3, 2)), np.eye(2)), "points and covariances must be of shapes that go together"),
    ],
)
def test_what_is_no_point(values, line):
    with pytest.raises(InvalidInput, match=line):
        point_distance(*values, np.zeros((2, 2)), np.eye(2))
    assert point_distance(np.array([1e9, 0]), 1e18 * np.eye(2), np.zeros(2), np.eye(2))[0] == 1e9


@pytest.mark.parametrize("degrees", [0.5, 30.0, 90.0, 150.0, 179.0])
def test_angle_of_lines(degrees, rng):
    """0 to 90 degrees; the variance is that of the difference of two correlated tilts."""
    angle, root = np.radians(degrees), rng.normal(size=(3, 3))
    covariance = (root @ root.T)[None]
    normals = np.array([[[0.6, 0.8], [7.0, 7.0], [0.0, 0.0]]])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    normals[0, 2] = turn @ normals[0, 0]
    value, variance = line_angle(SimpleNamespace(normals=normals, tilt_covariance=covariance), 0, 2)
    assert value == pytest.approx([min(degrees, 180 - degrees)])
    row = np.degrees([1.0, 0.0, -1.0])
    assert variance == pytest.approx([row @ covariance[0] @ row])


def test_sides_diagonals_and_angles(rng):
    """Names, values by plane geometry, standard deviations by central differences with all eight coordinates."""
    corners, root = np.array([[12.0, 9.0], [61.0, 15.0], [55.0, 48.0], [8.0, 40.0]]), rng.normal(size=(8, 8))
    covariance = root @ root.T

    def plain(corners):
        pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)]
        lengths = [np.hypot(*(corners[b] - corners[a])) for a, b in pairs]
        angles = []
        for i in range(4):
            one, other = (corners[(i + k) % 4] - corners[i] for k in (1, -1))
            turn = np.degrees(np.arctan2(one[1], one[0]) - np.arctan2(other[1], other[0]))
            angles.append(abs((turn + 180) % 360 - 180))
        return np.array([*lengths, *angles])

    steps = 1e-5 * np.eye(8).reshape(8, 4, 2)
    gradient = np.array([(plain(corners + h) - plain(corners - h)) / 2e-5 for h in steps]).T
    found = _values(corners, covariance)
    assert [each.name for each in found] == [
        "side 1-2", "side 2-3", "side 3-4", "side 4-1", "diagonal 1-3", "diagonal 2-4",
        "angle 1", "angle 2", "angle 3", "angle 4",
    ]  # fmt: skip
    assert [each.unit for each in found] == ["px"] * 6 + ["deg"] * 4
    assert [each.value for each in found] == pytest.approx(plain(corners))
    sigma = np.sqrt(np.einsum("mi,ij,mj->m", gradient, covariance, gradient))
    assert [each.sigma for each in found] == pytest.approx(sigma, rel=1e-6)
