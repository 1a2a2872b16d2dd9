"""What each picture's lines, circles and board are moved by: derivatives by the unknowns, and by exact projection."""

from __future__ import annotations

import numpy as np

from imaging.boards.seen import SeenBoard
from imaging.bundles.beside import point_moves, points_at
from imaging.bundles.unknowns import Unknowns, rim, rim_moves
from imaging.features.displaced import around, by_camera, by_place, of_circle, rim_fit, rim_normals, shifts, steps
from imaging.features.seen import Seen
from imaging.geometry.projection import from_axis
from imaging.placed import turn
from scenes import Board


def design(unknowns: Unknowns, seen: Seen, board: SeenBoard | None, number: int) -> np.ndarray:
    """Derivatives (q, n) of lines, circles and board of the picture of a number by the unknowns."""
    solid, lengths = seen.solid, np.linalg.norm(seen.along, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = by_place(seen, np.array(unknowns.scene.camera.look_at)) @ unknowns.basis("part")
        whole = whole - by_place(seen) @ unknowns.sensor(number)
        whole = whole + by_camera(seen, unknowns.modes[number - 1]) @ unknowns.camera(number)
        for e, name in enumerate(seen.names):
            ends = list(solid.edge(name).ends)
            slopes = np.einsum("i,nij->nj", seen.normals[e], seen.slopes(solid.vertices[ends]))
            first, last = (
                slope @ unknowns.basis(unknowns.vertex(end)) for slope, end in zip(slopes, ends, strict=True)
            )
            whole[2 * e] += first
            whole[2 * e + 1] += (last - first) / lengths[e]
        for c, name in enumerate(seen.circles):
            circle = solid.circle(name)
            whole[seen.numbers(c)] += of_circle(seen, circle, rim_moves(circle)) @ unknowns.basis(name)
        if board is not None:
            whole[seen.of_board] = _parameters(board, _board_design(unknowns, seen, board.board, number))
    return whole


def _board_design(unknowns: Unknowns, seen: Seen, board: Board, number: int) -> np.ndarray:
    """Derivatives (n, 2, N) of the images of a board's points by the N unknowns."""
    by_sensor = steps(board.points, np.array(seen.camera.look_at)) @ unknowns.sensor(number)
    by_camera = shifts(from_axis(board.points, seen.sensors, seen.camera), seen.camera, unknowns.modes[number - 1])
    moved = seen.slopes(board.points) @ (point_moves(unknowns, board) - by_sensor)
    return moved + by_camera @ unknowns.camera(number)


def _board_off(unknowns: Unknowns, seen: Seen, board: Board, number: int, numbers: np.ndarray) -> np.ndarray:
    """How far a board's points are off in the picture of a number, px (n, 2), by exact projection."""
    camera = unknowns.camera(number) @ numbers
    here = from_axis(board.points, seen.sensors, seen.camera)
    there = _projected(unknowns, seen, number, numbers, points_at(unknowns, board, numbers))
    return there - here + (shifts(here, seen.camera, unknowns.modes[number - 1]) @ camera if camera.any() else 0.0)


def _parameters(board: SeenBoard, points: np.ndarray) -> np.ndarray:
    """A board's parameters (k, ...) by its points (n, 2, ...)."""
    return np.einsum("kni,ni...->k...", board.gain(), np.where(np.isfinite(points), points, 0.0))


def off(unknowns: Unknowns, seen: Seen, board: SeenBoard | None, number: int, numbers: np.ndarray) -> np.ndarray:
    """How far lines, circles and board (q,) are off in the picture of a number, by exact projection."""
    solid, found = seen.solid, np.zeros(seen.count)
    ends = np.array([_ends(unknowns, name, numbers) for name in seen.names]).reshape(-1, 2, 3)
    image = _projected(unknowns, seen, number, numbers, ends.reshape(-1, 3)).reshape(-1, 2, 2)
    found[: 2 * len(ends)] = seen.line_errors(image[:, 0], image[:, 1] - image[:, 0])
    for c, name in enumerate(seen.circles):
        circle = solid.circle(name)
        there = _projected(unknowns, seen, number, numbers, rim(circle, unknowns.full(name, numbers)))
        here = from_axis(circle.at(around(circle)), seen.sensors, seen.camera)
        normal = rim_normals(seen, circle)
        found[seen.numbers(c)] = rim_fit(seen, circle)[1] @ np.einsum("ni,ni->n", normal, there - here)
    camera = unknowns.camera(number) @ numbers
    found = found + by_camera(seen, unknowns.modes[number - 1]) @ camera if camera.any() else found
    if board is not None:
        found[seen.of_board] = _parameters(board, _board_off(unknowns, seen, board.board, number, numbers))
    return found


def _ends(unknowns: Unknowns, name: str, numbers: np.ndarray) -> np.ndarray:
    solid = unknowns.scene.solid
    ends = solid.edge(name).ends
    return np.array([solid.vertices[end] + unknowns.full(unknowns.vertex(end), numbers) for end in ends])


def _projected(unknowns: Unknowns, seen: Seen, number: int, numbers: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Image points (n, 2) of places (n, 3) on the part that is moved, before the sensor that is."""
    part, sensor = unknowns.full("part", numbers), unknowns.sensor(number) @ numbers
    pivot, own = np.array(unknowns.scene.camera.look_at), np.array(seen.camera.look_at)
    there = (points - pivot) @ turn(np.degrees(part[3:])).T + pivot + part[:3]
    before = (there - own - sensor[:3]) @ turn(np.degrees(sensor[3:])) + own
    return from_axis(before, seen.sensors, seen.camera)
