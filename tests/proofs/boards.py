"""Cameras calibrated from simulated boards: nearer to the truth than with OpenCV's corners, and as exact as they say.

``--kind charuco`` and ``--kind markers`` are ChArUco boards and grids of AprilTags, beside OpenCV's own detectors.
With ``--photos`` a folder of chessboard photographs is calibrated with each kind of corners; the truth not being known,
what is left is printed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from scipy import stats

import measure
from measure.boards.chessboard import Board
from scenes import InvalidInput
from scenes.files.image import read
from tests.boards import SMALL, Rig, in_order, poses, told

ENOUGH = 0.6  # of cornerSubPix' reprojection error
FALSE_ALARM = 0.01
LARGE = Rig(np.array([[780.0, 0, 322.0], [0, 782.0, 236.0], [0, 0, 1]]), (-0.22, 0.08, 0.001, -0.0005, 0.0))
_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-4)
_SUB_PIX_PX = 0.1  # a guess of its standard deviation; the same for all corners, it does not change the fit
SHARE = 0.7  # of a square, or of the way to the next marker: a marker's side
_BORDER = 5  # px: half of cornerSubPix' window


@dataclass(frozen=True)
class Comparison:
    """Of both kinds of corners: rms against the true ones and of the calibration's residuals, px."""

    ours: tuple[float, float]
    theirs: tuple[float, float]
    camera: np.ndarray
    """Of each intrinsic, root mean square error of ours over theirs."""

    @property
    def ratios(self) -> tuple[float, float]:
        """Ours over cornerSubPix'."""
        return self.ours[0] / self.theirs[0], self.ours[1] / self.theirs[1]


@dataclass(frozen=True)
class Truth:
    """Squared errors of calibrations over their covariance: of all intrinsics together, and of each, in sigma."""

    total: float
    rows: int
    pulls: np.ndarray
    corners: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """Pulls of all corners."""

    @property
    def p_value(self) -> float:
        """Two-sided."""
        p = stats.chi2.cdf(self.total, self.rows)
        return float(2 * min(p, 1 - p))


def by_opencv(board: Board, image: np.ndarray) -> Board:
    """The same corners by cornerSubPix."""
    grey = _grey(image)
    good = board.measured
    start = np.ascontiguousarray(np.rint(board.corners[good])[:, None], np.float32)
    found = np.full(board.corners.shape, np.nan)
    found[good] = cv2.cornerSubPix(grey, start, (_BORDER, _BORDER), (-1, -1), _CRITERIA)[:, 0]
    return _alike(board, found)


def by_charuco_detector(board: Board, image: np.ndarray) -> Board:
    """The same corners by OpenCV's detector of ChArUco boards."""
    size = (board.shape[0] + 1, board.shape[1] + 1)
    known = cv2.aruco.CharucoBoard(size, 1.0, SHARE, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100))
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(known).detectBoard(_grey(image))
    found = np.full(board.corners.shape, np.nan)
    found[numbers.ravel()] = corners.reshape(-1, 2)
    return _alike(board, found)


def by_marker_detector(board: Board, image: np.ndarray) -> Board:
    """The same corners by OpenCV's detector of markers, with its refinement by lines, its best here."""
    how = cv2.aruco.DetectorParameters()
    how.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, numbers, _ = cv2.aruco.ArucoDetector(known, how).detectMarkers(_grey(image))
    found = np.full((len(board.corners) // 4, 4, 2), np.nan)
    for number, four in zip(numbers.ravel(), corners, strict=True):
        found[number] = four[0][[0, 1, 3, 2]]
    return _alike(board, found.reshape(-1, 2))


def _grey(image: np.ndarray) -> np.ndarray:
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _alike(board: Board, found: np.ndarray) -> Board:
    """Corners that all count the same, where both have measured one."""
    status = tuple(
        each if np.isfinite(place).all() else "not_visible" for each, place in zip(board.status, found, strict=True)
    )
    corners = np.where(board.measured[:, None], found, np.nan)
    return replace(
        board, corners=corners, status=status, covariance=np.tile(_SUB_PIX_PX**2 * np.eye(2), (len(found), 1, 1))
    )


@dataclass(frozen=True)
class Kind:
    """A kind of board: how it is drawn and measured, by whom it is measured beside, and where its corners are."""

    shape: tuple[int, int]
    square: float
    draw: Callable[[Rig, np.ndarray], np.ndarray]
    ours: Callable[[Rig, np.ndarray], Board]
    theirs: Callable[[Board, np.ndarray], Board]
    truth: Callable[[Rig, np.ndarray, Board], np.ndarray]
    name: str = "cornerSubPix"


CHESSBOARD = Kind(
    (9, 6), 25.0, Rig.image, lambda rig, image: measure.chessboard(image, rig.board), by_opencv,
    lambda rig, pose, board: in_order(board, rig.corners(pose)),
)  # fmt: skip
CHARUCO = Kind(
    (7, 5), 30.0, lambda rig, pose: rig.charuco(pose, "DICT_5X5_100", SHARE),
    lambda rig, image: measure.charuco(image, rig.board, "DICT_5X5_100", SHARE), by_charuco_detector,
    lambda rig, pose, board: rig.corners(pose), "CharucoDetector",
)  # fmt: skip
TAGS = Kind(
    (5, 4), 42.0, lambda rig, pose: rig.markers(pose, "DICT_APRILTAG_36h11", SHARE),
    lambda rig, image: measure.marker_grid(image, rig.board, "DICT_APRILTAG_36h11", SHARE), by_marker_detector,
    lambda rig, pose, board: rig.marker_corners(pose, SHARE), "ArucoDetector",
)  # fmt: skip
KINDS = {"chessboard": CHESSBOARD, "charuco": CHARUCO, "markers": TAGS}


def through_images(
    rig: Rig, views: int, runs: int, noise: float, rng: np.random.Generator, distance: float, kind: Kind = CHESSBOARD
):
    """Calibrations from noisy images of the same views: a `Comparison`, and the `Truth` of ours."""
    seen = poses(rig, views, rng, distance)
    clean = [kind.draw(rig, pose) for pose in seen]
    squares, rows, pulls, errors = np.zeros((2, 2)), np.zeros(2), [], ([], [])
    corners, total = [], 0.0
    for _ in range(runs):
        images = [np.rint(image + rng.normal(0, noise, image.shape)) for image in clean]
        ours = [kind.ours(rig, image) for image in images]
        theirs = [kind.theirs(board, image) for board, image in zip(ours, images, strict=True)]
        for k, boards in enumerate((ours, theirs)):
            found = measure.calibrate_camera(boards, rig.square, rig.size[::-1])
            away = [b.corners - kind.truth(rig, pose, b) for b, pose in zip(boards, seen, strict=True)]
            squares[k] += [np.nansum(np.square(np.concatenate(each))) for each in (away, found.residuals)]
            rows[k] += sum(board.measured.sum() for board in boards)
            error = found.values - rig.values
            errors[k].append(error)
            if k == 0:
                total += error @ np.linalg.solve(found.covariance, error)
                pulls.append(error / found.sd)
                corners += [pull(board, off) for board, off in zip(boards, away, strict=True)]
    rms = np.sqrt(squares / rows[:, None])
    camera = [np.sqrt(np.mean(np.square(each), 0)) for each in errors]
    compared = Comparison(tuple(rms[0]), tuple(rms[1]), camera[0] / camera[1])
    return compared, Truth(total, 9 * runs, np.array(pulls), np.concatenate(corners))


def pull(board: Board, off: np.ndarray) -> np.ndarray:
    """Errors of measured corners over their covariance's root, (n, 2)."""
    good = board.measured
    return np.einsum("nij,nj->ni", np.linalg.inv(np.linalg.cholesky(board.covariance[good])), off[good])


def through_corners(rig: Rig, views: int, runs: int, rng: np.random.Generator, distance: float) -> Truth:
    """Calibrations from corners with normal errors of the covariance that one image of each view tells."""
    seen = poses(rig, views, rng, distance)
    boards = [measure.chessboard(rig.image(pose), rig.board, noise=2.0) for pose in seen]
    truth = [in_order(board, rig.corners(pose)) for board, pose in zip(boards, seen, strict=True)]
    total, pulls = 0.0, []
    for _ in range(runs):
        drawn = []
        for board, true in zip(boards, truth, strict=True):
            root = np.linalg.cholesky(board.covariance)
            error = np.einsum("nij,nj->ni", root, rng.normal(size=true.shape))
            drawn.append(told(true + error, board.covariance, board.shape))
        found = measure.calibrate_camera(drawn, rig.square, rig.size[::-1])
        error = found.values - rig.values
        total += error @ np.linalg.solve(found.covariance, error)
        pulls.append(error / found.sd)
    return Truth(total, 9 * runs, np.array(pulls))


def boards(
    runs: Annotated[int, typer.Option(help="Calibrations through images.")] = 40,
    corner_runs: Annotated[int, typer.Option(help="Calibrations through simulated corners.")] = 200,
    views: Annotated[int, typer.Option(help="Boards of a calibration.")] = 8,
    large: Annotated[bool, typer.Option("--large", help="640 x 480 px instead of 320 x 240.")] = False,
    seed: Annotated[int, typer.Option()] = 1,
    kind: Annotated[str, typer.Option(help="chessboard, charuco or markers.")] = "chessboard",
    photos: Annotated[Path | None, typer.Option(metavar="DIR", help="Instead: these chessboard photographs.")] = None,
) -> None:
    """Calibrated cameras beside the truth, or photographs; exit status 1 if a claim does not hold."""
    if kind not in KINDS:
        raise typer.BadParameter(f"--kind must be one of {', '.join(KINDS)}, got {kind!r}")
    if photos is not None:
        raise typer.Exit(_photographs(photos))
    looked = KINDS[kind]
    rig = replace(LARGE if large else SMALL, board=looked.shape, square=looked.square)
    rng = np.random.default_rng(seed)
    compared, imaged = through_images(rig, views, runs, 2.0, rng, 420.0, looked)
    told = {f"{runs} runs of images": imaged}
    if looked is CHESSBOARD:
        told[f"{corner_runs} runs of corners"] = through_corners(rig, views, corner_runs, rng, 420.0)
    print(f"{'':24}true corners  residuals  (rms px)")
    print(f"{'ours':24}{compared.ours[0]:12.5f}{compared.ours[1]:11.5f}")
    print(f"{looked.name:24}{compared.theirs[0]:12.5f}{compared.theirs[1]:11.5f}")
    print(f"{'ratio, at most 0.6':24}{compared.ratios[0]:12.3f}{compared.ratios[1]:11.3f}")
    print("rms error of fx fy cx cy k1 k2 p1 p2 k3, ours over theirs: " + " ".join(f"{r:.2f}" for r in compared.camera))
    for name, found in told.items():
        print(f"{name}: chi-square {found.total:.1f} for {found.rows}, p = {found.p_value:.3f}")
        print("  sd of the pulls, fx fy cx cy k1 k2 p1 p2 k3: " + " ".join(f"{s:.2f}" for s in found.pulls.std(0)))
        print("  mean:                                        " + " ".join(f"{s:+.2f}" for s in found.pulls.mean(0)))
        if found.corners.size:
            off, (x, y) = found.corners, found.corners.mean(0)
            print(f"  of {len(off)} corners: sd of the pulls {off.std():.3f}, mean {x:+.3f} {y:+.3f}")
    good = max(compared.ratios) <= ENOUGH and min(found.p_value for found in told.values()) > FALSE_ALARM / 2
    raise typer.Exit(0 if good else 1)


def photographed(folder: Path) -> dict[str, measure.CameraCalibration]:
    """The camera of a folder of chessboard photographs, by each kind of corners.

    Raises
    ------
    InvalidInput
        If fewer than 3 photographs of the first one's size show a board.
    """
    ours, theirs, shape = [], [], None
    for path in sorted(each for each in folder.iterdir() if each.suffix.lower() in (".png", ".jpg", ".jpeg", ".tif")):
        try:
            image = read(path)
            board = measure.chessboard(image) if shape in (None, image.shape) else None
        except InvalidInput:
            continue
        if board is not None and board.measured.sum() >= 8:
            shape = image.shape
            ours.append(board)
            theirs.append(by_opencv(board, image))
    shape = shape or (1, 1)
    return {name: measure.calibrate_camera(each, 1.0, shape) for name, each in (("ours", ours), ("theirs", theirs))}


def _photographs(folder: Path) -> int:
    found = photographed(folder)
    ours, theirs = found["ours"], found["theirs"]
    excess = ours.chi_square / ours.freedom
    print(
        f"ours: {len(ours.residuals)} boards, {ours.rms_px:.4f} px rms, chi-square {excess:.3g} a degree, {ours.status}"
    )
    print(f"cornerSubPix: {theirs.rms_px:.4f} px rms")
    return 0 if ours.rms_px <= theirs.rms_px else 1
