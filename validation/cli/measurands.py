"""The table of ``ice measure IMAGE SCENE``: each measurand with its uncertainty, and whether it keeps its tolerance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from validation.report import cells
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure


def facts(found: measure.Measurements) -> list[dict[str, Any]]:
    """One record a measurand, of one image; null for what is not known."""
    from planner.uncertainty.conformity import decide

    rows, sigma_image = [], np.sqrt(np.einsum("mm->m", found.covariance_image))
    for k, quantity in enumerate(found.quantities):
        zone, value, spread, nominal = quantity.tolerance, found.value[k], found.sigma[k], float(found.nominal[k])
        state, good = str(found.status[k]), bool(np.isfinite(value))
        rows.append({
            "name": quantity.name,
            "kind": quantity.kind,
            "unit": found.units[k],
            "value": value,
            "sigma": spread if good else None,
            "value_image": found.value_image[k] if good else None,
            "sigma_image": sigma_image[k] if good else None,
            "nominal": nominal,
            "tolerance": zone and {"plus": zone.plus, "minus": zone.minus},
            "decision": zone and decide(float(value), float(spread), nominal, zone, status=state),
            "status": state,
        })  # fmt: skip
    return plain(rows)


def covariance(found: measure.Measurements) -> list[list[float | None]]:
    """Joint covariance of all values; null for what is not known."""
    return plain(found.covariance)


def table(rows: list[dict[str, Any]]) -> Table:
    """The same for a terminal."""
    columns = ("name", "kind", "value", "", "unit", "nominal", "tolerance", "decision", "status")
    shown = cells.table("Measurands (+- 1 sigma)", *columns, words=("name", "kind", "unit"), caption=_CAPTION)
    for row in rows:
        places = digits(row["sigma"])
        value = "-" if row["value"] is None else f"{row['value']:.{places}f}"
        sigma = "" if row["sigma"] is None else f"+- {row['sigma']:.{places}f}"
        nominal, zone = f"{row['nominal']:.6g}", row["tolerance"]
        limits = "-" if zone is None else _limits(zone)
        about = row["name"], row["kind"], value, sigma, row["unit"]
        shown.add_row(*about, nominal, limits, row["decision"] or "-", row["status"])
    return shown


_CAPTION = (
    "pass, fail: by more than the expanded uncertainty of 2 sigma within or beyond the tolerance (ISO 14253-1); only a "
    "value whose status is ok is decided."
)


def digits(sigma: float | None) -> int:
    """Decimal places that show two digits of a standard deviation."""
    return 4 if not sigma else int(np.clip(1 - math.floor(math.log10(sigma)), 0, 9))


def _limits(zone: dict[str, float]) -> str:
    if zone["plus"] == zone["minus"]:
        return f"+-{zone['plus']:g}"
    return f"+{zone['plus']:g} -{zone['minus']:g}"
