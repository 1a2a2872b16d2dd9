"""The law of a zone's size: Rice's and the folded normal, polar coordinates, drawn numbers; decisions by it."""

import numpy as np
import pytest
from scipy import stats

from planner.uncertainty.conformity import decide
from planner.uncertainty.zones import ZoneSize
from scenes import InvalidInput, Tolerance

TURN = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])


def law(off, sigmas, factor=2.0):
    """Of components with these standard deviations along two turned axes."""
    return ZoneSize(np.array(off, float), TURN @ np.diag(np.square(sigmas)) @ TURN.T, factor)


@pytest.mark.parametrize("away", [0.0, 0.3, 1.0, 4.0, 30.0])
def test_alike_in_all_directions_it_is_rices(away):
    found, known = law((away * 0.6, away * 0.8), (1.0, 1.0)), stats.rice(away, scale=2.0)
    for size in (0.1, 1.0, 2 * away + 0.5, 2 * away + 4):
        assert found.below(size) == pytest.approx(known.cdf(size), rel=1e-9, abs=1e-12)
    assert found.mean == pytest.approx(known.mean(), rel=1e-8)
    assert found.u == pytest.approx(known.std(), rel=1e-6)
    assert found.quantile(0.95) == pytest.approx(known.ppf(0.95), rel=1e-8)


@pytest.mark.parametrize(
    ("off", "sigmas"), [((0.4, -0.2), (1.0, 0.05)), ((3.0, 1.0), (0.2, 1.5)), ((0, 0), (1.0, 0.5))]
)
@pytest.mark.parametrize("size", [0.5, 2.0, 7.0])
def test_two_components_in_polar_coordinates(off, sigmas, size):
    """Another way to integrate the same density: trapezes around, which converge at once, Gauss along the radius."""
    a, b = TURN.T @ np.array(off, float)
    nodes, weights = np.polynomial.legendre.leggauss(400)
    r, turn = size / 4 * (nodes + 1), np.linspace(0, 2 * np.pi, 2000, endpoint=False)[:, None]
    x, y = (r * np.cos(turn) - a) / sigmas[0], (r * np.sin(turn) - b) / sigmas[1]
    density = r * np.exp(-(x**2 + y**2) / 2) / (2 * np.pi * sigmas[0] * sigmas[1])
    known = float((density.mean(0) * 2 * np.pi) @ weights * size / 4)
    assert law(off, sigmas).below(size) == pytest.approx(known, rel=1e-8, abs=1e-12)


def test_one_component_is_the_folded_normal():
    found, known = ZoneSize(np.array([0.7]), np.array([[4.0]]), 1.0), stats.foldnorm(0.35, scale=2.0)
    assert found.below(1.1) == pytest.approx(known.cdf(1.1), rel=1e-12)
    assert (found.mean, found.u) == pytest.approx((known.mean(), known.std()), rel=1e-8)
    assert found.interval() == pytest.approx((known.ppf(0.025), known.ppf(0.975)), rel=1e-8)


def test_a_component_that_is_known_exactly():
    found = ZoneSize(np.array([3.0, 0.5]), np.diag([0.0, 1.0]), 2.0)
    assert found.below(5.9) == 0.0
    assert found.below(10.0) == pytest.approx(stats.norm.cdf(3.5) - stats.norm.cdf(-4.5), rel=1e-12)
    exact = ZoneSize(np.array([3.0, 4.0]), np.zeros((2, 2)), 2.0)
    assert (exact.value, exact.mean, exact.quantile(0.9)) == pytest.approx((10.0, 10.0, 10.0))


def test_drawn_numbers(rng):
    """100,000 of them; a normal law of the propagated sigma is refused by the same test."""
    found, count = law((0.5, 0.3), (1.0, 0.6)), 100_000
    drawn = 2 * np.linalg.norm(rng.multivariate_normal(found.off, found.covariance, count), axis=-1)
    at = np.quantile(drawn, [0.1, 0.5, 0.95])
    own = np.array([found.below(size) for size in at])
    spread = 3.5 * np.sqrt(own * (1 - own) / count)
    assert (np.abs(own - [0.1, 0.5, 0.95]) < spread).all()
    unit = found.off / np.linalg.norm(found.off)
    linear = stats.norm(found.value, 2 * np.sqrt(unit @ found.covariance @ unit)).cdf(at)
    assert (np.abs(linear - [0.1, 0.5, 0.95]) > 5 * spread).all()


def test_far_from_zero_the_decision_is_the_guard_bands():
    """Where curvature is nothing: 2 sigma from the limit, to a thousandth of a sigma."""
    zone = Tolerance(plus=10.0, minus=10.0)
    for sign, word in ((-1, "pass"), (1, "fail")):
        for step, told in ((1.999, "undecided"), (2.001, word)):
            away = 1000.0 + sign * step
            found = ZoneSize(np.array([away * 0.6, away * 0.8]), np.eye(2) * 1e-6, 2.0)
            assert decide(away - 990, 1.0, 0.0, zone) == told
            scaled = ZoneSize(np.array([away, 0.0]), np.diag([1.0, 1e-6]), 2.0)
            assert scaled.decide(2000.0) == told
            assert found.decide(2000.0) == word


def test_near_zero_components_within_their_limits_do_not_keep_the_zone():
    """In a corner of the square both keep 0.1, and the circle of diameter 0.2 is left."""
    corner = ZoneSize(np.array([0.09, 0.09]), np.eye(2) * 0.001**2, 2.0)
    inside = Tolerance(plus=0.1, minus=0.1)
    assert decide(0.09, 0.001, 0.0, inside) == "pass"
    assert corner.decide(0.2) == "fail"
    assert corner.decide(0.2, status="clutter") == "undecided"
    assert ZoneSize(np.array([np.nan, 0.0]), np.eye(2)).decide(0.2) == "undecided"


def test_what_is_refused():
    with pytest.raises(InvalidInput, match="must be of one or two components, got"):
        ZoneSize(np.zeros(3), np.eye(3))
    with pytest.raises(InvalidInput, match="p must be between 0 and 1, got 1"):
        law((0, 0), (1, 1)).quantile(1)
    with pytest.raises(InvalidInput, match="k must be at least 0, got -1"):
        law((0, 0), (1, 1)).decide(1.0, k=-1)
