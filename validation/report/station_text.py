"""How well a station measures each requirement, for a terminal: the table, the sentence, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.text import Text

from validation.report import cells, station_table
from validation.report.requirements import Requirement, next_step, sentence

_WORDS = ("requirement", "result", "limited by")


def report(found: Sequence[Requirement], title: str) -> Group:
    """The same as the first screen of a page, without its pictures."""
    columns = ("no.", *station_table.COLUMNS[1:])
    rows = ((str(line.number), *map(_plain, line.cells)) for line in station_table.lines(found))
    table = cells.table(title, *columns, rows=rows, words=_WORDS)
    lines = [Text(f" {_plain(station_table.NOTE)}"), Text(f"\n{sentence(found)}", style="bold")]
    if step := next_step(found):
        lines.append(Text(f"What to do next. {step}"))
    return Group(table, *lines)


def _plain(cell: str) -> str:
    """Letters that every terminal has."""
    return cell.replace("±", "+-").replace("°", " degrees")
