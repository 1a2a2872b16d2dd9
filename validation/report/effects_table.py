"""What ``ice effects`` prints."""

from __future__ import annotations

import math

from rich.table import Table

from render.phenomena import Decision, Effect
from scenes import pairs, shown
from validation.effects_check import RENDERED, Switched


def saving(decisions: tuple[Decision, ...]) -> float:
    """Time of a render with everything over that of this choice: excesses add up, random rays are paid for once."""

    def time(effects: list[Effect]) -> float:
        random = max((effect.cost - 1 for effect in effects if effect.random), default=0.0)
        return 1 + random + sum(effect.cost - 1 for effect in effects if not effect.random)

    rendered = [decision for decision in decisions if decision.effect.name in RENDERED]
    return time([d.effect for d in rendered]) / time([d.effect for d in rendered if d.on])


def fact(decision: Decision) -> dict:
    effect, (bias, change) = decision.effect, decision.influence
    return {
        "name": effect.name,
        "on": decision.on,
        "reason": decision.reason,
        "bias_px": bias if math.isfinite(bias) else None,
        "variance": change if math.isfinite(change) else None,
        "cost": effect.cost,
        "switch": effect.switch,
    }


def checked(row: Switched) -> dict:
    bounds = [value if math.isfinite(value) else None for value in row.estimated]
    return {
        "sensor": list(row.setting.sensor),
        "light": pairs(row.setting.light),
        "effect": row.name,
        "estimated": bounds,
        "measured": [row.bias_px, row.variance],
        "resolution": [row.resolution_px, row.resolution_variance],
        "seconds": row.seconds,
        "seconds_auto": row.seconds_auto,
        "holds": row.holds,
    }


def _number(value: float) -> str:
    return "0" if value == 0 else "large" if not math.isfinite(value) else f"{value:.2g}"


def table(decisions: tuple[Decision, ...]) -> Table:
    made = Table(title="Effects: influence on the distance, at most", box=None, title_justify="left")
    for name in ("effect", "", "reason"):
        made.add_column(name)
    for name in ("bias px", "variance", "cost"):
        made.add_column(name, justify="right")
    for decision in decisions:
        influence = (_number(value) for value in decision.influence)
        cost = "each picture" if decision.effect.name == "pose_jitter" else f"{decision.effect.cost:.1f}"
        made.add_row(decision.effect.name, "on" if decision.on else "off", decision.reason, *influence, cost)
    made.caption = "variance: relative change. cost: time of a render with it over that without."
    return made


def check_table(rows: list[Switched]) -> Table:
    made = Table(title="\nSwitched on: measured against the bound", box=None, title_justify="left")
    made.add_column("sensor, light")
    made.add_column("effect")
    for name in ("bias px", "bound", "variance", "bound", "time", ""):
        made.add_column(name, justify="right")
    for row in rows:
        made.add_row(
            f"{row.setting.sensor} {shown(pairs(row.setting.light))}",
            row.name,
            f"{row.bias_px:+.4f}",
            f"{_number(row.estimated.bias_px)} +{row.resolution_px:.4f}",
            f"{row.variance:+.4f}",
            f"{_number(row.estimated.variance)} +{row.resolution_variance:.4f}",
            f"{row.seconds / row.seconds_auto:.1f}",
            "ok" if row.holds else "EXCEEDED",
        )
    made.caption = "bound: estimated, + what the renders scatter by (0.1 %). time: of one render over that of auto."
    return made


def total(rows: list[Switched]) -> str:
    """How many comparisons hold, and what the choice saves."""
    everything = [row for row in rows if row.name == "all"]
    auto, total = sum(row.seconds_auto for row in everything), sum(row.seconds for row in everything)
    held = sum(row.holds for row in rows)
    return (
        f"{held} of {len(rows)} comparisons within their bounds. auto {auto:.2f} s, all {total:.2f} s: "
        f"{total / auto:.1f} times faster."
    )
