"""What ``ice measure PHOTO`` says: as JSON, and as text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from scenes import InvalidInput
from scenes.results import picked
from scenes.status import legend
from validation.cli import recorded
from validation.cli.measurands import digits
from validation.report import cells
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure


_STANDING_OUT = ("score", "support", "contrast")


def numbers(option: str, text: str | None, count: int) -> tuple[float, ...] | None:
    """So many numbers with commas between.

    Raises
    ------
    InvalidInput
        If they are not.
    """
    if text is None:
        return None
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise InvalidInput(f"{option} must be {count} numbers with commas between, px, got {text!r}")
    return found


def facts(found: measure.Shapes) -> dict[str, Any]:
    """What was measured, and the shapes that were found; null for what is not known."""
    return plain({
        "found": [_facts(one) for one in found.found],
        "candidates": [
            {"kind": one.kind, "outline": one.outline.tolist(), **picked(one, *_STANDING_OUT)}
            for one in found.candidates
        ],
    })  # fmt: skip


def _facts(one: measure.MeasuredShape) -> dict[str, Any]:
    told: dict[str, Any] = {"kind": one.kind, "status": one.status}
    if one.candidate is not None and one.candidate.identifier is not None:
        told |= {"id": one.candidate.identifier, "family": one.candidate.family}
    if one.candidate is not None and one.candidate.grid is not None:
        told["shape"] = [one.candidate.grid.shape[1], one.candidate.grid.shape[0]]
    if one.kind in ("circle", "ellipse"):
        shape = None if one.ellipse is None else one.ellipse.tolist()
        told |= {"centre": shape and shape[:2], "axes": shape and shape[2:4], "angle": shape and shape[4]}
    else:
        told["corners"] = one.corners
        told["sides"] = _sides(one)
    return told | {
        "covariance": one.covariance,
        "quantities": [vars(quantity) for quantity in one.quantities],
        "residual_px": [side.rms for side in one.residuals],
        **picked(one, "p_value", "noise", "blur_px"),
        **({} if one.quadrilateral is None else recorded.of_sides(one.quadrilateral)),
        **({} if one.candidate is None else picked(one.candidate, *_STANDING_OUT)),
    }


def _sides(one: measure.MeasuredShape) -> list[dict[str, Any]]:
    sides = [quantity for quantity in one.quantities if quantity.name.startswith("side")]
    rms: list[float | None] = [side.rms for side in one.residuals] or [None] * len(sides)
    return [vars(side) | {"residual_px": each} for side, each in zip(sides, rms, strict=True)]


def text(found: measure.Shapes) -> str:
    """Each shape that was measured."""
    lines = [_text(number, one) for number, one in enumerate(found.found, 1)]
    if any(one.measured for one in found.found):
        lines.append(_TERMS)
    if any(math.isfinite(one.p_value) for one in found.found):
        lines.append(of_fit())
    return "\n".join(lines + legend(one.status for one in found.found))


def fit(p_value: float) -> str:
    """Goodness of fit beside a status; empty where it is not known."""
    return f" (goodness of fit: p = {p_value:.2g})" if math.isfinite(p_value) else ""


def of_fit() -> str:
    """What a goodness of fit is."""
    from measure.goodness import WORST

    return (
        "p: how likely so bad a fit is by chance if the picture is as the model says; below "
        f"{WORST:g} the status is misfit or a worse one."
    )


def _beside(sigma: float, places: int) -> str:
    return f"+- {sigma:.{places}f}" if math.isfinite(sigma) else "+- unknown"


def _text(number: int, one: measure.MeasuredShape) -> str:
    name = one.kind if one.kind != "tag" else f"tag {one.candidate.family} {one.candidate.identifier}"
    seen = f"noise {one.noise:.2f} grey levels, blur {one.blur_px:.2f} px"
    if one.kind == "chessboard":
        return f"{number}. {name}: {_board(one)}; {seen}{fit(one.p_value)}"
    lines = [f"{number}. {name}: {one.status}; {seen}{fit(one.p_value)}"]
    lines += [f"   {line}" for line in recorded.of_sides_lines(one.quadrilateral)] if one.quadrilateral else []
    if one.corners is not None and one.covariance is not None:
        sigma = np.sqrt(np.diag(one.covariance)).reshape(4, 2)
        for i, ((x, y), (sx, sy)) in enumerate(zip(one.corners, sigma, strict=True), 1):
            lines.append(f"   corner {i:<12} ({x:.3f} {_beside(sx, 3)}, {y:.3f} {_beside(sy, 3)}) px")
    for q in one.quantities:
        places = max(digits(q.sigma), 3) if math.isfinite(q.sigma) else 3
        lines.append(f"   {q.name:<19} {q.value:.{places}f} {_beside(q.sigma, places)} {q.unit}")
    return "\n".join(lines)


def _board(one: measure.MeasuredShape) -> str:
    rows, columns = one.candidate.grid.shape[:2]
    told = f"{one.status}, {columns} x {rows} inner corners"
    if one.corners is None:
        return told
    sigma = np.sqrt(np.diag(one.covariance))
    return f"{told}, {np.isfinite(sigma[::2]).sum()} measured to {np.nanmedian(sigma):.3f} px (median); --json has them"


def table(found: measure.Shapes) -> Table:
    """All shapes that were found, ranked."""
    measured = {id(one.candidate): number for number, one in enumerate(found.found, 1)}
    columns = ("kind", "at px", "size px", "support", "contrast/noise", "score", "measured as")
    shown = cells.table("Found", *columns, words=("kind",), caption=_CAPTION)
    for one in found.candidates[:_ROWS]:
        (x, y), (long, short) = one.centre, one.sizes
        shown.add_row(
            one.kind, f"{x:.0f}, {y:.0f}", f"{long:.0f} x {short:.0f}", f"{one.support:.0%}", f"{one.contrast:.1f}",
            f"{one.score:.0f}", str(measured.get(id(one), "-")),
        )  # fmt: skip
    if len(found.candidates) > _ROWS:
        shown.add_row(f"and {len(found.candidates) - _ROWS} more", *[""] * 6)
    return shown


_ROWS = 30
_CAPTION = (
    "at: middle of the shape, x, y. support: part of the outline (of the worst side) with an edge. contrast/noise: of "
    "its edges, in sigmas. score: signal to noise ratio of the whole outline; the highest are measured (--most, --all)."
)
_TERMS = "+-: standard deviation by noise (1 sigma). Places: x, y from the middle of the upper left pixel."
