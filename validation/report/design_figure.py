"""The picture of a design: cost against the worst U over tolerance, of all that was rated and of the front."""

from __future__ import annotations

from pathlib import Path

from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from planner.designing.outcome import Design
from validation.report.canvas import TEXT, WIDTH, plt, save
from validation.report.design_words import u_over_t


def draw(found: Design, currency: str, path: Path) -> Path:
    """Write it as PNG or SVG; its path."""
    figure, axis = plt.subplots(figsize=(WIDTH, 4.2), layout="constrained")
    front = [(each.cost, u_over_t(found, each)) for each in found.front]
    if front:
        axis.step(*zip(*front, strict=True), where="post", color="tab:blue", zorder=1)
        axis.plot(*zip(*front, strict=True), "o", color="tab:blue", label="least U for the cost", zorder=2)
    if found.best is not None and (worst := u_over_t(found, found.best)) is not None:
        label = "least cost that meets it" if found.reached else "nearest; nothing meets it"
        axis.plot([found.best.cost], [worst], "*", ms=15, color="tab:red", label=label, zorder=3)
    wishes = found.problem.wishes
    if wishes.false_acceptance is None:
        axis.axhline(1 / wishes.k, color="0.4", ls="--", label=f"asked: 1 / {wishes.k:g}", zorder=0)
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5, 7)))
    axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.set_xlabel(f"cost [{currency}]" if found.priced else "pixels of the camera [Mpx]", fontsize=TEXT)
    axis.set_ylabel("worst U over half of the tolerance zone", fontsize=TEXT)
    axis.legend(fontsize=TEXT)
    return save(figure, path)
