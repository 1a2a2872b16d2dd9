"""Blurred half-planes and wedges against quadrature of the normal density."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from measure.estimators.coverage import NODE_WEIGHTS, NODES, density, half_plane, wedge, wedge_slope


def both(h, k, rho):
    """P(X < h, Y < k) of unit normals with correlation rho: the one given the other, integrated."""
    root = np.sqrt((1 - rho) * (1 + rho))

    def slice_(x):
        return norm.pdf(x) * norm.cdf((k - rho * x) / root)

    middle = np.clip(k / rho, -9, h - 1e-9) if rho else 0.0
    return quad(slice_, -9, min(middle, h), epsabs=1e-13)[0] + quad(slice_, min(middle, h), h, epsabs=1e-13)[0]


@pytest.mark.parametrize("rho", [-0.999, -0.7, 0.0, 0.3, 0.95])
def test_wedge(rho):
    pairs = [(0.3, 1.2), (-1.0, 0.4), (2.5, -0.1), (-0.7, -1.9), (0.0, 0.8), (1.1, 0.0), (0.0, 0.0)]
    h, k = np.array(pairs).T
    assert wedge(h, k, rho) == pytest.approx([both(*pair, rho) for pair in pairs], abs=1e-8)


def test_wedge_of_far_lines():
    """Nothing or the other half-plane, whatever the angle."""
    h, k = np.array([8.0, -8.0, 8.0, 9.0]), np.array([0.7, 0.7, -9.0, 8.0])
    for rho in (-0.6, 0.0, 0.6):
        assert wedge(h, k, rho) == pytest.approx([norm.cdf(0.7), 0.0, 0.0, 1.0], abs=1e-12)


@pytest.mark.parametrize("h", [-1.5, 0.4, 1.3])
@pytest.mark.parametrize("k", [-0.2, 0.9])
def test_wedge_of_parallel_lines(h, k):
    """The smaller of two half-planes of one direction; the strip between opposite ones, if there is one."""
    assert wedge(np.array([h]), np.array([k]), 1.0)[0] == pytest.approx(norm.cdf(min(h, k)), abs=1e-12)
    strip = max(norm.cdf(h) - norm.cdf(-k), 0.0)
    assert wedge(np.array([h]), np.array([k]), -1.0)[0] == pytest.approx(strip, abs=1e-12)
    assert wedge(np.array([h]), np.array([k]), -1 + 1e-10)[0] == pytest.approx(strip, abs=1e-4)


def test_slopes_are_derivatives():
    u = np.linspace(-2, 2, 9)
    assert half_plane(u) == pytest.approx(norm.cdf(u), abs=1e-14)
    assert density(u) == pytest.approx((half_plane(u + 1e-5) - half_plane(u - 1e-5)) / 2e-5, abs=1e-9)
    for rho in (-0.8, 0.0, 0.5):
        k = np.full(u.shape, 0.6)
        numeric = (wedge(u + 1e-4, k, rho) - wedge(u - 1e-4, k, rho)) / 2e-4
        assert wedge_slope(u, k, rho) == pytest.approx(numeric, abs=1e-7)


def test_nodes_integrate_a_pixel():
    """Polynomials up to the seventh degree in x and y, over the unit square about 0."""
    x, y = NODES.T
    for i, j in [(0, 0), (2, 0), (0, 4), (6, 2), (7, 0), (1, 1), (6, 6)]:
        exact = np.prod([0.0 if n % 2 else 0.5**n / (n + 1) for n in (i, j)])
        assert NODE_WEIGHTS @ (x**i * y**j) == pytest.approx(exact, abs=1e-15)
