"""Values of several pictures combined: against least squares of all of them stacked."""

import numpy as np
import pytest

import planner
from planner.combining import combined


def covariance(rng, count: int) -> np.ndarray:
    """A random one, its variances of different sizes."""
    root = rng.normal(size=(count, count + 2)) * 10.0 ** rng.uniform(-2, 2, (count, 1))
    return root @ root.T


def hidden(covariances: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """What a prediction says of quantities that are not seen: infinite on the diagonal, NaN beside it."""
    lost = ~(seen[:, :, None] & seen[:, None, :])
    return np.where(lost, np.where(np.eye(seen.shape[1], dtype=bool), np.inf, np.nan), covariances)


def stacked(covariances, seen, values):
    """Least squares of all values, each picture's whitened by its own Cholesky factor: estimate and covariance."""
    design, whitened = [], []
    for each, own, value in zip(covariances, seen, values, strict=True):
        rows = np.flatnonzero(own)
        root = np.linalg.cholesky(each[np.ix_(rows, rows)])
        design.append(np.linalg.solve(root, np.eye(len(own))[rows]))
        whitened.append(np.linalg.solve(root, value[rows]))
    whole = np.concatenate(design)
    return np.linalg.lstsq(whole, np.concatenate(whitened), rcond=None)[0], np.linalg.inv(whole.T @ whole)


@pytest.mark.parametrize("seed", range(5))
def test_least_squares_of_all_stacked(seed):
    rng = np.random.default_rng(seed)
    seen = np.array([[1, 1, 0, 1], [0, 1, 1, 1], [1, 1, 1, 0]], bool)
    covariances = np.stack([covariance(rng, 4) for _ in seen])
    values = rng.normal(size=seen.shape) * np.sqrt(np.einsum("vmm->vm", covariances))
    told = combined(hidden(covariances, seen), np.where(seen, "ok", "not_visible"), np.zeros(seen.shape))
    estimate, joint = stacked(covariances, seen, values)
    size = np.sqrt(np.diag(joint))
    np.testing.assert_allclose(
        told.covariance_least_squares / np.outer(size, size), joint / np.outer(size, size), atol=1e-4
    )
    got = told.least_squares(np.where(seen, values, np.nan))
    np.testing.assert_allclose(got / size, estimate / size, atol=1e-3)
    # margin: never worse, by its kind, but for rounding
    assert (np.diag(told.covariance_least_squares) < told.variances * (1 + 1e-5)).all()
    # margin: one per cent is asked for, so that it is no rounding
    assert np.diag(told.covariance_least_squares).sum() < 0.99 * told.variances.sum()  # correlations do tell something


def test_inverse_variance_and_its_joint_covariance(rng):
    """Against the covariance of the weighted sum, from the stacked values' block-diagonal one."""
    seen = np.array([[1, 1, 1], [1, 0, 1]], bool)
    covariances = np.stack([covariance(rng, 3) for _ in seen])
    told = combined(hidden(covariances, seen), np.where(seen, "ok", "short"), np.ones(seen.shape))
    single = np.einsum("vmm->vm", covariances)
    np.testing.assert_allclose(told.variances, 1 / (seen / single).sum(0))
    whole = np.zeros((6, 6))
    whole[:3, :3], whole[3:, 3:] = covariances
    sums = np.concatenate([np.diag(weights) for weights in told.weights], 1)
    np.testing.assert_allclose(told.covariance, sums @ whole @ sums.T)
    np.testing.assert_allclose(told.weights.sum(0), 1)
    values = np.array([[1.0, 2.0, 3.0], [3.0, np.nan, 3.0]])
    assert told.weighted(values)[1:].tolist() == [2.0, 3.0]


def test_dependent_quantities(rng):
    """The third is the sum of the others in every picture: it stays so, and the others are as they are without it."""
    both = np.array([[1.0, 0, 0], [0, 1, 0], [1, 1, 0]])
    pairs = np.stack([covariance(rng, 3) for _ in range(2)])
    pairs[:, 2], pairs[:, :, 2] = 0, 0
    state = np.full((2, 3), "ok")
    told = combined(both @ pairs @ both.T, state, np.zeros((2, 3)))
    alone = combined(pairs[:, :2, :2], state[:, :2], np.zeros((2, 2)))
    joint = told.covariance_least_squares
    np.testing.assert_allclose(joint[:2, :2], alone.covariance_least_squares, rtol=1e-3)
    along = np.array([1.0, 1.0, -1.0])
    assert along @ joint @ along < 1e-5 * joint[2, 2]


def test_clutter_only_where_nothing_is_ok():
    seen = np.array([[True, True, False]] * 2)
    covariances = hidden(np.stack([np.diag([1.0, 4.0, 1.0])] * 2), seen)
    status = np.array([["ok", "clutter", "short"], ["clutter", "clutter", "not_visible"]])
    told = combined(covariances, status, np.array([[0.1, 0.2, np.nan], [9.0, 0.2, np.nan]]))
    assert told.used.tolist() == [[True, True, False], [False, True, False]]
    assert told.status == ("ok", "clutter", "short")
    assert told.variances.tolist() == [1.0, 2.0, np.inf]
    assert np.isnan(told.weighted(np.ones((2, 3)))[2])
    assert told.bias[:2].tolist() == [0.1, 0.2]


def test_a_bias_that_the_smaller_sigma_shows():
    """0.25 sigma of each picture is ok; of four of them together it is half a sigma."""
    one = np.array([[[1.0]]])
    assert combined(one, np.array([["ok"]]), np.array([[0.25]])).status == ("ok",)
    many = combined(np.repeat(one, 4, 0), np.array([["ok"]] * 4), np.full((4, 1), 0.25))
    assert many.variances.tolist() == [0.25]
    assert many.status == ("clutter",)


def test_repeats_of_a_prediction(task1):
    told = planner.predict(task1, (30, 135), (15, 315))
    three = planner.combine([told] * 3)
    np.testing.assert_allclose(three.covariance, told.covariance_object / 3)
    np.testing.assert_allclose(three.covariance_least_squares, told.covariance_object / 3, rtol=1e-5)
