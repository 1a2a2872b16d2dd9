"""``ICE_DATA=DIR python -m tests.proofs known-sizes``: are dots and squares of real patterns where they have to be?

DIR holds photographs of dot patterns and of a chessboard (github: DiamondLightSource/discorpy, folder data): lines that
are straight, steps that are equal. Every second dot tells pose and lens, one photograph each; where the others have to
be follows, and how far they are off is compared with what is told of them: told covariances, enlarged where the fit
says so, have to hold 95 % of them. Without DIR nothing is done, and the exit status is 0.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from scipy import stats

import measure
from measure import Board
from measure.boards.adjustment import Adjusted, adjust, begin
from measure.boards.eccentricity import centred
from measure.boards.parameters import Model, read_model
from scenes import InvalidInput, status
from scenes.files import image as image_file

PATTERNS = "dot_pattern_0*.jpg", "laptop_camera/chessboard.jpg"
_MODELS = "none", "k1,f", "k1,k2,p1,p2,k3,f"
_INSIDE = 0.95
_LEAST = 40  # dots


@dataclass(frozen=True)
class Row:
    """Of one photograph, by a lens model: dots used and held out, px that these are off (root mean square along each
    axis), told px, squared residuals of the fit over what is told, and which part of those held out lies in the
    ellipse of 95 %, as told by the dots alone and with what the fit adds."""

    file: str
    model: str
    used: int
    held_out: int
    off_px: float
    told_px: float
    dispersion: float
    inside: float
    inside_enlarged: float

    @property
    def interval(self) -> tuple[float, float]:
        """Of `inside_enlarged`, 95 % (Clopper and Pearson)."""
        found = stats.binomtest(round(self.inside_enlarged * self.held_out), self.held_out).proportion_ci()
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"{self.file:<22}{self.model:<18}{self.used:5d} {self.held_out:5d}  off {self.off_px:7.4f} px, told "
            f"{self.told_px:7.4f}, dispersion {self.dispersion:9.1f}, inside {self.inside:6.1%}, enlarged "
            f"{self.inside_enlarged:6.1%} [{low:.1%}, {high:.1%}]"
        )


def judged(board: Board, file: str, shape: tuple[int, int], model: str) -> Row:
    """What half of the dots tell of the other half, in a photograph of such a (height, width)."""
    even = board.places.sum(1) % 2 == 0
    half, free = _only(board, even), read_model(model)
    found = adjust([half], 1.0, free, begin([half], 1.0, shape, free))
    for _ in range(2):
        found = adjust(centred([half], 1.0, free, found.parameters), 1.0, free, found.parameters)
    which = board.measured & ~even
    away = _away(board, free, found)[which]
    covariance = board.covariance[which]
    square = np.einsum("ni,nij,nj->n", away, np.linalg.inv(covariance), away)
    freedom = found.rows - len(found.parameters)
    dispersion, limit = max(found.chi_square / freedom, 1.0), stats.chi2.ppf(_INSIDE, 2)
    return Row(
        file, model, int(half.measured.sum()), int(which.sum()), float(np.sqrt((away**2).mean())),
        float(np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean() / 2)), float(found.chi_square / freedom),
        float((square < limit).mean()), float((square < limit * dispersion).mean()),
    )  # fmt: skip


def _only(board: Board, which: np.ndarray) -> Board:
    """Without the other dots."""
    state = tuple(each if kept else status.NOT_VISIBLE for each, kept in zip(board.status, which, strict=True))
    return replace(board, status=state)


def _away(board: Board, model: Model, found: Adjusted) -> np.ndarray:
    """Measured less expected centres of all dots (n, 2), px."""
    whole = centred([board], 1.0, model, found.parameters)
    one = replace(whole[0], radius=0.0)
    return _residuals(one, model, found.parameters)


def _residuals(board: Board, model: Model, parameters: np.ndarray) -> np.ndarray:
    k = len(model.names)
    matrix, coefficients = model.camera(parameters[:k])
    places = np.column_stack([board.places, np.zeros(len(board.places))])
    seen = cv2.projectPoints(places[:, None], parameters[k : k + 3], parameters[k + 3 :], matrix, coefficients)[0]
    return board.corners - seen.reshape(-1, 2)


def photographs(root: Path) -> list[Path]:
    """Of patterns below a folder."""
    return sorted(file for pattern in PATTERNS for file in root.rglob(pattern))


def known_sizes(
    only: Annotated[str, typer.Option(help="Files whose names have this in them.")] = "",
) -> None:
    """Dots and corners of real patterns, against where the others say they are; some minutes."""
    root = os.environ.get("ICE_DATA", "")
    files = [file for file in photographs(Path(root)) if only in file.name] if root else []
    if not files:
        print("ICE_DATA names no folder with dot patterns (github: DiamondLightSource/discorpy): nothing done.")
        raise typer.Exit
    good = True
    for file in files:
        levels = image_file.read(file)
        try:
            board = (measure.chessboard if "chess" in file.name else measure.dot_grid)(levels)
        except InvalidInput as error:
            print(f"{file.name}: {error}")
            continue
        told = {name: board.status.count(name) for name in sorted(set(board.status))}
        print(f"{file.name}: {board.shape[0]} x {board.shape[1]}, {told}, noise {board.noise:.2f}", flush=True)
        if board.measured.sum() < _LEAST:
            continue
        rows = [judged(board, file.name, levels.shape, model) for model in _MODELS]
        print(*rows, sep="\n", flush=True)
        good &= rows[-1].interval[1] >= _INSIDE
    raise typer.Exit(0 if good else 1)
