"""``python -m tests.proofs peer FILE...``: another program's corners of a real camera, by our models.

FILE is a camera model of mrcal (github: dkogan/mrcal, doc/data/figueroa-overpass-looking-S, ``opencv8-0.cameramodel``
and ``splined-0.cameramodel``), which holds its ``optimization_inputs``: corners with weights, poses, the board's warp
and the solution. Its projections are evaluated as its documentation defines them (doc/lensmodels.org,
doc/formulation.org, doc/splined-models.org). Exit status 1 if its own model, adjusted here, ends elsewhere than stored.
"""

from __future__ import annotations

import ast
import base64
import io
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer
from scipy import stats
from scipy.interpolate import BSpline

import measure
from measure import Board
from measure.boards.adjustment import Adjusted, adjust, begin
from measure.boards.camera import DEFAULT_MODEL
from measure.boards.cross_validation import Known
from measure.boards.parameters import CameraModel, read_model, splined_control
from measure.boards.splined import fitted
from measure.boards.view import View
from scenes import InvalidInput, status

_OURS = "splined:8x6", "splined:14x10", DEFAULT_MODEL
_THEIRS = "opencv8"
_FAR = 4.0  # of what corners scatter: those beyond are counted
_MARGINS = 0.05, 0.15  # of the image's sides, that are not compared
_ORIGIN, _MOVED = np.zeros(3), 0.5  # of a standard deviation: their optimum is held by regularisation, ours is not


@dataclass(frozen=True, eq=False)
class Rational:
    """OpenCV's eight coefficients, LENSMODEL_OPENCV8."""

    names: tuple[str, ...] = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")

    @property
    def prior(self) -> np.ndarray:
        return np.zeros((0, 12))

    def seen(self, values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        matrix = np.array([[values[0], 0, values[2]], [0, values[1], values[3]], [0, 0, 1.0]])
        image, by = cv2.projectPoints(points[:, None], _ORIGIN, _ORIGIN, matrix, values[4:])
        by = by.reshape(len(points), 2, -1)
        return image.reshape(-1, 2), by[..., 6:18], by[..., 3:6]


@dataclass(frozen=True, eq=False)
class Stereographic:
    """LENSMODEL_SPLINED_STEREOGRAPHIC, cubic: fx, fy, cx, cy and two displacements of each control point, row by row.
    Derivatives by points are differences; by the values there are none."""

    control: tuple[int, int]
    field_deg: float
    names: tuple[str, ...] = ()

    @property
    def prior(self) -> np.ndarray:
        return np.zeros((0, 0))

    def seen(self, values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points = points / np.linalg.norm(points, axis=1, keepdims=True)
        steps = 1e-6 * np.eye(3)
        by = [(self._image(values, points + h) - self._image(values, points - h)) / 2e-6 for h in steps]
        return self._image(values, points), np.zeros((len(points), 2, 0)), np.stack(by, -1)

    def _image(self, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        beside = np.linalg.norm(points[:, :2], axis=1)
        angle = np.arctan2(beside, points[:, 2])
        u = points[:, :2] * (2 * np.tan(angle / 2) / np.maximum(beside, 1e-300))[:, None]
        columns, rows = self.control
        per_unit = (columns - 3) / (4 * np.tan(np.radians(self.field_deg) / 4))
        weights = []
        for place, count in zip((u * per_unit + (np.array(self.control) - 1) / 2).T, self.control, strict=True):
            knots = np.arange(-2.0, count + 2)
            inside = np.clip(place, 1, count - 2 - 1e-9)
            weights.append(BSpline.design_matrix(inside, knots, 3, extrapolate=True).toarray())
        moved = np.einsum("ni,nj,jik->nk", *weights, values[4:].reshape(rows, columns, 2))
        return values[:2] * (u + moved) + values[2:4]


@dataclass(frozen=True, eq=False)
class Peer:
    """A stored calibration: its model with all numbers, boards, poses, how the board is bent."""

    name: str
    model: Rational | Stereographic
    values: np.ndarray
    boards: list[Board]
    poses: np.ndarray
    sags: np.ndarray
    square: float
    image_shape: tuple[int, int]

    @property
    def marked(self) -> int:
        """Corners that it takes for outliers."""
        return sum(int((~board.measured).sum()) for board in self.boards)

    @property
    def stored(self) -> float:
        """Weighted distance of corners that the stored solution leaves, px rms."""
        known = Known(self.model, self.values)
        return _rms(_evaluated(self.boards, self.square, known, self.poses, self.sags))


@dataclass(frozen=True, eq=False)
class Found:
    """A camera by one of the models, its covariance by how corners scatter, as `measure.projection_difference` asks."""

    model: CameraModel
    values: np.ndarray
    covariance: np.ndarray
    image_shape: tuple[int, int]


def read(path: Path) -> Peer:
    """A calibration that mrcal stored.

    Raises
    ------
    InvalidInput
        If the file is none of one camera and one kind of board.
    """
    try:
        text = path.read_text()
        held = ast.literal_eval(text[text.index("{") :])["optimization_inputs"]
        with np.load(io.BytesIO(base64.b85decode(held)), allow_pickle=False) as arrays:
            told = dict(arrays)
        return _peer(path.name, told)
    except (OSError, ValueError, KeyError, SyntaxError, zipfile.BadZipFile) as error:
        raise InvalidInput(
            f"FILE must be a camera model of mrcal with optimization_inputs, got {path}: {error}"
        ) from None


def _peer(name: str, told: dict[str, Any]) -> Peer:
    observed, lens = told["observations_board"], str(told["lensmodel"])
    rows, columns = observed.shape[1:3]
    boards = []
    for corners in observed.reshape(len(observed), -1, 3):
        weight = np.where(corners[:, 2] > 0, corners[:, 2], np.nan)
        state = tuple(status.OK if good else status.NOT_VISIBLE for good in corners[:, 2] > 0)
        covariance = np.eye(2) / weight[:, None, None] ** 2
        boards.append(Board((columns, rows), corners[:, :2], covariance, state, np.ones(len(corners)), 1.0, 1.0))
    splined = re.fullmatch(r"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=(\d+)_Ny=(\d+)_fov_x_deg=(\d+)", lens)
    if not splined and lens != "LENSMODEL_OPENCV8":
        raise ValueError(f"lensmodel must be OPENCV8 or cubic splines, got {lens}")
    model = Stereographic((int(splined[1]), int(splined[2])), float(splined[3])) if splined else Rational()
    width, height = map(int, told["imagersizes"][0])
    return Peer(
        name, model, told["intrinsics"][0], boards, told["frames_rt_toref"], told["calobject_warp"],
        float(told["calibration_object_spacing"]), (height, width),
    )  # fmt: skip


def _evaluated(boards, square: float, known: CameraModel, poses: np.ndarray, sags: np.ndarray) -> list[np.ndarray]:
    """Weighted residuals of each board's corners (m, 2), px, nothing adjusted."""
    views = [View.of(board, square) for board in boards]
    return [
        view.residual(known, np.zeros(0), sags, pose).reshape(-1, 2) for view, pose in zip(views, poses, strict=True)
    ]


def _rms(residuals: list[np.ndarray]) -> float:
    return float(np.sqrt((np.concatenate(residuals) ** 2).sum(1).mean()))


def _adjusted(peer: Peer, name: str, boards: list[Board], which: slice) -> tuple[CameraModel, Adjusted]:
    """By a model of ours, or by the peer's coefficients from where it ended."""
    control, start = splined_control(name), np.concatenate([peer.values, peer.poses[which].ravel()])
    model: CameraModel = Rational()
    if control:
        model, start = fitted(boards, peer.square, peer.image_shape, control)
    elif name != _THEIRS:
        model = read_model(name)
        start = begin(boards, peer.square, peer.image_shape, read_model(name))
    return model, adjust(boards, peer.square, model, start, curved=True)


def _found(peer: Peer, model: CameraModel, adjusted: Adjusted) -> Found:
    k = len(model.names)
    scale = adjusted.chi_square / (adjusted.rows - adjusted.told)
    return Found(model, adjusted.parameters[:k], scale * adjusted.covariance[:k, :k], peer.image_shape)


@dataclass(frozen=True, eq=False)
class Line:
    """What a model leaves of all corners, how two halves of the photographs differ by it, and the squared residuals of
    each board (n,) by the half that it is not in."""

    text: str
    model: CameraModel
    whole: Adjusted
    found: Found
    left_out: np.ndarray


def line(peer: Peer, name: str) -> Line:
    """By a model."""
    model, whole = _adjusted(peer, name, peer.boards, slice(None))
    found, k, n = _found(peer, model, whole), len(model.names), len(peer.boards)
    poses = whole.parameters[k:].reshape(-1, 6)
    halves, left_out = [], np.zeros(n)
    for which in (slice(0, None, 2), slice(1, None, 2)):
        half = _adjusted(peer, name, peer.boards[which], which)
        halves.append(_found(peer, *half))
        known = Known(half[0], halves[-1].values)
        for i in set(range(n)) - set(range(n)[which]):
            asked = adjust([peer.boards[i]], peer.square, known, poses[i], sags=half[1].sags)
            left_out[i] = asked.chi_square
    apart = _compared(*halves)
    left = np.sqrt(whole.chi_square / whole.rows * 2)
    weights = [1 / np.sqrt(board.covariance[:, 0, 0]) for board in peer.boards]
    each = np.concatenate([np.abs(w[:, None] * r).max(1) for w, r in zip(weights, whole.residuals, strict=True)])
    far = int((each > _FAR * left / np.sqrt(2)).sum())
    centre = " ".join(f"{found.values[i]:9.2f}" for i, each in enumerate(model.names) if each in ("fx", "cx", "cy"))
    sags = " ".join(f"{1e3 * sag:+7.3f}" for sag in whole.sags)
    others = float(np.sqrt(2 * left_out.sum() / whole.rows))
    unknowns = whole.told - 6 * n
    text = f"{name:<18}{unknowns:7.0f} {left:8.4f} {others:8.4f} {far:5d} {centre:<30} {sags} {apart}"
    return Line(text, model, whole, found, left_out)


def _compared(first: Found, second: Found) -> str:
    """How far projections are apart, px rms, and what is told, over the image and over its inner half."""
    told = [measure.projection_difference(first, second, margin) for margin in _MARGINS]
    return "  ".join(f"{each.rms_px:7.3f} {each.told_px:7.3f} {len(each.places):4d}/{each.wanted}" for each in told)


def _stored(theirs: Peer) -> tuple[Line | None, bool]:
    """What the stored solution leaves; by its own model, where that can be adjusted here, and whether it stays."""
    corners = sum(len(board.corners) for board in theirs.boards)
    print(
        f"{theirs.name}: {len(theirs.boards)} boards, {corners} corners, {theirs.marked} marked as outliers; the "
        f"stored solution leaves {theirs.stored:.4f} px rms", flush=True,
    )  # fmt: skip
    if not isinstance(theirs.model, Rational):
        return None, True
    plain = line(theirs, _THEIRS)
    k = len(plain.model.names)
    moved = np.abs(plain.whole.parameters[:k] - theirs.values) / np.sqrt(np.diag(plain.whole.covariance)[:k])
    print(f"its own model, adjusted here: moved by at most {moved.max():.2f} sigma\n{plain.text}", flush=True)
    return plain, bool(moved.max() < _MOVED)


def peer(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Camera models of mrcal.")],
    models: Annotated[str, typer.Option(help="Of ours, with semicolons between.")] = ";".join(_OURS),
) -> None:
    """The corners that mrcal calibrated a real camera with, by our models; five minutes of processor time."""
    try:
        stored = [read(path) for path in files]
    except InvalidInput as error:
        print(error)
        raise typer.Exit(2) from None
    print("model, unknowns told, px rms, the same of boards left out, corners far off, fx cx cy, sags mm;")
    print("halves differ by, are told to, places; the same without the rim")
    told = [_stored(each) for each in stored]
    plain, last = next((each for each, _ in told if each is not None), None), stored[-1]
    known = Found(Known(last.model, last.values), last.values, np.zeros((0, 0)), last.image_shape)
    for name in models.split(";"):
        ours = line(last, name.strip())
        print(ours.text, flush=True)
        if plain is not None:
            better = stats.wilcoxon(plain.left_out, ours.left_out, alternative="greater").pvalue
            print(f"{'':18}boards left out better than by {_THEIRS}: p = {better:.2g}", flush=True)
        print(f"{'':18}against the stored {last.name}: {_compared(ours.found, known)}", flush=True)
    raise typer.Exit(0 if all(stays for _, stays in told) else 1)
