"""Weights of points along a line, and trends of values, by plain sums."""

import numpy as np
import pytest

from measure.features.lines import _GAP, cells, trapezoid, trend_along


@pytest.mark.parametrize("limits", [(0.0, 10.0), (1.2, 7.5), (-9.0, 30.0)])
def test_cells(limits):
    """Halfway to the neighbours that count, to the limits at the ends, no farther than the gap; none beyond limits."""
    along, valid = np.array([[0.5, 1.0, 2.0, 5.0, 8.0]]), np.array([[True, True, False, True, True]])
    found = cells(along, valid, limits)
    places = [0.5, 1.0, 5.0, 8.0]
    for k, (place, column) in enumerate(zip(places, (0, 1, 3, 4), strict=True)):
        left = place - limits[0] if k == 0 else (place - places[k - 1]) / 2
        right = limits[1] - place if k == 3 else (places[k + 1] - place) / 2
        assert found[0, column] == pytest.approx(np.clip(left, 0, _GAP) + np.clip(right, 0, _GAP))
    assert found[0, 2] == 0


def test_cells_of_dense_points_make_the_length():
    along = np.linspace(2.0, 9.0, 8)[None]
    assert cells(along, np.ones((1, 8), bool), (1.6, 9.4)).sum() == pytest.approx(7.8)
    assert not cells(along, np.zeros((1, 8), bool), (1.6, 9.4)).any()


@pytest.mark.parametrize(("count", "weights"), [(1, [1]), (2, [1, 1]), (3, [0.5, 1, 0.5]), (5, [0.5, 1, 1, 1, 0.5])])
def test_trapezoid(count, weights):
    assert trapezoid(np.linspace(3, 4, count)).tolist() == weights


def test_trend(rng):
    """Weighted least squares of a straight line through values, two images, three rows each."""
    along, weights = rng.uniform(0, 9, (2, 7)), rng.uniform(0.1, 1, (2, 7))
    value = rng.normal(size=(3, 2, 7))
    mean, slope, start = trend_along(along, value, weights)
    for k in range(3):
        for n in range(2):
            change, at_zero = np.polyfit(along[n], value[k, n], 1, w=np.sqrt(weights[n]))
            assert slope[k, n] == pytest.approx(change)
            assert start[k, n] == pytest.approx(at_zero)
            assert mean[k, n] == pytest.approx(np.average(value[k, n], weights=weights[n]))
    nothing = trend_along(along, value, np.zeros((2, 7)))
    assert all((part == 0).all() for part in nothing)
