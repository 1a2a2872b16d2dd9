"""The image of a board beside the part: its dark polygons on bright, exactly blurred."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from imaging.blurred.arrangement import BACKGROUND, Arrangement, Region, along_blur
from imaging.blurred.model import BlurredModel
from imaging.boards.seen import levels
from imaging.geometry.blur import signed_confusion
from imaging.geometry.lens import recorded
from imaging.geometry.projection import depth, project_ideal
from imaging.pictures import Pictures
from scenes import Board

_BRIGHT, _DARK = 1, 2
_LOOKED = np.stack(np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 1, 21)), -1).reshape(-1, 2)
_NONE = np.empty(0, int)


def add_board(image: np.ndarray, pictures: Pictures, seen: Callable[[np.ndarray], np.ndarray] | None = None) -> None:
    """Add the signal of a scene's board, where it has one, to the image (height, width) of one picture, grey levels.

    ``seen`` says of points (n, 3) at which ideal px (n, 2) they are, where that is not as the scene says.
    """
    board = pictures.scene.placement.board
    if board is None:
        return
    arrangement, points = _arrangement(pictures, board)
    if seen is not None:
        arrangement = replace(arrangement, vertices=seen(points))
    camera = pictures.scene.camera
    margin = 2 + 7 * camera.most_blur_px
    places = arrangement.recorded(arrangement.vertices)
    low = np.clip(np.floor(places.min(0) - margin), 0, [camera.width, camera.height]).astype(int)
    high = np.clip(np.ceil(places.max(0) + margin), 0, [camera.width, camera.height]).astype(int)
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
    if x.size:
        model = BlurredModel(arrangement, x.ravel(), y.ravel(), _NONE)
        image[low[1] : high[1], low[0] : high[0]] += model.image(model.start()).reshape(x.shape)


def _arrangement(pictures: Pictures, board: Board) -> tuple[Arrangement, np.ndarray]:
    """What a board shows: two regions, what is bright and what is dark; and its vertices in space (V, 3)."""
    camera, sensor = pictures.scene.camera, pictures.sensors
    places, ends, sides = _pieces(board)
    points = board.at(places)
    vertices = project_ideal(points, sensor, camera)
    middle = project_ideal(board.at(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])), sensor, camera)
    (a, b), (c, d) = middle[1:] - middle[0]
    sides = sides if a * d - b * c > 0 else sides[:, ::-1]  # which side is left depends on from where it is seen
    looked = board.at(board.outer[0] + _LOOKED * (board.outer[2] - board.outer[0]))
    seen = recorded(project_ideal(looked, sensor, camera), camera)
    made = Arrangement(
        vertices=vertices,
        defocus=signed_confusion(camera, depth(points, sensor, camera)),
        pieces=ends,
        sides=sides,
        regions=(
            Region.flat(np.zeros((1, 2)), 0), *(Region.shaded(seen, each) for each in levels(pictures, board, looked)),
        ),
        required=np.empty((0, 2), int),
        edges=np.full(len(ends), -1),
        corners=_NONE,
        camera=camera,
        blur_px=along_blur(vertices[ends], camera),
    )  # fmt: skip
    return made, points


def _pieces(board: Board) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places on the board (V, 2), pieces between them (N, 2), and what is on both sides of these (N, 2).

    First that on the side of the normal (-t_y, t_x), the board seen with its columns to the left of its rows.
    """
    loops, outer = board.dark_polygons, board.outer
    places = np.concatenate([loops.reshape(-1, 2), outer])
    inner = _around(*loops.shape[:2])
    rim = _around(1, len(outer)) + loops.shape[0] * loops.shape[1]
    sides = np.repeat([[_DARK, _BRIGHT], [_BRIGHT, BACKGROUND]], [len(inner), len(rim)], 0)
    return places, np.concatenate([inner, rim]), sides


def _around(count: int, corners: int) -> np.ndarray:
    """Numbers of the ends of the sides of so many polygons, (count * corners, 2)."""
    number = np.arange(count * corners).reshape(count, corners)
    return np.stack([number, np.roll(number, -1, 1)], -1).reshape(-1, 2)
