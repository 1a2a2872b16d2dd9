"""``ice measure --together``: several pictures of a part as one measurement."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, cast

import numpy as np
import typer
from rich.table import Table

import scenes
from scenes.status import CLUTTER, legend, unsure
from validation.cli import placement
from validation.cli.common import progress, say
from validation.report import cells
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure
    from imaging.bundles.unknowns import Sensors
    from validation.bundles import InspectedBundle


def measured(
    files: list[Path], images: list[np.ndarray], shown: list[scenes.Picture], sensors: str, estimator: str | None,
    *, correct: bool, as_json: bool,
) -> NoReturn:  # fmt: skip
    """Adjust the pictures together and say what they tell; exit status 1 where something could not be measured."""
    from validation import bundles

    shots = list(zip(images, shown, strict=True))
    with progress("simulating the pictures for their biases", "renders", at_once=True):
        inspected = bundles.inspect(shots, cast("Sensors", sensors), estimator, correct=correct)
    found, rows = inspected.found, facts(inspected)
    if as_json:
        told = {"files": [str(file) for file in files], "measurands": rows, "covariance": plain(found.covariance)}
        told |= {"placement": placement.of_place(found.pictures[0].scene, found.placement, found.u_placement)}
        say(told | {"p_value": float(found.p_value), "points": _points(found)}, True, "")
    else:
        console().print(table(rows, len(files)))
        for line in legend([row["status"] for row in rows], [row["reason"] for row in rows]):
            console().print(f" {line}", highlight=False)
        where = placement.where(found.pictures[0].scene, found.placement, found.u_placement)
        console().print(f"{where}.", highlight=False)
    raise typer.Exit(0 if all(row["value"] is not None for row in rows) else 1)


def facts(inspected: InspectedBundle) -> list[dict[str, Any]]:
    """One record a measurand; null for what is not known."""
    found, rows = inspected.found, []
    keys = "name", "kind", "unit", "value", "sigma", "u_placed", "u_bias", "u", "nominal"
    for m, (quantity, row) in enumerate(zip(found.quantities, found.as_rows(), strict=True)):
        zone, good = quantity.tolerance, row["value"] is not None and np.isfinite(found.u_bias[m])
        limits = zone and {"plus": zone.plus, "minus": zone.minus}
        told = {"bias": found.bias[m] if good else None, "tolerance": limits, "U": inspected.U[m]}
        decided = {"decision": inspected.decisions[m], "status": row["status"], "reason": _reason(inspected, m)}
        rows.append({name: row[name] for name in keys} | told | decided)
    return plain(rows)


def _reason(inspected: InspectedBundle, m: int) -> str:
    """Why a value is not told, or not relied on although its bias is taken off."""
    found, quantity = inspected.found, inspected.found.quantities[m]
    if found.reason[m] or found.status[m] != CLUTTER or np.isnan(found.u_bias[m]):
        return found.reason[m]
    half = 0.0 if quantity.tolerance is None else quantity.tolerance.half
    return f"{quantity.name}: {unsure(float(found.u_bias[m]), float(found.sigma[m]), half, found.units[m])}"


def _points(found: measure.Bundled) -> list[dict[str, Any]]:
    return plain([{"name": name, "at": at} for name, at in zip(found.points, found.places, strict=True)])


def table(rows: list[dict[str, Any]], pictures: int) -> Table:
    """The same for a terminal."""
    columns = "name", "kind", "value", "sigma", "u_bias", "u", "U", "unit", "nominal", "tolerance", "decision", "status"
    title, words = f"Measurands of {pictures} pictures together (+- u)", ("name", "kind", "unit", "decision")
    shown = cells.table(title, *columns, words=words, caption=_CAPTION)
    for row in rows:
        value = "-" if row["value"] is None else f"{row['value']:.6g}"
        spread = ("-" if row[name] is None else f"{row[name]:.2g}" for name in ("sigma", "u_bias", "u", "U"))
        zone = row["tolerance"]
        limits = "-" if zone is None else f"+{zone['plus']:g} -{zone['minus']:g}"
        about = row["name"], row["kind"], value, *spread, row["unit"]
        shown.add_row(*about, f"{row['nominal']:.6g}", limits, row["decision"] or "-", row["status"])
    return shown


_CAPTION = (
    "sigma: by noise. u_bias: of the correction of biases. u: both, and what is not known before of part, sensors and "
    "camera. U: 95 %, of all that the scene says."
)
