"""Circles and ellipses: their place on exact images, and their covariance by Monte Carlo."""

import numpy as np
import pytest

import measure
from measure.features.optics import Optics
from scenes import InvalidInput, status
from tests.oracle import polygon_image

SHAPE = (100, 110)
OPTICS = Optics(SHAPE, 0.7, 4.0)


def outline(parameters, t):
    x, y, a, b = parameters[:4]
    angle = np.radians(parameters[4])
    u, v = a * np.cos(t), b * np.sin(t)
    return np.stack([x + np.cos(angle) * u - np.sin(angle) * v, y + np.sin(angle) * u + np.cos(angle) * v], -1)


def picture(parameters):
    """Exact blurred ellipse, as a polygon of 3000 corners."""
    return polygon_image(outline(parameters, np.linspace(0, 2 * np.pi, 3000, endpoint=False)), SHAPE, 0.7, 100.0)


@pytest.mark.parametrize("radius", [8.0, 12.0, 30.0])
def test_circle_in_an_exact_image(radius):
    """Radius too: without the correction for curvature it would be 0.03 to 0.1 px too small."""
    true = np.array([55.3, 50.7, radius, radius, 0.0])
    found = measure.find_ellipse(picture(true), true + [0.6, -0.4, 0.5, 0.5, 0], OPTICS, circle=True)
    assert found.status == status.OK
    assert np.abs(found.parameters - true).max() < 5e-3


def test_ellipse_in_an_exact_image():
    true = np.array([55.3, 50.7, 35.0, 18.0, 23.0])
    found = measure.find_ellipse(picture(true), [55.0, 51.0, 34.4, 18.4, 24.0], OPTICS)
    assert np.abs((found.parameters - true) * [1, 1, 1, 1, np.radians(1)]).max() < 3e-3


@pytest.mark.parametrize("circle", [False, True])
def test_covariance_in_noisy_images(rng, circle):
    """1000 images: standard error of a variance 4.5 %; 1.5 x the prediction is refused for each parameter."""
    true = np.array([55.3, 50.7, 20.0, 20.0, 0.0]) if circle else np.array([55.3, 50.7, 35.0, 18.0, 23.0])
    clean = picture(true)
    predicted = np.diag(measure.find_ellipse(clean, true, OPTICS, circle=circle).covariance)
    noisy = clean + 2 * rng.standard_normal((1000, *SHAPE))
    found = measure.find_ellipse(noisy, true, OPTICS, circle=circle)
    assert (found.status == status.OK).all()
    used = slice(0, 4) if circle else slice(0, 5)
    ratio = found.parameters.var(0, ddof=1)[used] / predicted[used]
    within = 4 * np.sqrt(2 / 999)
    assert np.abs(ratio - 1).max() < within  # margin: 4 standard errors
    # margin: a third of the 50 % is beyond 4 standard errors, for each parameter
    assert np.abs(ratio / 1.5 - 1).min() > within  # each of the parameters


@pytest.mark.parametrize(("circle", "arc"), [(False, 2 * np.pi), (False, 4.0), (True, 2 * np.pi), (True, 2.0)])
def test_fit_to_points_of_unequal_noise(rng, circle, arc):
    """Radial errors of 0.02 to 0.2 px on 60 points, on the whole curve and on an arc; 3000 fits."""
    true = np.array([300.0, 200.0, 40.0, 40.0 if circle else 22.0, 0.0 if circle else 40.0])
    t = np.linspace(0, arc, 60, endpoint=False)
    sigma = 0.02 * 10 ** rng.random(60)
    points = outline(true, t)
    toward = outline(true * [1, 1, 0, 0, 1] + [0, 0, true[3], true[2], 0], t) - true[:2]
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    predicted = np.diag(measure.fit_ellipse(points, sigma**2, circle=circle).covariance)
    fits = [
        measure.fit_ellipse(points + (sigma * rng.standard_normal(60))[:, None] * toward, sigma**2, circle=circle)
        for _ in range(1500)
    ]
    assert all(fit.status == status.OK for fit in fits)
    used = slice(0, 4) if circle else slice(0, 5)
    ratio = np.array([fit.parameters for fit in fits]).var(0, ddof=1)[used] / predicted[used]
    assert np.abs(ratio - 1).max() < 5 * np.sqrt(2 / 1499)  # margin: 5 standard errors
    # margin: a third of the 50 % is beyond 5 standard errors, for each parameter
    assert np.abs(ratio / 1.5 - 1).min() > 5 * np.sqrt(2 / 1499)


def test_five_points_determine_an_ellipse():
    true = np.array([10.0, 20.0, 9.0, 4.0, 17.0])
    found = measure.fit_ellipse(outline(true, np.array([0.1, 1.2, 2.7, 3.9, 5.1])), 0.01)
    assert found.parameters == pytest.approx(true, abs=1e-6)


def test_points_on_a_line_are_refused():
    found = measure.fit_ellipse(np.stack([np.arange(20.0), 2 * np.arange(20.0)], 1), 0.01, circle=True)
    assert found.status == status.ILL_CONDITIONED or found.parameters[2] > 1e4
    assert measure.find_ellipse(np.zeros(SHAPE), [55.0, 50, 20, 20, 0], OPTICS).status == status.LOW_CONTRAST
    assert measure.find_ellipse(np.zeros(SHAPE), [355.0, 50, 20, 20, 0], OPTICS).status == status.NOT_VISIBLE


@pytest.mark.parametrize(
    ("points", "line"),
    [
        (np.zeros((4, 2)), "points must be at least 5 pairs"),
        (np.full((6, 2), np.nan), "points must be finite, got NaN"),
    ],
)
def test_bad_points(points, line):
    with pytest.raises(InvalidInput, match=line):
        measure.fit_ellipse(points)
