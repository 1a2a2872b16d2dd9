"""Points that have too little contrast are dropped from a line: against the normal equations of dense points."""

import numpy as np
import pytest

from imaging.models.along import NODES, EdgeNodes
from imaging.models.calibrated import _double_integral, _first_order, line_slope, line_weight, long_edge


def nodes(length, middle):
    t = length / 2 * np.concatenate([[-1], NODES, [1]])
    return EdgeNodes(t[None], np.array([[middle]]), np.array([[length]]), None, 0.6, 1.0, 1.0)


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


@pytest.mark.parametrize(("a", "b"), [(1.0, 0.0), (0.3, 25.0)])
def test_double_integral(a, b):
    """A sum over 800 points of an edge of 9 px, correlated over 1.2 px; the weight is the least-squares line's."""
    length, middle, scale = 9.0, 6.0, 1.2
    n = nodes(length, middle)
    t = length * ((np.arange(800) + 0.5) / 800 - 0.5)
    design = np.column_stack([np.ones(800), t + middle]) * (length / 800)
    weight = np.linalg.solve(design.T @ np.column_stack([np.ones(800), t + middle]), design.T).T @ [a, b]
    # per point; the closed weight is per px
    kernel = np.exp(-((t[:, None] - t) ** 2) / (4 * scale**2))
    expected = weight @ kernel @ weight
    g = line_weight(n, np.array([a]), np.array([b]))
    assert _double_integral(g, n.t, n.length, scale)[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("spans", [10.0, 14.0, 40.0])  # smoothing scales that the edge is long
@pytest.mark.parametrize(("a", "b"), [(1.0, 0.0), (0.0, 30.0), (0.3, -25.0)])
def test_a_long_edge(spans, a, b):
    """A sum over 4000 correlated points; without the slope's own term the tilt's variance would be 1.3 % too low."""
    scale, length = 1.2, 1.2 * spans
    n, a, b = nodes(length, 0.4 * length), np.array([a]), np.array([b])
    t = length * ((np.arange(4000) + 0.5) / 4000 - 0.5)
    weight = np.interp(t, n.t[0], line_weight(n, a, b)[0]) * length / 4000
    expected = weight @ np.exp(-((t[:, None] - t) ** 2) / (4 * scale**2)) @ weight
    found = long_edge(n, line_weight(n, a, b), line_slope(n, a, b), scale)[0].sum()
    assert found == pytest.approx(expected, rel=1e-5)
