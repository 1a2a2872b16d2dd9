"""A camera whose lens is splined: where it begins, how it sees, by what numbers.

Where the camera's own axes are is a matter of choice, for a rotation of the camera can be taken by lens and boards: the
axis is the ray that is recorded in the image's middle, and around it the lens turns nothing. What the splines could do
as well as the focal length is left to it. So displacement, turn and divergence are 0 in the middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import null_space

from measure.boards.adjustment import adjust
from measure.boards.chessboard import Board
from measure.boards.view import View
from scenes.cameras.splined import DEGREE, Plane, Splined, knots, off_plane, on_plane, plane_slope
from scenes.errors import InvalidInput

_ANY = 0.1  # focal lengths: of second differences of control points nothing more is known before
_FOCAL = np.geomspace(0.2, 8.0, 20)  # of the image's longer side, where the search begins
_FEWEST = 6  # corners that tell a pose
_WIDEST = 1.9  # of the stereographic plane: 87 degrees
_ROOM = 0.02, 0.15  # of the extent of the corners, around it: at last, and while they are not known exactly


@dataclass(frozen=True, eq=False)
class SplinedModel:
    """Free numbers of a splined lens: the focal length, and combinations of its control points.

    Attributes
    ----------
    plane : str
        Of `scenes.cameras.Splined`.
    extent : (x, y, x, y)
        Where splines have control points, least and largest.
    control : (columns, rows)
        Control points.
    middle : (x, y)
        Of the image, px.
    free : ndarray, shape (2 columns rows, m)
        Combinations of control points (all displacements to the right, then all downwards) that may be.
    """

    plane: Plane
    extent: tuple[float, float, float, float]
    control: tuple[int, int]
    middle: tuple[float, float]
    free: np.ndarray

    @classmethod
    def over(cls, plane: Plane, extent: np.ndarray, control: tuple[int, int], middle: np.ndarray) -> SplinedModel:
        """With all control points free that no other choice of the camera's axes or focal length replaces."""
        x0, y0, x1, y1 = map(float, extent)
        empty = np.zeros((2 * control[0] * control[1], 0))
        model = cls(plane, (x0, y0, x1, y1), control, (float(middle[0]), float(middle[1])), empty)
        value, by_x, by_y = (model._design(np.zeros((1, 2)), nu)[0] for nu in ((0, 0), (1, 0), (0, 1)))
        none = np.zeros_like(value)
        held = [(value, none), (none, value), (-by_y, by_x), (by_x, by_y)]
        return replace(model, free=null_space(np.array([np.concatenate(each) for each in held])))

    @property
    def names(self) -> tuple[str, ...]:
        """fx of both axes, d1, d2, ... of the displacements."""
        return ("fx", *(f"d{i + 1}" for i in range(self.free.shape[1])))

    @property
    def prior(self) -> np.ndarray:
        """That displacements are no larger than any lens' holds what no corner tells."""
        columns, rows = self.control
        along = np.kron(np.eye(rows), np.diff(np.eye(columns), 2, axis=0))
        across = np.kron(np.diff(np.eye(rows), 2, axis=0), np.eye(columns))
        bend = np.kron(np.eye(2), np.concatenate([along, across])) / _ANY
        return np.pad(bend @ self.free, [(0, 0), (1, 0)])

    def lens(self, values: np.ndarray) -> Splined:
        """Of the scene's kinds."""
        right, down = (self.free @ values[1:]).reshape(2, *self.control[::-1])
        return Splined(
            kind="splined", plane=self.plane, extent=self.extent,
            right=tuple(tuple(map(float, row)) for row in right), down=tuple(tuple(map(float, row)) for row in down),
        )  # fmt: skip

    def seen(self, values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `measure.boards.parameters.CameraModel` has it; beyond the extent the splines go on."""
        with np.errstate(all="ignore"):
            depth = np.where(points[:, 2] > 0, points[:, 2], np.nan)[:, None]
            ideal = points[:, :2] / depth
        place, focal = on_plane(ideal, self.plane), values[0]
        half = self.free.shape[0] // 2
        value, by_x, by_y = (self._design(place, nu) for nu in ((0, 0), (1, 0), (0, 1)))
        moved = np.stack([value @ self.free[:half], value @ self.free[half:]], 1)  # by each free number
        steps = self.free @ values[1:]
        both = steps.reshape(2, half).T
        recorded = place + value @ both
        by_place = np.eye(2) + np.stack([by_x @ both, by_y @ both], -1)
        by_ideal = by_place @ plane_slope(ideal, self.plane)
        by_points = np.concatenate([by_ideal, -(by_ideal @ ideal[..., None])], -1) / depth[..., None]
        by_values = np.concatenate([recorded[..., None], focal * moved], -1)
        return np.array(self.middle) + focal * recorded, by_values, focal * by_points

    def _design(self, places: np.ndarray, nu: tuple[int, int]) -> np.ndarray:
        """Weights (n, columns rows) of control points, row by row, in a displacement or a derivative of it."""
        there = np.isfinite(places).all(-1, keepdims=True)
        known = np.where(there, places, self.extent[:2])
        along, across = (spline[order](each) for spline, order, each in zip(self._splines, nu, known.T, strict=True))
        return np.where(there, (across[:, :, None] * along[:, None]).reshape(len(places), -1), np.nan)

    @cached_property
    def _splines(self) -> list[tuple[BSpline, BSpline]]:
        """Along columns and rows those of all control points, and their derivatives."""
        each = zip(knots(self.extent, self.control), self.control, strict=True)
        every = [BSpline(t, np.eye(count), DEGREE, extrapolate=True) for t, count in each]
        return [(spline, spline.derivative()) for spline in every]


def fitted(boards: Sequence[Board], square: float, image_shape: tuple[int, int], control: tuple[int, int]):
    """The model, and numbers and poses (flat) where its adjustment begins, over what boards show.

    Raises
    ------
    InvalidInput
        If no such camera is found.
    """
    middle = (np.array(image_shape[::-1]) - 1) / 2
    planes: tuple[Plane, Plane] = ("normalised", "stereographic")
    begun = [_begun(boards, square, image_shape, middle, plane) for plane in planes]
    plane = planes[int(np.argmin([each[0] for each in begun]))]
    start = begun[planes.index(plane)][1]
    if start is None:
        raise InvalidInput("boards must determine a camera, got boards from which none can be found")
    model = SplinedModel.over(plane, [-1, -1, 1, 1], (4, 4), middle)
    for count, room in (((0, 0), _ROOM[1]), ((5, 4), _ROOM[1]), (control, _ROOM[0])):
        if count[0]:
            model = SplinedModel.over(
                plane, _extent(boards, square, plane, start[-6 * len(boards) :], room), count, middle
            )
        else:
            model = replace(model, free=model.free[:, :0])
        start = np.concatenate([start[:1], np.zeros(model.free.shape[1]), start[-6 * len(boards) :]])
        if count != control:
            start = adjust(boards, square, model, start).parameters
    return model, start


def _begun(boards, square, image_shape, middle, plane: Plane) -> tuple[float, np.ndarray | None]:
    """What the best focal length leaves without displacements, median px, and it with the poses."""
    best, found = np.inf, None
    views = [View.of(board, square) for board in boards]
    for focal in _FOCAL * max(image_shape):
        poses, left = [], []
        for view in views:
            pose = _pose(view, (view.corners - middle) / focal, plane)
            if pose is None:
                break
            before = view.places @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]
            ideal = before[:, :2] / before[:, 2:]
            left.append(np.linalg.norm(focal * on_plane(ideal, plane) + middle - view.corners, axis=1))
            poses.append(pose)
        if len(poses) == len(views) and (score := float(np.median(np.concatenate(left)))) < best:
            best, found = score, np.concatenate([[focal], *poses])
    return best, found


def _pose(view: View, recorded: np.ndarray, plane: Plane) -> np.ndarray | None:
    """Of a board whose corners are recorded at (m, 2) focal lengths; None where it is not told."""
    known = np.linalg.norm(recorded, axis=1) < _WIDEST if plane == "stereographic" else np.ones(len(recorded), bool)
    if known.sum() < _FEWEST:
        return None
    ideal = off_plane(recorded[known], plane)
    try:
        good, turn, place = cv2.solvePnP(view.places[known], ideal, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return None
    if not good:
        return None
    pose = np.concatenate([turn.ravel(), place.ravel()])
    depth = view.places @ cv2.Rodrigues(turn)[0][2] + place[2]
    return pose if (depth > 0).all() and np.isfinite(pose).all() else None


def _extent(boards, square, plane: Plane, poses: np.ndarray, room: float) -> np.ndarray:
    """Least and largest places on the plane of corners and of the axis, with some room around."""
    places = [np.zeros((1, 2))]
    for board, pose in zip(boards, poses.reshape(-1, 6), strict=True):
        before = View.of(board, square).places @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]
        places.append(on_plane(before[:, :2] / before[:, 2:], plane))
    low, high = np.concatenate(places).min(0), np.concatenate(places).max(0)
    return np.concatenate([low - room * (high - low), high + room * (high - low)])
