"""Cameras calibrated from simulated boards: nearer to the truth than with OpenCV's corners, and as exact as they say.

With ``--photos`` a folder of chessboard photographs is calibrated with each kind of corners; the truth not being known,
what is left is printed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
_BORDER = 5  # px: half of cornerSubPix' window


@dataclass(frozen=True)
class Comparison:
    """Of both kinds of corners: rms against the true ones and of the calibration's residuals, px."""

    ours: tuple[float, float]
    theirs: tuple[float, float]

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

    @property
    def p_value(self) -> float:
        """Two-sided."""
        p = stats.chi2.cdf(self.total, self.rows)
        return float(2 * min(p, 1 - p))


def by_opencv(board: Board, image: np.ndarray) -> Board:
    """The same corners by cornerSubPix."""
    grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    good = board.measured
    start = np.ascontiguousarray(np.rint(board.corners[good])[:, None], np.float32)
    found = np.full(board.corners.shape, np.nan)
    found[good] = cv2.cornerSubPix(grey, start, (_BORDER, _BORDER), (-1, -1), _CRITERIA)[:, 0]
    return replace(board, corners=found, covariance=np.tile(_SUB_PIX_PX**2 * np.eye(2), (len(found), 1, 1)))


def through_images(rig: Rig, views: int, runs: int, noise: float, rng: np.random.Generator, distance: float):
    """Calibrations from noisy images of the same views: a `Comparison` and the `Truth` of ours."""
    seen = poses(rig, views, rng, distance)
    clean = [rig.image(pose) for pose in seen]
    squares, rows, pulls = np.zeros((2, 2)), np.zeros(2), []
    total = 0.0
    for _ in range(runs):
        images = [np.rint(image + rng.normal(0, noise, image.shape)) for image in clean]
        ours = [measure.chessboard(image, rig.board) for image in images]
        theirs = [by_opencv(board, image) for board, image in zip(ours, images, strict=True)]
        for k, boards in enumerate((ours, theirs)):
            found = measure.calibrate_camera(boards, rig.square, rig.size[::-1])
            away = [b.corners - in_order(b, rig.corners(pose)) for b, pose in zip(boards, seen, strict=True)]
            squares[k] += [np.square(np.concatenate(each)).sum() for each in (away, found.residuals)]
            rows[k] += sum(board.measured.sum() for board in boards)
            if k == 0:
                error = found.values - rig.values
                total += error @ np.linalg.solve(found.covariance, error)
                pulls.append(error / found.sd)
    rms = np.sqrt(squares / rows[:, None])
    return Comparison(tuple(rms[0]), tuple(rms[1])), Truth(total, 9 * runs, np.array(pulls))


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
    photos: Annotated[Path | None, typer.Option(metavar="DIR", help="Instead: these chessboard photographs.")] = None,
) -> None:
    """Calibrated cameras beside the truth, or photographs; exit status 1 if a claim does not hold."""
    if photos is not None:
        raise typer.Exit(_photographs(photos))
    rig, distance = (LARGE, 420.0) if large else (SMALL, 420.0)
    rng = np.random.default_rng(seed)
    compared, imaged = through_images(rig, views, runs, 2.0, rng, distance)
    cornered = through_corners(rig, views, corner_runs, rng, distance)
    print(f"{'':24}true corners  residuals  (rms px)")
    print(f"{'ours':24}{compared.ours[0]:12.5f}{compared.ours[1]:11.5f}")
    print(f"{'cornerSubPix':24}{compared.theirs[0]:12.5f}{compared.theirs[1]:11.5f}")
    print(f"{'ratio, at most 0.6':24}{compared.ratios[0]:12.3f}{compared.ratios[1]:11.3f}")
    for name, found in ((f"{runs} runs of images", imaged), (f"{corner_runs} runs of corners", cornered)):
        print(f"{name}: chi-square {found.total:.1f} for {found.rows}, p = {found.p_value:.3f}")
        print("  sd of the pulls, fx fy cx cy k1 k2 p1 p2 k3: " + " ".join(f"{s:.2f}" for s in found.pulls.std(0)))
        print("  mean:                                        " + " ".join(f"{s:+.2f}" for s in found.pulls.mean(0)))
    good = max(compared.ratios) <= ENOUGH and min(imaged.p_value, cornered.p_value) > FALSE_ALARM / 2
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
