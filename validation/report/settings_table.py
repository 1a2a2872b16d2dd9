"""All settings of a run, the best first: where camera and lamp stand, and what is not proven there."""

from __future__ import annotations

import heapq
import math

from scenes.status import MEANINGS, counted, is_trusted
from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.report.cells import PLACED, placed
from validation.report.cells import name as shown_name
from validation.report.page_tables import Table
from validation.report.run_cells import names
from validation.report.station import merit

_ROWS = 32  # table.csv has all


def table(found: Validation, halves: dict[str, float], chosen: int | None) -> Table:
    """The table; ``halves`` of the tolerance zones by name, ``chosen`` the number of the setting that is shown."""
    rows = heapq.nsmallest(_ROWS, found.rows, key=lambda row: (*merit(row, halves), row.index))
    headings, cells = names(found, rows)
    columns = ["setting", *map(placed, headings), "largest sigma", "proven", "not proven, by status"]
    lines = [[str(row.index + 1), *cells[row.index], _largest(row, halves), _proven(row), _doubtful(row)]
             for row in rows]  # fmt: skip
    note = f"The best {_ROWS} of {len(found.rows)}; all are in table.csv." if len(found.rows) > _ROWS else ""
    what = f"{PLACED} {_proof(rows)} " + (
        "largest sigma: of the requirement whose sigma is largest against its tolerance, in per cent of half the zone."
        if halves
        else f"largest sigma: of {shown_name(found.rows[0].measurands[0].name)}, one picture's; no tolerance is given."
    )
    where = next((i for i, row in enumerate(rows) if row.index + 1 == chosen), None)
    return Table("All settings, the best first", columns, lines, " ".join([what, note]).strip(), chosen=where)


def _largest(row: Row, halves: dict[str, float]) -> str:
    known = [(each.predicted**0.5 / halves[each.name], each.name) for each in row.measurands if each.name in halves]
    if known:
        part, name = max(known, key=lambda pair: round(pair[0], 9))
        return f"{100 * part:.2g} % ({shown_name(name)})"
    first = row.measurands[0]
    return f"{math.sqrt(first.predicted):#.3g} {first.unit}" if math.isfinite(first.predicted) else "-"


def _proof(rows: list[Row]) -> str:
    """What is proven in the table, and what each status that is not means."""
    told = "proven: value and sigma can be relied on (status ok), whatever the tolerance."
    states = dict.fromkeys(each.status for row in rows for each in row.measurands if not is_trusted(each.status))
    return " ".join([told, *(f"{state}: {MEANINGS[state]}." for state in states)])


def _proven(row: Row) -> str:
    return f"{sum(is_trusted(each.status) for each in row.measurands)} of {len(row.measurands)}"


def _doubtful(row: Row) -> str:
    """Statuses and their numbers."""
    return counted(each.status for each in row.measurands if not is_trusted(each.status)) or "-"
