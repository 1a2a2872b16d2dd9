"""Step of the viewing space and kind of search: how far from the best setting the plan is."""

from __future__ import annotations

import time

import planner
from planner.search.exhaustive import has_bound
from scenes import Scene
from validation.cost.parameter import Parameter, Trend, slope
from validation.cost.watch import Watch

_STEPS = (20.0, 10.0, 5.0, 2.5)
_COARSE = (30.0, 20.0, 15.0)  # where every pair has to be evaluated


def grid_parameter(scene: Scene, watch: Watch = Watch()) -> Parameter:
    """Variance of the grid's optimum over the refined one's, less 1, against the step."""
    steps, told = _STEPS if has_bound(scene, "calibrated") else _COARSE, lambda *_: watch.tell()
    plans = []
    for number in watch.samples(len(steps), least=2):
        step = steps[number]
        for search in ("exhaustive", "alternating"):
            began = time.perf_counter()
            found = planner.plan(scene, step_deg=step, search=search, refined=False, report=told)
            plans.append((search, step, time.perf_counter() - began, found))
    finest = plans[-2][3]
    best = min(planner.plan(scene, step_deg=step, report=told).variance, finest.grid_variance)
    rows = tuple((s, step, seconds, found.grid_variance / best - 1) for s, step, seconds, found in plans)
    points = [(row[1], row[3]) for row in rows if row[0] == "exhaustive" and row[3] > 0]
    fits = (Trend("exhaustive: gap against step", slope(*zip(*points, strict=True)), 2.0),) if len(points) > 1 else ()
    return Parameter(
        name="grid",
        title="Step of the viewing space: optimality gap against the refined optimum",
        columns=("search", "step deg", "seconds", "gap"),
        rows=rows,
        x="step deg",
        y="gap",
        series="search",
        fits=fits,
        note="Theory: 2 for a smooth bowl whose minimum lies anywhere between the directions. One grid's gap depends "
        "on where its nearest direction happens to lie, and the bowl has an edge where a face comes into view.",
    )
