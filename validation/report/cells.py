"""What all printed tables share: their looks, and numbers and poses in their cells."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

from rich.table import Table

from scenes import Tolerance
from scenes.pose import several

MODELS = {
    "calibrated": "the formula of camera, light, surface and noise (model calibrated)",
    "paper": "the paper's formula (model paper), which is right up to one factor",
    "bound": "what no unbiased measurement can beat (model bound)",
}
PLACES = "sensor, light: (angle from the vertical, azimuth), degrees."
PLACED = "camera, lamp: (angle from the vertical, azimuth), degrees."  # on pages, which have no options to name


def placed(heading: str) -> str:
    """A column's heading as a page says it, where nothing is a key.

    >>> placed("sensor"), placed("light"), placed("noise.sigma")
    ('camera', 'lamp', 'noise.sigma')
    """
    return {"sensor": "camera", "light": "lamp"}.get(heading, heading)


def table(
    title: str,
    *columns: str,
    rows: Iterable[Iterable[str]] = (),
    words: Iterable[str] = (),
    wrap: bool = False,
    **looks: Any,
) -> Table:
    """A table for a terminal: columns of numbers to the right, those of ``words`` to the left.

    Cells are broken where there is no room only with ``wrap``; ``looks`` are rich's.
    """
    made = Table(
        title=title, title_justify="left", title_style="bold", box=None, **{"caption_justify": "left", **looks}
    )
    for name in columns:
        made.add_column(name, justify="left" if name in words else "right", no_wrap=not wrap)
    for row in rows:
        made.add_row(*row)
    return made


def number(value: float | None, form: str = ".3g") -> str:
    """A number, "-" for none that is known.

    >>> number(0.12345), number(None), number(math.inf)
    ('0.123', '-', '-')
    """
    return "-" if value is None or not math.isfinite(value) else format(value, form)


def percent(part: float) -> str:
    """A part of one in per cent, two digits; from 1000 % on how many times.

    >>> percent(0.0871), percent(1.704), percent(12.34)
    ('8.7 %', '170 %', '12 x')
    """
    return f"{float(f'{100 * part:.2g}'):g} %" if part < 10 else f"{part:.2g} x"


def sigma(variance: float | None) -> str:
    """Standard deviation of a variance."""
    return number(variance if variance is None else math.sqrt(variance))


def pose(poses: Any) -> str:
    """A pose or a pair of numbers, or several, degrees, always to a tenth.

    >>> from scenes import Pose
    >>> pose(Pose(15, 315)), pose((15, 315)), pose([Pose(15, 315), Pose(60, 90)]), pose(())
    ('(15.0, 315.0)', '(15.0, 315.0)', '(15.0, 315.0) (60.0, 90.0)', '-')
    """
    return " ".join("({:.1f}, {:.1f})".format(*each) for each in several(poses)) or "-"


def name(told: str) -> str:
    """A requirement's name as a page shows it: a position's coordinates, NAME.x and NAME.y, without the point.

    >>> name("bore from sides.x"), name("slot 1.5")
    ('bore from sides, x', 'slot 1.5')
    """
    return re.sub(r"\.([xy])$", r", \1", told)


def united(number: str, unit: str) -> str:
    """A number as text with its unit, where there is a number.

    >>> united("0.02", "mm"), united("90", "degrees"), united("-", "mm"), united("4", "")
    ('0.02 mm', '90°', '-', '4')
    """
    if number == "-" or not unit:
        return number
    return f"{number}°" if unit == "degrees" else f"{number} {unit}"


def zone(tolerance: Tolerance | None) -> str:
    """A tolerance as on a drawing.

    >>> zone(Tolerance(plus=0.02, minus=0.02)), zone(Tolerance(plus=0.02, minus=0.0)), zone(None)
    ('±0.02', '+0.02 -0', '-')
    """
    if tolerance is None:
        return "-"
    if tolerance.plus == tolerance.minus:
        return f"±{tolerance.plus:g}"
    return f"+{tolerance.plus:g} -{tolerance.minus:g}"
