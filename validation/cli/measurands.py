"""The table of ``ice measure IMAGE SCENE``: each measurand with its uncertainty, and whether it keeps its tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from scenes.measurands.kinds import MEASURANDS
from scenes.status import CLUTTER, is_trusted
from validation.report import cells
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure
    from validation.inspection import Inspected, Inspection


def facts(inspected: Inspection) -> list[dict[str, Any]]:
    """One record a measurand, of one image; null for what is not known."""
    rows = []
    for k, row in enumerate(inspected.rows):
        found = inspected.found(row)
        quantity, combined, sigma_image = found.quantities[k], found.u, np.sqrt(np.diag(found.covariance_image))
        zone, value, spread, nominal = quantity.tolerance, found.value[k], found.sigma[k], float(found.nominal[k])
        state, good, known = str(found.status[k]), bool(np.isfinite(value)), bool(np.isfinite(combined[k]))
        rows.append({
            "name": quantity.name,
            "kind": quantity.kind,
            "unit": found.units[k],
            "value": value,
            "sigma": spread if good else None,
            "bias": found.bias[k] if good and known else None,
            "u_bias": found.u_bias[k] if good and known else None,
            "u": combined[k] if good and known else None,
            "value_image": found.value_image[k] if good else None,
            "sigma_image": sigma_image[k] if good else None,
            "nominal": nominal,
            "tolerance": zone and {"plus": zone.plus, "minus": zone.minus},
            "U": row.requirement.U,
            "decision": row.decision,
            "status": state,
            "estimator": found.estimator,
        } | _of_some(found, row, k, len(inspected.taken), good))  # fmt: skip
    return plain(rows)


def _of_some(found: measure.Measurements, row: Inspected, k: int, pictures: int, good: bool) -> dict[str, Any]:
    """What is told only of several pictures, and of a part whose place counts."""
    several = {"picture": row.picture} if pictures > 1 else {}
    if found.picture.scene.placement.is_known:
        return several
    return several | {"u_placed": found.u_placed[k] if good else None}


def zones(inspected: Inspection) -> list[dict[str, Any]]:
    """One record a geometric tolerance that several numbers, or all points, keep together; null for what is unknown."""
    return plain([each.facts for each in inspected.zones])


def reasons(rows: list[dict[str, Any]], inspected: Inspection) -> list[str]:
    """What decided each record's status, with its number; empty where it is ``ok``, or nothing more is known."""
    every = [_reasons(rows, each.found) for each in inspected.taken]
    return [every[row.picture - 1][m] for m, row in enumerate(inspected.rows)]


def _reasons(rows: list[dict[str, Any]], found: measure.Measurements) -> list[str]:
    """The same of one picture."""
    picture = found.picture
    if not picture.lights or all(is_trusted(row["status"]) for row in rows):
        return [""] * len(rows)
    import planner

    told = planner.predict(picture).measurands
    why = [each.why(row["status"], row["u_bias"], row["sigma"]) for each, row in zip(told, rows, strict=True)]
    if found.saturated > 0:
        cut = np.isinf(found.u_bias) & (found.status == CLUTTER)
        why = [_saturated(int(found.saturated)) if at else text for at, text in zip(cut, why, strict=True)]
    return [f"{row['name']}: {text}" if text else "" for row, text in zip(rows, why, strict=True)]


def _saturated(count: int) -> str:
    pixels = "1 pixel near the edges is" if count == 1 else f"{count} pixels near the edges are"
    return f"{pixels} at the end of the sensor's scale, not as in the simulation, whose bias is another one"


def by_others(inspected: Inspection) -> list[str]:
    """A line for each picture whose straight edges are measured by another estimator than the default one."""
    from measure import best_estimator

    told = [(found.estimator, best_estimator(found.picture)) for found in (each.found for each in inspected.taken)]
    of = [f" in picture {number}" for number in range(1, len(told) + 1)] if len(told) > 1 else [""]
    return [
        f"Straight edges{where} by {name}, which tells more of the values than {default} does."
        for where, (name, default) in zip(of, told, strict=True)
        if name != default
    ]


def covariance(inspected: Inspection) -> list[list[float | None]]:
    """Joint covariance of all values; null for what is not known."""
    return plain(inspected.covariance)


def table(rows: list[dict[str, Any]], zones: Sequence[dict[str, Any]] = ()) -> Table:
    """The same for a terminal, each zone in a row below its numbers, a form's instead of its number."""
    columns = (
        "name", "kind", "value", "u", "unit", "bias off", "u(bias)", "U", "nominal", "tolerance", "decision", "status",
    )  # fmt: skip
    caption = f"{_CAPTION} {_OF_ZONES}" if zones else _CAPTION
    shown = cells.table("Measurands (+- u)", *columns, words=("name", "kind", "unit"), caption=caption)
    after = {zone["parts"][-1]: zone for zone in zones}
    for row in rows:
        told = row["sigma"] if row["u"] is None else row["u"]
        places = digits(told)
        value = "-" if row["value"] is None else f"{row['value']:.{places}f}"
        sigma = "" if told is None else f"{told:.{places}f}"
        off = ["-" if row[name] is None else f"{row[name]:.2g}" for name in ("bias", "u_bias", "U")]
        nominal, zone = f"{row['nominal']:.6g}", row["tolerance"]
        limits = "-" if zone is None else _limits(zone)
        about = row["name"], row["kind"], value, sigma, row["unit"], *off
        if not MEASURANDS[row["kind"]].is_form:
            shown.add_row(*about, nominal, limits, _decision(row), row["status"])
            off = "-", "-", ""
        if row["name"] in after:
            shown.add_row(*_zone_cells(after[row["name"]], *off[:2]))
    return shown


def _zone_cells(zone: dict[str, Any], bias: str, u_bias: str) -> tuple[str, ...]:
    """A zone's row: the size that is needed, and what it is below in 95 %; of a form with the bias that is off."""
    if zone["value"] is None:
        value, below = "-", ""
    else:
        places = digits(zone["u"])
        value, below = f"{zone['value']:.{places}f}", f"<= {zone['at_most']:.{places}f}"
    size = "-" if zone["size"] is None else f"{zone['size']:g}"
    return (
        zone["name"], zone["kind"], value, "", zone["unit"], bias, u_bias, below, "0", size, zone["decision"] or "-",
        zone["status"],
    )  # fmt: skip


def _decision(row: dict[str, Any]) -> str:
    """With what an undecided value may be off by, where its bias is what keeps it from being decided."""
    if row["decision"] is None:
        return "-"
    if row["decision"] != "undecided" or is_trusted(row["status"]) or row["value"] is None:
        return row["decision"]
    from planner.uncertainty.conformity import COVERAGE  # slow to load, and rarely needed

    reach = "unknown" if row["u_bias"] is None else f"up to {COVERAGE * row['u_bias']:.1g}"
    return f"undecided (bias {reach})"


_CAPTION = (
    "value: with the bias taken off that a simulation of this picture tells (bias off). u(bias): standard uncertainty "
    "of that. u: combined standard uncertainty, of noise and u(bias); of noise alone where no light is given, or with "
    "--as-measured. U: expanded uncertainty (95 %) of all that the scene says is not exact; none where no light is "
    "given. pass, fail: by more than U within or beyond the tolerance (ISO 14253-1); only a value whose status is ok "
    "is decided."
)

_OF_ZONES = (
    "A geometric tolerance's row is the zone that its numbers need together, and what that is below in 95 %: its law "
    "is not normal near 0. It is decided by that law, a form by bounds, as surely as by 2 u; its numbers alone are "
    "not. Under the maximum material requirement its tolerance is the drawing's with what the measured size adds, "
    "which is in the law."
)


def digits(sigma: float | None) -> int:
    """Decimal places that show two digits of a standard deviation."""
    return 4 if not sigma else int(np.clip(1 - math.floor(math.log10(sigma)), 0, 9))


def _limits(zone: dict[str, float]) -> str:
    if zone["plus"] == zone["minus"]:
        return f"+-{zone['plus']:g}"
    return f"+{zone['plus']:g} -{zone['minus']:g}"
