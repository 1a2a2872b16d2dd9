"""The picture of a calibration: the paper's Fig. 1 with ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from measure.calibration import Calibration
from validation.report.canvas import WIDTH, legend_below, plt, save

_MARKS = "os^vDP"  # told apart in grey as well


def draw(found: Calibration, path: Path) -> Path:
    """Standard deviation of an edge point against noise / contrast, log-log, as PNG."""
    figure, axis = plt.subplots(figsize=(WIDTH, 6.4), layout="constrained")
    for k, curve in enumerate(found.curves):
        good = np.isfinite(curve.sigma_px)
        label = f"{curve.name}: κ² {curve.kappa2:.2f}, correlated over {curve.correlation_px:.1f} px"
        axis.plot(curve.ratios[good], curve.sigma_px[good], f"C{k}{_MARKS[k % len(_MARKS)]}", ms=5, label=label)
        axis.plot(curve.ratios, np.hypot(curve.floor_px, np.sqrt(curve.kappa2) * curve.ratios), f"C{k}-", lw=0.8)
        if np.isfinite(curve.linear_to) and curve.linear_to < curve.ratios[-1]:
            axis.axvline(curve.linear_to, color=f"C{k}", ls=":", lw=1)
    ratios = np.array([found.curves[0].ratios[0], found.curves[0].ratios[-1]])
    paper = f"the paper: κ² {found.paper_kappa2}"
    axis.plot(ratios, np.sqrt(found.paper_kappa2) * ratios, "k--", lw=1, label=paper)
    bound = found.bound / found.closed_correlation_px
    axis.plot(ratios, np.sqrt(bound) * ratios, "k-", lw=1, label=f"Cramer-Rao bound, correlated alike: {bound:.2f}")
    axis.set(
        xscale="log", yscale="log", xlabel="noise / contrast", ylabel="standard deviation of an edge point, px",
        title=f"{found.scene}: blur {found.blur_px:g} px, smoothing {found.scale_px:g} px\n(dotted: linearity ends)",
    )  # fmt: skip
    axis.title.set_fontsize(11)
    legend_below(axis)
    return save(figure, path)
