"""How well a station measures each requirement, for a terminal: the table, the sentence, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.text import Text

from validation.report import cells, station_table
from validation.report.requirements import Grade, Requirement
from validation.report.wording import next_step, sentence, wrong

_WORDS = ("requirement", "measurement", "limited by")
_SHORT = ((str(Grade.OPEN), "no tolerance"),)
_UNITS = "tolerance, sigma, bias and U have the unit of the nominal value."


def report(found: Sequence[Requirement], title: str) -> Group:
    """The same as the first screen of a page, without its pictures."""
    columns = ("no.", *station_table.COLUMNS[1:])
    rows = (
        (str(line.number), line.cells[0], *map(_plain, line.cells[1:]))
        for line in station_table.lines(found, units=False)
    )
    table = cells.table(title, *columns, rows=rows, words=_WORDS, wrap=True)
    terms = _plain(f"{station_table.ABOVE} {station_table.note(found)} {station_table.GRADED}")
    lines = [Text(f" {terms} {_UNITS}"), Text(f"\n{sentence(found)}", style="bold")]
    lines += [Text(f"What is wrong: {line}") for line in wrong(found)]
    lines.append(Text(f"What to do next: {next_step(found)}"))
    return Group(table, *lines)


def _plain(cell: str) -> str:
    """In few letters, and in those that every terminal has."""
    for long, short in (("±", "+-"), ("°", " degrees"), ("²", "^2"), *_SHORT):
        cell = cell.replace(long, short)
    return cell
