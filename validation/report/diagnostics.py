"""Plots that look for what a table does not show: residuals, the distances' distribution, where the time went."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from scipy import stats

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.report.canvas import WIDTH, legend_below, save

_EDGES = np.linspace(-8, 8, 1601)


@dataclass(frozen=True)
class Distances:
    """All distances of the verdict's method, each minus its setting's mean, over its predicted sigma.

    ``counts`` are those in the bins between ``_EDGES``, the outermost with all beyond; a histogram of fixed size, so
    that any number of settings can be looked at.
    """

    counts: np.ndarray

    @classmethod
    def of(cls, found: Validation, store: RunFile) -> Distances:
        counts = np.zeros(_EDGES.size - 1, int)
        for row in found.rows:
            values = store.distances(row.index, row.main.method)
            values = values[np.isfinite(values)]
            if values.size > 1 and 0 < row.main.propagated < np.inf:
                z = (values - values.mean()) / np.sqrt(row.main.propagated)
                counts += np.histogram(np.clip(z, _EDGES[0], _EDGES[-1]), _EDGES)[0]
        return cls(counts)

    @property
    def total(self) -> int:
        return int(self.counts.sum())

    def inside(self, sigmas: float) -> float:
        """Part of the distances within so many predicted sigmas."""
        middle = (_EDGES[1:] + _EDGES[:-1]) / 2
        return float(self.counts[np.abs(middle) < sigmas].sum() / max(self.total, 1))


def residuals(found: Validation) -> np.ndarray:
    """ln(measured / predicted variance) over its standard error sqrt(2 / (n - 1)), one a judged row."""
    judged = (row.main for row in found.rows if row.main.ratio)
    return np.fromiter((np.log(j.ratio) / np.sqrt(2 / (j.n - j.failed - 1)) for j in judged), float)


def draw_residuals(found: Validation, path: Path) -> Path:
    """Residual of each setting, with the limits of one row and of the whole table."""
    values = residuals(found)
    figure, axis = plt.subplots(figsize=(WIDTH, 3.8), layout="constrained")
    places = np.fromiter((row.index + 1 for row in found.rows if row.main.ratio), int)
    axis.plot(places, values, "o", ms=5 if values.size < 100 else 2)
    axis.axhline(0, color="k", lw=0.8)
    limit = stats.norm.isf(found.verdict.limit / 2)
    for level, style, label in ((stats.norm.isf(0.025), ":", "95 %, one row"), (limit, "--", "verdict, whole table")):
        axis.axhline(level, color="0.4", ls=style, lw=1, label=label)
        axis.axhline(-level, color="0.4", ls=style, lw=1)
    reach = 1.4 * max(limit, np.abs(values).max(initial=0))
    axis.set(xlabel="setting", ylabel="residual, standard errors", ylim=(-reach, reach))
    legend_below(axis, 2)
    return save(figure, path)


def draw_distribution(distances: Distances, path: Path) -> Path:
    """Histogram and normal plot of the standardised distances."""
    figure, (left, right) = plt.subplots(2, 1, figsize=(WIDTH, 7.6), layout="constrained")
    coarse = distances.counts.reshape(-1, 20).sum(1)
    edges = _EDGES[::20]
    left.stairs(coarse / max(distances.total, 1) / np.diff(edges), edges, fill=True, alpha=0.5, label="measured")
    x = np.linspace(-4.5, 4.5, 300)
    left.plot(x, stats.norm.pdf(x), "k", lw=1, label="predicted")
    left.set(xlim=(-4.5, 4.5), xlabel="(distance - mean) / predicted sigma", ylabel="density")
    below = np.cumsum(distances.counts)[:-1] / max(distances.total, 1)
    some = (distances.counts[:-1] > 0) & (below < 1)  # where a value lies, not the gaps of the tails
    right.plot(stats.norm.ppf(below[some]), _EDGES[1:-1][some], ".", ms=2.5)
    right.plot([-4.5, 4.5], [-4.5, 4.5], "k-", lw=0.8)
    right.set(xlabel="normal quantile", ylabel="(distance - mean) / predicted sigma")
    legend_below(left, 2)
    return save(figure, path)


def draw_time(found: Validation, path: Path) -> Path:
    """Working seconds of all workers, by what they were spent on."""
    spent = {name: value for name, value in found.seconds.items() if name not in ("wall", "workers")}
    figure, axis = plt.subplots(figsize=(WIDTH, 0.8 + 0.32 * len(spent)), layout="constrained")
    bars = axis.barh(list(spent), list(spent.values()))
    axis.bar_label(bars, fmt="%.1f", padding=3)
    axis.invert_yaxis()
    axis.margins(x=0.15)
    axis.set(xlabel="working seconds of all workers")
    return save(figure, path)
