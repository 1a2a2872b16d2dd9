"""The cells of the table of requirements: a line each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scenes.status import MEANINGS
from validation.report import cells
from validation.report.budget_table import decimals
from validation.report.grades import LOOKS, Look
from validation.report.page_tables import Table
from validation.report.requirements import Grade, Requirement

COLUMNS = ("", "requirement", "nominal", "tolerance", "sigma", "bias", "U", "U / tolerance", "result", "limited by")
NOTE = (
    "sigma: standard deviation of one picture's value, by noise. bias: mean error that is left, ± what its correction "
    "is not sure of. U: expanded uncertainty, 95 %. tolerance: how far the value may lie from the nominal one; U is "
    "compared with half of the whole zone."
)


@dataclass(frozen=True)
class Line:
    """A requirement as text; ``part`` is U over half of the tolerance zone, for the bar, at most 1."""

    number: int
    look: Look
    cells: tuple[str, ...]
    part: float | None
    why: str


def lines(found: Sequence[Requirement]) -> list[Line]:
    """One a requirement; ``cells`` from its name on, as `COLUMNS`."""
    return [
        Line(each.number, LOOKS[each.grade], _cells(each), None if each.ratio is None else min(each.ratio, 1.0),
             MEANINGS[each.status] if each.grade == Grade.DOUBT else "")
        for each in found
    ]  # fmt: skip


def table(found: Sequence[Requirement]) -> Table:
    """The same for Markdown."""
    rows = [[str(line.number), *line.cells] for line in lines(found)]
    return Table("Requirements", ["no.", *COLUMNS[1:]], rows, NOTE)


def _cells(each: Requirement) -> tuple[str, ...]:
    places = decimals(each.sigma) if math.isfinite(each.sigma) else 3
    part = "-" if each.ratio is None else cells.percent(each.ratio)
    result = f"{each.grade}: {each.status}" if each.grade == Grade.DOUBT else str(each.grade)
    return (
        each.name, _nominal(each), cells.zone(each.tolerance),
        "-" if not math.isfinite(each.sigma) else f"{each.sigma:.{places}f}",
        _bias(each, places), "-" if each.U is None or each.grade == Grade.DOUBT else f"{each.U:.{decimals(each.U)}f}",
        part, result, each.limits or "-",
    )  # fmt: skip


def _nominal(each: Requirement) -> str:
    return f"{each.nominal:.6g}" + ("°" if each.unit == "degrees" else f" {each.unit}")


def _bias(each: Requirement, places: int) -> str:
    if each.bias is None:
        return "not known"
    told = f"{each.bias:+.{places}f}"
    told = "0" if float(told) == 0 else told
    if each.u_bias is None:
        return told
    if not math.isfinite(each.u_bias):
        return f"{told} ± not known"
    beside = f"{each.u_bias:.{places}f}"
    return f"{told}, ± less than {10**-places:.{places}f}" if float(beside) == 0 else f"{told} ± {beside}"
