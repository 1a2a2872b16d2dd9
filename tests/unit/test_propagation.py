"""Error propagation: against Monte Carlo, against central differences, and against the formulas as printed."""

import numpy as np
import pytest

import planner
from imaging.features.propagation import corner_covariance
from imaging.models.paper import paper
from imaging.pictures import Pictures
from measure.features.calipers import Caliper
from measure.features.corners import corner_response, intersect, line_equations
from measure.features.lines import fit_lines, regression
from measure.features.optics import Optics
from measure.features.points import EdgePoints
from measure.measurement import separation
from tests.scalar import weighted_points

SENSOR, LIGHT = (30.0, 135.0), (15.0, 315.0)
DRAWS = 20_000
WITHIN = 4 * np.sqrt(2 / (DRAWS - 1))  # 4 standard errors of a variance: 4 %


@pytest.fixture(scope="module")
def fitted(task1):
    """Offsets and slopes of lines through 20 000 draws of the paper's 100 points of each required edge.

    A weighted total-least-squares line of its own: the long axis of the points' weighted moments.

    Returns
    -------
    dict
        By edge: the place of the first end, direction and length of the edge's image; centroids and normals of the
        lines (DRAWS, 2); and the sum of the weights.
    """
    rng, found = np.random.default_rng(7), {}
    for name in task1.task.edges:
        points, weights = (np.array(part) for part in weighted_points(task1, task1.solid.edge(name), SENSOR, LIGHT))
        noisy = points + rng.standard_normal((DRAWS, *points.shape)) / np.sqrt(weights)[:, None]
        centroid = weights @ noisy / weights.sum()
        away = noisy - centroid[:, None]
        axes = np.linalg.eigh(np.einsum("i,nij,nik->njk", weights, away, away))[1]
        along = points[-1] - points[0]
        length = np.linalg.norm(along)
        found[name] = points[0], along / length, length, centroid, axes[:, :, 0], weights.sum()
    return found


def displacement(edge, place):
    """Where each line crosses the true line's normal at a place along it (px from the first end), px."""
    start, direction, _, centroid, normal, _ = edge
    across = np.array([-direction[1], direction[0]])
    away = centroid - (start + place * direction)
    return np.einsum("ni,ni->n", away, normal) / (normal @ across)


@pytest.fixture(scope="module")
def predicted(task1):
    return paper(Pictures.of(task1, SENSOR, LIGHT))


@pytest.mark.parametrize("fraction", [0.0, 0.5, 1.0, 1.7])
def test_the_papers_line_variance_against_monte_carlo(task1, fitted, predicted, fraction):
    """Eq. 3 at both ends, the middle and beyond; 1.3 x the truth and 0 are refused by the same sample."""
    for e, name in enumerate(predicted.measurands.view.names):
        place = fraction * fitted[name][2]
        ones = np.ones(len(task1.task.edges))
        variance = predicted.line_variance(ones, place * ones)[e]
        empirical = displacement(fitted[name], place).var(ddof=1)
        assert empirical == pytest.approx(variance, rel=WITHIN)  # margin: 4 standard errors
        assert empirical != pytest.approx(1.3 * variance, rel=WITHIN)
        assert empirical != pytest.approx(0, abs=WITHIN * variance)


def test_the_papers_tilt_against_monte_carlo(task1, fitted, predicted):
    """The line's angle, rad^2: A = 0 and B = 1."""
    ones = np.ones(len(task1.task.edges))
    for e, name in enumerate(predicted.measurands.view.names):
        _, direction, _, _, normal, _ = fitted[name]
        sine = normal @ direction * np.sign(normal @ [-direction[1], direction[0]])
        variance = predicted.line_variance(0 * ones, ones)[e]
        assert np.arcsin(sine).var(ddof=1) == pytest.approx(variance, rel=WITHIN)  # margin: 4 standard errors


def test_the_printed_gamma_variance_fails_the_same_test(task1, fitted, predicted):
    """In V(gamma) the last term is 1/W; the printed I/W is off by a factor I = 100, and the sample refuses it."""
    ones = np.ones(len(task1.task.edges))
    for e, name in enumerate(predicted.measurands.view.names):
        middle, total = fitted[name][2] / 2, fitted[name][-1]
        repaired = predicted.line_variance(ones, middle * ones)[e]
        printed = repaired + (100 - 1) / total
        assert printed > 10 * repaired
        assert displacement(fitted[name], middle).var(ddof=1) != pytest.approx(printed, rel=WITHIN)


def test_the_papers_distance_variance_against_monte_carlo(task1, fitted):
    """Eq. 3, 5 and 6 in a row: corners where the drawn lines cross, and their distance; 1.3 x is refused."""
    ends = []
    for feature in task1.task.corners:
        centroids, normals = (np.stack([fitted[name][k] for name in feature.edges], 1) for k in (3, 4))
        ends.append(np.linalg.solve(normals, (normals * centroids).sum(-1)[..., None])[..., 0])
    values, said = np.linalg.norm(ends[1] - ends[0], axis=1), planner.predict(task1, SENSOR, LIGHT, "paper")
    # margin: 4 standard errors
    assert values.mean() == pytest.approx(said.value_px, abs=4 * np.sqrt(said.variance_px2 / DRAWS))
    assert values.var(ddof=1) == pytest.approx(said.variance_px2, rel=WITHIN)  # margin: 4 standard errors
    assert values.var(ddof=1) != pytest.approx(1.3 * said.variance_px2, rel=WITHIN)


def test_the_variance_of_correlated_points_against_monte_carlo(rng):
    """Mean and slope of lines through 20 000 draws of smoothed noise; that of independent points is refused."""
    along, scale, sigma = np.linspace(3, 27, 25), 1.5, 1e-3
    together = np.exp(-((along[:, None] - along) ** 2) / (4 * scale**2))
    root = np.linalg.cholesky(together + 1e-12 * np.eye(25))
    offset = sigma * rng.standard_normal((DRAWS, 25)) @ root.T
    whole = np.ones(offset.shape, bool)
    lines = fit_lines(EdgePoints(np.broadcast_to(along, offset.shape), offset, whole, whole[:, 0], whole[:, 0]))
    response = regression(along)
    ours = sigma**2 * response @ together @ response.T
    for values, known in ((lines.mean_offset, ours[0, 0]), (np.tan(lines.tilt), ours[1, 1])):
        assert values.var(ddof=1) == pytest.approx(known, rel=WITHIN)  # margin: 4 standard errors
    independent = sigma**2 * response @ response.T
    assert lines.mean_offset.var(ddof=1) != pytest.approx(independent[0, 0], rel=WITHIN)


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
    rest = 50.0, np.empty(0), "ok", Optics((100, 100)), np.zeros(2)
    calipers = tuple(
        Caliper("", np.array(origin), np.array([np.cos(a), np.sin(a)]), *rest)
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


def test_corner_covariance_of_many_at_once(rng):
    """Each of a table of corners as by itself, and in units of its own: scaled variances scale it."""
    angles = rng.uniform(0, np.pi, (3, 4, 2))
    normals = np.stack([np.sin(angles), np.cos(angles)], -1)
    variances = rng.uniform(0.1, 2, (3, 4, 2))
    together = corner_covariance(normals, variances)
    for at in np.ndindex(3, 4):
        inverse = np.linalg.inv(normals[at])  # the corner moves by -N^-1 d
        assert together[at] == pytest.approx(inverse @ np.diag(variances[at]) @ inverse.T, rel=1e-9)
    parallel = corner_covariance(np.array([[0.6, 0.8], [0.6, 0.8]]), np.ones(2))
    assert np.isinf(np.diag(parallel)).all()
