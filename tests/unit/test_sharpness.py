"""Blur of each side, modulation transfer, and uneven light, from images made with known ones."""

from functools import lru_cache

import cv2
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import chi2

import measure
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.photo.blur import SideBlur, side_blur
from measure.photo.expected import optics_of
from measure.photo.noise_curve import NoiseCurve
from measure.photo.patches import smooth_patches
from measure.photo.uneven import _inside, orders
from scenes import InvalidInput
from tests.oracle import polygon_image

SHAPE = (200, 260)
CORNERS = np.array([[61.3, 52.2], [201.6, 63.9], [190.4, 150.7], [50.8, 139.1]])
CURVE = NoiseCurve(2.25, 0.0, 0.0, 0.0, None)


@lru_cache(maxsize=8)
def clean(blur=0.8):
    return polygon_image(CORNERS, SHAPE, blur, 135.0, 50.0)


def layout(blur=1.0, shift=0.0):
    return polygon_layout(CORNERS + shift, Optics(SHAPE, blur))


def transfer(u, normal, blur):
    """Gaussian lens and square pixel across an edge with a unit normal."""
    return np.exp(-2 * (np.pi * blur * u) ** 2) * np.abs(np.sinc(u * normal[0]) * np.sinc(u * normal[1]))


@pytest.mark.parametrize("blur", [0.5, 1.2, 2.5])
def test_blur_of_each_side(blur, rng):
    """Within 4 standard errors, which are below 1 %, from a layout half a pixel off; the sides are alike."""
    found = side_blur(clean(blur) + 1.5 * rng.standard_normal(SHAPE), layout(1.0, 0.4), CURVE)
    # margin: 4 standard errors, which are below 1 %
    assert np.abs(found.sigma - blur).max() < 4 * found.error.max() < 0.04 * blur
    assert found.common == pytest.approx(blur, abs=4 * found.error.max())
    assert not found.differs
    assert found.p_value > 1e-3


def test_astigmatic_blur(rng):
    """Each side as the Gaussian along its normal; ok, unbiased, measured side by side."""
    image = cv2.GaussianBlur(clean(), (0, 0), sigmaX=1.0, sigmaY=0.01) + 1.5 * rng.standard_normal(SHAPE)
    found = side_blur(image, layout(), CURVE)
    expected = np.sqrt(0.64 + layout().normals[:, 0] ** 2)
    assert np.abs(found.sigma - expected).max() < 5 * found.error.max() < 0.1  # margin: 5 standard errors
    assert found.differs
    whole = measure.measure_quadrilateral(image)
    assert (whole.status, whole.estimator) == ("ok", "strip")
    true = np.roll(CORNERS, -int(np.argmin(CORNERS.sum(1))), 0)
    away = min(np.abs(whole.corners - np.roll(way, k, 0)).max() for way in (true, true[::-1]) for k in range(4))
    assert away < 5 * np.sqrt(np.diag(whole.covariance).max())  # margin: 5 standard deviations


def test_what_is_no_straight_gaussian_edge(rng):
    """Motion by 6 px is a box; p says so."""
    image = cv2.blur(clean(), (6, 1)) + 1.5 * rng.standard_normal(SHAPE)
    assert side_blur(image, layout(), CURVE).p_value < 1e-6


@pytest.mark.parametrize("side", range(4))
def test_modulation_transfer(side):
    """The closed form to 0.2 % of 1 up to half a cycle a pixel; MTF50 to 0.2 %; motion's own zero."""
    found = measure.mtf(clean(), CORNERS, side)
    normal = layout().normals[side]
    low = found.frequency <= 0.5
    # margin: the claim, 0.2 %: bins of edge points
    assert found.mtf[low] == pytest.approx(transfer(found.frequency[low], normal, 0.8), abs=2e-3)
    half = brentq(lambda u: transfer(u, normal, 0.8) - 0.5, 0.01, 1)
    assert found.mtf50 == pytest.approx(half, rel=2e-3)  # margin: the claim, 0.2 %: bins of edge points
    moved = measure.mtf(cv2.blur(clean(), (6, 1)), CORNERS, side)
    six = np.arange(-2.5, 3)[:, None] * normal[0] * found.frequency[low]
    seen = np.abs(np.cos(2 * np.pi * six).mean(0)) * transfer(found.frequency[low], normal, 0.8)
    assert moved.mtf[low] == pytest.approx(seen, abs=4e-3)


def test_an_edge_as_sharp_as_its_samples_has_no_mtf50():
    """Of two levels alone the transfer stays above a half at all frequencies that are looked at."""
    found = measure.mtf(np.where(clean() > 92.5, 135.0, 50.0), CORNERS, 0)
    assert found.mtf.min() > 0.5
    assert np.isnan([found.mtf50, found.mtf50_error]).all()


@pytest.mark.parametrize(("blur", "is_told"), [(0.13, True), (0.02, False)])
def test_how_sharp_is_too_sharp(blur, is_told):
    """A blur of half of what the pixels resolve is told still, one of a fifteenth is not."""
    assert np.isfinite(side_blur(clean(blur), layout(), CURVE).sigma).all() == is_told


@pytest.mark.parametrize("count", [2, 4])
def test_sides_differ_where_chance_would_seldom_make_them(count):
    """One in a thousand, by the chi-square of one less than the sides: just above and just below; one side never."""
    error = np.array([0.01, 0.03, 0.02, 0.05])[:count]
    away = np.array([1.0, -1.0, 0.5, -0.2])[:count]
    limit = chi2.isf(1e-3, count - 1)
    told = []
    for factor in (1.01, 0.99):
        weight = error**-2
        centred = away - (away * weight).sum() / weight.sum()
        sigma = 0.8 + centred * np.sqrt(factor * limit / ((centred / error) ** 2).sum())
        told.append(SideBlur(sigma, error, *np.ones((3, count)), None).differs)
    assert told == [True, False]
    assert not SideBlur(sigma[:1], error[:1], *np.ones((3, 1)), None).differs


def test_standard_error_of_mtf50(rng):
    """60 noisy images scatter as told (standard error 9 %), and a third more would be seen."""
    runs = [measure.mtf(clean() + 1.5 * rng.standard_normal(SHAPE), CORNERS, 1) for _ in range(60)]
    ratio = np.std([one.mtf50 for one in runs], ddof=1) / np.mean([one.mtf50_error for one in runs])
    assert abs(ratio - 1) < 3 / np.sqrt(2 * 59)
    assert abs(ratio / 1.33 - 1) > abs(ratio - 1)


def test_sides_that_tell_no_transfer():
    """Along the rows there are no samples in between; too short a side; no such side."""
    straight = np.array([[40.0, 50.0], [200.0, 50.0], [200.0, 150.0], [40.0, 150.0]])
    with pytest.raises(InvalidInput, match="side 1 must lean by some degrees"):
        measure.mtf(clean(), straight, 0)
    with pytest.raises(InvalidInput, match="side 1 must show at least"):
        measure.mtf(clean(), CORNERS / 4 + 60, 0)
    with pytest.raises(InvalidInput, match="side must be one of a polygon's of 4 corners, got 4"):
        measure.mtf(clean(), CORNERS, 4)
    assert measure.mtf(clean(), CORNERS[:2]).mtf50 == pytest.approx(measure.mtf(clean(), CORNERS, 0).mtf50, rel=0.02)


@pytest.mark.parametrize(("bend", "expected"), [((0, 0), (0, 0)), ((0.2, 0), (1, 1)), ((0.1, 0.5), (2, 2))])
def test_orders_of_uneven_light(bend, expected, rng):
    """Even, linear and quadratic light on both sides."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    u, v = x / SHAPE[1] - 0.5, y / SHAPE[0] - 0.5
    image = clean() * (1 + bend[0] * u - bend[1] * (u * u + v * v)) + 1.5 * rng.standard_normal(SHAPE)
    found = orders(smooth_patches(image), layout(0.8), CURVE)
    assert found == expected


@pytest.mark.parametrize("turn", [1, -1])
def test_what_lies_within_a_polygon(turn, rng):
    """Whichever way round its corners are told, to a thousandth of a pixel at its sides; against OpenCV's test."""
    corners = CORNERS[::turn]
    middles = (corners + np.roll(corners, -1, 0)) / 2
    inward = (corners.mean(0) - middles) / np.linalg.norm(corners.mean(0) - middles, axis=1, keepdims=True)
    places = np.concatenate([rng.uniform(0, 230, (200, 2)), middles + 2e-3 * inward, middles - 2e-3 * inward])
    outline = corners.astype(np.float32).reshape(-1, 1, 2)
    expected = [cv2.pointPolygonTest(outline, place.tolist(), True) > 0 for place in places]
    assert _inside(places, corners).tolist() == expected
    assert 20 < sum(expected) < 180


@pytest.mark.parametrize("corner", [(8.0, 9.0), (16.0, 16.0), (40.0, 30.0)])
def test_the_noise_is_that_of_the_mean_level_around(corner):
    """Within 16 px of the corners, and within the image: where no two rows or columns are alike."""
    image = np.add.outer(np.geomspace(1, 4000, 90), np.geomspace(2, 9000, 110))
    corners = np.array(corner) + np.array([[0.0, 0], [30, 2], [28, 25], [1, 22]])
    curve = NoiseCurve(1.0, 0.5, 0.0, 0.0, None)
    x0, y0 = np.maximum(np.floor(corners.min(0) - 16), 0).astype(int)
    x1, y1 = np.ceil(corners.max(0) + 17).astype(int)
    expected = curve.variance(image[y0:y1, x0:x1].mean())
    assert optics_of(image, corners, 1.5, curve).noise_variance == pytest.approx(float(expected), rel=1e-12)
