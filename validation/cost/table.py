"""The tables of a sweep, for a terminal, and as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from validation.cost.parameter import Parameter
from validation.cost.sweep import Sweep
from validation.report.cells import table


def tables(found: Sweep) -> Group:
    """One table a parameter, its slopes beside the theoretical ones below."""
    parts = [part for parameter in found.parameters for part in (_table(parameter), _below(parameter))]
    parts += [Text(f"\n{name} left out: {reason}") for name, reason in found.omitted.items()]
    return Group(*parts, Text(f"\nMeasured in {found.seconds:.0f} s on {found.model.variant}."))


def write_csv(found: Sweep, directory: Path) -> list[Path]:
    """One file a parameter."""
    paths = []
    for parameter in found.parameters:
        paths.append(directory / f"{parameter.name}.csv")
        with paths[-1].open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([parameter.columns, *parameter.rows])
    return paths


def _table(parameter: Parameter) -> Table:
    rows = [row for row in parameter.rows if "front" not in parameter.columns or row[-1]]  # the others are in the CSV
    cells = [[f"{value:.3g}" if isinstance(value, float) else str(value) for value in row] for row in rows]
    return table(f"\n{parameter.title}", *parameter.columns, rows=cells, wrap=True)


def _below(parameter: Parameter) -> Text:
    lines = [
        f"  slope, {fit.what}: {fit.slope:+.2f}" + (f" (theory {fit.theory:+.2f})" if fit.theory is not None else "")
        for fit in parameter.fits
    ]
    return Text("\n".join([*lines, *([f"  {parameter.note}"] if parameter.note else [])]))
