"""``python -m tests.proofs stations``: how often does the stated interval hold the true value?

Every station has its own errors, drawn as the scene states them: lens, place, turn, part, fixed pattern. One noisy
picture of each is measured by who believes the scene, and its interval value +- U either holds the part's true length
or does not. Of 1000 stations 93.5 to 96.5 % have to, for a stated 95 %.
"""

from __future__ import annotations

import json
from typing import Annotated

import typer

import planner
import scenes
from scenes.results import picked
from validation import coverage

LEAST, MOST = 0.935, 0.965


def attained(scene: scenes.Scene, count: int, seed: int, estimator: str | None = None) -> dict[str, float]:
    """Part of ``count`` simulated stations whose interval holds the true value, of the first measurand."""
    setting = scene.settings[0]
    first = coverage.pictured(planner.budget(scene, setting.sensor, setting.light), count, seed, estimator)[0]
    return {
        **picked(first, "held", "low", "high"),
        "scatter_over_u": first.sigma / first.u,
        "shift_over_u": (first.mean - first.true) / first.u,
        "lost": first.failed,
        "warned": first.warned,
    }


def stations(
    scene: Annotated[str, typer.Argument()] = "calibrated_rig",
    count: Annotated[int, typer.Option()] = 1000,
    seed: Annotated[int, typer.Option()] = 1,
    estimator: Annotated[str | None, typer.Option()] = None,
) -> None:
    """Coverage of the stated 95 % interval over simulated stations (plain scenes), 1.5 minutes."""
    found = attained(scenes.load(scene), count, seed, estimator)
    print(json.dumps({"scene": scene, "stations": count, **found}, indent=1))
    raise typer.Exit(0 if found["lost"] == 0 and LEAST <= found["held"] <= MOST else 1)
