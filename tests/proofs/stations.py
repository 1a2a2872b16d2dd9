"""``python -m tests.proofs stations``: how often does the stated interval hold the true value?

Every station has its own errors, drawn as the scene states them: lens, place, turn, part, fixed pattern. One noisy
picture of each is measured by who believes the scene, and its interval value +- U either holds the part's true length
or does not. Of 1000 stations 93.5 to 96.5 % have to, for a stated 95 %.
"""

from __future__ import annotations

import json
from typing import Annotated

import numpy as np
import typer
from scipy import stats

import planner
import scenes
from validation.chain import Chain

LEAST, MOST = 0.935, 0.965


def coverage(scene: scenes.Scene, count: int, seed: int, estimator: str | None = None) -> dict[str, float]:
    """Part of ``count`` simulated stations whose interval holds the true value, of the first measurand."""
    setting = scene.settings[0]
    found = planner.budget(scene, setting.sensor, setting.light)
    values, states = Chain(found).pictured(np.random.default_rng(seed), count, estimator)
    first = found.measurands[0]
    held = np.abs(values[:, 0] - first.value) <= first.U
    low, high = stats.binomtest(int(held.sum()), count).proportion_ci(0.95)
    return {
        "held": float(held.mean()),
        "low": float(low),
        "high": float(high),
        "scatter_over_u": float(np.nanstd(values[:, 0], ddof=1) / first.u),
        "shift_over_u": float((np.nanmean(values[:, 0]) - first.value) / first.u),
        "lost": int((~np.isfinite(values[:, 0])).sum()),
        "warned": int((states[:, 0] != "ok").sum()),
    }


def stations(
    scene: Annotated[str, typer.Argument()] = "calibrated_rig",
    count: Annotated[int, typer.Option()] = 1000,
    seed: Annotated[int, typer.Option()] = 1,
    estimator: Annotated[str | None, typer.Option()] = None,
) -> None:
    """Coverage of the stated 95 % interval over simulated stations (plain scenes), 1.5 minutes."""
    found = coverage(scenes.load(scene), count, seed, estimator)
    print(json.dumps({"scene": scene, "stations": count, **found}, indent=1))
    raise typer.Exit(0 if LEAST <= found["held"] <= MOST else 1)
