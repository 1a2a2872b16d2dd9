"""Lagrange's polynomials of the planner's searches, by polynomials that they must reproduce."""

import numpy as np
import pytest

from imaging.blurred.boundaries import _SUPPORT, _interpolation
from imaging.sensor import headroom, recorded
from planner.search.exhaustive import _DEGREE, _cut_off, _influence, _lagrange, _nodes


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


@pytest.mark.parametrize("levels", [(300.0, 260.0), (245.0, 90.0), (150.0, 90.0), (234.5, 233.0)])
def test_the_end_of_the_scale_never_raises_what_a_search_may_rely_on(levels, task1):
    """The least factor of noise over squared contrast along an edge: 1 at the most, a little less where it is less."""
    sides, r2 = np.array(levels) * 1e6 * np.ones((1, 1, 2)), np.full((1, 1, 9), 1e4)
    with np.errstate(divide="ignore"):  # of no contrast
        found = float(_cut_off(task1, sides, r2, False)[0, 0])
    told, noise = recorded(task1.noise, task1.noise.dark_level + np.array(levels)), task1.noise
    with np.errstate(divide="ignore"):
        ratio = told.noise_variance.mean() / np.diff(told.level)[0] ** 2 * np.diff(levels)[0] ** 2 / noise.variance
    hot = levels[0] > 0.99 * headroom(noise)
    assert found == pytest.approx(min(0.98 * ratio, 1.0) if hot else 1.0, rel=1e-9)
