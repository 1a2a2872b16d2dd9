"""``python -m tests.proofs stations``: how often does the stated interval hold the true value?

Every station has its own errors, drawn as the scene states them: lens, place, turn, part, fixed pattern. Of plain
scenes one noisy picture of each is measured by who believes the scene; of others the closed form of the values stands
for it.
The interval value +- U either holds the part's true value or does not: for a stated 95 % it has to in 93 to 97 %, but
for what chance explains (binomial tests, all values together at 1 %).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer
from scipy import stats

import planner
import scenes
from validation import coverage
from validation.coverage import Coverage

LEAST, MOST, FALSE_ALARM = 0.93, 0.97, 0.01
_SCENES = ("calibrated_rig", "printed_label", "grey_floor", "shaft_ring", "bracket_station")


def attained(
    scene: scenes.Scene, count: int, seed: int, estimator: str | None = None
) -> tuple[str, Sequence[Coverage]]:
    """How ``count`` stations at the first setting are simulated, and of each value what their intervals hold."""
    setting = scene.settings[0]
    found = planner.budget(scene, setting.sensor, setting.light)
    if estimator is not None:
        return coverage.PICTURES, coverage.pictured(found, count, seed, estimator)
    return coverage.simulated(found, count, seed)


def is_true(row: Coverage, rows: int) -> bool:
    """Whether a stated interval of 95 % may hold the truth in 93 to 97 %, but for chance in one of 100 such tables."""
    if row.failed or not row.n:
        return False
    held = round(row.held * row.n)
    chances = stats.binom.cdf(held, row.n, LEAST), stats.binom.sf(held - 1, row.n, MOST)
    return bool(min(chances) > 1 - (1 - FALSE_ALARM) ** (1 / rows))


def stations(
    scene: Annotated[list[str] | None, typer.Argument(help="Bundled names. [default: five]")] = None,
    count: Annotated[int, typer.Option()] = 1000,
    seed: Annotated[int, typer.Option()] = 1,
    estimator: Annotated[str | None, typer.Option(help="Of plain scenes.")] = None,
) -> None:
    """Coverage of stated 95 % intervals over simulated stations; 3 minutes."""
    found = []
    for name in scene or _SCENES:
        how, rows = attained(scenes.load(name), count, seed, estimator)
        print(f"{name}: {count} stations, {how}")
        for row in rows:
            print(
                f"  {row.name:<20} held {row.held:.1%} [{row.low:.1%}, {row.high:.1%}], "
                f"scatter {row.sigma / row.u:.3f} u, mean off {(row.mean - row.true) / row.u:+.3f} u, "
                f"{row.failed} without a value, {row.warned} not ok",
                flush=True,
            )
        found += rows
    true = [is_true(row, len(found)) for row in found]
    print(f"{sum(true)} of {len(true)} intervals hold the truth as often as they say, but for chance.")
    raise typer.Exit(0 if all(true) else 1)
