"""What limits a designed station, and what one step more would buy, in words."""

from __future__ import annotations

import math

from planner.designing.outcome import Design, Offer
from validation.report.source_words import words

_NAMED = 3  # sources


def limits(offer: Offer) -> list[tuple[str, float]]:
    """Largest sources of the quantity that is nearest to what is allowed, and their shares of u_c^2."""
    if offer.close is None or not offer.close.budgets:
        return []
    found = offer.close.budgets[offer.close.worst]
    rows = sorted(found.contributions, key=lambda row: -row.share)[:_NAMED]
    return [(words(row.source), float(row.share)) for row in rows if row.share > 0]


def limiting(design: Design, offer: Offer) -> str:
    """Name of that quantity."""
    worst = offer.rated.worst if offer.close is None else offer.close.worst
    return design.problem.scene.quantities[worst].name


def u_over_t(design: Design, offer: Offer) -> float | None:
    """Worst U over half of the tolerance zone; None where a quantity is not measured."""
    quantities = design.problem.scene.quantities
    found = offer.rated.U if offer.close is None else [each.U for each in offer.close.budgets]
    if not math.isfinite(offer.ratio):
        return None
    pairs = zip(found, quantities, strict=True)
    return max(float(U) / each.tolerance.half for U, each in pairs if each.tolerance is not None)


def cost(design: Design, value: float, currency: str) -> str:
    """A cost with its unit."""
    return f"{value:.0f} {currency}".strip() if design.priced else f"{value:.3g} Mpx"


def step_more(design: Design, offer: Offer, currency: str) -> str:
    """What the next station of the front costs and gives; empty for the last."""
    more = [each for each in design.front if each.cost > offer.cost and each.ratio < offer.ratio]
    if not more:
        return ""
    other = more[0]
    changed = [b for a, b in zip(offer.rated.names, other.rated.names, strict=True) if a != b]
    return (
        f"one step more: {cost(design, other.cost - offer.cost, currency)} for {' and '.join(changed)} makes the worst"
        f" U / T {u_over_t(design, other):.3g} instead of {u_over_t(design, offer):.3g}"
    )


def left_out(design: Design) -> list[str]:
    """What was left out by what, a line a table."""
    found = design.searched
    lines = [
        f"{name}: {total} in the catalogue{_by(found.left_out[name])}"
        for name, total in (("sensors", found.sensors), ("lenses", found.lenses), ("lights", found.lights))
    ]
    lines.append(f"pairs of sensor and lens: {found.pairs}{_by(found.pairs_left_out)}")
    lines.append(
        f"of {found.combinations:,} combinations {found.views} pairs were looked at from their places,"
        f" {found.rated} with a light, {found.close} closely"
    )
    return lines


def _by(counts: dict[str, int]) -> str:
    return f"; left out by {', '.join(f'{why} {count}' for why, count in counts.items())}" if counts else ""
