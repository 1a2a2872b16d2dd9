"""How often does a stated interval hold the true value? Of simulated stations, drawn as the scene says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from imaging.light.appearance import is_plain
from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.groups import draw
from scenes.status import is_trusted
from validation.chain import Chain

PICTURES = "a picture of each draw by the closed form of plain scenes"
CLOSED = "closed form, second order in the inputs"


@dataclass(frozen=True)
class Coverage:
    """Of one measurand, over simulated stations.

    Attributes
    ----------
    name, unit : str
    stated : float
        Coverage probability of the stated interval, value +- U.
    mean, sigma : float
        Of the values, and their standard deviation (not variance), of the unit; ``u`` is the stated one.
    held : float
        Part of the values whose interval holds the true one, with its interval ``low`` to ``high`` (95 %, Clopper and
        Pearson 1934).
    n, failed, warned : int
        Stations with a value, without one, and with a status that is not trusted.
    status : str
        Of the budget.
    """

    name: str
    unit: str
    stated: float
    mean: float
    sigma: float
    u: float
    true: float
    held: float
    low: float
    high: float
    n: int
    failed: int
    warned: int
    status: str

    @property
    def holds(self) -> bool:
        """Whether the stated probability is not above what was found beyond chance: an interval may be too wide, and
        is then safe."""
        return self.high >= self.stated


def pictured(
    found: SceneBudget,
    count: int,
    seed: int,
    estimator: str | None = None,
    report: Callable[[int], None] = lambda done: None,
) -> tuple[Coverage, ...]:
    """Of stations of which one noisy picture each is measured by who believes the scene; plain scenes only.

    Raises
    ------
    InvalidInput
        If the scene is not one convex body before darkness.
    """
    values, states = Chain(found).pictured(np.random.default_rng(seed), count, estimator, report)
    return tuple(_of(found, m, values[:, m], states[:, m]) for m in range(len(found.measurands)))


def drawn(found: SceneBudget, count: int, seed: int) -> tuple[Coverage, ...]:
    """Of drawn inputs, evaluated in closed form to second order, noise and what else is added as drawn; any scene."""
    chain, streams = Chain(found), np.random.SeedSequence(seed).spawn(len(found.measurands))
    rows = []
    for m, (each, stream) in enumerate(zip(found, streams, strict=True)):
        values = chain.model(m)(draw(each.sources, np.random.default_rng(stream), count))
        rows.append(_of(found, m, values, np.full(count, found.statuses[m])))
    return tuple(rows)


def simulated(
    found: SceneBudget, count: int, seed: int, report: Callable[[int], None] = lambda done: None
) -> tuple[str, tuple[Coverage, ...]]:
    """By pictures where there is a closed form of them, else by the closed form of the values; which, and what."""
    if is_plain(found.picture.scene):
        return PICTURES, pictured(found, count, seed, report=report)
    return CLOSED, drawn(found, count, seed)


def _of(found: SceneBudget, m: int, values: np.ndarray, states: np.ndarray) -> Coverage:
    each, good = found.measurands[m], values[np.isfinite(values)]
    held = int((np.abs(good - each.value) <= each.U).sum())
    low, high = stats.binomtest(held, good.size).proportion_ci(0.95) if good.size else (0.0, 1.0)
    return Coverage(
        each.name, each.unit, each.p, float(good.mean()) if good.size else np.nan,
        float(good.std(ddof=1)) if good.size > 1 else np.nan, each.u, each.value, held / max(good.size, 1),
        float(low), float(high), good.size, values.size - good.size, int((~is_trusted(states)).sum()),
        found.statuses[m],
    )  # fmt: skip
