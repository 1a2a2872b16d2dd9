"""The noise of photographs as a fit tells it: the likeliest line, against a search for it, and what counts as flat."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

from measure.fitting.noise import Curve, by_neighbours, by_repetition, curve
from measure.fitting.photograph import Pixels, Shots
from scenes import Noise


def unlikely(line, signal, variance, freedom):
    """Minus the logarithm of the likelihood of sample variances, constants left out."""
    model = line[0] + line[1] * signal
    return float((freedom / 2 * (np.log(model) + variance / model)).sum())


@pytest.mark.parametrize(
    ("line", "bent"), [((3.0, 0.05), 0.0), ((0.2, 0.5), -0.02), ((4.0, -0.03), 0.0), ((1e-3, 0.2), 0.01)]
)
def test_a_noise_curve_is_the_likeliest_line_that_can_be(line, bent, rng):
    """Dark noise and gain of at least 0: of what begins below it, or falls, the other one alone."""
    signal = rng.uniform(2, 90, 300)
    freedom = rng.integers(1, 6, 300).astype(float)
    clean = np.maximum(line[0] + line[1] * signal + bent * signal * (90 - signal) / 9, 0.05)
    variance = clean * rng.chisquare(freedom) / freedom
    found = curve(signal, variance, freedom)
    beside = minimize(
        unlikely, (1.0, 0.1), (signal, variance, freedom), method="L-BFGS-B", bounds=[(1e-9, None), (0, None)],
        options={"ftol": 1e-15, "gtol": 1e-12},
    )  # fmt: skip
    told = np.array([max(found.dark, 1e-9), found.gain])
    # margin: an inequality: no line is likelier
    assert unlikely(told, signal, variance, freedom) <= beside.fun + 1e-6 * abs(beside.fun)
    assert told == pytest.approx(beside.x, rel=1e-3, abs=1e-4)
    design = np.stack([np.ones(300), signal], 1)
    fisher = (design.T * freedom / (2 * (design @ told) ** 2)) @ design
    assert found.covariance == pytest.approx(np.linalg.inv(fisher), rel=1e-6)
    assert found.freedom == freedom.sum()


def test_of_one_level_the_noise_is_the_mean_of_the_squares():
    """Weighted by their degrees of freedom; its variance is 2 v^2 / f, and nothing is told of a gain."""
    freedom = np.array([1.0, 2.0, 5.0])
    found = curve(np.full(3, 8.0), np.array([2.0, 5.0, 4.0]), freedom)
    assert (found.dark, found.gain, found.freedom) == (pytest.approx(4.0), 0.0, 8.0)
    assert found.covariance == pytest.approx(np.diag([2 * 16 / 8, 0.0]))


def test_neighbours_count_that_the_model_has_less_than_the_noise_apart():
    """Pairs of a row, none twice; half the squared difference of what is left of them, at their middle."""
    signal = np.array([[10.0, 11.9, 30, 32.1, 50], [20, 20, 20, 18.1, 7]])
    left = np.array([[1.0, 4, 9, 9, 9], [2, 8, 5, 4, 9]])
    image = signal + left
    pixels = Pixels(*(part.ravel() for part in np.indices((2, 5))[::-1]), (1, 2, 5))
    where, squares, freedom = by_neighbours(Shots(image, 1, None, (0,)), pixels, signal.ravel(), 4.0)
    assert where == pytest.approx([10.95, 20, 19.05])
    assert squares == pytest.approx([4.5, 18, 0.5])
    assert freedom == 1


def test_repeated_photographs_tell_their_scatter_at_each_signal():
    scatter = np.arange(6.0).reshape(2, 3)
    pixels = SimpleNamespace(of=lambda image: image[[0, 1], [2, 1]])
    told = by_repetition(Shots(scatter, 4, scatter, (0, 1, 2, 3)), pixels, np.array([7.0, 9.0]))
    assert [np.asarray(each).tolist() for each in told] == [[7, 9], [2, 4], 3]


@pytest.mark.parametrize(("bits", "sigma"), [(None, 2.0), (8, np.sqrt(4 - 1 / 12))])
def test_rounding_is_no_part_of_the_sensors_sigma(bits, sigma):
    found = Curve(4.0, 0.3, np.eye(2), 9.0).noise(Noise(sigma=1.0, gain=0.1, bits=bits, dark_level=7.0))
    assert (found.sigma, found.gain, found.bits, found.dark_level) == (pytest.approx(sigma), 0.3, bits, 7.0)
