"""The cells of the table of requirements: a line each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from validation.report import cells
from validation.report.budget_table import decimals
from validation.report.grades import LOOKS, Look
from validation.report.page_tables import Table
from validation.report.requirements import HALF, WELL, Grade, Requirement

_DATUMS = ((", x", "first"), (", y", "second"))  # how names of coordinates end, and the edges they are counted from
COLUMNS = (
    "", "requirement", "nominal", "tolerance", "sigma", "bias", "U", "U / half zone", "measurement", "limited by",
)  # fmt: skip
PART = f"U / half zone: U over {HALF} (of ±0.02 mm: over 0.02 mm)."
ABOVE = f"U: expanded uncertainty (95 %). {PART}"
GRADED = f"Up to {100 * WELL:.0f} % of {HALF} a measurement is precise enough, up to 100 % usable."
NOTE = (
    "sigma: standard deviation of one picture's value, by noise. bias: mean error that is left after the simulated "
    "correction (all of it where none was made), ± standard uncertainty of the correction, which is part of U. "
    "limited by: what adds most to U, and its share of U²."
)


@dataclass(frozen=True)
class Line:
    """A requirement as text; ``part`` is U over half of the tolerance zone, for the bar, at most 1; ``fails``: as of
    its grade; ``about`` what its name does not say, empty where that is nothing."""

    number: int
    look: Look
    cells: tuple[str, ...]
    part: float | None
    fails: bool
    about: str = ""


def lines(found: Sequence[Requirement], *, units: bool = True) -> list[Line]:
    """One a requirement, those that fail first; ``cells`` from its name on, as `COLUMNS`, each with its unit, or with
    ``units`` off the nominal value alone."""
    worst = [each for grade in (Grade.MISSING, Grade.DOUBT, Grade.OVER) for each in found if each.grade == grade]
    return [
        Line(each.number, LOOKS[each.grade], _cells(each, each.unit if units else ""),
             None if each.ratio is None else min(each.ratio, 1.0), each.grade.fails, _about(each))
        for each in (*worst, *(each for each in found if not each.grade.fails))
    ]  # fmt: skip


def note(found: Sequence[Requirement], terms: str = NOTE) -> str:
    """What the columns mean, and the names and the order of the rows where these need it."""
    told = [terms]
    if any(each.title != each.name for each in found):
        told.append("x, y: distances of a position from its first and its second datum edge.")
    fails = [each.grade.fails for each in found]
    if fails != sorted(fails, reverse=True):
        told.append("What fails comes first.")
    return " ".join(told)


def table(found: Sequence[Requirement]) -> Table:
    """The same for Markdown."""
    rows = [[str(line.number), *line.cells] for line in lines(found)]
    return Table("Requirements", ["no.", *COLUMNS[1:]], rows, f"{ABOVE} {note(found)}")


def _cells(each: Requirement, unit: str) -> tuple[str, ...]:
    places = decimals(each.sigma) if math.isfinite(each.sigma) else 3
    part = "-" if each.ratio is None else cells.percent(each.ratio)
    doubtful = each.grade in (Grade.MISSING, Grade.DOUBT)
    sigma = "-" if not math.isfinite(each.sigma) else f"{each.sigma:.{places}f}"
    whole = "-" if each.U is None or doubtful else f"{each.U:.{_places(each.U, each.ratio is not None)}f}"
    return (
        each.title, cells.united(f"{each.nominal:.6g}", each.unit), cells.united(cells.zone(each.tolerance), unit),
        cells.united(sigma, unit), _bias(each, places, unit), cells.united(whole, unit),
        part, f"{each.grade}: {each.status}" if doubtful else str(each.grade), each.limits or "-",
    )  # fmt: skip


def _places(U: float, compared: bool) -> int:
    """Decimal places of U: two digits, and a third where its ratio to the tolerance, which has two, stands beside it.

    >>> _places(0.00134, True), _places(0.00134, False), _places(13.4, True), _places(134.0, True)
    (5, 4, 1, 0)
    """
    return decimals(U) + (compared and U < 100)


def _about(each: Requirement) -> str:
    """What a coordinate of a position is counted from."""
    return next((f"distance from its {which} datum edge" for axis, which in _DATUMS if each.title.endswith(axis)), "")


def _bias(each: Requirement, places: int, unit: str = "") -> str:
    """With its standard uncertainty, to two digits of that, the unit once at the end; ``places`` those of sigma, which
    nothing has more than one more of."""
    if each.bias is None:
        return "not known"
    if each.u_bias and math.isfinite(each.u_bias):
        places = min(decimals(each.u_bias), places + 1)
    told = f"{each.bias:+.{places}f}"
    told = "0" if float(told) == 0 else told
    if each.u_bias is None:
        return cells.united(told, unit)
    if not math.isfinite(each.u_bias):
        return f"{cells.united(told, unit)} ± not known"
    beside = f"{each.u_bias:.{places}f}"
    if float(beside) == 0:
        return f"{told}, ± less than {cells.united(f'{10**-places:.{places}f}', unit)}"
    return f"{told} ± {cells.united(beside, unit)}"
