"""What locators do to noise, by quadrature of their kernels, and the functions that a limb's crossing is told by."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import pbdv

from imaging.features.limb_locator import _cylinder_functions, box_cumulant
from imaging.features.locator import (
    CLEARANCE,
    STEP,
    correlation,
    edge_blur,
    information_bound,
    isophote_kappa2,
    kappa2,
    located_kappa2,
    reach,
)
from measure.estimators import crossings


def bell(x: float, sigma: float) -> float:
    return math.exp(-((x / sigma) ** 2) / 2) / (math.sqrt(2 * math.pi) * sigma)


def bent(x: float, sigma: float) -> float:
    """Second derivative of the normal density."""
    return (x**2 / sigma**4 - 1 / sigma**2) * bell(x, sigma)


def squared(kernel, sigma: float) -> float:
    return quad(lambda x: kernel(x, sigma) ** 2, -12 * sigma, 12 * sigma, epsabs=1e-14)[0]


@pytest.mark.parametrize(("scale", "blur"), [(1.3, 0.6), (0.8, 1.7)])
def test_a_point_s_variance_is_the_noise_s_over_the_slope(scale, blur):
    """Of the filtered white noise, one filter across the edge and a Gaussian along it; an edge of unit contrast."""
    width = math.sqrt(scale**2 + blur**2 + 1 / 12)
    along = squared(bell, scale)
    third = -bell(0.0, width) / width**2  # of the blurred step, at its crossing
    assert kappa2(scale, blur) == pytest.approx(squared(bent, scale) * along / third**2, rel=1e-9)
    assert isophote_kappa2(scale, blur) == pytest.approx(squared(bell, scale) * along / bell(0.0, width) ** 2, rel=1e-9)
    assert edge_blur(blur) == pytest.approx(math.sqrt(blur**2 + 1 / 12))
    assert reach(scale, blur) == pytest.approx(CLEARANCE * width)


@pytest.mark.parametrize(("scale", "blur"), [(1.0, 0.6), (0.8, 1.7)])
def test_the_cubic_of_a_profile_is_less_steep_than_what_it_passes_through(scale, blur):
    """Through four places of the second derivative of a blurred step, which is at one of them; fitted here.

    So a point's error is the larger, which the estimator's own places say, too.
    """
    width = math.sqrt(scale**2 + blur**2 + 1 / 12)
    places = STEP * np.arange(-1, 3)
    steep = np.polyfit(places, [-x / width**2 * bell(x, width) for x in places], 3)[2]
    exact = -bell(0.0, width) / width**2
    assert located_kappa2(scale, blur) == pytest.approx(kappa2(scale, blur) * (exact / steep) ** 2, rel=1e-9)
    assert crossings.STEP == STEP


def test_errors_along_an_edge_correlate_as_the_smoothed_noise():
    scale, apart = 1.3, 1.9
    both = quad(lambda x: bell(x, scale) * bell(x - apart, scale), -20, 20)[0]
    assert correlation(np.array([apart]), scale)[0] == pytest.approx(both / squared(bell, scale), rel=1e-9)


def test_information_of_a_blurred_step():
    """Integral of the squared derivative by the edge's place over the noise's variance."""
    blur, contrast, variance = 0.7, 40.0, 2.5
    width = edge_blur(blur)
    expected = contrast**2 * squared(bell, width) / variance
    assert information_bound(contrast, variance, blur) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("count", [1, 5])
def test_parabolic_cylinder_functions_between_the_table_s_places(count):
    """D_(k - p / 2)(-x) for k of 1, 2, 5, 6, to 2e-12 of the largest: a degree less would miss 5e-12."""
    x = np.random.default_rng(3).uniform(-4, 4, 200)
    found = _cylinder_functions(count)(x).reshape(200, 4, count)
    for i, k in enumerate((1.0, 2.0, 5.0, 6.0)):
        for p in range(count):
            exact = pbdv(np.full(200, k - p / 2), -x)[0]
            assert np.abs(found[:, i, p] - exact).max() < 2e-12 * np.abs(exact).max()


def test_a_pixel_s_fourth_cumulant_is_that_of_its_two_sides():
    """-2/15 of a uniform distribution from -1 to 1, halved four times: -1/120 for a side across the line."""
    angles = np.array([0.0, 0.4, math.pi / 4, 2.0])
    normals = np.stack([np.cos(angles), np.sin(angles)], -1)
    assert box_cumulant(normals) == pytest.approx(-(np.cos(angles) ** 4 + np.sin(angles) ** 4) * (2 / 15) / 16)
