"""Is an empirical variance what was predicted? Intervals, p-values and one verdict for a whole table."""

from __future__ import annotations

import functools
import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from scenes.status import OK, counted, is_trusted

LEVEL = 0.01  # of false alarm, of a whole verdict
SHARES = {"rows": 0.45, "pooled": 0.45, "bias": 0.10}  # of that level, by test
ALLOWANCE = 0.3  # standard uncertainties of one value: adds 4 % to its root mean square error
STRAY = 0.01  # of a row's images may be lost; with more the rest is a selection, whose scatter says nothing


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
    if n < 2 or not math.isfinite(ratio):
        return 0.0, math.inf
    below, above = _quantiles(n - 1, level)
    return ratio * (n - 1) / above, ratio * (n - 1) / below


@functools.lru_cache(maxsize=1024)
def _quantiles(freedom: int, level: float) -> tuple[float, float]:
    """Ends of the central interval of a chi-square variable with some probability (``level``)."""
    tail = (1 - level) / 2
    return float(special.chdtri(freedom, 1 - tail)), float(special.chdtri(freedom, tail))


def p_value(ratio: float, n: int) -> float:
    """Two-sided p-value of the hypothesis that the prediction is the true variance."""
    return float(_p_values(np.array(ratio, float), np.array(n)))


def _p_values(ratios: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """The same for each of many; NaN where there is no ratio."""
    freedom = np.where((counts >= 2) & np.isfinite(ratios), counts - 1.0, np.nan)
    x = ratios * freedom
    return np.minimum(1.0, 2 * np.minimum(special.chdtr(freedom, x), special.chdtrc(freedom, x)))


@dataclass(frozen=True)
class Pooled:
    """All judged rows as one: a chi-square test that sees what is a little wrong everywhere.

    Attributes
    ----------
    ratio : float
        Mean of the rows' variance ratios, weighted by their degrees of freedom n - 1.
    interval : pair of float
        Its two-sided 95 % chi-square interval.
    p_value, limit : float
        Two-sided, and the level it is held to.
    """

    ratio: float
    interval: tuple[float, float]
    p_value: float
    limit: float


@dataclass(frozen=True)
class Bias:
    """Whether the mean errors are what was predicted, up to what is allowed.

    Attributes
    ----------
    rows : int
        Rows judged.
    allowance : float
        What a mean error may differ from the predicted one, in standard uncertainties of one value: its predicted sigma
        and what its bias is not sure of together.
    largest : float
        The largest difference, in the same unit.
    significant : int
        Rows whose difference is significantly not 0 (95 %), relevant or not.
    within : int
        Rows shown to keep the allowance (two one-sided tests at 5 %).
    smallest_p, limit : float
        Smallest p-value of the hypothesis that the difference is at most the allowance, and the level each row is held
        to (Sidak).
    """

    rows: int
    allowance: float
    largest: float
    significant: int
    within: int
    smallest_p: float
    limit: float


@dataclass(frozen=True)
class Verdict:
    """Judgement of a table of predictions.

    Attributes
    ----------
    agrees : bool
        Whether none of the tests contradicts the predictions, a row is proven, and at least half of all were measured.
    rows, inside : int
        Rows judged, which are those proven where it agrees; rows whose own 95 % interval of the variance ratio holds 1.
    smallest_p, limit : float
        Smallest p-value of a row's variance, and the level each row is held to (Sidak).
    text : str
        One line; begins with "agree" or "contradict".
    not_measured : int
        Rows without a variance, or with more than `STRAY` of their images lost; they are not judged, but counted.
    not_proven : dict
        Number of measured rows by status, of those that are not trusted; they are not judged, but counted.
    pooled : Pooled or None
        None without a row.
    bias : Bias or None
        None if no mean errors were given.
    reasons : tuple of str
        What contradicts: some of ``rows``, ``pooled``, ``bias``, ``not measured``, ``not proven``.
    """

    agrees: bool
    rows: int
    inside: int
    smallest_p: float
    limit: float
    text: str
    not_measured: int
    not_proven: dict[str, int]
    pooled: Pooled | None
    bias: Bias | None
    reasons: tuple[str, ...]


def verdict(
    ratios: ArrayLike,
    counts: ArrayLike,
    level: float = LEVEL,
    *,
    lost: ArrayLike = 0,
    bias_px: ArrayLike | None = None,
    predicted_bias_px: ArrayLike = 0.0,
    sigma_px: ArrayLike | None = None,
    u_bias_px: ArrayLike = 0.0,
    render_noise_px: ArrayLike = 0.0,
    status: ArrayLike = OK,
    independent: ArrayLike = 1.0,
) -> Verdict:
    """Judge all rows together: a table of true predictions is contradicted with probability ``level`` at most.

    Three tests share the level (Bonferroni, so whatever they have to do with each other; `SHARES`): the variance of
    each row, the variance of all rows pooled, and the mean error of each row that is ``ok``. The last asks what is
    relevant as well as significant. Its hypothesis is that the mean error lies within `ALLOWANCE` standard
    uncertainties of the predicted one, sqrt(sigma^2 + u_bias^2) of one value, and a p-value is taken at the end of that
    interval (a minimum-effect test, as in Murphy and Myors 1999): a bias that no single image would show is forgiven
    however many images prove it, and a small run, which could not show that a bias is small, is not blamed for it. With
    1000 images the allowance is 9.5 standard errors wide, so a small share of the level costs this test hardly any
    power.

    Parameters
    ----------
    ratios : array_like, shape (rows,)
        Sample variance over predicted variance; NaN where there is none.
    counts, lost : array_like
        Images measured, and images that could not be.
    level : float
        Probability of contradicting a table that is true.
    bias_px, predicted_bias_px, sigma_px : array_like
        Measured and predicted mean error and predicted standard deviation (not variance) of one image, px. Without the
        first nothing is said of biases.
    u_bias_px : array_like
        Standard uncertainty (not variance) of the predicted mean error, px; NaN counts as 0.
    render_noise_px : array_like
        Standard deviation (not variance) of measured less predicted mean error by the renderer's own noise, which no
        number of noisy copies of one render averages out, px; NaN counts as 0.
    status : array_like of str
        Of each row; what is not trusted (`scenes.status`) promises nothing: neither agreement nor contradiction.
    independent : array_like
        For how many independent rows each counts when they are pooled: less than 1 for quantities measured in the same
        images (their number over the sum of their squared correlations).

    Examples
    --------
    >>> verdict([1.0, 1.04], [1000, 1000]).agrees
    True
    >>> verdict([1.0, 1.3], [1000, 1000]).agrees
    False
    >>> verdict([1.0, 1.0], [1000, 1000], bias_px=[0.001, 0.05], sigma_px=[0.1, 0.1]).reasons
    ('bias',)
    >>> verdict([1.0, float("nan"), float("nan")], [1000, 0, 0]).reasons
    ('not measured',)
    >>> verdict([1.0, 1.3], [1000, 1000], status=["ok", "clutter"]).text.split("; ")[:2]
    ['agree: measured is as predicted', '1 of 2 rows proven, 1 not: clutter 1']
    """
    ratios, counts, lost, shares = np.broadcast_arrays(np.asarray(ratios, float), counts, lost, independent)
    status = np.broadcast_to(np.asarray(status, object), ratios.shape)
    measured = np.isfinite(ratios) & (counts >= 2) & (lost <= STRAY * (counts + lost))
    judged = measured & is_trusted(status)
    rows, missing, doubts = int(judged.sum()), int((~measured).sum()), Counter(status[measured & ~judged].tolist())
    if not rows:
        return _nothing(ratios.size, missing, dict(doubts), level)
    away, known = np.full(ratios.shape, np.nan), np.array(counts, float)
    if bias_px is not None:
        away[:], known = _mean_errors(bias_px, predicted_bias_px, sigma_px, counts, u_bias_px, render_noise_px)
    promised = judged & np.isfinite(away)
    levels = _levels(level, promised.any())
    p_values, limit = _p_values(ratios[judged], counts[judged]), sidak(levels["rows"], rows)
    smallest = float(p_values.min())
    pooled = _pooled(ratios[judged], shares[judged] * (counts[judged] - 1), levels["pooled"])
    bias = bias_test(away[promised], known[promised], levels["bias"]) if "bias" in levels else None
    broken = {
        "rows": smallest < limit,
        "pooled": pooled.p_value < pooled.limit,
        "bias": bias is not None and bias.smallest_p < bias.limit,
        "not measured": missing > measured.sum(),
    }
    reasons = tuple(name for name, wrong in broken.items() if wrong)
    inside = int((p_values >= 0.05).sum())  # as much as 1 lying in the 95 % interval
    found = Verdict(not reasons, rows, inside, smallest, limit, "", missing, dict(doubts), pooled, bias, reasons)
    return replace(found, text=_text(found, level))


def _mean_errors(
    bias: ArrayLike, predicted: ArrayLike, sigma: ArrayLike, counts: np.ndarray, u_bias: ArrayLike, noise: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Mean errors less predicted ones in standard uncertainties of one value, and how many images would tell as much.

    What is not finite then is not judged.
    """
    variance = np.square(np.asarray(sigma, float))
    with np.errstate(all="ignore"):
        whole = variance + np.nan_to_num(np.square(np.asarray(u_bias, float)), nan=0.0, posinf=np.inf)
        scatter = variance / counts + np.nan_to_num(np.square(np.asarray(noise, float)), nan=0.0, posinf=np.inf)
        return np.subtract(bias, predicted, dtype=float) / np.sqrt(whole), whole / scatter


def _nothing(rows: int, missing: int, doubts: dict[str, int], level: float) -> Verdict:
    """Where no row can be judged."""
    why = f"proven: {_listed(doubts)}" if doubts else "measured"
    text = f"contradict: none of {rows} rows could be {why}, so nothing is shown."
    reasons = ("not proven",) if doubts else ("not measured",)
    return Verdict(False, 0, 0, float("nan"), level, text, missing, doubts, None, None, reasons)


def _listed(doubts: dict[str, int]) -> str:
    return counted(Counter(doubts).elements())


def _levels(level: float, with_bias: bool) -> dict[str, float]:
    """The level of each test; the shares of one that is not made go to the others."""
    shares = {name: share for name, share in SHARES.items() if with_bias or name != "bias"}
    return {name: level * share / sum(shares.values()) for name, share in shares.items()}


def sidak(level: float, tests: int) -> float:
    """Level of each of several independent tests so that all together have ``level``.

    >>> round(sidak(0.01, 16), 6)
    0.000628
    """
    return -math.expm1(math.log1p(-level) / tests)


def bias_p_value(difference: ArrayLike, n: ArrayLike, allowance: float = ALLOWANCE) -> np.ndarray:
    """P-value of the hypothesis that a mean error differs from the predicted one by no more than an allowance.

    Parameters
    ----------
    difference : array_like
        Mean of n errors less its prediction, in standard uncertainties of one value (as a user is told).
    n : array_like
        Number of images whose values scatter by as much and average out.
    allowance : float
        In the same unit; 0 for the plain two-sided test.

    Examples
    --------
    >>> float(bias_p_value(0.25, 1000)), float(bias_p_value(0.5, 1000)) < 1e-9
    (0.943..., True)
    """
    root = np.sqrt(n)
    away = np.abs(difference) * root
    return np.minimum(special.ndtr(allowance * root - away) + special.ndtr(-away - allowance * root), 1.0)


def _pooled(ratios: np.ndarray, freedoms: np.ndarray, level: float) -> Pooled:
    freedom = max(int(freedoms.sum()), 1)
    ratio = float((freedoms * ratios).sum() / freedoms.sum())
    return Pooled(ratio, ratio_interval(ratio, freedom + 1), p_value(ratio, freedom + 1), level)


def bias_test(difference: np.ndarray, counts: np.ndarray, level: float) -> Bias:
    """Judge the mean errors of several rows; parameters as of `bias_p_value`, at least one row."""
    shown = np.abs(difference) + special.ndtri(0.95) / np.sqrt(counts) < ALLOWANCE
    return Bias(
        rows=difference.size,
        allowance=ALLOWANCE,
        largest=float(np.abs(difference).max()),
        significant=int((bias_p_value(difference, counts, 0.0) < 0.05).sum()),
        within=int(shown.sum()),
        smallest_p=float(bias_p_value(difference, counts).min()),
        limit=sidak(level, difference.size),
    )


_WRONG = {"rows": "a row's variance", "pooled": "the pooled variance", "bias": "a row's mean error"}


def _text(found: Verdict, level: float) -> str:
    """One line: the outcome, then the figures of each test."""
    low, high = found.pooled.interval
    word, measured = "proven" if found.agrees else "judged", found.rows + sum(found.not_proven.values())
    parts = [f"{found.rows} of {measured} rows {word}, {measured - found.rows} not: {_listed(found.not_proven)}"]
    parts = parts * bool(found.not_proven) + [
        f"{found.inside} of {found.rows} rows inside their 95 % interval, smallest p-value {found.smallest_p:.2g} "
        f"against {found.limit:.2g}",
        f"pooled ratio {found.pooled.ratio:.3f} [{low:.3f}, {high:.3f}], p-value {found.pooled.p_value:.2g} against "
        f"{found.pooled.limit:.2g}",
    ]
    if found.bias:
        parts.append(
            f"mean errors up to {found.bias.largest:.2f} u from predicted, {found.bias.allowance:g} allowed, "
            f"p-value {found.bias.smallest_p:.2g} against {found.bias.limit:.2g}"
        )
    if found.not_measured:
        parts.append(f"{found.not_measured} of {measured + found.not_measured} rows not measured")
    return f"{'; '.join([_outcome(found), *parts])} (false alarm at most {level:.2g} for all)."


def _outcome(found: Verdict) -> str:
    if found.agrees:
        return "agree: measured is as predicted"
    wrong = " and ".join(_WRONG[reason] for reason in found.reasons if reason in _WRONG)
    said = [f"{wrong} not as predicted"] * bool(wrong) + ["most rows not measured"] * ("not measured" in found.reasons)
    return f"contradict: {', '.join(said)}"


def correlation(first: ArrayLike, second: ArrayLike) -> dict[str, float] | None:
    """Pearson and Spearman correlation of the rows that have both numbers; None with fewer than three.

    A number that is not there is None or not finite.
    """
    pairs = np.stack([np.asarray(first, float), np.asarray(second, float)], axis=-1)
    pairs = pairs[np.isfinite(pairs).all(1)]
    if len(pairs) < 3 or np.ptp(pairs, axis=0).min() == 0:
        return None
    from scipy import stats  # half a second to load, which a measurement does not need

    return {
        "pearson": float(stats.pearsonr(*pairs.T).statistic),
        "spearman": float(stats.spearmanr(*pairs.T).statistic),
        "rows": len(pairs),
    }
