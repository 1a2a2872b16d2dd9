"""Inputs of an uncertainty budget: their distributions, correlated draws, and what is refused."""

import math

import numpy as np
import pytest
from scipy import integrate, stats

from planner.uncertainty import Group, Input, draw
from scenes import InvalidInput

SHAPES = [
    Input("normal", 1.0, 0.2),
    Input("t", 1.0, 0.2, "t", dof=5),
    Input("rectangular", 1.0, 0.2, "rectangular"),
    Input("trapezoid", 1.0, 0.2, "rectangular", dof=2),
    Input("triangular", 1.0, 0.2, "triangular"),
    Input("arcsine", 1.0, 0.2, "arcsine"),
]
named = pytest.mark.parametrize("given", SHAPES, ids=lambda given: given.name)


@named
def test_draws_follow_the_quantiles(given, rng):
    """Kolmogorov-Smirnov: the probability integral transform of the draws is uniform, by the inverted quantile."""
    values = given.draw(rng, 20_000)
    grid = np.linspace(0, 1, 4001)[1:-1]
    p = np.interp(values, given.quantile(grid), grid, left=0, right=1)
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    assert stats.kstest(np.clip(p + 0.03, 0, 1), "uniform").pvalue < 1e-3


@named
def test_standard_deviation_is_that_of_the_quantiles(given):
    """The variance is the integral of (quantile - mean)^2; of t and trapezoid it is not u."""

    def square(p):
        return (float(given.quantile(p)) - given.value) ** 2

    half = integrate.quad(square, 0, 0.1, epsabs=1e-14)[0] + integrate.quad(square, 0.1, 0.5, epsabs=1e-14)[0]
    assert given.sd == pytest.approx(math.sqrt(2 * half), rel=1e-5)
    assert (given.sd > given.u) == (given.name in ("t", "trapezoid"))


@named
def test_quantiles_are_symmetric_and_rise(given):
    p = np.linspace(0.001, 0.999, 997)
    found = given.quantile(p)
    assert (np.diff(found) > 0).all()
    assert found + found[::-1] == pytest.approx(2 * given.value, abs=1e-12)


def test_a_rectangle_of_inexact_limits_is_the_curvilinear_trapezoid(rng):
    """JCGM 101 6.4.3.4: limits drawn uniformly within +- d, then the value between them. 50 % known limits: dof 2."""
    half, d = 0.05, 0.025
    given = Input.from_half_width("temperature", 0.0, half, dof=2)
    low = -half - d + 2 * d * rng.random(50_000)
    direct = low + (-2 * low) * rng.random(50_000)
    drawn = given.draw(rng, 50_000)
    assert stats.ks_2samp(drawn, direct).pvalue > 1e-3
    exact = Input.from_half_width("temperature", 0.0, half)
    assert stats.ks_2samp(exact.draw(rng, 50_000), direct).pvalue < 1e-3
    assert np.abs(given.quantile(np.array([0.0, 1.0]))) == pytest.approx(half + d, rel=1e-7)
    assert given.sd**2 == pytest.approx((2 * half) ** 2 / 12 + d**2 / 9, rel=1e-12)


def test_half_widths_are_the_ends():
    for shape in ("rectangular", "triangular", "arcsine"):
        given = Input.from_half_width("x", 3.0, 0.5, shape)
        assert given.quantile(np.array([0.0, 1.0])) == pytest.approx([2.5, 3.5], abs=1e-12)


def test_correlated_normals(rng):
    covariance = np.array([[4.0, -1.8], [-1.8, 1.0]])
    group = Group((Input("fx", 3500.0, 2.0), Input("cx", 640.0, 1.0)), ((1, -0.9), (-0.9, 1)), "calibration")
    assert group.covariance == pytest.approx(covariance)
    drawn = group.draw(rng, 40_000)
    found = np.cov(drawn["fx"], drawn["cx"])
    spread = np.sqrt((np.outer(np.diag(covariance), np.diag(covariance)) + covariance**2) / 40_000)
    assert (np.abs(found - covariance) < 5 * spread).all()
    assert not (np.abs(found - np.diag(np.diag(covariance))) < 5 * spread).all()


def test_fully_correlated_inputs_move_together(rng):
    group = Group((Input("a", 1.0, 0.1), Input("b", 2.0, 0.2)), ((1, -1), (-1, 1)))
    drawn = group.draw(rng, 100)
    assert (drawn["a"] - 1) * 2 == pytest.approx(2 - drawn["b"], abs=1e-12)


def test_copula_keeps_each_distribution(rng):
    """A rectangular and a normal input tied by 0.8: margins as stated, rank correlation 6/pi asin(0.8 / 2)."""
    group = Group((Input("a", 0, 1, "rectangular"), Input("b", 0, 1)), ((1, 0.8), (0.8, 1)))
    drawn = group.draw(rng, 20_000)
    assert stats.kstest(drawn["a"], stats.uniform(-math.sqrt(3), 2 * math.sqrt(3)).cdf).pvalue > 1e-3
    assert stats.kstest(drawn["b"], stats.norm.cdf).pvalue > 1e-3
    rank = stats.spearmanr(drawn["a"], drawn["b"]).statistic
    assert rank == pytest.approx(6 / math.pi * math.asin(0.4), abs=0.015)


def test_independent_inputs_are_drawn_independently(rng):
    drawn = draw([Input("a", 0, 1), Group((Input("b", 0, 1),), ((1,),))], rng, 10_000)
    assert list(drawn) == ["a", "b"]
    assert abs(np.corrcoef(drawn["a"], drawn["b"])[0, 1]) < 0.05


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (("", 0, 1), "name must be a text that is not empty, got ''"),
        (("x", math.nan, 1), "x: value must be a finite number, got nan"),
        (("x", 0, -1), "x: u must be a finite number of at least 0, got -1"),
        (("x", 0, math.inf), "x: u must be a finite number of at least 0, got inf"),
        (("x", 0, 1, "gauss"), "x: distribution must be one of normal, rectangular.*, got gauss"),
        (("x", 0, 1, "normal", 0.5), "x: dof must be at least 1, got 0.5"),
        (("x", 0, 1, "normal", math.nan), "x: dof must be at least 1, got nan"),
        (("x", 0, 1, "t"), "x: dof must be finite for distribution t, got inf"),
        (("x", 0, 1, "normal", 5, "C"), "x: type must be one of A, B, got C"),
        (("x", 0, 1, "normal", 5, "A", "mm", "bias"), "x: kind must be one of noise, systematic, got bias"),
    ],
)
def test_bad_inputs(values, message):
    with pytest.raises(InvalidInput, match=message):
        Input(*values)


def test_bad_half_widths():
    with pytest.raises(InvalidInput, match=r"distribution must be one of rectangular.* with a half-width, got normal"):
        Input.from_half_width("x", 0, 1, "normal")
    with pytest.raises(InvalidInput, match="half_width must be a finite number of at least 0, got -1"):
        Input.from_half_width("x", 0, -1)


A, B = Input("a", 0, 1), Input("b", 0, 1)


@pytest.mark.parametrize(
    ("inputs", "correlation", "message"),
    [
        ((), (), "inputs of a group must be at least one, got none"),
        ((A, B), ((1,),), r"a, b: correlation must be of shape \(2, 2\), got \(1, 1\)"),
        ((A, B), ((1, math.nan), (math.nan, 1)), "correlation must be finite, got nan"),
        ((A, B), ((1, 0.5), (0.4, 1)), "correlation must be symmetric, got a difference of 0.1"),
        ((A, B), ((2, 0.5), (0.5, 1)), "correlation must be 1 on its diagonal, got 2"),
        ((A, B), ((1, 1.5), (1.5, 1)), "correlation must be positive semidefinite, got an eigenvalue of -0.5"),
        ((A, Input("b", 0, 1, kind="noise")), ((1, 0), (0, 1)), "kind must be the same for all inputs of a group"),
    ],
)
def test_bad_groups(inputs, correlation, message):
    with pytest.raises(InvalidInput, match=message):
        Group(inputs, correlation)


def test_a_group_of_no_freedom():
    with pytest.raises(InvalidInput, match="dof must be at least 1, got 0"):
        Group((A, B), ((1, 0), (0, 1)), dof=0)
