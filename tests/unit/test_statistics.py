"""The verdict is calibrated: it rejects true tables as often as it says, and false ones nearly always."""

import numpy as np
import pytest
from scipy import stats

from validation.statistics import correlation, p_value, ratio_interval, verdict


def tables(rng, count, rows, n, factor=1.0):
    return factor * rng.chisquare(n - 1, (count, rows)) / (n - 1)


def test_interval_covers_and_p_value_is_uniform(rng):
    ratios = tables(rng, 4000, 1, 50)[:, 0]
    covered = np.mean([low <= 1 <= high for low, high in (ratio_interval(r, 50) for r in ratios)])
    assert abs(covered - 0.95) < 4 * np.sqrt(0.05 * 0.95 / 4000)
    assert stats.kstest([p_value(r, 50) for r in ratios], "uniform").pvalue > 1e-3


def test_verdict_rejects_true_tables_as_often_as_it_claims(rng):
    rejected = np.mean([not verdict(list(row), [200] * 16, level=0.05).agrees for row in tables(rng, 2000, 16, 200)])
    assert abs(rejected - 0.05) < 4 * np.sqrt(0.05 * 0.95 / 2000)


@pytest.mark.parametrize("factor", [1.3, 1 / 1.3])
def test_verdict_rejects_wrong_predictions(rng, factor):
    assert not any(verdict(list(row), [1000] * 16).agrees for row in tables(rng, 200, 16, 1000, factor))


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
        assert found["pearson"] == pytest.approx(expected, abs=5e-4)


def test_correlation_needs_three_rows():
    assert correlation([1.0, 2.0], [2.0, 3.0]) is None
    assert correlation([1.0, 1.0, 1.0], [2.0, 3.0, 4.0]) is None
