"""Lagrange's polynomials of the planner's searches, by polynomials that they must reproduce."""

import numpy as np
import pytest

from imaging.blurred.boundaries import _SUPPORT, _interpolation
from planner.search.bound import _DEGREE, _influence, _lagrange, _nodes


def reproduced(weights, nodes, at, degree, rng):
    """Whether values of a random polynomial at the nodes give it elsewhere."""
    polynomial = np.polynomial.Polynomial(rng.normal(size=degree + 1))
    return weights @ polynomial(nodes) == pytest.approx(polynomial(at), rel=1e-9, abs=1e-9)


def test_of_a_search_by_bounds(rng):
    """Chebyshev's points on 0 to 1, their weights true to one degree less than there are points."""
    nodes, at = _nodes(), rng.random((3, 5))
    assert len(nodes) == _DEGREE
    assert np.sort(nodes) == pytest.approx(np.sort((1 + np.polynomial.chebyshev.chebpts1(_DEGREE)) / 2))
    assert _lagrange(at).shape == (3, 5, _DEGREE)
    assert reproduced(_lagrange(at), nodes, at, _DEGREE - 1, rng)
    assert _lagrange(nodes) == pytest.approx(np.eye(_DEGREE), abs=1e-12)


@pytest.mark.parametrize("shape", [(7,), (2, 7), (2, 3, 7)])
def test_of_levels_along_an_edge(shape, rng):
    at = rng.random(shape)
    found = _interpolation(at)
    assert found.shape == (*shape, _SUPPORT.size)
    assert reproduced(found, _SUPPORT, at, _SUPPORT.size - 1, rng)


def test_influence(rng):
    """Squared weight of one point's error in A d + B theta of the unweighted line, from the normal equations."""
    points, a, b = np.sort(rng.uniform(0, 50, (2, 9))), np.array([0.7, -1.0]), np.array([11.0, 20.0])
    found = _influence(points, a, b, points)
    for k in range(2):
        design = np.column_stack([np.ones(9), points[k]])
        expected = (np.array([a[k], b[k]]) @ np.linalg.pinv(design)) ** 2
        assert found[k] == pytest.approx(expected)
