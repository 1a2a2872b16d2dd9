"""A quadrilateral in a user's own photograph: sides, diagonals and angles, each with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from measure.estimators.registry import SYNONYMS
from measure.features.found import Shape
from measure.features.layout import Layout
from measure.features.shape import find_shape
from measure.find.search import find_quadrilateral
from measure.goodness import WORST
from measure.photo.binned import back, bin_size, binned, into
from measure.photo.expected import Expected, expected, likeliest
from measure.photo.grown import grown_covariance
from measure.photo.lens import AnyIntrinsics, straight_corners
from measure.photo.noise_curve import NoiseCurve
from measure.photo.profiles import refined
from measure.photo.recording import Recording, recording
from scenes import InvalidInput, status
from scenes.arrays import finite, picture
from scenes.photograph import Photograph

_ALIKE = 0.05  # of a standard deviation: what correlated noise may change before the status says so


@dataclass(frozen=True)
class MeasuredValue:
    """A measured number: name, value, standard deviation (1 sigma) and unit ("px" or "deg")."""

    name: str
    value: float
    sigma: float
    unit: str


@dataclass(frozen=True, eq=False)
class Quadrilateral:
    """What a photograph tells.

    Attributes
    ----------
    corners : ndarray, shape (4, 2)
        (x, y), px, in order around it; without distortion if a lens was given.
    covariance : ndarray, shape (8, 8)
        Joint covariance of all corners, px^2.
    measurands : tuple of MeasuredValue
        Four sides, two diagonals, four angles.
    noise, blur_px : float
        Standard deviation of a grey level, at the mean level around it, and of the lens blur, px (of the sharpest side
        where they differ), as estimated from the image.
    status : str
        ``compressed``, ``correlated`` and ``misfit`` come with values whose standard deviation is not to be relied on,
        ``tone_unknown`` with such as are right only if levels are linear in the light.
    p_value : float
        Goodness of fit of straight sides, smooth faces, Gaussian blur and white noise, whichever estimator measured:
        where it is below 1e-4 the status is ``misfit``. NaN where a lens bends the sides.
    estimator : str
        What measured: ``strip`` instead of ``arrangement`` where the sides are not equally blurred.
    curve : NoiseCurve
        Variance of the noise at each grey level.
    side_blur_px : ndarray, shape (4,)
        Standard deviation of each side's blur, px; NaN where it is not told.
    """

    corners: np.ndarray
    covariance: np.ndarray
    measurands: tuple[MeasuredValue, ...]
    noise: float
    blur_px: float
    status: str
    p_value: float
    estimator: str
    curve: NoiseCurve
    side_blur_px: np.ndarray


def measure_quadrilateral(
    image: np.ndarray | Photograph,
    estimator: str = "arrangement",
    lens: AnyIntrinsics | None = None,
    corners: np.ndarray | None = None,
) -> Quadrilateral:
    """Measure a quadrilateral: the one near ``corners``, or else the most prominent one.

    Parameters
    ----------
    image : array_like, shape (height, width), or Photograph
        Grey levels, linear in the light; `scenes.photograph.read` makes them of a file.
    estimator : {"strip", "arrangement", "isophote", "gradient", "canny"}
        With a lens always ``gradient``, whose edge points are freed from distortion one by one.
    lens : Intrinsics or SplinedIntrinsics, optional
        Intrinsics and distortion.
    corners : array_like, shape (4, 2), optional
        Where its corners are, (x, y), px, to some 5 px, in order around it.

    Raises
    ------
    InvalidInput
        If there is no quadrilateral, the image is no image, or the corners are no quadrilateral's in it.
    """
    photo = image if isinstance(image, Photograph) else Photograph(picture(image))
    levels, name = photo.levels, SYNONYMS.get(estimator, estimator)
    near = find_quadrilateral(levels) if corners is None else _expected(corners, levels.shape)
    near = refined(levels, near)
    seen = recording(photo, near)
    size = 1 if lens is not None else bin_size(levels, near)
    if size > 1:
        coarse = measure_quadrilateral(binned(photo, size, seen.compressed), name, corners=into(near, size))
        return _finer(coarse, size, seen, levels)
    there = expected(levels, near, seen)
    found = _found(levels, there, "gradient" if lens is not None else name, lens is None)
    if found.state in status.MEASURED and lens is not None:
        straight = straight_corners(levels, there.at(lens.straighten(found.corners)), lens)
        found = replace(found, corners=straight.corners, covariance=straight.covariance, p_value=float("nan"))
    elif found.state in status.MEASURED and not seen.correlation.white:
        found = _grown(levels, found, seen)
    if found.state in status.MEASURED:
        said = status.OK if seen.correlation.white or found.alike else status.CORRELATED
        tone = there.blur.tone.status(photo.tone_known)
        found = replace(found, state=status.worst(found.state, said, seen.status, tone))
    return _reported(found, there, seen)


@dataclass(frozen=True, eq=False)
class _Found:
    """Corners, their covariance, and how they were found; ``alike`` where correlation hardly changes them."""

    corners: np.ndarray
    covariance: np.ndarray
    state: str
    p_value: float
    estimator: str
    threshold: float
    layout: Layout
    alike: bool = False


def _finer(found: Quadrilateral, size: int, seen: Recording, levels: np.ndarray) -> Quadrilateral:
    """What was measured in larger pixels, told in those of the photograph, whose noise is ``seen``."""
    corners, covariance = back(found.corners, size), size**2 * found.covariance
    noise = float(np.sqrt(seen.curve.variance(levels.mean())))
    values = _values(corners, covariance) if np.isfinite(corners).all() else ()
    return replace(
        found, corners=corners, covariance=covariance, measurands=values, noise=noise, curve=seen.curve,
        blur_px=size * found.blur_px, side_blur_px=size * found.side_blur_px,
    )  # fmt: skip


def _found(levels: np.ndarray, there: Expected, name: str, judged: bool) -> _Found:
    """What an estimator finds in the image; where sides differ in their blur each is measured by itself."""
    image, apart = levels[None], there.blur.differs
    if not judged or apart:
        return _beside(levels, there, name, judged)
    whole, shown = likeliest(levels, there.bent if name == "arrangement" else there)
    if whole.status[0] not in status.MEASURED:
        return _beside(levels, there, name, judged)
    there = shown
    corners, state = whole.corners[0], str(whole.status[0])
    near = there.at(corners)
    if name == "arrangement":
        return _told(whole, state, whole.p_value[0], name, 1.0, near)
    threshold = _threshold(whole)
    shape = find_shape(image, near, name, threshold, judged=False)
    fits = status.MISFIT if state == status.MISFIT else status.OK
    return _told(shape, _judged(shape, fits, there), whole.p_value[0], name, threshold, near)


def _beside(levels: np.ndarray, there: Expected, name: str, judged: bool) -> _Found:
    """Each side by itself, from where edge points show it: where their blur differs, or the whole is not seen."""
    first = find_shape(levels[None], there.layout, "gradient")
    state = str(first.status[0])
    if state not in status.MEASURED or not judged:
        return _told(first, state, np.nan, "gradient", 1.0, there.layout)
    near, threshold = there.at(first.corners[0]), _threshold(first)
    name, shape = "strip" if name == "arrangement" else name, first
    if name != "gradient":
        shape = find_shape(levels[None], near, name, threshold, judged=False)
    fits = status.OK if there.blur.p_value >= WORST else status.MISFIT
    return _told(shape, _judged(shape, fits, there), there.blur.p_value, name, threshold, near)


def _judged(shape: Shape, fits: str, there: Expected) -> str:
    """Status of what each side by itself tells."""
    state = str(shape.status[0])
    uneven = status.CLUTTER if there.uneven else status.OK
    return status.worst(state, fits, uneven) if state in status.MEASURED else state


def _told(shape: Shape, state: str, p: float, name: str, threshold: float, layout: Layout) -> _Found:
    return _Found(shape.corners[0], shape.covariance[0], state, float(p), name, threshold, layout)


def _grown(levels: np.ndarray, found: _Found, seen: Recording) -> _Found:
    """With the covariance that correlated noise makes."""
    whole = grown_covariance(levels, found.layout, seen, found.estimator, found.threshold)
    if not np.isfinite(whole).all():
        return replace(found, covariance=found.covariance * max(float(seen.correlation.kernel.sum()), 1.0))
    change = np.sqrt(np.diag(whole) / np.diag(found.covariance))
    return replace(found, covariance=whole, alike=bool(np.abs(change - 1).max() < _ALIKE))


def _expected(corners: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    corners = finite(corners, "corners")
    if corners.shape != (4, 2) or not cv2.isContourConvex(corners.astype(np.float32)):
        raise InvalidInput(f"corners must be the four corners of a convex quadrilateral, got {corners.tolist()}")
    if (corners < 0).any() or (corners > np.array(shape[::-1]) - 1).any():
        raise InvalidInput(f"corners must lie in the image of {shape[1]} x {shape[0]} px, got {corners.tolist()}")
    return corners


def _threshold(shape) -> float:
    """Canny's gradient threshold at a third of the weakest edge's peak, grey levels a px."""
    return float(max(shape.edge_contrast[0].min() / 9, 1e-6))


def _reported(found: _Found, there: Expected, seen: Recording) -> Quadrilateral:
    values = _values(found.corners, found.covariance) if np.isfinite(found.corners).all() else ()
    optics, sides = there.layout.optics, there.blur.sigma
    return Quadrilateral(
        found.corners, found.covariance, values, float(np.sqrt(optics.noise_variance)), optics.blur_px, found.state,
        found.p_value, found.estimator, seen.curve, sides,
    )  # fmt: skip


def _values(corners: np.ndarray, covariance: np.ndarray) -> tuple[MeasuredValue, ...]:
    found = [_length(f"side {i + 1}-{(i + 1) % 4 + 1}", corners, covariance, i, (i + 1) % 4) for i in range(4)]
    found += [_length(f"diagonal {i + 1}-{i + 3}", corners, covariance, i, i + 2) for i in range(2)]
    return tuple(found + [_angle(f"angle {i + 1}", corners, covariance, i) for i in range(4)])


def _length(name: str, corners: np.ndarray, covariance: np.ndarray, i: int, j: int) -> MeasuredValue:
    across = corners[j] - corners[i]
    value = float(np.linalg.norm(across))
    gradient = np.zeros(8)
    gradient[2 * i : 2 * i + 2], gradient[2 * j : 2 * j + 2] = -across / value, across / value
    return MeasuredValue(name, value, float(np.sqrt(gradient @ covariance @ gradient)), "px")


def _angle(name: str, corners: np.ndarray, covariance: np.ndarray, i: int) -> MeasuredValue:
    """Angle at corner i: each arm's direction turns by its cross component over its length."""
    gradient, directions = np.zeros(8), []
    for sign, j in ((1, (i + 1) % 4), (-1, (i - 1) % 4)):
        arm = corners[j] - corners[i]
        turn = sign * np.array([-arm[1], arm[0]]) / (arm @ arm)
        gradient[2 * j : 2 * j + 2] += turn
        gradient[2 * i : 2 * i + 2] -= turn
        directions.append(arm / np.linalg.norm(arm))
    value = np.degrees(np.arccos(np.clip(directions[0] @ directions[1], -1, 1)))
    return MeasuredValue(name, float(value), float(np.degrees(np.sqrt(gradient @ covariance @ gradient))), "deg")
