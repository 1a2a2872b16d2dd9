"""Points of a board beside the part, and how the unknowns of several pictures move them."""

from __future__ import annotations

import numpy as np

from imaging.bundles.unknowns import BOARD, BOARD_PITCH, BOARD_POINTS, Unknowns
from imaging.features.displaced import steps
from imaging.placed import turn
from scenes import Board


def points_at(unknowns: Unknowns, board: Board, numbers: np.ndarray) -> np.ndarray:
    """Where a board's points (n, 3) are on the part with unknowns (n,) beside what the scene says."""
    place, (pitch,), printed = (unknowns.full(name, numbers) for name in (BOARD, BOARD_PITCH, BOARD_POINTS))
    pivot = np.array(unknowns.scene.camera.look_at)
    there = board.points + pitch * board.by_pitch + printed.reshape(-1, 3)
    return (there - pivot) @ turn(np.degrees(place[3:])).T + pivot + place[:3]


def point_moves(unknowns: Unknowns, board: Board) -> np.ndarray:
    """Derivatives (n, 3, N) of its points by the N unknowns, with the part's own motion."""
    place = unknowns.basis("part") + unknowns.basis(BOARD)
    moved = steps(board.points, np.array(unknowns.scene.camera.look_at)) @ place
    moved += board.by_pitch[..., None] * unknowns.basis(BOARD_PITCH)
    return moved + unknowns.basis(BOARD_POINTS).reshape(-1, 3, unknowns.count)
