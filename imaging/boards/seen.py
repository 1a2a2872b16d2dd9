"""What the points of a board beside the part tell of the place of both.

Points are found off by y = J p + L b + s + e: J their derivative by the placement p (of part and board together), L b
what is not known of the board's place relative to the part and of its pitch, s what print and flatness leave open of
each point, e noise. All that they tell of p is in k numbers (k the components that are not exact): the place that fits
the points best, in units in which b, s and e together have the covariance 1. These count as the parameters of one more
feature beside lines and circles (`imaging.features.seen`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging import sensor
from imaging.boards.dot_fitting import dot_expected, dot_reach
from imaging.boards.fitting import crossing_rows
from imaging.boards.saddle import response
from imaging.boards.windows import INWARD, Marked, Windows, wedges, windows
from imaging.boards.windows import steps as ways
from imaging.features.displaced import points_by_deviations
from imaging.features.seen import Seen
from imaging.geometry.blur import blur_at
from imaging.geometry.lens import image_centre, lens_jacobian, recorded
from imaging.geometry.projection import depth, from_axis
from imaging.geometry.rays import first_face
from imaging.light.appearance import signal
from imaging.pictures import Pictures
from scenes import Board, Material
from scenes.placement import of_board, pitch_u, root

_MARGIN = 14.0  # px from the image's ends: beyond what a corner's window reaches
CLEAR = 40.0  # px between part and board: farther than an estimator looks beside an edge, and blurs
NEEDED = (
    "no point of the board is found: it must be lit, in the picture, large enough, and "
    f"{CLEAR:g} px beside the part there"
)
_UNTOLD = 1e-9  # of what was known before: a direction of which points tell less is none
_EXACT = 1e-16  # px^2: of points without noise and print


@dataclass(frozen=True, eq=False)
class SeenBoard:
    """A board in pictures of leading shape (...): n points, k components of the placement in units of their u before.

    Attributes
    ----------
    board : Board
    slopes : ndarray, shape (..., n, 2, k)
        J: ideal px.
    noise : ndarray, shape (..., n, 2, 2)
        Covariance of each point by pixel noise, ideal px^2; infinite diagonal where it cannot be found.
    printed : ndarray, shape (..., n, 2, 2)
        The same by print and flatness.
    beside : ndarray, shape (..., n, 2, m)
        L in standard uncertainties: place relative to the part, pitch.
    """

    board: Board
    slopes: np.ndarray
    noise: np.ndarray
    printed: np.ndarray
    beside: np.ndarray

    def gain(self, noise: np.ndarray | None = None) -> np.ndarray:
        """Derivatives (..., k, n, 2) of the board's parameters by its points, found with a noise (..., n, 2, 2) of
        their own."""
        fit, _ = self._fit(self.noise if noise is None else noise)
        return np.einsum("...kl,...lni->...kni", self.root, fit)

    def spread(self, covariance: np.ndarray, gain: np.ndarray | None = None) -> np.ndarray:
        """Covariance (..., k, k) of the parameters by independent errors of the points (..., n, 2, 2)."""
        gain = self.gain() if gain is None else gain
        known = np.where(np.isfinite(covariance), covariance, 0.0)
        return np.einsum("...kni,...nij,...lnj->...kl", gain, known, gain)

    @property
    def of_beside(self) -> np.ndarray:
        """The same by place relative to the part and pitch."""
        moved = np.einsum("...kni,...nim->...km", self.gain(), self.beside)
        return moved @ np.swapaxes(moved, -1, -2)

    @cached_property
    def root(self) -> np.ndarray:
        """Derivatives (..., k, k) of the parameters by the placement: a square root of what they tell of it."""
        fit, (sizes, directions) = self._fit(self.noise)
        told = sizes > _UNTOLD
        whole = np.where(told, np.sqrt(np.maximum(sizes, 0.0)), 0.0)[..., None] * np.swapaxes(directions, -1, -2)
        moved = whole @ np.einsum("...kni,...nim->...km", fit, self.beside)
        total, turn = np.linalg.eigh(np.eye(whole.shape[-1]) + moved @ np.swapaxes(moved, -1, -2))
        return (turn / np.sqrt(total)[..., None, :]) @ np.swapaxes(turn, -1, -2) @ whole

    def _fit(self, noise: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Weighted least squares, (..., k, n, 2), and sizes and directions of what the points tell."""
        whole = noise + self.printed + _EXACT * np.eye(2)
        there = np.isfinite(np.einsum("...ii->...", whole))[..., None, None]
        weight = np.where(there, np.linalg.inv(np.where(there, whole, np.eye(2))), 0.0)
        back = np.einsum("...nik,...nij->...knj", self.slopes, weight)
        sizes, directions = np.linalg.eigh(np.einsum("...knj,...njl->...kl", back, self.slopes))
        inverse = np.where(sizes > _UNTOLD, 1 / np.where(sizes > _UNTOLD, sizes, 1.0), 0.0)[..., None, :]
        covariance = (directions * inverse) @ np.swapaxes(directions, -1, -2)
        return np.einsum("...kl,...lnj->...knj", covariance, back), (sizes, directions)


def seen_board(pictures: Pictures, seen: Seen) -> SeenBoard | None:
    """That of a scene as it is expected; None where there is no board."""
    board, said = pictures.scene.placement.board, pictures.scene.uncertainty
    if board is None:
        return None
    by_place = seen.slopes(board.points)  # (..., n, 2, 3)
    moved = points_by_deviations(board.points, pictures.sensors, pictures.scene)
    by_pitch = np.einsum("...nij,nj->...ni", by_place, board.by_pitch)[..., None] * pitch_u(pictures.scene)
    beside = np.concatenate([moved[..., :6] * of_board(said), by_pitch], -1)
    return SeenBoard(
        board=board,
        slopes=moved @ root(pictures.scene),
        noise=_noise(pictures, board),
        printed=board.point_sd**2 * by_place @ np.swapaxes(by_place, -1, -2),
        beside=beside,
    )


def _noise(pictures: Pictures, board: Board) -> np.ndarray:
    """Covariance (..., n, 2, 2) of points as they are found, ideal px^2."""
    camera, centre = pictures.scene.camera, image_centre(pictures.scene.camera)
    ideal = centre + from_axis(board.points, pictures.sensors, camera)
    places = recorded(ideal, camera)
    back = np.linalg.inv(lens_jacobian(ideal, camera))
    share, noise = _contrast(pictures, board)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = noise / share**2
        found = size[..., None, None] * (back @ _unit(pictures, board, places) @ np.swapaxes(back, -1, -2))
    there = _inside(places, camera) & _apart(pictures, board)[..., None]
    good = np.isfinite(found).all((-1, -2)) & (share > 0) & there
    return np.where(good[..., None, None], found, np.where(np.eye(2, dtype=bool), np.inf, 0.0))


def levels(pictures: Pictures, board: Board, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signals of bright and of dark at points (n, 3) of a board, grey levels above darkness, (..., n) each.

    0 where a light or the sensor does not reach them, or the part shades them; as of a white surface before the light
    where it is not known where that stands.
    """
    shades = board.bright, board.dark
    if not pictures.lights:
        lead = (*pictures.sensors.shape[:-1], len(points))
        bright, dark = (np.full(lead, pictures.scene.camera.exposure * shade) for shade in shades)
        return bright, dark
    lit = tuple(_lit(pictures, np.asarray(emitter.at), points) for emitter in pictures.emitters)
    normal = board.axes[2]
    bright, dark = (
        signal(pictures, points, normal, 1, lit, material=Material(diffuse_reflectance=shade)) for shade in shades
    )
    return bright, dark


def _lit(pictures: Pictures, at: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether light from places (..., 3) passes the part on its way to points (n, 3), bool (..., n)."""
    start = np.broadcast_to(at[..., None, :], (*at.shape[:-1], *points.shape))
    _, t = first_face(pictures.scene.bodies, start, points - start, ())
    return t >= 1


def _contrast(pictures: Pictures, board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Recorded contrast of bright and dark, and the mean variance of the noise of both, (..., n) each."""
    noise = pictures.scene.noise
    both = [sensor.recorded(noise, noise.dark_level + each) for each in levels(pictures, board, board.points)]
    return both[0].level - both[1].level, (both[0].noise_variance + both[1].noise_variance) / 2


def _inside(places: np.ndarray, camera) -> np.ndarray:
    """Which recorded places (..., 2) are far enough from the image's ends."""
    last = np.array([camera.width, camera.height]) - 1
    with np.errstate(invalid="ignore"):
        return ((places >= _MARGIN) & (places <= last - _MARGIN)).all(-1)


def _apart(pictures: Pictures, board: Board) -> np.ndarray:
    """Whether a side of the board has all of the part behind it in the picture, bool (...)."""
    shown = (board.outline, pictures.scene.solid.vertices)
    return apart(*(from_axis(each, pictures.sensors, pictures.scene.camera) for each in shown))


def apart(outline: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Whether a side of a board's image (..., 4, 2) has all points of a part's image (..., n, 2) `CLEAR` px beyond it,
    bool (...)."""
    side = np.roll(outline, -1, -2) - outline
    normal = np.stack([side[..., 1], -side[..., 0]], -1)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    away = np.einsum("...si,...spi->...sp", normal, part[..., None, :, :] - outline[..., :, None, :])
    middle = np.einsum("...si,...si->...s", normal, outline.mean(-2, keepdims=True) - outline)
    beyond = -np.sign(middle)[..., None] * away
    return (beyond > CLEAR).all(-1).any(-1)


def _unit(pictures: Pictures, board: Board, places: np.ndarray) -> np.ndarray:
    """Covariance of points for unit noise and unit contrast, recorded px^2: (..., 1, 2, 2), or (..., n, 2, 2) of n
    corners of markers.

    All of a board's points are taken to be seen as that in its middle, or as the four of the marker there: what differs
    from end to end is alike on both sides of it. Infinite where there is no room.
    """
    camera, lead = pictures.scene.camera, places.shape[:-2]
    grids = places.reshape(*lead, *board.laid, 2)
    y, x = (count // 2 for count in board.laid[:2])
    middle = (y, x, *(0 for _ in board.laid[2:]))
    away = depth(board.points.reshape(*board.laid, 3)[middle][None], pictures.sensors, camera)[..., 0]
    blur = np.broadcast_to(blur_at(camera, away, grids[(..., *middle, slice(None))]), lead)
    if board.kind == "markers":
        gap, cell = (1 - board.share) / board.share, 1 / board.cells
        each = [wedge(grids[i][y, x], float(blur[i]), gap, cell) for i in np.ndindex(*lead)]
        return np.tile(np.reshape(each, (*lead, 4, 2, 2)), (board.markers, 1, 1))
    grids = grids[..., y - 1 : y + 2, x - 1 : x + 2, :]
    if board.kind == "dots":
        each = [dot(grids[i], float(blur[i]), board.radius / board.pitch) for i in np.ndindex(*lead)]
    else:
        marked = marked_beside(board, x + y)
        each = [crossing(grids[i], float(blur[i]), marked) for i in np.ndindex(*lead)]
    return np.reshape(each, (*lead, 1, 2, 2))


def marked_beside(board: Board, skipped: int = 0) -> Marked | None:
    """What corners lie beside, from one so many columns and rows behind the first on; None without markers."""
    if board.kind != "charuco":
        return None
    return Marked((1 - board.share) / 2, board.before == (skipped % 2 == 0))


def crossing(grid: np.ndarray, blur: float, marked: Marked | None = None) -> np.ndarray:
    """Covariance (2, 2) of the middle one of 3 x 3 corners (3, 3, 2), px, as it is fitted, px^2, maybe beside markers.

    For noise of variance 1 in each pixel and a contrast of 1 of bright and dark squares.
    """
    if not np.isfinite(grid).all():
        return np.full((2, 2), np.inf)
    around = int(_MARGIN) + 2
    here = grid - np.rint(grid[1, 1]) + around
    window = windows(np.zeros((2 * around + 1, 2 * around + 1)), here, marked, blur).some(np.array([4]))
    return _fitted(window, here[None, 1, 1], ways(here)[None, 1, 1], blur, np.array([[0.0, 0.0, 0.5]]))[0]


def wedge(quad: np.ndarray, blur: float, gap: float, cell: float) -> np.ndarray:
    """The same (4, 2, 2) of a dark marker's corners (2, 2, 2), px; ``gap`` and ``cell`` as of `windows.wedges`."""
    if not np.isfinite(quad).all():
        return np.full((4, 2, 2), np.inf)
    corners = quad.reshape(-1, 2)
    here = quad - np.rint(corners.min(0)) + int(_MARGIN)
    size = int(np.ceil(np.ptp(corners, axis=0).max())) + 2 * int(_MARGIN) + 2
    toward = ways(here).reshape(-1, 2, 2)
    turn = np.sign(toward[:, 0, 0] * toward[:, 1, 1] - toward[:, 0, 1] * toward[:, 1, 0])
    one, other = turn * INWARD[:, 1], -turn * INWARD[:, 0]  # sides of both edges on which it is dark
    window = wedges(np.zeros((size, size)), here[None], gap, cell, blur)
    return _fitted(window, here.reshape(-1, 2), toward, blur, -np.stack([one, other, one * other], -1) / 4)


def _fitted(found: Windows, corners: np.ndarray, toward: np.ndarray, blur: float, parts: np.ndarray) -> np.ndarray:
    """Covariance (n, 2, 2) of crossings at n corners (n, 2), px, as they are fitted: their edges run (n, 2, 2), their
    levels are so much (n, 3) of the signs of both edges and of their product."""
    covariance, room = np.full((len(corners), 2, 2), np.inf), np.flatnonzero(found.room)
    if not room.size:
        return covariance
    some, straight = found.some(room), np.zeros((room.size, 2))
    angles = np.arctan2(toward[..., 1], toward[..., 0])
    shape = np.column_stack([corners, angles, np.full(len(corners), np.log(blur))])[room]
    signs = response(some.places, shape, straight).signs
    some.levels[:] = np.where(some.there, np.einsum("npk,nk->np", signs, parts[room]), 0.0)
    rows = crossing_rows(some, shape, straight)
    covariance[room] = rows @ np.swapaxes(rows, -1, -2)
    return covariance


def dot(grid: np.ndarray, blur: float, share: float) -> np.ndarray:
    """The same of dots whose radius is a share of the way from one to the next."""
    if not np.isfinite(grid).all():
        return np.full((2, 2), np.inf)
    return leaning(grid, blur, share)[0]


def leaning(grid: np.ndarray, blur: float, share: float) -> tuple[np.ndarray, np.ndarray]:
    """The same, and the derivative (2, 2) of its centre by the slope of the light over the light, px^2."""
    toward = ways(grid)[1, 1].T
    axes, size, _ = np.linalg.svd(share * toward)
    ellipse = np.array([*grid[1, 1], *size, np.degrees(np.arctan2(axes[1, 0], axes[0, 0]))])
    reach = float(dot_reach(size[0], np.sqrt(abs(np.linalg.det(toward)))))
    return dot_expected(ellipse, reach, float(np.hypot(blur, 12**-0.5)))
