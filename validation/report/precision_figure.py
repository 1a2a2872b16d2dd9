"""Where single precision is safe, drawn over the viewing space."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import scenes
from planner import ViewingSpace
from validation.hard.precision import SAFE, error_of_single
from validation.report.canvas import TEXT, WIDTH

SENSOR, LIGHT = (30.0, 135.0), (15.0, 315.0)


def draw(path: Path, step_deg: float = 2.0) -> None:
    """Relative error of the variance in single precision over sensor and light poses; SVG, PNG or PDF by suffix."""
    space = ViewingSpace(step_deg, (0, 90))
    fixed = np.broadcast_to
    panels = (
        ("sensor moves, light (15, 315)", scenes.load("task1"), space.poses, fixed(LIGHT, space.poses.shape)),
        ("light moves, sensor (30, 135)", scenes.load("task1"), fixed(SENSOR, space.poses.shape), space.poses),
    )
    figure = Figure(figsize=(WIDTH, 11), layout="constrained")
    for i, (title, scene, sensors, lights) in enumerate(panels, 1):
        axes = figure.add_subplot(2, 1, i, projection="polar")
        error = error_of_single(scene, np.array(sensors), np.array(lights))
        seen = ~np.isnan(error)
        shown = np.log10(np.clip(error[seen], 1e-8, 1.0))
        azimuth, polar = np.radians(space.poses[seen, 1]), space.poses[seen, 0]
        dots = axes.scatter(azimuth, polar, c=shown, s=11, zorder=3, cmap="viridis", vmin=-8, vmax=0, linewidths=0)
        unsafe = (error[seen] > SAFE).mean()
        axes.set_title(
            f"{title}\nworst {error[seen].max():.1g}, above {SAFE:.0%}: {unsafe:.1%} of the poses", fontsize=11
        )
        axes.set_rlim(0, 90)  # ty: ignore[missing-attribute]
        axes.set_axisbelow(True)
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=TEXT)
    figure.colorbar(
        dots, ax=figure.axes, location="bottom", shrink=0.9,
        label="log10 relative error of the variance,\nfloat32 against float64",
    )  # fmt: skip
    figure.suptitle(
        "Where single precision is safe\nblank: nothing can be measured; radius: polar angle, degrees", fontsize=11
    )
    figure.savefig(path, dpi=160)
