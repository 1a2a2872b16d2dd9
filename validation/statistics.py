"""Is an empirical variance what was predicted? Intervals, p-values and one verdict for a whole table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats


def ratio_interval(ratio: float, n: int, level: float = 0.95) -> tuple[float, float]:
    """Two-sided chi-square interval of a true variance ratio.

    Parameters
    ----------
    ratio : float
        Sample variance (of n values, n - 1 degrees of freedom) over predicted variance.
    n : int
        Number of values, at least 2; with fewer the interval is (0, inf).

    Examples
    --------
    >>> [round(x, 3) for x in ratio_interval(1.0, 1000)]
    [0.918, 1.094]
    """
    if n < 2 or not np.isfinite(ratio):
        return 0.0, float("inf")
    tail = (1 - level) / 2
    low, high = stats.chi2.isf([tail, 1 - tail], n - 1)
    return float(ratio * (n - 1) / low), float(ratio * (n - 1) / high)


def p_value(ratio: float, n: int) -> float:
    """Two-sided p-value of the hypothesis that the prediction is the true variance."""
    if n < 2 or not np.isfinite(ratio):
        return float("nan")
    x = ratio * (n - 1)
    return float(min(1.0, 2 * min(stats.chi2.cdf(x, n - 1), stats.chi2.sf(x, n - 1))))


@dataclass(frozen=True)
class Verdict:
    """Judgement of a table of predictions.

    Attributes
    ----------
    agrees : bool
        Whether no row contradicts its prediction at the Sidak-corrected level, and there is a row at all.
    rows, inside : int
        Rows judged; rows whose own 95 % interval holds 1.
    smallest_p, limit : float
        Smallest p-value, and the level each row is held to so that the whole table has the level asked for.
    text : str
        One sentence.
    """

    agrees: bool
    rows: int
    inside: int
    smallest_p: float
    limit: float
    text: str


def verdict(ratios: list[float], counts: list[int], level: float = 0.01) -> Verdict:
    """Judge all rows together: a table of true predictions is rejected with probability ``level``.

    Examples
    --------
    >>> verdict([1.0, 1.04], [1000, 1000]).agrees
    True
    >>> verdict([1.0, 1.3], [1000, 1000]).agrees
    False
    """
    judged = [(r, n) for r, n in zip(ratios, counts, strict=True) if n >= 2 and np.isfinite(r)]
    if not judged:
        return Verdict(False, 0, 0, float("nan"), level, "No row could be measured, so nothing is shown.")
    limit = 1 - (1 - level) ** (1 / len(judged))
    smallest = min(p_value(*row) for row in judged)
    inside = sum(low <= 1 <= high for low, high in (ratio_interval(*row) for row in judged))
    agrees = smallest >= limit
    words = "agree with" if agrees else "contradict"
    text = (
        f"The measured variances {words} the predictions: {inside} of {len(judged)} rows inside their 95 % interval, "
        f"smallest p-value {smallest:.2g} against {limit:.2g} (Sidak, {level:.0%} for the table)."
    )
    return Verdict(agrees, len(judged), inside, smallest, limit, text)


def correlation(first: list[float], second: list[float]) -> dict[str, float] | None:
    """Pearson and Spearman correlation of the rows that have both numbers; None with fewer than three."""
    pairs = np.array([(a, b) for a, b in zip(first, second, strict=True) if a is not None and b is not None], float)
    pairs = pairs[np.isfinite(pairs).all(1)] if pairs.size else pairs
    if len(pairs) < 3 or np.ptp(pairs, axis=0).min() == 0:
        return None
    return {
        "pearson": float(stats.pearsonr(*pairs.T).statistic),
        "spearman": float(stats.spearmanr(*pairs.T).statistic),
        "rows": len(pairs),
    }
