"""``python -m tests.proofs msa``: is a study as its analysis says, and does the guard band of least cost cost least?

Studies are drawn whose components are known. Of each component the stated 95 % interval has to hold the true ratio in
95 % of the studies, a study as predicted may be called otherwise in 1 % of them, and a component that is twice as large
as predicted has to be named as often as is told, by the smallest study that is told to name each, too. Guard bands:
parts and measurements are drawn, and the cost of wrong decisions counted.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from typing import Annotated

import numpy as np
import typer
from scipy import stats

from planner.uncertainty.msa import (
    COMPONENTS,
    Components,
    Study,
    cheapest_guard,
    check,
    found_by,
    smallest_study,
    too_large,
)
from planner.uncertainty.risks import Limits

TOLD = Components(1.0, 0.5, 0.8, 4.0)
FIELDS = dict(zip(COMPONENTS, ("repeats", "both", "operators", "parts"), strict=True))
_SURE = 0.001  # significance of all comparisons with chance


def study(rng: np.random.Generator, told: Components, shape: tuple[int, int, int]) -> Study:
    """A study of (operators, parts, repeats), its effects drawn."""
    o, p, r = shape
    sizes = ((told.repeats, (o, p, r)), (told.both, (o, p, 1)), (told.operators, (o, 1, 1)), (told.parts, (1, p, 1)))
    return Study(sum((sigma * rng.standard_normal(size) for sigma, size in sizes), np.zeros(shape)))


def calibrated(count: int, seed: int, shape: tuple[int, int, int]) -> dict[str, float]:
    """Part of so many studies whose interval holds the truth, by component, and of those called otherwise."""
    rng = np.random.default_rng(seed)
    rows = [check(study(rng, TOLD, shape), TOLD) for _ in range(count)]
    held = {name: np.mean([row[k].low <= 1 <= row[k].high for row in rows]) for k, name in enumerate(COMPONENTS)}
    called = np.mean([bool(too_large(row)) for row in rows])
    return {**{name: float(part) for name, part in held.items()}, "called": float(called)}


def found(count: int, seed: int, shape: tuple[int, int, int], times: float = 2.0) -> dict[str, float]:
    """Part of so many studies in which a component that many times as large is named, by component."""
    rng, rates = np.random.default_rng(seed), {}
    for name, field in FIELDS.items():
        wrong = replace(TOLD, **{field: times * getattr(TOLD, field)})
        named = [too_large(check(study(rng, wrong, shape), TOLD)) for _ in range(count)]
        rates[name] = float(np.mean([name in each for each in named]))
    return rates


def cost(width: float, limits: Limits, costs: tuple[float, float], parts: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """What wrong decisions on drawn parts cost, each (n,), of a guard band."""
    good = (limits.lower <= parts) & (parts <= limits.upper)
    passed = (limits.lower + width <= seen) & (seen <= limits.upper - width)
    return costs[0] * (passed & ~good) + costs[1] * (good & ~passed)


def guard(draws: int, seed: int, mean: float, u: float, costs: tuple[float, float]) -> dict[str, float]:
    """The guard band of least cost of a process of spread 1 within +-2: its cost told, and drawn with its standard
    error; by how many standard errors wider and narrower ones cost more (the least of them)."""
    rng, limits = np.random.default_rng(seed), Limits(-2.0, 2.0)
    told = cheapest_guard(mean, 1.0, u, limits, *costs)
    parts = mean + rng.standard_normal(draws)
    seen = parts + u * rng.standard_normal(draws)
    here = cost(told.width, limits, costs, parts, seen)
    more = []
    for other in (told.width - u / 2, told.width + u / 2):
        difference = cost(other, limits, costs, parts, seen) - here
        more.append(float(difference.mean() / (difference.std() / np.sqrt(draws))))
    error = float(here.std() / np.sqrt(draws))
    return {"width": told.width, "told": told.cost, "drawn": float(here.mean()), "error": error, "more": min(more)}


def msa(
    studies: Annotated[int, typer.Option()] = 200,
    operators: Annotated[int, typer.Option()] = 8,
    parts: Annotated[int, typer.Option()] = 10,
    repeats: Annotated[int, typer.Option()] = 3,
    draws: Annotated[int, typer.Option()] = 1_000_000,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Analysis of variance over simulated studies, and guard bands of least cost against drawn parts, 10 seconds."""
    shape = (operators, parts, repeats)
    told, named = calibrated(studies, seed, shape), found(studies, seed, shape)
    small = smallest_study(TOLD)
    assert small is not None
    smallest = found(studies, seed + 1, small)
    guards = [guard(draws, seed, *each) for each in GUARDS]
    ratios = {name: stats.binomtest(round(told[name] * studies), studies, 0.95).pvalue for name in COMPONENTS}
    right = all(p > _SURE for p in ratios.values())
    right &= stats.binomtest(round(told["called"] * studies), studies, 0.01, alternative="greater").pvalue > _SURE
    right &= all(abs(each["told"] - each["drawn"]) < 4 * each["error"] and each["more"] > 3 for each in guards)
    for rates, size in ((named, shape), (smallest, small)):
        for name, p in found_by(TOLD, *size).items():
            right &= stats.binomtest(round(rates[name] * studies), studies, float(p)).pvalue > _SURE
    right &= min(smallest.values()) > 0.9 - 4 * (0.09 / studies) ** 0.5
    print(json.dumps({"study": shape, "predicted": asdict(TOLD), "held": told, "doubled, named": named,
                      "smallest": small, "doubled, named by it": smallest,
                      "guards": guards}, indent=1))  # fmt: skip
    raise typer.Exit(0 if right else 1)


GUARDS = ((0.0, 0.25, (20.0, 1.0)), (0.5, 0.25, (1.0, 1.0)), (0.3, 0.5, (100.0, 1.0)), (0.0, 0.1, (1.0, 10.0)))
"""Mean of the process, u, and what a bad part that is accepted and a good one that is rejected cost."""
