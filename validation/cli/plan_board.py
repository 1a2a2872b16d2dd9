"""``ice plan --place-board``: where a board beside the part should stand, and how large it should be."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import scenes
from scenes.results import picked
from validation.cli.common import check_left_out, progress, say
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import planner
    from planner.board_places import PlacedBoard
    from validation.cli.plan import Options

_NOT_BOARD = (
    "--search", "--model", "--edges", "--start", "--shares", "--tolerance", "--vary", "--hold", "--certify", "--check",
    "--map", "--out", "--views", "--views-share", "--coverage",
)  # fmt: skip


def run(scene: scenes.Scene, given: Options, how: dict[str, Any], target: Path | None) -> None:
    """Plan poses unless both are held, then the board; show, and write it into a scene's file."""
    import planner

    check_left_out(given.context, "--place-board", *_NOT_BOARD)
    if scene.placement.board is None:
        raise scenes.InvalidInput(
            f"--place-board must be given with placement.from = 'board', got {scene.placement.source!r}"
        )
    began, (sensor, light) = time.perf_counter(), (how["sensor"], how["light"])
    if sensor is None or light is None:
        with progress(f"{scene.name}: searching places of sensor and light", "steps", at_once=True) as shown:
            found = planner.plan(scene, given.objective, **how, report=shown)
        sensor, light = found.sensor, found.light
    with progress(f"{scene.name}: searching a place for the board", "sizes of squares", at_once=True) as shown:
        placed = planner.place_board(scene, sensor, light, over=given.over, report=shown)
    seconds = time.perf_counter() - began
    if target:
        from validation.planned_scene import write_board

        write_board(target, placed)
    if given.as_json:
        say(plain(facts(placed, seconds) | {"written": target}), True, "")
        return
    from validation.report import board_table

    console().print(board_table.report(placed, seconds), highlight=False)
    if target:
        console().print(f"The board and the poses stand in {target} now.", highlight=False)


def facts(found: planner.BoardPlan, seconds: float) -> dict[str, Any]:
    """Everything for JSON."""
    return {
        "scene": found.picture.scene.name, "sensor": list(found.picture.sensor),
        "light": scenes.pairs(found.light), "boards": [_placed(*each) for each in found.named.items()],
        "evaluated": found.evaluated, "seconds": seconds,
    }  # fmt: skip


def _placed(name: str, each: PlacedBoard) -> dict[str, Any]:
    budget = each.budget
    rows = () if budget is None else zip(budget.measurands, budget.statuses, strict=True)
    return {
        "name": name,
        "board": {**picked(each.board, "kind", "corner", "shape", "pitch"), "size": each.board.size},
        "objective": each.objective,
        "measurands": [{**picked(one, "name", "unit", "U"), "status": status} for one, status in rows],
    }
