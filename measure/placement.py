"""Where the part lies in a picture: found anywhere within what is plausible, then adjusted from its datums or a
board."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.boards.seen import NEEDED
from imaging.light.appearance import is_plain
from imaging.placed import combined, placed
from measure.best import best_estimator
from measure.features.board import by_board
from measure.goodness import WORST
from measure.measurement import DEFAULT_ESTIMATOR, checked_image
from measure.quantities import MeasuredFeatures, find
from measure.registration import Place, candidates, rivals
from scenes import InvalidInput, Picture, Scene, status
from scenes.arrays import picture as one_picture

_STEPS = 6
_BENDS = (1.0, -1.0, 2.0, -2.0, 3.0, -3.0)  # standard deviations of k1
_SETTLED = 0.02  # px that an adjustment still moves a datum: what is not linear in it is then far below the noise


@dataclass(frozen=True, eq=False)
class Located:
    """The place of a part in a picture.

    Attributes
    ----------
    picture : Picture
        The part where it lies to a few hundredths of a px, as `measure.measure` takes it, which adjusts the rest; as
        the scene says where `status` is not ``ok``. Where a board tells k1 so that edges are a misfit, by the k1 near
        it with which they are straightest.
    placement : ndarray, shape (6 + c,)
        Shift along x, y and z, the scene's unit, and rotation vector about the point that the camera looks at,
        degrees; then the deviation of each of ``placement.camera``, of the focal length its logarithm.
    covariance : ndarray, shape (6 + c, 6 + c)
        Of the shift and of the rotation that is still missing, along the part's own axes, and of the camera's
        deviations; the scene's unit and degrees squared. Infinite on the diagonal where it is not found.
    status : str
        ``ok``; ``ambiguous`` where another place explains the picture as well; ``not_visible`` where none does.
    explained : float
        Share of the model's visible edges on which a step of grey levels lies, or of the board's points that are found.
    reason : str
        Why it is not ``ok``; empty where it is.
    """

    picture: Picture
    placement: np.ndarray
    covariance: np.ndarray
    status: str
    explained: float
    reason: str = ""


def locate(
    image: np.ndarray, scene: Scene | Picture, sensor: Any = None, light: Any = None, estimator: str | None = None
) -> Located:
    """Find the part in a picture, within what the scene says is plausible of its place.

    Parameters
    ----------
    image : ndarray, shape (height, width)
        Grey levels.
    scene, sensor, light, estimator
        As for `measure.measure`; the scene's placement is from datums or a board.

    Raises
    ------
    InvalidInput
        If the scene does not say that the part's place is to be found.

    Notes
    -----
    Coarsely by `measure.registration`, whose best places are compared; then by Gauss-Newton steps of the adjustment of
    the datums (`imaging.features.placing`) until they settle. A board is looked for itself, anywhere in the picture.
    """
    picture = Picture.of(scene, sensor, light)
    if not picture.scene.placement.is_estimated:
        told = picture.scene.placement.source
        raise InvalidInput(f"placement.from must be datums or board to find the part, got {told!r}")
    camera = picture.scene.camera
    levels = checked_image(one_picture(image), (camera.height, camera.width))
    if picture.scene.placement.board is not None:
        start, share = by_board(levels, picture)
        if start is None:
            return _nowhere(picture, status.NOT_VISIBLE, "no board as told lies within what is plausible", 0.0)
        return adjusted(levels, picture, start, estimator, share)
    found = candidates(levels, picture)
    if not found:
        return _nowhere(picture, status.NOT_VISIBLE, "no place within what is plausible explains the picture", 0.0)
    best, others = found[0], rivals(found)
    if others:
        return _nowhere(picture, status.AMBIGUOUS, _both(best, others[0]), best.explained)
    return adjusted(levels, picture, best.placement, estimator, best.explained)


def adjusted(
    image: np.ndarray, picture: Picture, start: np.ndarray, estimator: str | None = None, explained: float = 1.0
) -> Located:
    """The place of a part that lies about at a start (6 + c,), within the capture of the locator.

    First by the gradient locator, which needs no lights; then, in plain scenes, by the estimator that is meant, which
    may take levels from the lights.
    """
    here = before = np.asarray(start, float)
    name = estimator or best_estimator(picture)
    passes = [(DEFAULT_ESTIMATOR, False)]
    if name != DEFAULT_ESTIMATOR and is_plain(picture.scene) and picture.lights:
        passes.append((name, True))
    for method, lit in passes:
        for _ in range(_STEPS):
            there = placed(picture, here)
            found = find(image[None], there if lit else there.unlit(), method)
            step = found.known.placing.root @ found.placement[0]
            if not np.isfinite(step).all() or not _told(found).any():
                return _nowhere(picture, status.NOT_VISIBLE, _why_untold(found), explained)
            before, here = here, combined(here, step)
            if _moved(found) < _SETTLED:
                break
        else:
            return _nowhere(picture, status.ILL_CONDITIONED, "its adjustment does not settle", explained)
    best = _straightest(image, picture, before, found, passes[-1])
    return Located(placed(picture, best), here, found.adjustment.covariance()[0], status.OK, explained)


def _straightest(
    image: np.ndarray, picture: Picture, here: np.ndarray, found: MeasuredFeatures, last: tuple[str, bool]
) -> np.ndarray:
    """Where edges are as straight as they look, (6 + c,): a placement, or near it as far as k1 is not known.

    A board may leave more of k1 open than edges do, which then are a misfit of the lens that it tells. What is adjusted
    is the same from either.
    """
    numbers, (method, lit) = picture.scene.placement.camera, last
    if "k1" not in numbers or not found.shape.p_value[0] < WORST:
        return here
    covariance, k1 = found.adjustment.covariance()[0], 6 + numbers.index("k1")
    along = covariance[k1] / np.sqrt(covariance[k1, k1])
    likely = {}
    for many in _BENDS:
        there = placed(picture, combined(here, many * along))
        fits = find(image[None], there if lit else there.unlit(), method).shape.p_value[0]
        likely[many] = np.nan_to_num(fits) * np.exp(-(many**2) / 2)
    best = max(likely, key=lambda many: likely[many])
    return combined(here, best * along) if likely[best] > found.shape.p_value[0] else here


def _told(found: MeasuredFeatures) -> np.ndarray:
    """Which features of one image tell of the place, bool (q,)."""
    variances = np.diagonal(found.of_datums[0])
    return found.known.placing.datums & np.isfinite(variances) & np.isfinite(found.offsets[0])


def _why_untold(found: MeasuredFeatures) -> str:
    """Why nothing tells of the place."""
    board = found.known.placing.board
    if board is not None and not np.isfinite(board.noise[..., 0, 0]).any():
        return NEEDED
    return "nothing that tells it is found"


def _moved(found: MeasuredFeatures) -> float:
    """How far that moves the datums' ends or radii, or the board's points, at most, px."""
    placing, seen = found.known.placing, found.known.seen
    if placing.board is not None:
        return float(np.linalg.norm(placing.board.slopes @ found.placement[0], axis=-1).max())
    moved = placing.slopes @ found.placement[0]
    lengths = np.linalg.norm(seen.along, axis=-1)
    size = np.ones(seen.count)
    size[1 : 2 * len(lengths) : 2] = lengths
    for c in range(len(seen.circles)):
        size[seen.numbers(c)] = seen.camera.focal_px / seen.divisor(seen.centres[c])
    return float(np.abs(moved * size)[_told(found)].max(initial=0.0))


def _nowhere(picture: Picture, state: str, reason: str, explained: float) -> Located:
    none = np.full(picture.scene.placement.mean.size, np.nan)
    return Located(picture, none, np.diag(np.full(none.size, np.inf)), state, explained, reason)


def _both(best: Place, other: Place) -> str:
    return f"two places explain the picture equally well: {best}, and {other}"
