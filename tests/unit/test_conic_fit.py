"""Fits of conics to points: orthogonal distances by dense sampling, derivatives and covariance by differences."""

import numpy as np
import pytest

from measure import fit_ellipse
from measure.features.conic import _distances, _start
from scenes import InvalidInput, status


def curve(parameters, t):
    x, y, a, b, angle = parameters
    c, s = np.cos(angle), np.sin(angle)
    u, v = a * np.cos(t), b * np.sin(t)
    return np.column_stack([x + c * u - s * v, y + s * u + c * v])


TRUE = np.array([30.0, -12.0, 20.0, 9.0, 0.6])


def test_distances(rng):
    """The nearest of 200,000 points of the curve; outside is positive; derivatives by central differences."""
    t = rng.uniform(0, 2 * np.pi, 12)
    points = curve(TRUE, t) + rng.uniform(-2, 2, (12, 2))
    dense = curve(TRUE, np.linspace(0, 2 * np.pi, 200_001))
    nearest = np.array([np.linalg.norm(dense - point, axis=1).min() for point in points])
    c, s = np.cos(TRUE[4]), np.sin(TRUE[4])
    d = points - TRUE[:2]
    outside = ((c * d[:, 0] + s * d[:, 1]) / TRUE[2]) ** 2 + ((-s * d[:, 0] + c * d[:, 1]) / TRUE[3]) ** 2 > 1
    found, slopes = _distances(points, TRUE)
    assert found == pytest.approx(np.where(outside, nearest, -nearest), abs=1e-5)
    for i in range(5):
        step = 1e-6 * (np.arange(5) == i)
        numeric = (_distances(points, TRUE + step)[0] - _distances(points, TRUE - step)[0]) / 2e-6
        assert slopes[:, i] == pytest.approx(numeric, abs=1e-6)


@pytest.mark.parametrize("angle", [-80.0, -20.0, 0.0, 35.0, 90.0])
def test_exact_points(angle):
    """The longer axis comes first and its angle is in (-90, 90], whichever axis is the longer one to begin with."""
    t = np.linspace(0, 5.5, 23)
    radians = np.radians(angle)
    for a, b, turn in ((20.0, 9.0, 0.0), (9.0, 20.0, np.pi / 2)):
        found = fit_ellipse(curve((30.0, -12.0, a, b, radians + turn), t), 0.01)
        assert found.parameters[:4] == pytest.approx([30, -12, 20, 9], abs=1e-7)
        away = (found.parameters[4] - angle + 90) % 180 - 90
        assert abs(away) < 1e-6
        assert -90 - 1e-6 <= found.parameters[4] <= 90 + 1e-6  # margin: the ends of the range


@pytest.mark.parametrize("circle", [False, True])
def test_covariance_is_that_of_the_fit(circle, rng):
    """Each point moved along its normal by a little: the fit's response, and so the covariance of unequal points."""
    true = (30.0, -12.0, 15.0, 15.0, 0.0) if circle else tuple(TRUE)
    t = np.linspace(0.2, 5.0, 14)
    points, variances = curve(true, t), rng.uniform(0.01, 0.2, 14)
    full = np.diag(variances)
    full[0, 1] = full[1, 0] = 0.5 * np.sqrt(variances[0] * variances[1])
    tangent = curve(true, t + 1e-6) - curve(true, t - 1e-6)
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.linalg.norm(tangent, axis=1)[:, None]
    response = []
    for i in range(14):
        move = 1e-4 * (np.arange(14) == i)[:, None] * normal
        ahead, behind = (fit_ellipse(points + k * move, full, circle=circle).parameters for k in (1, -1))
        response.append((ahead - behind) / 2e-4)
    response = np.array(response).T
    found = fit_ellipse(points, full, circle=circle)
    expected = response @ full @ response.T
    assert found.covariance == pytest.approx(expected, rel=2e-4, abs=1e-7 * np.abs(expected).max())
    assert found.covariance[..., :2, :2] == pytest.approx(expected[:2, :2], rel=2e-4, abs=1e-6)
    assert found.centre == pytest.approx(true[:2], abs=1e-7)


def test_limits():
    t = np.linspace(0, 6, 12)
    points = curve(TRUE, t)
    for few, circle in ((4, False), (2, True)):
        with pytest.raises(InvalidInput, match=f"points must be at least {few + 1} pairs"):
            fit_ellipse(points[:few], circle=circle)
        assert fit_ellipse(points[: few + 1], circle=circle) is not None
    with pytest.raises(InvalidInput, match=r"points must lie within 1e\+09 px"):
        fit_ellipse(points + [1.1e9, 0])
    with pytest.raises(InvalidInput, match="covariance must be a number or of shape"):
        fit_ellipse(points, np.ones(5))
    with pytest.raises(InvalidInput, match=r"covariance must be of variances from 0 to 1e\+18 px\^2"):
        fit_ellipse(points, -np.ones(12))
    line = np.column_stack([t, 2 * t])
    assert fit_ellipse(line, 1.0).status == status.ILL_CONDITIONED or fit_ellipse(line, 1.0).parameters[2] > 1e3


@pytest.mark.parametrize("first", [0.0, 1.0])
def test_start(first):
    """Kasa's fit of points that lie on a circle is the circle; the direct fit of an ellipse's is the ellipse."""
    t = first + np.linspace(0, 4.0, 15)
    assert _start(curve((30.0, -12.0, 15.0, 15.0, 0.0), t), True) == pytest.approx([30, -12, 15, 15, 0])
    x, y, a, b, angle = _start(curve(TRUE, t), False)
    assert curve((x, y, a, b, angle), np.zeros(1)).shape == (1, 2)
    ends = curve((x, y, a, b, angle), np.pi / 2 * np.arange(4))
    assert np.abs(_distances(ends, TRUE)[0]).max() < 1e-3
