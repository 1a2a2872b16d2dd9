"""Find the quadrilateral in a photograph when no pose is known."""

from __future__ import annotations

import cv2
import numpy as np

from scenes import InvalidInput

_LEVELS = 24
_ENOUGH = 1_000_000  # pixels in which a quadrilateral is sought
_SMALLEST = 0.004  # part of the image's area


def find_quadrilateral(image: np.ndarray) -> np.ndarray:
    """Corners of the most prominent convex quadrilateral, to a pixel or two (of a megapixel, where there are more).

    Parameters
    ----------
    image : ndarray, shape (height, width)
        Grey levels.

    Returns
    -------
    ndarray, shape (4, 2)
        (x, y), px, in order around it, the first the one nearest to the image's upper left corner.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    coarse, factor = _coarse(image)
    smooth = cv2.GaussianBlur(coarse, (0, 0), 1.0)
    gx, gy = cv2.Scharr(smooth, cv2.CV_32F, 1, 0) / 32, cv2.Scharr(smooth, cv2.CV_32F, 0, 1) / 32
    best, score = None, 0.0
    for corners in _candidates(smooth):
        strength = _support(corners, gx, gy)
        if strength > score:
            best, score = corners, strength
    if best is None:
        raise InvalidInput("image must show a convex quadrilateral, got none that stands out")
    first = int(np.argmin(best.sum(1)))
    return np.roll(best, -first, axis=0) * factor + (factor - 1) / 2


def _coarse(image: np.ndarray) -> tuple[np.ndarray, int]:
    """The image, or means of squares of its pixels that make some megapixel, and the squares' side."""
    factor = max(int(np.sqrt(image.size / _ENOUGH)), 1)
    height, width = (size // factor for size in image.shape)
    whole = np.asarray(image[: height * factor, : width * factor], np.float32)
    return (whole if factor == 1 else cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)), factor


def _candidates(smooth: np.ndarray):
    """Quadrilaterals among the outlines of the image cut at many grey levels, brighter and darker side."""
    low, high = np.percentile(smooth, [0.5, 99.5])
    for level in np.linspace(low, high, _LEVELS + 2)[1:-1]:
        cut = (smooth > level).astype(np.uint8)
        for part in (cut, 1 - cut):
            outlines, _ = cv2.findContours(part, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            for outline in outlines:
                corners = _four_corners(outline, smooth.shape)
                if corners is not None:
                    yield corners


def _four_corners(outline: np.ndarray, shape: tuple[int, int]) -> np.ndarray | None:
    if cv2.contourArea(outline) < _SMALLEST * shape[0] * shape[1]:
        return None
    length = cv2.arcLength(outline, True)
    for tolerance in (0.01, 0.02, 0.03, 0.05):
        corners = cv2.approxPolyDP(outline, tolerance * length, True)[:, 0].astype(float)
        if len(corners) == 4:
            inside = (corners > 1).all() and (corners < np.array(shape[::-1]) - 2).all()
            return corners if inside and cv2.isContourConvex(corners.astype(np.float32)) else None
    return None


def _support(corners: np.ndarray, gx: np.ndarray, gy: np.ndarray) -> float:
    """How strongly the image changes across the sides: the weakest side's mean gradient times root length."""
    means, total = [], 0.0
    for start, stop in zip(corners, np.roll(corners, -1, 0), strict=True):
        length = np.linalg.norm(stop - start)
        normal = np.array([-(stop - start)[1], (stop - start)[0]]) / length
        places = start + np.linspace(0.1, 0.9, 40)[:, None] * (stop - start)
        across = [places + offset * normal for offset in (-1.5, -0.5, 0.5, 1.5)]
        rises = [_sample(gx, p) * normal[0] + _sample(gy, p) * normal[1] for p in across]
        means.append(abs(np.mean(np.max(np.abs(rises), 0) * np.sign(np.sum(rises, 0)))))
        total += length
    return float(min(means) * np.sqrt(total))


def _sample(picture: np.ndarray, places: np.ndarray) -> np.ndarray:
    x, y = np.clip(np.rint(places).astype(int), 0, np.array(picture.shape[::-1]) - 1).T
    return picture[y, x]
