"""The picture of a camera calibration: what the corners are off, enlarged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from measure.boards.camera import CameraCalibration
from measure.boards.chessboard import Board
from validation.report.canvas import plt

_LENGTH = 0.02  # of the image's width: the root mean square arrow
_MOST_NAMED = 10  # boards in the legend


def draw(found: CameraCalibration, boards: Sequence[Board], path: Path) -> Path:
    """Each corner's residual (measured less reprojected) as an arrow, one colour a board, as PNG."""
    height, width = found.image_shape
    factor = _round(_LENGTH * width / found.rms_px) if found.rms_px > 0 else 1.0
    figure, axis = plt.subplots(figsize=(9, 9 * height / width + 1.2), layout="constrained")
    for i, (board, left) in enumerate(zip(boards, found.residuals, strict=True)):
        label = f"board {i + 1}" if len(boards) <= _MOST_NAMED else None
        (x, y), (dx, dy) = board.corners.T, factor * left.T
        axis.quiver(x, y, dx, dy, angles="xy", scale_units="xy", scale=1, width=0.0015, color=f"C{i % 10}", label=label)
    axis.plot(found.lens.cx, found.lens.cy, "k+", ms=12)
    title = f"Residuals x {factor:g}: {found.rms_px:.4f} px rms, {found.status}, p = {found.p_value:.2g}; +: the axis"
    axis.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", xlabel="x, px", ylabel="y, px")
    axis.set_title(title, fontsize=10)
    if len(boards) <= _MOST_NAMED:
        axis.legend(frameon=False, fontsize=8, ncols=5, loc="upper center", bbox_to_anchor=(0.5, -0.08))
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


def _round(factor: float) -> float:
    """1, 2 or 5 times a power of ten, at most the factor."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1, 2, 5) if step * power <= factor * (1 + 1e-9)))
