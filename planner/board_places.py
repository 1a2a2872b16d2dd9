"""Where a board beside the part should stand, and how large it should be, for one picture.

Candidates lie in the plane of the scene's board: its middle on a grid over what the picture shows of that plane, its
squares larger or smaller, more or fewer of them. Those are left out that stand within the part, are not all in the
picture wherever part and board may plausibly lie, are nearer to the part there than measuring allows, unlit or shaded,
or whose squares are too small. Of the others that one is taken, and then moved, of which the objective of a plan
(`planner.search.objective`: noise, and what is not known of the place) is least.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from pydantic import ValidationError

from imaging.boards.seen import apart, seen_board
from imaging.features.placing import Placing
from imaging.geometry.projection import project, ray_origins, rays
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.models.errors import Errors
from imaging.pictures import Pictures
from planner.budgeting.budgets import SceneBudget, budget
from planner.search.objective import DEFAULT_OVER, Aim, minimised
from scenes import Board, InvalidInput, Picture, Pose, Scene
from scenes.board import PITCH
from scenes.placement import limits
from scenes.pose import one_or_all
from scenes.uncertain import UncertainNumber

_PLACES = 33  # of the middle, along each side of what is seen of the plane
_SCALES = (0.5, 0.7, 1.0, 1.4, 2.0)  # of the squares' side
_COUNTS = (3, 4, 5, 6, 8, 10, 13, 17, 22)  # of inner corners, dots or markers, along a side
_LEAST_SQUARE = 16.0  # px: what is found without a start
_HALVINGS = 3  # of the grid's step, when the best is moved


@dataclass(frozen=True, eq=False)
class PlacedBoard:
    """A board, and what is measured with it.

    Attributes
    ----------
    board : Board
    objective : float
        Of a plan: the worst variance over the squared half tolerance; of one measurand its variance.
    budget : SceneBudget, optional
        None where a measurand cannot be measured.
    """

    board: Board
    objective: float
    budget: SceneBudget | None


@dataclass(frozen=True, eq=False)
class BoardPlan:
    """Where a board should stand in one picture.

    Attributes
    ----------
    picture : Picture
        With the best board.
    before : PlacedBoard
        As the scene says.
    moved : PlacedBoard, optional
        Of the same size elsewhere; None where it fits nowhere.
    best : PlacedBoard
        Of any size.
    evaluated : int
        Candidates that were evaluated: all that meet the conditions, but for those of which a larger one about the same
        middle does.
    """

    picture: Picture
    before: PlacedBoard
    moved: PlacedBoard | None
    best: PlacedBoard
    evaluated: int

    @property
    def named(self) -> dict[str, PlacedBoard]:
        """Those that there are, the scene's first and the best last."""
        each = {"as the scene says": self.before, "as large, elsewhere": self.moved, "best": self.best}
        return {name: placed for name, placed in each.items() if placed is not None}

    @property
    def light(self) -> Pose | tuple[Pose, ...]:
        """Pose of the free light, or of each."""
        return one_or_all(self.picture.free_lights)


def place_board(
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    *,
    over: str = DEFAULT_OVER,
    report: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> BoardPlan:
    """Search the place and the size of a scene's board in one picture.

    What the board is stays: its kind, plane, direction, print (``point_sd``) and how well its pitch is known as a part
    of it.

    Parameters
    ----------
    scene : Scene or Picture
        Its placement is from a board.
    sensor, light : Pose or pair of float
        Degrees; not with a picture, which has its own.
    over : {"minimax", "sum"}
        Of several measurands, as of `planner.plan`.
    report : callable
        Called with a stage's name, steps done and in total.

    Raises
    ------
    InvalidInput
        If the scene has no board, or none of the candidates meets the conditions.
    """
    picture = Picture.of(scene, sensor, light)
    if picture.scene.placement.board is None:
        raise InvalidInput(f"placement.from must be board to place one, got {picture.scene.placement.source!r}")
    search = _Search.of(picture, over)
    sizes = search.sizes()
    rated = []
    for k, made in enumerate(sizes):
        rated += search.rated(made)
        report("sizes of squares", k + 1, len(sizes))
    own = [row for row in rated if search.is_own(row[1])]
    if not rated:
        raise InvalidInput("placement.board must have room beside the part in the picture, got none for any size")
    best, moved = (search.settled(min(rows, key=lambda row: row[0])) if rows else None for rows in (rated, own))
    return BoardPlan(
        picture=with_board(picture, best), before=search.placed(picture.scene.placement.board),
        moved=None if moved is None else search.placed(moved), best=search.placed(best), evaluated=len(rated),
    )  # fmt: skip


def with_board(picture: Picture, board: Board) -> Picture:
    """The picture with another board, its pitch known as well as before as a part of it; checked.

    Raises
    ------
    InvalidInput
        If the scene cannot have it.
    """
    scene = picture.scene
    scale = board.pitch / scene.placement.board.pitch
    told = [each.model_dump(exclude_none=True) for each in _with_pitch(scene, scale)]
    return picture.with_scene(scene.with_(placement={"board": board.model_dump()}, uncertain=told))


@dataclass(frozen=True, eq=False)
class _Search:
    """One picture and what of it no board changes."""

    picture: Picture
    errors: Errors
    aim: Aim

    @classmethod
    def of(cls, picture: Picture, over: str) -> _Search:
        errors = variance_model(DEFAULT_MODEL)(Pictures.of(picture))
        return cls(picture, errors, Aim.of(errors.measurands.quantities, "object", over))

    @property
    def board(self) -> Board:
        """As the scene says."""
        return self.picture.scene.placement.board

    def is_own(self, board: Board) -> bool:
        """Whether one is as large as the scene's."""
        return board.shape == self.board.shape and board.pitch == self.board.pitch

    def _tried(self, board: Board) -> Pictures:
        scene, scale = self.picture.scene, board.pitch / self.board.pitch
        tried = scene.tried(placement=scene.placement.tried(board=board), uncertain=_with_pitch(scene, scale))
        return Pictures.of(self.picture.with_scene(tried))

    def objective(self, board: Board) -> float:
        """What a plan minimises; infinite where one of the board's points is not found."""
        pictures, known = self._tried(board), self.errors.measurands
        seen = seen_board(pictures, known.seen)
        if not np.isfinite(seen.noise[:, 0, 0]).all():
            return np.inf
        placing = Placing.of(pictures.scene, known.seen, seen)
        return float(minimised(replace(self.errors, measurands=replace(known, placing=placing)), self.aim))

    def placed(self, board: Board) -> PlacedBoard:
        """With its budget."""
        same = board is self.board
        value = float(minimised(self.errors, self.aim)) if same else self.objective(board)
        try:
            return PlacedBoard(board, value, budget(self.picture if same else with_board(self.picture, board)))
        except InvalidInput:
            return PlacedBoard(board, value, None)

    def sizes(self) -> list[list[Board]]:
        """Boards of all sizes, those of the same squares together, the larger ones first."""
        shapes = {*product(_COUNTS, _COUNTS), self.board.shape}
        rows = [[_sized(self.board, scale, shape) for shape in shapes] for scale in _SCALES]
        return [sorted(filter(None, each), key=lambda board: -board.count) for each in rows]

    def rated(self, boards: list[Board]) -> list[tuple[float, Board]]:
        """Boards of a size of squares, the larger ones first, wherever they meet the conditions, and what a plan
        minimises; but for those about the same middle as a larger one in both directions."""
        middles, found = self._middles(), []
        larger: list[list[tuple[int, int]]] = [[] for _ in middles]
        for board in boards:
            outline = board.outline - _middle(board)
            for k in np.flatnonzero(self._is_possible(middles[:, None] + outline, board.pitch)):
                if not self.is_own(board) and any(x >= board.shape[0] and y >= board.shape[1] for x, y in larger[k]):
                    continue
                there = _about(board, middles[k])
                value = self.objective(there)
                if np.isfinite(value):
                    larger[k].append(board.shape)
                    found.append((value, there))
        return found

    def _is_possible(self, outlines: np.ndarray, pitch: float) -> np.ndarray:
        """Whether boards of the scene's plane may have outlines (n, 4, 3), but for light, bool (n,): in the picture
        wherever part and board may plausibly be shifted to, squares not too small, outside the part, and far enough
        from it in the picture."""
        camera, solid = self.picture.scene.camera, self.picture.scene.solid
        reach = limits(self.picture.scene.uncertainty)[:3]
        shifts = np.array(list(product(*((-each, each) if each else (0.0,) for each in reach))))
        seen = self._seen(outlines[:, None] + shifts[:, None])
        with np.errstate(invalid="ignore"):
            last = np.array([camera.width, camera.height]) - 1
            good = ((seen >= 0) & (seen <= last)).reshape(len(outlines), -1).all(1)
        sides, seen = (_sides(each[good]) for each in (outlines, self._seen(outlines)))
        good[good] = (seen / sides).min(1, initial=np.inf) * pitch >= _LEAST_SQUARE
        good[good] = apart(self._seen(outlines[good]), self._seen(solid.vertices))
        good[good] = [all(solid.height_above(point) > 0 for point in each) for each in outlines[good]]
        return good

    def _seen(self, points: np.ndarray) -> np.ndarray:
        """Images of points (..., 3), px."""
        return project(points.reshape(-1, 3), self._sensor, self.picture.scene.camera).reshape(*points.shape[:-1], 2)

    @property
    def _sensor(self) -> np.ndarray:
        return np.array(list(self.picture.sensor))

    def _middles(self) -> np.ndarray:
        """Places (n, 3) on a grid over what the picture shows of the board's plane."""
        camera, (across, down, normal) = self.picture.scene.camera, self.board.axes
        corner = np.array([camera.width, camera.height]) / 2
        image = corner * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        ray, start = (make(image, self._sensor, camera) for make in (rays, ray_origins))
        first = np.array(self.board.corner)
        reach = ((first - start) @ normal) / (ray @ normal)
        if not (np.isfinite(reach) & (reach > 0)).all():
            raise InvalidInput("placement.board must lie in a plane that the whole picture shows, got another")
        flat = (start + reach[:, None] * ray - first) @ np.stack([across, down], -1)
        sides = np.linspace(flat.min(0), flat.max(0), _PLACES + 2)[1:-1].T
        grid = np.stack(np.meshgrid(*sides), -1).reshape(-1, 2)
        return first + grid @ np.stack([across, down])

    def settled(self, rated: tuple[float, Board]) -> Board:
        """A board moved along its rows and columns to where no step of a shrinking one is better."""
        value, board = rated
        middles = self._middles().reshape(_PLACES, _PLACES, 3)
        ways = np.array([middles[0, 1] - middles[0, 0], middles[1, 0] - middles[0, 0]])
        for halving in range(1, _HALVINGS + 1):
            while True:
                near = [_about(board, _middle(board) + way / 2**halving) for way in (*ways, *-ways)]
                good = self._is_possible(np.array([each.outline for each in near]), board.pitch)
                tried = [(self.objective(each), each) for each, there in zip(near, good, strict=True) if there]
                best = min(tried, key=lambda row: row[0], default=(np.inf, board))
                if not best[0] < value:
                    break
                value, board = best
        return board


def _with_pitch(scene: Scene, scale: float) -> tuple[UncertainNumber, ...]:
    """The scene's uncertain numbers with a pitch so many times as large, known as well as a part of it."""

    def grown(each: UncertainNumber) -> UncertainNumber:
        return each.tried(sd=_times(each.sd, scale), half_width=_times(each.half_width, scale))

    return tuple(grown(each) if each.key == PITCH else each for each in scene.uncertain)


def _times(value: float | None, scale: float) -> float | None:
    return None if value is None else value * scale


def _sized(board: Board, scale: float, shape: tuple[int, int]) -> Board | None:
    """A board of the same kind with squares and a shape of other sizes; None where there is no such one."""
    told = board.model_dump() | {"shape": shape}
    told |= {name: _times(told[name], scale) for name in ("pitch", "dot_radius", "marker")}
    try:
        return type(board).model_validate(told)
    except ValidationError:
        return None


def _sides(outlines: np.ndarray) -> np.ndarray:
    """Lengths (n, 4) of the sides of outlines (n, 4, ...)."""
    return np.linalg.norm(np.roll(outlines, -1, 1) - outlines, axis=-1)


def _middle(board: Board) -> np.ndarray:
    """Of its outline, (3,)."""
    return board.at(board.outer.mean(0))


def _about(board: Board, middle: np.ndarray) -> Board:
    """The same board elsewhere in its plane."""
    return board.tried(corner=tuple((np.array(board.corner) + middle - _middle(board)).tolist()))
