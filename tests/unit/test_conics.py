"""Circle and ellipse fits: variances by Monte Carlo on points with unequal noise, Jacobians by central differences."""

import numpy as np
import pytest

import planner
import scenes
from planner.circles import fisher_centre, rim
from planner.conics import fit_circle, fit_ellipse
from planner.prices import PAPER_KAPPA2, paper
from scenes import InvalidInput

COUNT = 1500
TOLERANCE = 4 * np.sqrt(2 / (COUNT - 1))  # four standard errors of a variance


def arc(rng):
    """Points on three quarters of a circle, with unequal noise."""
    angle = np.linspace(0, 1.5 * np.pi, 80)
    return angle, 0.03 * (1 + 2 * rng.random(80) + np.cos(angle) ** 2)


def check(empirical, predicted):
    """Each variance within four standard errors; 1.3 times the prediction and 0 are not."""
    for ours, theirs in zip(empirical, predicted, strict=True):
        assert ours / theirs == pytest.approx(1, abs=TOLERANCE)
        assert ours / (1.3 * theirs) != pytest.approx(1, abs=TOLERANCE)
        assert ours > TOLERANCE * theirs


def test_circle_by_monte_carlo(rng):
    angle, sigma = arc(rng)
    points = np.array([70.0, 40.0]) + 20 * np.stack([np.cos(angle), np.sin(angle)], -1)
    predicted = fit_circle(points, 1 / sigma**2)
    found = []
    for _ in range(COUNT):
        fit = fit_circle(points + sigma[:, None] * rng.standard_normal(points.shape), 1 / sigma**2)
        found.append([*fit.centre, fit.radius])
    check(np.var(found, axis=0, ddof=1), np.diag(predicted.covariance))
    correlation = np.corrcoef(np.array(found).T)
    scale = np.sqrt(np.diag(predicted.covariance))
    assert correlation == pytest.approx(predicted.covariance / np.outer(scale, scale), abs=0.1)


def test_ellipse_by_monte_carlo(rng):
    angle, sigma = arc(rng)
    shape = np.array([[25.0, 6.0], [6.0, 12.0]])
    points = np.array([70.0, 40.0]) + np.stack([np.cos(angle), np.sin(angle)], -1) @ shape
    predicted = fit_ellipse(points, 1 / sigma**2)
    assert predicted.centre == pytest.approx([70, 40], abs=1e-9)
    assert predicted.shape == pytest.approx(shape, abs=1e-8)
    found = []
    for _ in range(COUNT):
        fit = fit_ellipse(points + sigma[:, None] * rng.standard_normal(points.shape), 1 / sigma**2)
        found.append([*fit.centre, fit.shape[0, 0], fit.shape[1, 1], fit.shape[0, 1]])
    check(np.var(found, axis=0, ddof=1), np.diag(predicted.covariance))


def test_jacobian_of_the_ellipse_against_central_differences(rng):
    """The covariance belongs to the numeric derivatives of the points' distances by centre and shape."""
    angle, sigma = arc(rng)
    shape = np.array([[25.0, 6.0], [6.0, 12.0]])
    points = np.array([70.0, 40.0]) + np.stack([np.cos(angle), np.sin(angle)], -1) @ shape

    def distance(p):
        inverse = np.linalg.inv([[p[2], p[4]], [p[4], p[3]]])
        unit = (points - p[:2]) @ inverse
        return ((unit**2).sum(1) - 1) / 2 / np.linalg.norm(unit @ inverse, axis=1)

    truth, step = np.array([70.0, 40.0, 25.0, 12.0, 6.0]), 1e-4
    columns = [(distance(truth + d) - distance(truth - d)) / (2 * step) for d in step * np.eye(5)]
    expected = np.linalg.inv(np.einsum("ki,li,i->kl", columns, columns, 1 / sigma**2))
    assert fit_ellipse(points, 1 / sigma**2).covariance == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_rim_is_measured_from_the_ellipses_own_centre():
    plate = scenes.load("plate")
    seen = rim(plate, plate.solid.circle("c2"), np.array([50.0, 30.0]), np.array([20.0, 100.0]), fall_off=True)
    normal = seen.design[:, :2]
    points = seen.design[:, 2:4] / normal
    assert np.linalg.norm(normal, axis=1) == pytest.approx(np.ones(len(normal)))
    assert seen.design[:, 4] == pytest.approx((normal * points[:, ::-1]).sum(1), rel=1e-6, abs=1e-6)
    assert fit_ellipse(points, np.ones(len(points))).centre == pytest.approx([0, 0], abs=1e-6)


def test_centre_of_a_hole_by_fitting(rng):
    """The paper price of the plate's hole is that of an ellipse fitted to points with the paper's errors."""
    plate = scenes.load("plate")
    sensor, light = np.array([40.0, 30.0]), np.array([25.0, 100.0])
    seen = rim(plate, plate.solid.circle("c2"), sensor, light, fall_off=False)
    used = seen.counted
    weight = seen.squared[used] / (PAPER_KAPPA2 * plate.noise.sigma**2)
    x, y = (seen.design[used, i] / seen.design[used, i - 2] for i in (2, 3))
    points, sigma = np.stack([x, y], -1), 1 / np.sqrt(weight)
    keep = sigma < 1.0  # a point worse than a pixel is nearly no point, and its distance is not linear
    predicted = fisher_centre(seen, seen.squared / (PAPER_KAPPA2 * plate.noise.sigma**2) * 1.0, used)
    priced = paper(plate, sensor, light)
    assert priced.centres[0] == pytest.approx(predicted)
    centres = [
        fit_ellipse(points[keep] + sigma[keep, None] * rng.standard_normal((keep.sum(), 2)), weight[keep]).centre
        for _ in range(COUNT)
    ]
    check(np.var(centres, axis=0, ddof=1), np.diag(predicted))
    assert planner.predict(plate, sensor, light, "paper").variance_px2 == pytest.approx(priced.variance)


def test_bad_points():
    line = np.stack([np.arange(9.0), np.arange(9.0)], -1)
    with pytest.raises(InvalidInput, match="points must not lie on a line"):
        fit_circle(line, np.ones(9))
    with pytest.raises(InvalidInput, match="points must be at least 5 with weight, got 4"):
        fit_ellipse(np.random.default_rng(1).random((9, 2)), np.array([1, 1, 1, 1, 0, 0, 0, 0, 0]))
