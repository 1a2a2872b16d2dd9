"""Edge spread, line spread and modulation transfer of a photograph's sides, drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from scenes import InvalidInput

if TYPE_CHECKING:
    from measure import EdgeResponse


def write(path: Path, sides: list[tuple[int, EdgeResponse]]) -> None:
    """Write the picture; the three curves side by side, one line for each (number, response).

    Raises
    ------
    InvalidInput
        If the file cannot be written as a PNG.
    """
    if path.suffix.lower() != ".png":
        raise InvalidInput(f"--mtf must end in .png, got {str(path)!r}")
    figure = Figure(figsize=(11, 3.4), layout="constrained")
    spread, line, transfer = figure.subplots(1, 3)
    for number, one in sides:
        name = f"side {number}, across {one.direction_deg:.0f}\N{DEGREE SIGN}"
        spread.plot(one.offset, one.spread, lw=1, label=name)
        line.plot(one.line_offset, one.line, lw=1)
        transfer.plot(one.frequency, one.mtf, lw=1)
    for axes, x, y in (
        (spread, "distance [px]", "edge spread"), (line, "distance [px]", "line spread [1/px]"),
        (transfer, "frequency [cycles/px]", "modulation transfer"),
    ):  # fmt: skip
        axes.set(xlabel=x, ylabel=y)
        axes.grid(alpha=0.3)
    spread.set_xlim(-5, 5)
    line.set_xlim(-5, 5)
    transfer.set(xlim=(0, 1), ylim=(0, 1.05))
    transfer.axvline(0.5, color="grey", lw=0.8, ls=":")
    if sides:
        spread.legend(fontsize=7)
    try:
        figure.savefig(path, dpi=110)
    except OSError as error:
        raise InvalidInput(f"--mtf must be a writable file, got {path} ({error.strerror})") from None
