"""What ``ice msa`` finds: the predicted study of a station, from its budget, and a real one beside it."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.budget import Budget
from planner.uncertainty.msa import Components, Study
from scenes import InvalidInput, Tolerance
from scenes.files.door import read_bytes

_MOST_BYTES = 64 << 20
_PLACED = ("part_shift", "part_tilt_deg")  # what a part that is laid in anew changes
_SET_UP = ("light", "exposure", "blur_px", "sigma", "dark_level", "temperature_K")  # from day to day, or by who sets up
_ROUNDED = ("rounding", "rounding_deg")


@dataclass(frozen=True)
class Predicted:
    """A measurand of a station as a study would find it: ``constant`` is the standard uncertainty that no study shows,
    for it stays the same in all of it."""

    name: str
    unit: str
    nominal: float
    tolerance: Tolerance | None
    components: Components
    constant: float
    status: str

    @property
    def width(self) -> float | None:
        """T, the tolerance's whole width."""
        return self.tolerance and self.tolerance.plus + self.tolerance.minus

    @property
    def u(self) -> float:
        """Combined standard uncertainty of one measurement."""
        return math.hypot(self.components.grr, self.constant)

    @property
    def cg(self) -> float | None:
        """0.2 T over six standard deviations of repeats; None without a tolerance, or without scatter."""
        spread = self.components.repeats
        return 0.2 * self.width / (6 * spread) if self.width and spread > 0 else None

    @property
    def cgk(self) -> float | None:
        """The same with a bias of one standard uncertainty of what stays the same: (0.1 T - bias) / (3 s)."""
        spread = self.components.repeats
        return (0.1 * self.width - self.constant) / (3 * spread) if self.width and spread > 0 else None


def predicted(found: SceneBudget, *, placed_once: bool = False) -> tuple[Predicted, ...]:
    """Of each measurand of a budget, by what differs from repeat to repeat, from operator to operator, or never.

    A repeat has its own noise, and unless the part is placed once for all repeats of an operator its own place in the
    fixture (``part_shift``, ``part_tilt_deg``). Operators differ by what is set up anew: lights' places, exposure,
    focus, noise, temperature. Camera, calibration and all else stay the same: they are in U, and in no study.
    """
    spread = found.picture.scene.uncertainty.process_sd
    return tuple(
        _predicted(found, m, each, None if each.unit == "degrees" else spread, placed_once)
        for m, each in enumerate(found)
    )


def _predicted(found: SceneBudget, m: int, each: Budget, spread: float | None, placed_once: bool) -> Predicted:
    told, zone = found.prediction.measurands[m], found.prediction.measurands[m].tolerance
    noise = math.hypot(each.repeatability, _part(each, _is(_ROUNDED)))
    placed, set_up = _part(each, _is(_PLACED)), _part(each, _is(_SET_UP))
    moved = noise**2 + placed**2 + set_up**2
    once, anew = (placed, noise) if placed_once else (0.0, math.hypot(noise, placed))
    return Predicted(
        each.name, each.unit, told.nominal, zone,
        Components(anew, once, set_up, spread), math.sqrt(max(each.u**2 - moved, 0.0)), found.statuses[m],
    )  # fmt: skip


def _is(names: tuple[str, ...]) -> Callable[[str], bool]:
    """Whether a source is one of some names, or of a component or a number of one of them: `part_shift.x`."""
    begins = tuple(f"{name}{sign}" for name in names for sign in ".[_")
    return lambda source: source in names or source.startswith(begins)


def _part(each: Budget, wanted: Callable[[str], bool]) -> float:
    """Of the contributions that are not noise."""
    rows = (row.contribution for row in each.contributions if row.kind != "noise" and wanted(row.source))
    return math.hypot(*rows)


def read(file: Path, names: tuple[str, ...]) -> dict[str, Study]:
    """A study of a CSV file, one row a measurement: columns ``operator``, ``part``, and one for each measurand.

    A file with one measurand may call its column ``value``. Repeats are rows of the same operator and part.

    Raises
    ------
    InvalidInput
        If a column is missing, a value is no number, or a cell has fewer repeats than the others.
    """
    text = read_bytes(file, _MOST_BYTES).decode("utf-8-sig", "replace")
    rows = list(csv.DictReader(text.splitlines()))
    columns = tuple(rows[0]) if rows else ()
    own = {name: name for name in names if name in columns}
    if not own and len(names) == 1 and "value" in columns:
        own = {names[0]: "value"}
    if not own or not {"operator", "part"} <= set(columns):
        raise InvalidInput(
            f"{file} must have the columns operator, part and one of {', '.join(names)}, got"
            f" {', '.join(columns) or 'none'}"
        )
    cells: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in rows:
        cells.setdefault((row["operator"], row["part"]), []).append(row)
    operators, parts = (list(dict.fromkeys(key[i] for key in cells)) for i in (0, 1))
    counts = {len(cells.get((o, p), ())) for o in operators for p in parts}
    if len(counts) != 1:
        raise InvalidInput(f"{file} must have each operator and part as often as the others, got {sorted(counts)} rows")
    return {
        name: Study(np.array([[[_number(file, column, row) for row in cells[o, p]] for p in parts] for o in operators]))
        for name, column in own.items()
    }


def _number(file: Path, column: str, row: dict[str, str]) -> float:
    try:
        return float(row[column])
    except (TypeError, ValueError):
        raise InvalidInput(f"{file}: {column} must be a number, got {row[column]!r}") from None
