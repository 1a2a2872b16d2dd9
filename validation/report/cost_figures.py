"""The pictures of a sweep: each parameter on logarithmic axes, fitted and theoretical slopes, the Pareto front."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np

from validation.cost.parameter import Parameter
from validation.cost.sweep import Sweep
from validation.report.canvas import TEXT, WIDTH, legend_below, plt, save


def draw(found: Sweep, directory: Path) -> list[Path]:
    """Write one PNG a parameter; their paths."""
    return [_draw(parameter, directory / f"{parameter.name}.png") for parameter in found.parameters]


def _draw(parameter: Parameter, path: Path) -> Path:
    figure, axes = plt.subplots(figsize=(WIDTH, 6.2), layout="constrained")
    joined = parameter.name not in ("estimators", "effects")
    for label, (x, y) in parameter.curves().items():
        axes.plot(x, y, "o-" if joined else "o", ms=4, lw=1, label=f"{parameter.series} {label}" if label else None)
    if parameter.name == "pareto":
        _front(parameter, axes)
    axes.set(xscale="log", yscale="log", ylabel=parameter.y)
    axes.set_title(textwrap.fill(parameter.title, 48), fontsize=11)
    if parameter.series:
        legend_below(axes, 2)
    axes.grid(which="both", alpha=0.2)
    lines = [f"{f.what}: {f.slope:+.2f}" + (f", theory {f.theory:+.2f}" if f.theory else "") for f in parameter.fits]
    lines += textwrap.wrap(parameter.note, 54)
    axes.set_xlabel("\n".join([parameter.x, *lines]), fontsize=TEXT)
    return save(figure, path)


def _front(parameter: Parameter, axes) -> None:
    points = np.array([row[2:4] for row in parameter.rows if row[-1]])
    points = points[points[:, 0].argsort()]
    axes.plot(*points.T, "k-", lw=3, alpha=0.25, label="Pareto front", zorder=0)
