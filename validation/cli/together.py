"""``ice measure --together``: several pictures of a part as one measurement."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, cast

import numpy as np
import typer
from rich.table import Table

import scenes
from scenes.status import legend
from validation.cli.common import say
from validation.report import cells
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure
    from imaging.bundles.unknowns import Sensors


def measured(
    files: list[Path], images: list[np.ndarray], shown: list[scenes.Picture], sensors: str, estimator: str | None,
    *, as_json: bool,
) -> NoReturn:  # fmt: skip
    """Adjust the pictures together and say what they tell; exit status 1 where something could not be measured."""
    import measure

    shots = list(zip(images, shown, strict=True))
    found = measure.bundle(shots, cast("Sensors", sensors), estimator=estimator)
    rows = facts(found)
    if as_json:
        told = {"files": [str(file) for file in files], "measurands": rows, "covariance": plain(found.covariance)}
        say(told | {"p_value": float(found.p_value), "points": _points(found)}, True, "")
    else:
        console().print(table(rows, len(files)))
        for line in legend([row["status"] for row in rows], [row["reason"] for row in rows]):
            console().print(f" {line}", highlight=False)
    raise typer.Exit(0 if all(row["value"] is not None for row in rows) else 1)


def facts(found: measure.Bundled) -> list[dict[str, Any]]:
    """One record a measurand; null for what is not known."""
    rows = []
    for quantity, row, why in zip(found.quantities, found.as_rows(), found.reason, strict=True):
        zone = quantity.tolerance
        kept = {name: row[name] for name in ("name", "kind", "unit", "value", "sigma", "u_placed", "u", "nominal")}
        limits = zone and {"plus": zone.plus, "minus": zone.minus}
        rows.append({**kept, "tolerance": limits, "status": row["status"], "reason": why})
    return plain(rows)


def _points(found: measure.Bundled) -> list[dict[str, Any]]:
    return plain([{"name": name, "at": at} for name, at in zip(found.points, found.places, strict=True)])


def table(rows: list[dict[str, Any]], pictures: int) -> Table:
    """The same for a terminal."""
    columns = "name", "kind", "value", "sigma", "u", "unit", "nominal", "tolerance", "status"
    title, words = f"Measurands of {pictures} pictures together (+- u)", ("name", "kind", "unit")
    shown = cells.table(title, *columns, words=words, caption=_CAPTION)
    for row in rows:
        value = "-" if row["value"] is None else f"{row['value']:.6g}"
        sigma, u = ("-" if row[name] is None else f"{row[name]:.2g}" for name in ("sigma", "u"))
        zone = row["tolerance"]
        limits = "-" if zone is None else f"+{zone['plus']:g} -{zone['minus']:g}"
        about = row["name"], row["kind"], value, sigma, u, row["unit"]
        shown.add_row(*about, f"{row['nominal']:.6g}", limits, row["status"])
    return shown


_CAPTION = "sigma: by noise. u: also by what is not known before of part, sensors and camera. Biases are not taken off."
