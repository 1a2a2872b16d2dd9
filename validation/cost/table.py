"""The tables of a survey, for a terminal, and as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from validation.cost.parameter import Knob
from validation.cost.sweep import Survey


def tables(found: Survey) -> Group:
    """One table a knob, its slopes beside the theoretical ones below."""
    parts = [part for knob in found.knobs for part in (_table(knob), _below(knob))]
    parts += [Text(f"\n{name} left out: {reason}") for name, reason in found.omitted.items()]
    return Group(*parts, Text(f"\nMeasured in {found.seconds:.0f} s on {found.model.variant}."))


def write_csv(found: Survey, directory: Path) -> list[Path]:
    """One file a knob."""
    paths = []
    for knob in found.knobs:
        paths.append(directory / f"{knob.name}.csv")
        with paths[-1].open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([knob.columns, *knob.rows])
    return paths


def _table(knob: Knob) -> Table:
    made = Table(title=f"\n{knob.title}", title_justify="left", box=None, padding=(0, 1), title_style="bold")
    for name in knob.columns:
        made.add_column(name, justify="right")
    rows = [row for row in knob.rows if "front" not in knob.columns or row[-1]]  # the others are in the CSV
    for row in rows:
        made.add_row(*map(_cell, row))
    return made


def _below(knob: Knob) -> Text:
    lines = [
        f"  slope, {fit.what}: {fit.slope:+.2f}" + (f" (theory {fit.theory:+.2f})" if fit.theory is not None else "")
        for fit in knob.fits
    ]
    return Text("\n".join([*lines, *([f"  {knob.note}"] if knob.note else [])]))


def _cell(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
