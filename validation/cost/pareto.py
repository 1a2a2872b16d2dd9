"""Total error against total time of all combinations of rays and images, and those that none beats in both."""

from __future__ import annotations

import numpy as np

from validation.cost.interval import LEAST
from validation.cost.model import CostModel, rays
from validation.cost.parameter import Parameter

_LIKE = 1.005  # times the half-width is no worse


def pareto_parameter(model: CostModel) -> Parameter:
    """Half-width of all sources together against the run's seconds, from the cost model."""
    options = [
        (rays(rendered.quality), n, model.run_seconds(rendered, n), model.total(rendered, n))
        for rendered in model.rendered
        for n in np.unique(np.geomspace(LEAST, 50_000, 16).astype(int)).tolist()
    ]
    rows = tuple((*o, "yes" if not any(_beats(other, o) for other in options) else "") for o in options)
    return Parameter(
        name="pareto",
        title="Total error (95 % half-width of a variance ratio) against total time, by rays a pixel",
        columns=("rays", "images", "seconds", "half-width", "front"),
        rows=rows,
        x="seconds",
        y="half-width",
        series="rays",
        note=f"{model.settings} settings, {model.workers} workers; beside the sampling: render noise, pixel phase "
        f"{1.96 * model.phase:.2g} and model {model.model:.2g}.",
    )


def _beats(one: tuple, other: tuple) -> bool:
    return one[2] < other[2] and one[3] <= _LIKE * other[3]
