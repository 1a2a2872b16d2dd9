"""A board that is not quite as its scene says: displaced beside the part, of another pitch, points off their places."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, KDTree
from scipy.spatial.transform import Rotation

from imaging.geometry.projection import project_ideal
from imaging.placed import placed
from scenes import Board, Picture, Scene
from scenes.placement import of_board, root
from tests import placements as parts

CAMERA = {"width": 352, "height": 400, "look_at": [0, 16, 6]}
"""Of `tests.placements`, with room for a board behind the part."""

_POINTS = {"shape": [9, 5], "pitch": {"value": 4.0, "sd": 2e-4}, "corner": [-16.0, 42.0, 0.0]}
_TAGS = {"shape": [4, 2], "pitch": {"value": 9.0, "sd": 4.5e-4}, "corner": [-17.0, 39.5, 0.0], "marker": 7.0,
         "dictionary": "DICT_APRILTAG_16h5"}  # fmt: skip
_WHOLE = np.array([0.6, 0.6, 1, 1, 1, 1])  # of `tests.placements.MOST`


class Printed(Board):
    """A board as it truly is."""

    shift: tuple[float, ...] = (0.0,) * 3
    turn_deg: tuple[float, ...] = (0.0,) * 3
    pivot: tuple[float, ...] = (0.0,) * 3
    off: tuple[tuple[float, ...], ...] = ()

    def at(self, places: np.ndarray) -> np.ndarray:
        """Points of places; those of corners, or of a dot, with their own errors."""
        near = 0.45 if self.kind in ("dots", "charuco") else 1e-9
        number = KDTree(self.places).query(places, p=np.inf, distance_upper_bound=near)[1]
        errors = np.concatenate([np.reshape(self.off, (-1, 3)), np.zeros((1, 3))])
        points = super().at(places) + errors[np.minimum(number, len(self.off))]
        turn, pivot = Rotation.from_rotvec(self.turn_deg, degrees=True), np.array(self.pivot)
        flat = turn.apply((points - pivot).reshape(-1, 3)).reshape(points.shape)
        return flat + pivot + np.array(self.shift)


def scene(folder: Any, name: str, kind: str = "chessboard", **changes: Any) -> Scene:
    """One of the three parts with a board behind it: known to `tests.placements.MOST` before."""
    board = {"kind": kind, **(_TAGS if kind == "markers" else _POINTS), "point_sd": 0.002}
    made = parts.scene(folder, name, camera=CAMERA).with_(
        placement={"from": "board", "board": board, "datums": [], "datum_sd": None},
        uncertainty={"board_shift": 0.003, "board_tilt_deg": 0.005},
    )
    return made.with_(**changes) if changes else made


def estimated(scene: Scene, *which: str) -> Scene:
    """A scene whose pictures tell so much of the camera, too: the focal length is known to 1 % before, k1 to 0.02."""
    told = {"focal": ("camera.focal_px", 0.01 * scene.camera.focal_px), "k1": ("camera.lens.distortion[0]", 0.02)}
    rows = [each.model_dump(exclude_none=True) for each in scene.uncertain]
    rows += [{"key": told[name][0], "sd": told[name][1]} for name in which]
    return scene.with_(placement={"camera": which}, uncertain=rows)


def lenient(scene: Scene) -> Scene:
    """A scene of wide tolerances: what a picture leaves open of the camera is told, and not refused."""
    rows = [each.model_dump(exclude_none=True) | {"tolerance": 0.5} for each in scene.measurands]
    return scene.with_(measurands=rows)


def as_said(picture: Picture) -> Picture:
    """The same picture by who takes the camera's numbers for what the scene says."""
    return picture.with_scene(picture.scene.with_(placement={"camera": []}))


def of_camera(picture: Picture, rng: np.random.Generator) -> np.ndarray:
    """Deviations of what is estimated of the camera at random, normally, (c,)."""
    return root(picture.scene)[6:] @ rng.standard_normal(root(picture.scene).shape[1])


def place(picture: Picture, rng: np.random.Generator) -> np.ndarray:
    """A place of the part at random, (6,), and the camera's deviations after it; with a board such that all of it is in
    the picture, as far from the part
    there as it has to be."""
    if picture.scene.placement.board is None:
        return np.append(parts.drawn(rng, parts.MOST), of_camera(picture, rng))
    while True:
        there = np.append(parts.drawn(rng, parts.MOST * _WHOLE), of_camera(picture, rng))
        if is_whole(placed(picture, there)) and is_clear(placed(picture, there)):
            return there


def is_whole(picture: Picture) -> bool:
    """Whether all of the board, its border too, is in the picture."""
    camera = picture.scene.camera
    corners = _corners(picture)
    return bool((corners > 0).all() and (corners < [camera.width - 1, camera.height - 1]).all())


def is_clear(picture: Picture) -> bool:
    """Whether one of the board's sides has all of the part more than 40 px beyond it, in the picture."""
    scene = picture.scene
    part = project_ideal(scene.solid.vertices, np.array(list(picture.sensor)), scene.camera)
    hull = ConvexHull(_corners(picture)).equations  # outward
    return bool(((hull[:, :2] @ part.T + hull[:, 2:]) > 40.0).all(1).any())


def _corners(picture: Picture) -> np.ndarray:
    board, camera = picture.scene.placement.board, picture.scene.camera
    return project_ideal(board.outline, np.array(list(picture.sensor)), camera)


def drawn(picture: Picture, rng: np.random.Generator) -> Picture:
    """The picture with a board as it may truly be; the same where there is none."""
    scene, board = picture.scene, picture.scene.placement.board
    if board is None:
        return picture
    shift, turn = np.split(of_board(scene.uncertainty) * rng.standard_normal(6), 2)
    pitch = next(each.u for each in scene.uncertain if each.key.endswith("pitch"))
    told = board.model_dump() | {
        "pitch": board.pitch + pitch * rng.standard_normal(), "shift": shift, "turn_deg": turn,
        "pivot": scene.camera.look_at, "off": board.point_sd * rng.standard_normal((board.count, 3)),
    }  # fmt: skip
    true = Printed.model_validate({key: _plain(value) for key, value in told.items()})
    return picture.with_scene(scene.tried(placement=scene.placement.tried(board=true)))


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def seen(picture: Picture, placement: np.ndarray) -> np.ndarray:
    """Noise-free image of part and board at a place, grey levels."""
    return parts.image(placed(picture, placement))
