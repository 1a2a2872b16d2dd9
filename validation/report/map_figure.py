"""Maps of a plan (the paper's Figs 9, 10, 12) and surfaces (11, 13): where sensor and light may stand, and why not.

Seen from above the object: the polar angle is the distance from the middle, the azimuth runs anticlockwise from the
scene's x axis, which points right, in every map.
"""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator

from imaging.geometry.projection import direction
from planner import Map, Plan
from scenes import Pose

COLOURS = "viridis_r"  # lightness rises evenly, so that it is told apart in grey: the lighter, the more precise
_PIXELS = 400  # across a map
_DECADE = 10.0  # range of sigma beyond which its scale is logarithmic
_MOST = 95  # per cent of the directions that the scale of sigma spans
_REASONS = {
    "not_visible": ("edge hidden", "0.35", ""),
    "short": ("edge too short", "0.72", "////"),
    "low_contrast": ("contrast too low", "0.55", "...."),
    "ill_conditioned": ("edges nearly parallel", "0.85", "xxxx"),
}
_BIASED = ("measurable, but clutter: biased", "none", "\\\\\\\\")


@dataclass(frozen=True)
class Chart:
    """What one map shows.

    Attributes
    ----------
    found : Map
    biased : bool
        Whether the bias of straight edges was looked for.
    best : Pose
        Of the sensor or the light that moves.
    title : str
    """

    plan: Plan
    found: Map
    biased: bool
    best: Pose
    title: str

    @property
    def reach(self) -> float:
        """Greatest polar angle that is drawn, degrees."""
        return float(self.found.space.polar_deg[1])

    @property
    def label(self) -> str:
        """What the colours are, with its unit."""
        measurands = self.plan.prediction.measurands
        if len(measurands) > 1:
            return (
                "worst sigma / tolerance" if self.plan.over == "minimax" else "root of the sum of (sigma / tolerance)²"
            )
        unit = measurands[0].unit
        return f"sigma of {measurands[0].name}, " + (
            "px" if self.plan.objective == "image" and unit != "degrees" else unit
        )

    def norm(self) -> Normalize:
        """Scale of sigma: logarithmic where it spans more than a decade."""
        sigma = np.sqrt(self.found.variance[np.isfinite(self.found.variance)])
        if not sigma.size:
            return Normalize(0, 1)
        low, high = sigma.min(), max(np.percentile(sigma, _MOST), sigma.min() * 1.01)
        return (LogNorm if high > _DECADE * low else Normalize)(low, high)


def draw_map(figure, axis, below, chart: Chart) -> None:
    """One map with its rings, azimuths, best place and scale; its legend in the axes below it."""
    nearest = _nearest(chart)
    sigma = np.where(nearest < 0, np.nan, np.sqrt(np.append(chart.found.variance, np.nan)[nearest]))
    status = np.where(nearest < 0, "", np.append(chart.found.status, "")[nearest])
    norm, extent = chart.norm(), [-chart.reach, chart.reach] * 2
    axis.imshow(
        np.where(np.isfinite(sigma), sigma, np.nan), extent=extent, origin="lower", cmap=COLOURS, norm=norm,
        interpolation="nearest",
    )  # fmt: skip
    handles = _reasons(axis, status, ~np.isfinite(sigma), extent)
    rings(axis, chart.reach)
    x, y = place(*chart.best)
    axis.plot(x, y, "o", mfc="w", mec="k", ms=10, mew=1.4)
    axis.plot(x, y, "+", color="#c00000", ms=9, mew=2.2)
    label = f"best: polar angle {chart.best.polar_deg:.0f}, azimuth {chart.best.azimuth_deg:.0f} degrees"
    best = Line2D([], [], marker="+", color="#c00000", ls="", ms=9, mew=2.2, label=label)
    axis.set_title(f"{chart.title}\nrings: polar angle, rays: azimuth, degrees", fontsize=11)
    if not chart.biased:
        handles.append(Line2D([], [], ls="", label="(the bias of straight edges is not looked for)"))
    below.axis("off")
    below.legend(handles=[best, *handles], loc="upper center", frameon=False, fontsize=10, borderaxespad=0)
    _scale(figure, axis, chart, norm)


def _scale(figure, axis, chart: Chart, norm: Normalize) -> None:
    """Colour bar under a map."""
    bar = figure.colorbar(
        ScalarMappable(norm, COLOURS), ax=axis, location="bottom", shrink=0.85, pad=0.02, aspect=30, extend="max",
        format=FuncFormatter(lambda v, _: f"{v:.3g}"),
        ticks=LogLocator(10, (1, 2, 5)) if isinstance(norm, LogNorm) else MaxNLocator(5),
    )  # fmt: skip
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=10)
    bar.set_label(chart.label, fontsize=10)


def _nearest(chart: Chart) -> np.ndarray:
    """Index of the direction nearest to each pixel, -1 outside the map; shape (pixels, pixels)."""
    side = ((np.arange(_PIXELS) + 0.5) * 2 / _PIXELS - 1) * chart.reach
    x, y = np.meshgrid(side, side)
    polar, azimuth = np.hypot(x, y), np.degrees(np.arctan2(y, x))
    found = np.full(polar.shape, -1)
    inside = polar <= chart.reach
    found[inside] = chart.found.space.nearest_direction(direction(np.column_stack([polar[inside], azimuth[inside]])))
    return found


def _reasons(axis, status: np.ndarray, lost: np.ndarray, extent: list[float]) -> list[Patch]:
    """Grey, hatched areas where nothing can be measured, hatches where it is biased; their legend."""
    handles = []
    for name, (words, grey, hatch) in _REASONS.items():
        some = lost & (status == name)
        if some.any():
            _area(axis, some, extent, grey, hatch)
            label = f"cannot be measured: {words} ({name})"
            handles.append(Patch(fc=grey, ec="0.15", hatch=hatch, lw=0.6, label=label))
    some = ~lost & (status == "clutter")
    if some.any():
        words, grey, hatch = _BIASED
        _area(axis, some, extent, grey, hatch)
        handles.append(Patch(fc=grey, ec="0.15", hatch=hatch, lw=0.6, label=words))
    return handles


def _area(axis, some: np.ndarray, extent: list[float], colour: str, hatch: str) -> None:
    with matplotlib.rc_context({"hatch.linewidth": 0.6, "hatch.color": "0.15"}):
        drawn = axis.contourf(
            some.astype(float), levels=[0.5, 1.5], colors=[colour], extent=extent, hatches=[hatch], origin="lower"
        )
    drawn.set_edgecolor("0.15")
    drawn.set_linewidth(0)


def place(polar: float, azimuth: float) -> tuple[float, float]:
    """Where a pose lies in a map."""
    return polar * np.cos(np.radians(azimuth)), polar * np.sin(np.radians(azimuth))


def rings(axis, reach: float) -> None:
    """Rings of equal polar angle and rays of equal azimuth, all numbered."""
    halo = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7}
    for polar in (30, 60, 90) if reach <= 90 else (45, 90, 135, 180):
        axis.add_patch(Circle((0, 0), polar, fill=False, ec="0.2", lw=0.7))
        if polar < reach:
            axis.text(*place(polar, 22.5), f"{polar}", fontsize=10, ha="center", va="center", bbox=halo)
    axis.text(*place(1.06 * reach, 22.5), f"{reach:g}", fontsize=10, ha="center", va="center", bbox=halo)
    for azimuth in range(0, 360, 45):
        x, y = place(reach, azimuth)
        axis.plot([0, x], [0, y], color="0.2", lw=0.5)
        name = {0: "0 (x)", 90: "90 (y)"}.get(azimuth, f"{azimuth}")
        axis.text(1.04 * x, 1.04 * y, name, fontsize=10, ha=_side(x, "left", "right"), va=_side(y, "bottom", "top"))
    axis.set(aspect="equal", xlim=(-1.33 * reach, 1.33 * reach), ylim=(-1.16 * reach, 1.16 * reach))
    axis.axis("off")


def _side(offset: float, positive: str, negative: str) -> str:
    return "center" if abs(offset) < 1e-6 else positive if offset > 0 else negative


def draw_surface(axis, chart: Chart) -> None:
    """The map as a surface, upside down as in the paper, so that the optimum is the summit."""
    side = np.linspace(-chart.reach, chart.reach, 161)
    x, y = np.meshgrid(side, side)
    polar, azimuth = np.hypot(x, y), np.degrees(np.arctan2(y, x))
    values = chart.found.variance[chart.found.space.nearest_direction(direction(np.stack([polar, azimuth], -1)))]
    height = np.where(polar <= chart.reach, np.nanmin(chart.found.variance) / values, np.nan)
    axis.plot_surface(x, y, height, cmap="viridis", rcount=161, ccount=161, lw=0, antialiased=False, vmin=0, vmax=1)
    axis.view_init(elev=38)
    ticks = [-90, -45, 0, 45, 90] if chart.reach <= 90 else [-180, -90, 0, 90, 180]
    axis.set(xticks=ticks, yticks=ticks, zlim=(0, 1))
    axis.set_xlabel("polar angle along x, degrees", fontsize=10, labelpad=8)
    axis.set_ylabel("polar angle along y, degrees", fontsize=10, labelpad=8)
    axis.set_zlabel("least variance / variance", fontsize=10, labelpad=6)
    axis.tick_params(labelsize=10)
    axis.set_box_aspect((1, 1, 0.7), zoom=0.86)
    axis.set_title(f"{chart.title}\n1 at the best, 0 where it cannot be measured", fontsize=11)


def short(pose: Pose | tuple[Pose, ...]) -> str:
    """A pose, or several, to a degree.

    >>> short(Pose(15, 315))
    '(15, 315)'
    """
    if not isinstance(pose, Pose):
        return " ".join(map(short, pose))
    return f"({pose.polar_deg:.0f}, {pose.azimuth_deg:.0f})"
