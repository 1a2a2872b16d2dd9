"""Where the uncertainty of each measurand at a state comes from: U against its tolerance, by source."""

from __future__ import annotations

import math
from typing import Any

from planner.uncertainty.budget import Budget
from scenes import Scene
from validation.explore.state import State
from validation.report import source_words
from validation.report.requirements import measurable_budget

_NAMED = 3  # sources; the others are put together
_LEAST = 0.005  # of the variance: what adds less is with the others


def rows(scene: Scene, state: State) -> list[dict[str, Any]]:
    """One a measurand: its U (95 %) in the object, over half of its tolerance zone, and the largest sources' parts.

    ``parts`` are pairs of a source, in words, and its share of the variance, which add up to 1; ``U`` and ``ratio`` are
    None, and there are no parts, where it cannot be measured, ``ratio`` without a tolerance.
    """
    found = measurable_budget(state.picture(scene), biased=True)  # by the locator whose sigma the page shows
    known = {} if found is None else {each.name: each for each in found}
    return [_row(quantity, known.get(quantity.name)) for quantity in scene.quantities]


def _row(quantity: Any, found: Budget | None) -> dict[str, Any]:
    if found is None or not math.isfinite(found.U):
        return {"name": quantity.name, "unit": "", "U": None, "ratio": None, "parts": []}
    shares = sorted(((row.share, row.source) for row in found.contributions), key=lambda s: (-round(s[0], 9), s[1]))
    parts = [[source_words.words(source), share] for share, source in shares[:_NAMED] if share >= _LEAST]
    left = 1 - sum(share for _, share in parts)
    return {
        "name": quantity.name,
        "unit": found.unit,
        "U": found.U,
        "ratio": found.U / quantity.tolerance.half if quantity.tolerance else None,
        "parts": parts + ([["all others", left]] if left >= _LEAST else []),
    }
