"""``ICE_DATA=DIR python -m tests.proofs shots``: is what one shot tells as far from the mean of many as it says?

DIR holds single shots of real cameras and means of hundreds (github: csjunxu/MCWNNM-ICCV2017, folder
Real_ccnoise_denoised_part, PNG; csjunxu/PolyU-Real-World-Noisy-Images-Dataset, CroppedImages, JPEG). Quadrilaterals,
circles and ellipses that the mean shows are measured in both, as `ice measure PHOTO` does; differences by the shot's
told covariance are numbers of standard deviation 1 where the status is `ok`. All other statuses are listed as well:
cameras interpolate, smooth and compress. Without DIR nothing is done, and the exit status is 0.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy import stats

import measure
from measure.find.candidate import CIRCLE, ELLIPSE, QUADRILATERAL
from measure.photo.ellipses import measure_ellipse
from measure.photo.photograph import MeasuredShape
from scenes import InvalidInput, photograph, status
from scenes.photograph import Photograph

_ENDINGS = {"_mean.png": "_real.png", "_mean.JPG": "_real.JPG"}
_OFF = 0.15  # of a standard deviation of 1, where the status is ok
_ROUND = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.5, 0.5]])  # centre and mean radius


@dataclass(frozen=True)
class Pull:
    """A shape in one shot: its kind, the shot's status, and its numbers less those of the mean, by their covariance."""

    file: str
    kind: str
    status: str
    whitened: np.ndarray

    @property
    def measured(self) -> bool:
        """Whether the shot shows it."""
        return self.whitened.size > 0


def pairs(root: Path) -> list[tuple[Path, Path]]:
    """Means and shots of them below a folder."""
    found = [(file, ending) for ending in _ENDINGS for file in root.rglob(f"*{ending}")]
    both = [(file, file.with_name(file.name.replace(ending, _ENDINGS[ending]))) for file, ending in sorted(found)]
    return [(mean, shot) for mean, shot in both if shot.exists()]


def pulls(mean: Photograph, shot: Photograph, file: str = "") -> Iterator[Pull]:
    """Of all shapes that the mean shows."""
    try:
        found = measure.photograph(mean, kinds=(QUADRILATERAL, CIRCLE, ELLIPSE), most=20).found
    except InvalidInput:
        return
    for shape in found:
        if not shape.measured:
            continue
        try:
            yield _quadrilateral(shape, shot, file) if shape.kind == QUADRILATERAL else _round(shape, shot, file)
        except InvalidInput:
            yield Pull(file, shape.kind, status.NOT_VISIBLE, np.empty(0))


def _quadrilateral(shape: MeasuredShape, shot: Photograph, file: str) -> Pull:
    told = measure.photograph(shot, corners=shape.corners).found[0]
    if not told.measured:
        return Pull(file, shape.kind, told.status, np.empty(0))
    return Pull(file, shape.kind, told.status, _by(told.covariance, (told.corners - shape.corners).ravel()))


def _round(shape: MeasuredShape, shot: Photograph, file: str) -> Pull:
    told = measure_ellipse(shot, shape.ellipse)
    if told.status not in status.MEASURED:
        return Pull(file, shape.kind, told.status, np.empty(0))
    away = _ROUND @ (told.parameters - shape.ellipse)[:4]
    return Pull(file, shape.kind, told.status, _by(_ROUND @ told.covariance[:4, :4] @ _ROUND.T, away))


def _by(covariance: np.ndarray, away: np.ndarray) -> np.ndarray:
    return np.linalg.solve(np.linalg.cholesky(covariance), away)


def spread(found: list[Pull]) -> tuple[float, float, float]:
    """Root mean square of the numbers, and its 95 % interval of as many independent ones."""
    numbers = np.concatenate([pull.whitened for pull in found])
    square, count = float((numbers**2).sum()), numbers.size
    low, high = square / stats.chi2.ppf([0.975, 0.025], count)
    return float(np.sqrt(square / count)), float(np.sqrt(low)), float(np.sqrt(high))


def shots(
    only: Annotated[str, typer.Option(help="Files whose names have this in them.")] = "",
) -> None:
    """Shapes in one shot and in the mean of many, over the told sigma; some minutes."""
    root = os.environ.get("ICE_DATA", "")
    files = [both for both in pairs(Path(root)) if only in both[0].name] if root else []
    if not files:
        print("ICE_DATA names no folder with means and shots (csjunxu/MCWNNM-ICCV2017 or PolyU): nothing done.")
        raise typer.Exit
    found: dict[str, list[Pull]] = defaultdict(list)
    for mean, shot in files:
        for pull in pulls(photograph.read(mean), photograph.read(shot), mean.name):
            found[pull.status].append(pull)
            told = f"{np.sqrt((pull.whitened**2).mean()):6.2f} of told sigma" if pull.measured else "not measured"
            print(f"{pull.file:<52}{pull.kind:<14}{pull.status:<13}{told}", flush=True)
    good = True
    for state, some in sorted(found.items()):
        kept = [pull for pull in some if pull.measured]
        if not kept:
            print(f"{state}: {len(some)} shapes, none measured in the shot")
            continue
        whole, low, high = spread(kept)
        middle = np.median([np.sqrt((pull.whitened**2).mean()) for pull in kept])
        print(f"{state}: {len(kept)} of {len(some)} shapes, spread {whole:.2f} [{low:.2f}, {high:.2f}], "
              f"median shape {middle:.2f}")  # fmt: skip
        good &= state != status.OK or (low < 1 + _OFF and high > 1 - _OFF)
    print(f"{len(files)} pairs, {len(found[status.OK])} shapes are ok")
    raise typer.Exit(0 if good else 1)
