"""What ``ice effects`` prints."""

from __future__ import annotations

import math

from rich.table import Table

from render.phenomena import Decision, Effect
from scenes import pairs
from scenes.results import picked
from validation.effects_check import RENDERED, Switched
from validation.report import cells
from validation.strict_json import plain

_LOOKS = {"wrap": True, "caption_justify": "center"}


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
        **picked(decision, "on", "reason"),
        "bias_px": plain(bias),
        "variance": plain(change),
        **picked(effect, "cost", "switch"),
    }


def checked(row: Switched) -> dict:
    return {
        "sensor": list(row.setting.sensor),
        "light": pairs(row.setting.light),
        "effect": row.name,
        "estimated": plain(tuple(row.estimated)),
        "measured": [row.bias_px, row.variance],
        "resolution": [row.resolution_px, row.resolution_variance],
        **picked(row, "seconds", "seconds_auto", "holds"),
    }


def _number(value: float) -> str:
    return "0" if value == 0 else "large" if not math.isfinite(value) else f"{value:.2g}"


def table(decisions: tuple[Decision, ...]) -> Table:
    columns = ("effect", "", "reason", "bias px", "variance", "cost")
    caption = (
        "bias, variance: what leaving it out changes, the latter as a part of itself. cost: time of a render with it "
        "over that without. free: it takes no time, so it is on."
    )
    rows = map(_effect, decisions)
    title = "Effects: influence on the distance, at most"
    return cells.table(title, *columns, rows=rows, words=columns[:3], **_LOOKS, caption=caption)


def _effect(decision: Decision) -> list[str]:
    effect = decision.effect
    cost = "each picture" if effect.name == "pose_jitter" else f"{effect.cost:.1f}"
    return [effect.name, "on" if decision.on else "off", decision.reason, *map(_number, decision.influence), cost]


def check_table(rows: list[Switched]) -> Table:
    columns = ("sensor, light", "effect", "bias px", "bound", "variance", "bound", "time", "")
    caption = "bound: estimated, + what the renders scatter by (0.1 %). time: of one render over that of auto."
    title = "\nSwitched on: measured against the bound"
    return cells.table(title, *columns, rows=map(_switched, rows), words=columns[:2], **_LOOKS, caption=caption)


def _switched(row: Switched) -> list[str]:
    return [
        f"{cells.pose(row.setting.sensor)} {cells.pose(row.setting.light)}",
        row.name,
        f"{row.bias_px:+.4f}",
        f"{_number(row.estimated.bias_px)} +{row.resolution_px:.4f}",
        f"{row.variance:+.4f}",
        f"{_number(row.estimated.variance)} +{row.resolution_variance:.4f}",
        f"{row.seconds / row.seconds_auto:.1f}",
        "ok" if row.holds else "EXCEEDED",
    ]


def total(rows: list[Switched]) -> str:
    """How many comparisons hold, and what the choice saves."""
    everything = [row for row in rows if row.name == "all"]
    auto, total = sum(row.seconds_auto for row in everything), sum(row.seconds for row in everything)
    held = sum(row.holds for row in rows)
    return (
        f"{held} of {len(rows)} comparisons within their bounds. auto {auto:.2f} s, all {total:.2f} s: "
        f"{total / auto:.1f} times faster."
    )
