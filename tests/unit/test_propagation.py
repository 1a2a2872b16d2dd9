"""Error propagation: against Monte Carlo, against central differences, and against the formulas as printed."""

import numpy as np
import pytest

from planner.features.propagation import (
    corner_covariance,
    distance_variance,
    fit_line,
    line_covariance,
    offset_variance,
)


@pytest.fixture
def noisy_line(rng):
    """60 points of unequal noise on the line at 30 degrees through (40, 7), and their true moments."""
    s = np.linspace(-30, 50, 60)
    points = np.array([40.0, 7.0]) + s[:, None] * [np.cos(0.5), np.sin(0.5)]
    return points, 0.05 * (1 + rng.random(60))


def simulated(points, sigma, rng, count=40000):
    noisy = points + sigma[:, None] * rng.standard_normal((count, *points.shape))
    fit = fit_line(noisy, np.broadcast_to(1 / sigma**2, noisy.shape[:-1]))
    return np.concatenate([fit.normal, fit.gamma[:, None]], -1)


def test_line_covariance_against_monte_carlo(noisy_line, rng):
    points, sigma = noisy_line
    predicted = line_covariance(fit_line(points, 1 / sigma**2))
    empirical = np.cov(simulated(points, sigma, rng).T)
    # relative standard error of a variance from 40000 samples is 0.7 %
    assert np.diag(empirical) == pytest.approx(np.diag(predicted), rel=0.03)
    assert empirical == pytest.approx(
        predicted, rel=0.05, abs=0.03 * np.sqrt(np.outer(np.diag(predicted), np.diag(predicted))).min()
    )


def test_printed_gamma_variance_fails_the_same_test(noisy_line, rng):
    """Negative control: the printed I/W in V(gamma) is refuted by the same sample, as are 1.3 x the truth and 0."""
    points, sigma = noisy_line
    fit = fit_line(points, 1 / sigma**2)
    repaired = line_covariance(fit)[2, 2]
    printed = repaired + (fit.count - 1) / fit.total_weight
    empirical = simulated(points, sigma, rng)[:, 2].var(ddof=1)
    assert empirical == pytest.approx(repaired, rel=0.03)
    assert empirical != pytest.approx(printed, rel=0.03)
    assert empirical != pytest.approx(1.3 * repaired, rel=0.03)
    assert empirical != pytest.approx(0, abs=0.03 * repaired)


def test_offset_variance_is_the_printed_quadratic_form(noisy_line):
    points, sigma = noisy_line
    fit = fit_line(points, 1 / sigma**2)
    for s in (-80.0, 0.0, 33.0):
        point = fit.centroid + s * np.array([fit.normal[1], -fit.normal[0]])
        v = np.append(point, 1.0)
        assert offset_variance(fit, point) == pytest.approx(v @ line_covariance(fit) @ v, rel=1e-9)


def crossing(parameters):
    (a1, b1, g1), (a2, b2, g2) = parameters.reshape(2, 3)
    return np.linalg.solve([[a1, b1], [a2, b2]], [-g1, -g2])


def central_difference(function, x, step=1e-6):
    columns = []
    for i in range(x.size):
        up, down = x.copy(), x.copy()
        up[i] += step
        down[i] -= step
        columns.append((function(up) - function(down)) / (2 * step))
    return np.stack(columns, -1)


@pytest.mark.parametrize(("first", "second"), [(0.1, 1.4), (0.3, 0.9), (2.0, -0.4), (0.0, np.pi / 2)])
def test_corner_covariance_against_central_differences(first, second):
    normals = np.array([[np.sin(first), np.cos(first)], [np.sin(second), np.cos(second)]])
    lines = np.column_stack([normals, [-3.0, 5.0]])
    response = central_difference(crossing, lines.ravel())[:, [2, 5]]  # only the offsets move
    variances = np.array([0.3, 0.8])
    expected = response @ np.diag(variances) @ response.T
    assert corner_covariance(normals, variances) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_distance_variance_against_central_differences():
    ends = np.array([[3.0, 4.0], [90.0, -20.0]])
    gradient = central_difference(lambda p: np.linalg.norm(p[:2] - p[2:]), ends.ravel())
    covariances = np.array([[[0.2, 0.05], [0.05, 0.1]], [[0.4, -0.1], [-0.1, 0.3]]])
    joint = np.zeros((4, 4))
    joint[:2, :2], joint[2:, 2:] = covariances
    assert distance_variance(ends, covariances) == pytest.approx(gradient @ joint @ gradient, rel=1e-6)


def test_far_line_keeps_its_digits(noisy_line):
    """Moving everything 1e8 px away changes no variance of the line's position; raw moments would lose 16 digits."""
    points, sigma = noisy_line
    near, far = fit_line(points, 1 / sigma**2), fit_line(points + 1e8, 1 / sigma**2)
    assert far.tilt_variance == pytest.approx(near.tilt_variance, rel=1e-6)


def test_what_cannot_be_measured_is_infinite():
    assert np.isinf(corner_covariance(np.array([[0.0, 1.0], [0.0, 1.0]]), np.ones(2)).diagonal()).all()
    assert distance_variance(np.zeros((2, 2)), np.stack([np.eye(2)] * 2)) == np.inf
