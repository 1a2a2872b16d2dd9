"""The pictures of a survey: each knob on logarithmic axes with fitted and theoretical slopes, and the Pareto front."""

from __future__ import annotations

import textwrap
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from validation.cost.parameter import Knob
from validation.cost.sweep import Survey
from validation.report.figures import save


def draw(found: Survey, directory: Path) -> list[Path]:
    """Write one PNG a knob; their paths."""
    return [_draw(knob, directory / f"{knob.name}.png") for knob in found.knobs]


def _draw(knob: Knob, path: Path) -> Path:
    figure, axes = plt.subplots(figsize=(6.8, 5.4), layout="constrained")
    joined = knob.name not in ("estimators", "effects")
    for label, (x, y) in knob.curves().items():
        axes.plot(x, y, "o-" if joined else "o", ms=4, lw=1, label=f"{knob.series} {label}" if label else None)
    if knob.name == "pareto":
        _front(knob, axes)
    axes.set(xscale="log", yscale="log", xlabel=knob.x, ylabel=knob.y)
    axes.set_title(knob.title, fontsize=10)
    if knob.series:
        axes.legend(frameon=False, fontsize=8)
    axes.grid(which="both", alpha=0.2)
    lines = [f"{f.what}: {f.slope:+.2f}" + (f", theory {f.theory:+.2f}" if f.theory else "") for f in knob.fits]
    lines += textwrap.wrap(knob.note, 100)
    if lines:
        figure.supxlabel("\n".join(lines), fontsize=7)
    return save(figure, path)


def _front(knob: Knob, axes) -> None:
    points = np.array([row[2:4] for row in knob.rows if row[-1]])
    points = points[points[:, 0].argsort()]
    axes.plot(*points.T, "k-", lw=3, alpha=0.25, label="Pareto front", zorder=0)
