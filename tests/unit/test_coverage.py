"""Blurred half-planes against the normal distribution, and quadrature over a pixel."""

import numpy as np
import pytest
from scipy.stats import norm

from measure.estimators.coverage import NODE_WEIGHTS, NODES, density, half_plane


def test_slopes_are_derivatives():
    u = np.linspace(-2, 2, 9)
    assert half_plane(u) == pytest.approx(norm.cdf(u), abs=1e-14)
    assert density(u) == pytest.approx((half_plane(u + 1e-5) - half_plane(u - 1e-5)) / 2e-5, abs=1e-9)


def test_nodes_integrate_a_pixel():
    """Polynomials up to the seventh degree in x and y, over the unit square about 0."""
    x, y = NODES.T
    for i, j in [(0, 0), (2, 0), (0, 4), (6, 2), (7, 0), (1, 1), (6, 6)]:
        exact = np.prod([0.0 if n % 2 else 0.5**n / (n + 1) for n in (i, j)])
        assert NODE_WEIGHTS @ (x**i * y**j) == pytest.approx(exact, abs=1e-15)
