"""Error propagation: against Monte Carlo, against central differences, and against the formulas as printed."""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

import planner
from measure.features.calipers import Caliper
from measure.features.corners import corner_response, intersect, line_equations
from measure.features.lines import fit_lines, regression
from measure.features.optics import Optics
from measure.measurement import separation
from planner.features.propagation import corner_covariance
from tests.scalar import weighted_points

SENSOR, LIGHT = (30.0, 135.0), (15.0, 315.0)
DRAWS = 20_000
WITHIN = 4 * np.sqrt(2 / (DRAWS - 1))  # 4 standard errors of a variance: 4 %


class Drawn(NamedTuple):
    """Lines through many draws of an edge's points: centroids and normals (DRAWS, 2), the true one's normal, and W."""

    centroid: np.ndarray
    normal: np.ndarray
    across: np.ndarray
    total: float

    def displacement(self, place: np.ndarray) -> np.ndarray:
        """Where each line crosses the true line's normal at a place on that, px."""
        return np.einsum("ni,ni->n", self.centroid - place, self.normal) / (self.normal @ self.across)


@pytest.fixture(scope="module")
def drawn(task1):
    """20 000 draws of the paper's 100 points of each required edge, by edge.

    A weighted total-least-squares line of its own: the long axis of the points' weighted moments.
    """
    rng, found = np.random.default_rng(7), {}
    for name in task1.task.edges:
        points, weights = (np.array(part) for part in weighted_points(task1, task1.solid.edge(name), SENSOR, LIGHT))
        noisy = points + rng.standard_normal((DRAWS, *points.shape)) / np.sqrt(weights)[:, None]
        centroid = weights @ noisy / weights.sum()
        away = noisy - centroid[:, None]
        normal = np.linalg.eigh(np.einsum("i,nij,nik->njk", weights, away, away))[1][:, :, 0]
        x, y = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
        found[name] = Drawn(centroid, normal, np.array([-y, x]), weights.sum())
    return found


@pytest.fixture(scope="module")
def predicted(task1):
    return planner.predict(task1, SENSOR, LIGHT, "paper")


def at_corners(task1, drawn, predicted):
    """(lines, corner, variance that the paper's model says the line's offset has there) of each required edge.

    A corner moves along an edge's normal n by just that edge's offset, so that variance is n C n (eq. 5).
    """
    for feature, corner, covariance in zip(task1.task.corners, predicted.corners, predicted.covariances, strict=True):
        for name in feature.edges:
            edge = drawn[name]
            yield edge, corner, float(edge.across @ covariance @ edge.across)


def test_the_papers_line_variance_against_monte_carlo(task1, drawn, predicted):
    """Eq. 3 at the corner; 1.3 x the truth and 0 are refused by the same sample, and so is the printed formula.

    In V(gamma) the last term is 1/W; the printed I/W is off by a factor I = 100.
    """
    for edge, corner, variance in at_corners(task1, drawn, predicted):
        empirical = edge.displacement(corner).var(ddof=1)
        assert empirical == pytest.approx(variance, rel=WITHIN)
        assert empirical != pytest.approx(1.3 * variance, rel=WITHIN)
        assert empirical != pytest.approx(0, abs=WITHIN * variance)
        printed = variance + (100 - 1) / edge.total
        assert printed > 10 * variance
        assert empirical != pytest.approx(printed, rel=WITHIN)


def test_the_papers_distance_variance_against_monte_carlo(task1, drawn, predicted):
    """Eq. 3, 5 and 6 in a row: corners where the drawn lines cross, and their distance."""
    ends = []
    for feature in task1.task.corners:
        lines = [drawn[name] for name in feature.edges]
        normals = np.stack([line.normal for line in lines], 1)
        ends.append(
            np.linalg.solve(normals, np.einsum("nei,eni->ne", normals, [line.centroid for line in lines])[..., None])
        )
    values = np.linalg.norm(ends[1] - ends[0], axis=(1, 2))
    assert values.mean() == pytest.approx(predicted.value_px, abs=4 * np.sqrt(predicted.variance_px2 / DRAWS))
    assert values.var(ddof=1) == pytest.approx(predicted.variance_px2, rel=WITHIN)
    assert values.var(ddof=1) != pytest.approx(1.3 * predicted.variance_px2, rel=WITHIN)


def test_lines_of_correlated_points_against_monte_carlo(rng):
    """Mean and slope of lines through 20 000 draws of smoothed noise; that of independent points is refused."""
    along, scale, sigma = np.linspace(3, 27, 25), 1.5, 1e-3
    together = np.exp(-((along[:, None] - along) ** 2) / (4 * scale**2))
    offset = sigma * rng.standard_normal((DRAWS, 25)) @ np.linalg.cholesky(together + 1e-12 * np.eye(25)).T
    lines = fit_lines(SimpleNamespace(along=np.broadcast_to(along, offset.shape), offset=offset, valid=offset < np.inf))
    response = sigma * regression(along)
    known, independent = response @ together @ response.T, response @ response.T
    for i, values in enumerate((lines.mean_offset, np.tan(lines.tilt))):
        assert values.var(ddof=1) == pytest.approx(known[i, i], rel=WITHIN)
        assert values.var(ddof=1) != pytest.approx(independent[i, i], rel=WITHIN)


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


PAIRS = [(0.1, 1.4), (0.3, 0.9), (2.0, -0.4), (0.0, np.pi / 2)]


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_corner_covariance_against_central_differences(first, second):
    normals = np.array([[np.sin(first), np.cos(first)], [np.sin(second), np.cos(second)]])
    lines = np.column_stack([normals, [-3.0, 5.0]])
    response = central_difference(crossing, lines.ravel())[:, [2, 5]]  # only the offsets move
    variances = np.array([0.3, 0.8])
    expected = response @ np.diag(variances) @ response.T
    assert corner_covariance(normals, variances) == pytest.approx(expected, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_corner_response_against_central_differences(first, second):
    """Level and slope of two of three lines found in the image; the third has no part in the corner."""
    calipers = tuple(
        Caliper(
            "",
            np.array(origin),
            np.array([np.cos(a), np.sin(a)]),
            50.0,
            np.empty(0),
            "ok",
            Optics((100, 100)),
            np.zeros(2),
        )
        for a, origin in ((first, (40.0, 30.0)), (0.7, (10.0, 10.0)), (second, (90.0, 70.0)))
    )

    def corner(lines):
        normals, points = line_equations(calipers, lines[None, ::2], lines[None, 1::2])
        return intersect(normals[:, [0, 2]], points[:, [0, 2]])[0][0]

    ours = corner_response(calipers, (0, 2))
    assert ours == pytest.approx(central_difference(corner, np.zeros(6)), rel=1e-6, abs=1e-8)
    assert (ours[:, 2:4] == 0).all()


def test_distance_gradient_against_central_differences():
    ends = np.array([[3.0, 4.0], [90.0, -20.0]])
    (value,), (gradient,) = separation(ends[None])
    assert value == pytest.approx(np.hypot(87, 24))
    expected = central_difference(lambda p: np.linalg.norm(p[:2] - p[2:]), ends.ravel())
    assert gradient == pytest.approx(expected, rel=1e-6)


def test_what_cannot_be_measured_is_infinite():
    assert np.isinf(corner_covariance(np.array([[0.0, 1.0], [0.0, 1.0]]), np.ones(2)).diagonal()).all()
