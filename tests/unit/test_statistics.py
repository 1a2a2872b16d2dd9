"""The verdict is calibrated: it rejects true tables as often as it says, and false ones nearly always."""

import numpy as np
import pytest
from scipy import stats

from tests.sequential import simulate
from validation.cost.interval import LEAST
from validation.statistics import ALLOWANCE, SHARES, _levels, correlation, p_value, ratio_interval, verdict


def tables(rng, count, rows, n, factor=1.0):
    return factor * rng.chisquare(n - 1, (count, rows)) / (n - 1)


def test_interval_covers_and_p_value_is_uniform(rng):
    ratios = tables(rng, 4000, 1, 50)[:, 0]
    covered = np.mean([low <= 1 <= high for low, high in (ratio_interval(r, 50) for r in ratios)])
    assert abs(covered - 0.95) < 4 * np.sqrt(0.05 * 0.95 / 4000)
    assert stats.kstest([p_value(r, 50) for r in ratios], "uniform").pvalue > 1e-3


def judged(rng, count, n, rows=16, factor=1.0, bias=0.0, level=0.01, predicted_bias=0.0):
    """Verdicts on ``count`` tables of normal errors of variance ``factor`` (predicted: 1) and mean ``bias``."""
    means = bias + np.sqrt(factor) * rng.standard_normal((count, rows)) / np.sqrt(n)
    pairs = zip(tables(rng, count, rows, n, factor), means, strict=True)
    known = {"predicted_bias_px": predicted_bias, "sigma_px": np.ones(rows)}
    return [verdict(ratios, np.full(rows, n), level, bias_px=mean, **known) for ratios, mean in pairs]


def contradicted(*found, reason=None):
    return np.mean([reason in v.reasons if reason else not v.agrees for v in found])


@pytest.mark.parametrize(("bias", "most"), [(0.0, SHARES["rows"] + SHARES["pooled"]), (ALLOWANCE, 1.0)])
@pytest.mark.parametrize("n", [50, 1000])
def test_true_tables_are_contradicted_as_seldom_as_is_claimed(rng, n, bias, most):
    """Of 3000 true tables no more than the level, and not far less; also where every bias just keeps its allowance.

    The binomial limits are those of 99.99 %; a true table without bias spends the shares of the two variance tests,
    and what the Bonferroni split gives away is less than a fifth.
    """
    tried, level = 3000, 0.01
    found = judged(rng, tried, n, bias=bias, level=level)
    rejected = sum(not v.agrees for v in found)
    assert stats.binom.ppf(5e-5, tried, 0.8 * most * level) <= rejected <= stats.binom.ppf(1 - 5e-5, tried, level)


@pytest.mark.parametrize("of", SHARES)
def test_each_test_has_the_share_of_the_level_that_it_claims(rng, of):
    """3000 tables at a level of 20 %, every bias at the end of what is allowed: binomial limits of 99.99 %."""
    tried, level = 3000, 0.2
    found = judged(rng, tried, 200, bias=ALLOWANCE, level=level)
    rejected = sum(of in v.reasons for v in found)
    assert stats.binom.ppf(5e-5, tried, SHARES[of] * level) <= rejected
    assert rejected <= stats.binom.ppf(1 - 5e-5, tried, SHARES[of] * level)


@pytest.mark.parametrize("factor", [1.05, 0.95, 1 / 1.05, 1 / 0.95])
def test_a_prediction_wrong_by_5_percent_everywhere_is_contradicted(rng, factor):
    """16 rows x 1000 images, at 1 %: in more than 88 % of 400 tables; row by row it would be seen in 20 % at most."""
    found = judged(rng, 400, 1000, factor=factor)
    assert contradicted(*found) > 0.88  # margin: 93.5 %, of 400 tables: 4.5 standard errors
    assert contradicted(*found, reason="rows") < 0.2  # margin: chance: 400 tables, 4.7 standard errors


@pytest.mark.parametrize("factor", [1.3, 1 / 1.3])
def test_verdict_rejects_wrong_predictions(rng, factor):
    assert contradicted(*judged(rng, 200, 1000, factor=factor)) == 1
    one = tables(rng, 200, 16, 1000)
    one[:, 3] = factor  # the pooled test alone would let it pass
    found = [verdict(row, [1000] * 16) for row in one]
    assert contradicted(*found, reason="rows") == 1
    assert contradicted(*found, reason="pooled") < 0.3  # margin: chance: 200 tables, 5 standard errors


def test_a_relevant_bias_is_contradicted_and_an_irrelevant_one_is_not(rng):
    """A quarter of a sigma is 8 standard errors, and significant in every row; 0.45 sigma is too much."""
    small, large = judged(rng, 200, 1000, bias=0.25), judged(rng, 200, 1000, bias=-0.45)
    assert contradicted(*small, reason="bias") == 0
    # margin: the largest of 16 estimates of 0.25 is below it once in 2^16 tables
    assert all(v.bias.significant == 16 and v.bias.largest > 0.25 for v in small)
    assert contradicted(*large, reason="bias") == 1
    expected = judged(rng, 200, 1000, bias=-0.45, predicted_bias=-0.45)
    assert contradicted(*expected, reason="bias") == 0
    assert all(v.bias.within == 16 for v in expected)


def test_a_bias_of_one_row_in_16_is_seen_if_that_row_is_ok():
    errors, status = np.zeros(16), ["ok"] * 16
    errors[5], status[5] = 0.6, "clutter"
    known = {"bias_px": errors, "sigma_px": np.ones(16)}
    assert verdict(np.ones(16), np.full(16, 1000), **known).reasons == ("bias",)
    assert verdict(np.ones(16), np.full(16, 1000), **known, status=status).agrees


def test_what_a_correction_is_not_sure_of_widens_what_a_mean_error_may_be():
    """0.3 u with u = sqrt(1 + 0.75^2) = 1.25 is 0.375 sigma: 0.36 is forgiven however often shown, 0.45 is not."""
    n = 10**6
    for error, agrees in (0.36, True), (-0.36, True), (0.45, False):
        found = verdict([1.0], [n], bias_px=[2 * error], sigma_px=[2.0], u_bias_px=[1.5])
        assert found.bias.largest == pytest.approx(abs(error) / 1.25)
        assert found.agrees == agrees
    assert verdict([1.0], [n], bias_px=[0.72], sigma_px=[2.0], u_bias_px=[np.nan]).reasons == ("bias",)
    assert verdict([1.0], [n], bias_px=[0.72], sigma_px=[2.0]).reasons == ("bias",)


@pytest.mark.parametrize(("told", "is_held"), [(1.0, True), (0.5, False)])
def test_noise_of_the_renderer_is_allowed_for(rng, told, is_held):
    """Mean errors scatter by 1.3 sigma from render to render, which 1000 copies of one do not average out.

    3000 tables of one row at a level of 20 %, each mean error at the end of what is allowed and beyond by chance: the
    share of the level where the noise is told, far more where half of it is.
    """
    tried, level, n, noise = 3000, 0.2, 1000, 1.3
    errors = ALLOWANCE + rng.standard_normal(tried) * np.sqrt(noise**2 + 1 / n)
    found = [
        verdict([1.0], [n], level, bias_px=[e], sigma_px=[1.0], render_noise_px=[told * noise]) for e in errors
    ]  # fmt: skip
    rejected = sum("bias" in v.reasons for v in found)
    assert rejected >= stats.binom.ppf(5e-5, tried, level * SHARES["bias"] / 2)  # the other end seldom adds as much
    assert (rejected <= stats.binom.ppf(1 - 5e-5, tried, level * SHARES["bias"])) == is_held


def test_a_small_run_is_not_blamed_for_what_it_cannot_show():
    found = verdict(np.ones(4), np.full(4, 20), bias_px=np.full(4, 0.4), sigma_px=np.ones(4))
    assert found.agrees
    assert found.bias.within == 0


@pytest.mark.parametrize(("measured", "agrees"), [(16, True), (8, True), (7, False), (1, False), (0, False)])
def test_rows_that_were_not_measured_count(measured, agrees):
    """However well the others agree, and whether no image, or only a part of a row's images, was measured."""
    there = np.arange(16) < measured
    found = verdict(np.where(there, 1.0, np.nan), np.where(there, 1000, 0))
    assert (found.agrees, found.rows, found.not_measured) == (agrees, measured, 16 - measured)
    some = verdict(np.ones(16), np.where(there, 990, 989), lost=np.where(there, 10, 11))
    assert (some.agrees, some.rows, some.not_measured) == (agrees, measured, 16 - measured)
    assert found.text.startswith("agree: " if agrees else "contradict: ")
    assert agrees or "measured" in found.text.split(";")[0]


def test_rows_that_stopped_when_narrow_enough_do_not_upset_the_pooled_test(rng):
    """`--accuracy 0.2`: how long a row goes on depends on what it shows, but its sum of squares stays fair (Wald)."""
    tried, rows = 400, 4
    found = []
    for _ in range(tried):
        ratios, counts = zip(*(simulate(1.0, 0.2, LEAST, rng) for _ in range(rows)), strict=True)
        found.append(verdict(ratios, counts, level=0.1))
    share = 0.1 * SHARES["pooled"] / (SHARES["rows"] + SHARES["pooled"])
    assert sum("pooled" in v.reasons for v in found) <= stats.binom.ppf(1 - 1e-3, tried, share)


def test_nothing_measured_is_no_agreement():
    assert not verdict([float("nan")], [1000]).agrees
    assert not verdict([], []).agrees
    assert ratio_interval(1.0, 1) == (0.0, float("inf"))


def test_correlation_of_the_papers_printed_columns(task1):
    """The claimed 0.768 does not follow from Table 3 as printed."""
    ice = [setting.paper_ice for setting in task1.settings]
    for which, expected in ((0, 0.198), (1, 0.129)):
        real = [None if s.paper_real is None else s.paper_real[which] for s in task1.settings]
        found = correlation(ice, real)
        assert found["rows"] == 11
        assert found["pearson"] == pytest.approx(expected, abs=5e-4)  # margin: what three printed decimals tell


def test_correlation_needs_three_rows():
    assert correlation([1.0, 2.0], [2.0, 3.0]) is None
    assert correlation([1.0, 1.0, 1.0], [2.0, 3.0, 4.0]) is None


@pytest.mark.parametrize("with_bias", [True, False])
def test_shares_of_the_level(with_bias):
    """They add up to it, in the proportions of the shares; a test that is not made takes none."""
    levels = _levels(0.02, with_bias)
    assert sum(levels.values()) == pytest.approx(0.02)
    assert ("bias" in levels) is with_bias
    for one in levels:
        assert levels[one] / levels["rows"] == pytest.approx(SHARES[one] / SHARES["rows"])
