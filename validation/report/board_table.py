"""What ``ice plan --place-board`` prints: boards, and how uncertain each measurand is with them."""

from __future__ import annotations

from rich.console import Group
from rich.text import Text

import planner
import scenes
from planner.board_places import PlacedBoard
from scenes.status import legend
from validation.report import cells

_TERMS = (
    " corner: of the first point; size: of its outer sides. U: expanded uncertainty (95 %) with everything in the"
    " budget. The board is sought by noise and by what is not known of the place, as poses are; it is all in the"
    " picture wherever part and board may plausibly be shifted to."
)


def report(found: planner.BoardPlan, seconds: float) -> Group:
    """The boards, the measurands, and what to do next."""
    scene = found.picture.scene
    known = found.named
    states = [] if found.best.budget is None else list(found.best.budget.statuses)
    notes = [_TERMS, *(f" {line}" for line in legend(states, [""] * len(states)))]
    if found.moved is None:
        notes.append(" A board as large as the scene's has no room so.")
    poses = f"sensor {cells.pose(found.picture.sensor)}, light {scenes.shown(scenes.pairs(found.light))}"
    boards = cells.table(
        f"{scene.title or scene.name}: {poses}", "board", f"corner [{scene.units}]", "points",
        f"pitch [{scene.units}]", f"size [{scene.units}]",
        rows=[(name, *_board(each)) for name, each in known.items()], words=("board",),
    )  # fmt: skip
    return Group(
        boards, _measurands(known), Text("\n".join(notes)), Text(f"\n {found.evaluated} boards in {seconds:.1f} s")
    )


def _board(each: PlacedBoard) -> tuple[str, ...]:
    board = each.board
    return (
        ", ".join(f"{value:.4g}" for value in board.corner), " x ".join(map(str, board.shape)), f"{board.pitch:.4g}",
        " x ".join(f"{value:.3g}" for value in board.size),
    )  # fmt: skip


def _measurands(known: dict[str, PlacedBoard]):
    """U of each measurand with each board, and its status with the best."""
    budgets = {name: each.budget for name, each in known.items() if each.budget is not None}
    best = list(budgets.values())[-1]
    rows = []
    for m, one in enumerate(best.measurands):
        worth = (cells.number(each.measurands[m].U, ".2g") for each in budgets.values())
        rows.append((one.name, one.unit, *worth, best.statuses[m]))
    columns = ("measurand", "unit", *(f"U, {name}" for name in budgets), "status")
    return cells.table("\nWhat they are worth", *columns, rows=rows, words=("measurand", "unit", "status"))
