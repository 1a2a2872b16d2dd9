"""Capability, guard bands and the risks of wrong decisions against independent integrals and published figures."""

import math

import mpmath
import numpy as np
import pytest
from scipy import stats

from planner.uncertainty import (
    Limits,
    gauge,
    global_risks,
    nonconforming_probability,
    tur,
)
from scenes import InvalidInput, Tolerance


def in_high_precision(mean, spread, u, tolerance, acceptance):
    """Wrong acceptance and wrong rejection by mpmath: 20 digits, adaptive, another form (survival functions)."""
    with mpmath.workdps(20):
        breaks = [mean + k * spread for k in range(-14, 15, 2)]
        near = [end + k * u for end in (acceptance.lower, acceptance.upper) for k in (-8, -3, 0, 3, 8)]
        near = [x for x in near if math.isfinite(x)]

        def outside(x):
            low, high = mpmath.mpf(acceptance.lower), mpmath.mpf(acceptance.upper)
            return (mpmath.erfc((x - low) / u / mpmath.sqrt(2)) + mpmath.erfc((high - x) / u / mpmath.sqrt(2))) / 2

        def mass(low, high, of):
            ends = sorted({low, high, *(x for x in breaks + near if low < x < high)})
            return mpmath.quad(lambda x: mpmath.npdf(x, mean, spread) * of(x), ends)

        least, most = mean - 16 * spread, mean + 16 * spread
        low, high = max(tolerance.lower, least), min(tolerance.upper, most)
        bad = mass(least, low, lambda x: 1 - outside(x)) if low > least else mpmath.mpf(0)
        bad += mass(high, most, lambda x: 1 - outside(x)) if high < most else mpmath.mpf(0)
        return float(bad), float(mass(low, high, outside))


ZONE = Limits(-2.0, 2.0)
CASES = {
    "good gauge": (0.0, 1.0, 0.25, ZONE, ZONE),
    "guarded": (0.0, 1.0, 0.25, ZONE, ZONE.guarded(0.5)),
    "off centre": (1.2, 0.7, 0.2, ZONE, ZONE.guarded(0.4, 0.83)),
    "coarse gauge": (0.3, 0.5, 3.0, ZONE, ZONE),
    "fine gauge": (0.3, 1.0, 1e-3, ZONE, ZONE),
    "rare": (0.0, 0.3, 0.2, ZONE, ZONE.guarded(0.4)),
    "one-sided": (0.0, 1.0, 0.3, Limits(-math.inf, 1.5), Limits(-math.inf, 1.1)),
    "wider acceptance": (0.0, 1.0, 0.3, ZONE, ZONE.guarded(0.6, -1)),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_global_risks_against_high_precision(case):
    found = global_risks(*case)
    wanted = in_high_precision(*case)
    assert (found.wrong_acceptance, found.wrong_rejection) == pytest.approx(wanted, rel=1e-9, abs=1e-18)
    mean, spread, u, tolerance, acceptance = case
    inside = stats.norm(mean, spread).cdf([tolerance.lower, tolerance.upper])
    assert found.conforming == pytest.approx(inside[1] - inside[0], rel=1e-9)
    measured = stats.norm(mean, math.hypot(spread, u)).cdf([acceptance.lower, acceptance.upper])
    assert found.accepted == pytest.approx(measured[1] - measured[0], rel=1e-9)


def test_global_risks_against_draws(rng):
    """The same by counting 400,000 parts; without the guard band the count would be far off."""
    n, (mean, spread, u, tolerance, acceptance) = 400_000, CASES["guarded"]
    part = rng.normal(mean, spread, n)
    told = part + rng.normal(0, u, n)
    good = (part > tolerance.lower) & (part < tolerance.upper)
    taken = (told > acceptance.lower) & (told < acceptance.upper)
    found = global_risks(mean, spread, u, tolerance, acceptance)
    plain = global_risks(mean, spread, u, tolerance)
    for counted, risk, other in (
        (np.sum(~good & taken), found.wrong_acceptance, plain.wrong_acceptance),
        (np.sum(good & ~taken), found.wrong_rejection, plain.wrong_rejection),
    ):
        assert stats.binomtest(int(counted), n, risk).pvalue > 1e-3
        assert stats.binomtest(int(counted), n, other).pvalue < 1e-6


@pytest.mark.parametrize(
    ("limit", "ratio", "share", "acceptance", "rejection"),
    [
        (2.0, 4, 1.0, 0.008, 0.015),
        (2.5, 4, 1.0, 0.0025, None),
        (2.5, 1, 1.0, 0.005, None),
        (2.0, 2, 0.91, 0.008, 0.066),
    ],
)
def test_published_risks(limit, ratio, share, acceptance, rejection):
    """Deaver's figures: process of spread 1, limits +-limit, TUR `ratio`, acceptance limits `share` of them."""
    zone, u = Limits(-limit, limit), limit / ratio / 2
    found = global_risks(0.0, 1.0, u, zone, Limits(-share * limit, share * limit))
    assert found.wrong_acceptance == pytest.approx(acceptance, abs=5e-4)  # margin: half the last digit that is printed
    if rejection is not None:
        assert found.wrong_rejection == pytest.approx(rejection, abs=1e-3)
    assert tur(2 * limit, 2 * u) == pytest.approx(ratio)


def test_guard_bands_trade_one_risk_for_the_other():
    risks = [global_risks(0.0, 1.0, 0.25, ZONE, ZONE.guarded(0.5, g)) for g in (-0.5, 0, 0.5, 1)]
    assert (np.diff([each.wrong_acceptance for each in risks]) < 0).all()
    assert (np.diff([each.wrong_rejection for each in risks]) > 0).all()


def test_guard_band_bounds_the_specific_risk():
    """At the acceptance limit of g = 1.645 / k the part is bad with 5 %; of g = 1 at k = 2 with 2.3 %."""
    u, zone = 0.1, Limits(0.0, 10.0)
    for g, wanted in ((1.6448536 / 2, 0.05), (1.0, stats.norm.sf(2)), (0.0, 0.5)):
        limits = zone.guarded(2 * u, g)
        assert nonconforming_probability(limits.upper, u, zone) == pytest.approx(wanted, rel=1e-6)
        assert nonconforming_probability(limits.lower, u, zone) == pytest.approx(wanted, rel=1e-6)


def test_specific_risk_with_a_known_process(rng):
    """Among drawn parts that are measured near one value the bad ones are as many as JCGM 106 A.4.4 says."""
    mean, spread, u, zone = 0.2, 1.0, 0.5, Limits(-1.5, 1.5)
    part = rng.normal(mean, spread, 400_000)
    told = part + rng.normal(0, u, part.size)
    chosen = part[np.abs(told - 1.4) < 0.05]
    bad = int(np.sum(np.abs(chosen) > 1.5))
    weight = 1 / (1 + (u / spread) ** 2)
    known = nonconforming_probability(mean + weight * (1.4 - mean), u * math.sqrt(weight), zone)
    assert stats.binomtest(bad, chosen.size, known).pvalue > 1e-3
    assert stats.binomtest(bad, chosen.size, nonconforming_probability(1.4, u, zone)).pvalue < 1e-6


def test_limits_of_a_drawing():
    limits = Limits.of(10.0, Tolerance(plus=0.02, minus=0.01))
    assert (limits.lower, limits.upper) == pytest.approx((9.99, 10.02))
    assert Limits(-math.inf, 1.0).guarded(0.2) == Limits(-math.inf, 0.8)


def test_gauge_study(rng):
    """Cg and Cgk estimate 0.2 T / (6 sigma) and that less the bias; the bias enters cgk alone."""
    repeats = 10.004 + rng.normal(0, 0.001, 20_000)
    found = gauge(repeats, 10.0, 0.1)
    assert found.cg == pytest.approx(0.02 / 0.006, rel=4 * math.sqrt(1 / (2 * 20_000)))
    assert found.cgk == pytest.approx((0.01 - 0.004) / 0.003, rel=0.03)
    assert (found.n, found.reference, found.width) == (20_000, 10.0, 0.1)
    assert found.bias == pytest.approx(0.004, abs=5e-5)
    mirrored = gauge(20.0 - repeats, 10.0, 0.1)
    assert mirrored.cgk == pytest.approx(found.cgk, rel=1e-9)
    assert gauge(repeats, 9.9, 0.1).cgk < 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Limits(1.0, 1.0), r"limits must be a lower and a greater upper one, got 1\.0 and 1\.0"),
        (lambda: Limits(math.nan, 1.0), r"limits must be a lower and a greater upper one, got nan and 1\.0"),
        (lambda: ZONE.guarded(2.0), r"guard band must be less than half of the tolerance, 2, got 2"),
        (lambda: ZONE.guarded(-1.0), r"U must be a finite number of at least 0, got -1\.0"),
        (lambda: global_risks(0, 1, 0, ZONE), "u must be a finite number greater than 0, got 0"),
        (lambda: global_risks(0, -1, 1, ZONE), "spread must be a finite number greater than 0, got -1"),
        (lambda: global_risks(math.nan, 1, 1, ZONE), "mean must be a finite number, got nan"),
        (lambda: nonconforming_probability(0, 0, ZONE), "u must be a finite number greater than 0, got 0"),
        (lambda: tur(0, 1), "width must be a finite number greater than 0, got 0"),
        (lambda: tur(1, 0), "U must be a finite number greater than 0, got 0"),
        (lambda: gauge([1.0], 1.0, 1.0), r"repeats must be at least 2 finite numbers .*, got an array of shape \(1,\)"),
        (lambda: gauge([1.0, math.nan], 1.0, 1.0), "repeats must be at least 2 finite numbers"),
        (lambda: gauge([1.0, 1.0], 1.0, 1.0), r"repeats must be different from each other, got 1\.0 every time"),
        (lambda: gauge([1.0, 2.0], math.inf, 1.0), "reference must be a finite number, got inf"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InvalidInput, match=message):
        call()
