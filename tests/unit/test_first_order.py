"""The variance of a line: against sums over edge points, and where points of too little contrast are dropped."""

import numpy as np
import pytest

from imaging.features.locator import correlation, points_along, spacing
from imaging.models.along import NODES, EdgeNodes
from imaging.models.calibrated import _first_order, _sum_of_points, line_slope, line_weight, long_edge
from measure.features.lines import line_map, trapezoid

SCALE = 1.2
WANTED = [(1.0, 0.0), (0.0, 30.0), (0.3, -25.0)]  # of offset at the first end, px, and tilt


def nodes(length, middle):
    t = length / 2 * np.concatenate([[-1], NODES, [1]])
    apart = spacing(np.array([[length]]), SCALE)
    return EdgeNodes(t[None], np.array([[middle]]), np.array([[length]]), apart, None, 0.6, 1.0, 1.0)


def of_points(length, middle, a, b, sigma=lambda t: 1.0):
    """The variance by the line through the points that `gradient` has, of errors of standard deviations sigma(t)."""
    t = np.linspace(-length / 2, length / 2, points_along(length, SCALE))
    weight = np.array([a, b]) @ line_map(t + middle, trapezoid(t)) * sigma(t)
    return weight @ correlation(t[:, None] - t, SCALE) @ weight


@pytest.mark.parametrize("cut", [0.0, -6.0])
@pytest.mark.parametrize(("a", "b"), [(1.0, 0.0), (0.3, 25.0), (-0.8, 60.0)])
def test_first_order(a, b, cut):
    """The variance of A d + B theta from independent points of density 1 a px that lie beyond the cut."""
    length, middle = 40.0, 27.0
    n = nodes(length, middle)
    kept = (n.t >= cut) if cut else np.ones(n.t.shape, bool)
    per_point = 0.02 + 0.0005 * (n.t - 5) ** 2
    found = _first_order(n, np.array([a]), np.array([b]), per_point, kept)[0]
    weights = np.polynomial.legendre.leggauss(16)[1] * length / 2
    used, t = weights * kept[0, 1:-1], n.t[0, 1:-1]
    design = np.column_stack([np.ones(16), t + middle])  # d at the edge's first end, and the slope
    gram = design.T @ (used[:, None] * design)
    response = np.array([a, b]) @ np.linalg.solve(gram, (used[:, None] * design).T)
    assert found == pytest.approx((response**2 * per_point[0, 1:-1] / np.where(used > 0, used, 1)).sum(), rel=1e-9)


def test_too_little_is_left():
    n = nodes(40.0, 27.0)
    kept = n.t > 19.0
    with np.errstate(all="ignore"):  # as its caller does
        found = _first_order(n, np.ones(1), np.ones(1), np.ones(n.t.shape), kept)
    assert np.isinf(found).all()


@pytest.mark.parametrize("spans", [1.8, 4.0, 9.9])  # smoothing scales that the edge is long
@pytest.mark.parametrize(("a", "b"), WANTED)
def test_a_short_edge(spans, a, b):
    """The nine points themselves, at a contrast that changes by a third; dense ones are 0.3 to 9 % off."""
    length, middle = SCALE * spans, 6.0

    def sigma(t):
        return 1 / (1 + 0.3 * t / length)

    n = nodes(length, middle)
    weight = line_weight(n, np.array([a]), np.array([b])) * sigma(n.t)
    assert _sum_of_points(weight, n.length, SCALE)[0] == pytest.approx(of_points(length, middle, a, b, sigma), rel=1e-9)


def long(length, middle, a, b):
    n, a, b = nodes(length, middle), np.array([a]), np.array([b])
    return long_edge(n, line_weight(n, a, b), line_slope(n, a, b), SCALE)[0].sum()


@pytest.mark.parametrize("spans", [10.0, 14.0, 17.0, 25.0, 41.0, 201.0])
@pytest.mark.parametrize(("a", "b"), WANTED)
def test_a_long_edge(spans, a, b):
    """Points as far apart as the mean of those lengths; dense ones are 0.2 to 11 % off."""
    length = SCALE * spans
    expected = of_points(length, 0.4 * length, a, b)
    assert long(length, 0.4 * length, a, b) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(("a", "b"), WANTED)
def test_edges_of_any_length(a, b):
    """Whose points are a whole number: between them the sum leaps about the smooth one."""
    ratios = [
        long(length, 0.4 * length, a, b) / of_points(length, 0.4 * length, a, b)
        for length in SCALE * np.arange(10.0, 60.0, 0.1)
    ]
    assert np.ptp(ratios) < 0.05
    assert np.mean(ratios) == pytest.approx(1, abs=2e-3)
