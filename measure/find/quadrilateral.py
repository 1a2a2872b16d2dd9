"""Find the quadrilateral in a photograph when no pose is known."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.special import ndtr, ndtri

from measure.features.corners import intersect
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from scenes import InvalidInput

_LEVELS = 24
_CUT = 2.5  # standard deviations beyond which a second difference is no noise
_ENOUGH, _BAND = 1_000_000, 64  # pixels that tell the noise to 0.1 %, and where a quadrilateral is; rows taken together
_CUTS = 8  # times that the cut is made anew
_SMALLEST = 0.004  # part of the image's area
_REACH = 6.0  # px across a side
_ORDINARY = 0.7  # px: a usual lens blur


def noise_sigma(image: np.ndarray) -> float:
    """Standard deviation of white noise, from second differences, which plain surfaces do not have.

    The mask [[1, -2, 1], [-2, 4, -2], [1, -2, 1]] (Immerkaer 1996) has norm 6. Differences beyond 2.5 standard
    deviations are edges and do not count; what the cut takes away of normal noise is put back.

    Examples
    --------
    >>> bool(abs(noise_sigma(np.random.default_rng(1).normal(50, 3, (200, 200))) - 3) < 0.1)
    True
    """
    mask = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
    image = np.asarray(image)
    image = image if image.dtype == np.uint8 else np.asarray(image, np.float32)
    rows = max(image.size // _ENOUGH, 1)  # bands of rows, so many apart, tell enough
    bands = [image[i : i + _BAND] for i in range(0, len(image), rows * _BAND)]
    square = np.concatenate([np.square(cv2.filter2D(b, cv2.CV_32F, mask)[1:-1, 1:-1].ravel()) for b in bands])
    sigma = float(np.sqrt(np.median(square)) / ndtri(0.75))
    left = 1 - 2 * _CUT * np.exp(-(_CUT**2) / 2) / np.sqrt(2 * np.pi) / (2 * ndtr(_CUT) - 1)  # of the mean square
    for _ in range(_CUTS):
        kept = square <= (_CUT * max(sigma, 1e-6)) ** 2
        sigma = float(np.sqrt(square[kept].mean() / left)) if kept.any() else sigma
    return sigma / 6


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


def refined(image: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Corners (4, 2) of lines through the steepest places across each side: to some tenths of a pixel.

    As they were where a line is not found within 6 px.
    """
    lines = []
    for places, normal, offsets, profiles in _across(image, corners):
        rise = np.diff(profiles, axis=1)
        steep = np.clip(rise * np.sign(rise.sum()), 0, None) ** 2
        middle = (steep @ (offsets[1:] + offsets[:-1]) / 2) / np.maximum(steep.sum(1), 1e-12)
        points = (places + middle[:, None] * normal).astype(np.float32)
        lines.append(cv2.fitLine(points, cv2.DIST_HUBER, 0, 0.01, 0.01).ravel().astype(float))
    along, points = np.split(np.array(lines), 2, axis=1)
    normals = np.stack([-along[:, 1], along[:, 0]], 1)
    found, _ = intersect(np.stack([np.roll(normals, 1, 0), normals], 1), np.stack([np.roll(points, 1, 0), points], 1))
    return found if np.abs(found - corners).max() < 2 * _REACH else corners


def edge_sigma(image: np.ndarray, corners: np.ndarray) -> float:
    """Lens blur (standard deviation, px) from the width of the quadrilateral's sides, the pixel's box taken off.

    The derivative of each side's mean profile, cut at 6 px, has the blur's variance; the median of the sides counts.
    """
    widths = []
    for _, _, offsets, profiles in _across(image, corners):
        rise = np.diff(profiles.mean(0))
        middles = (offsets[1:] + offsets[:-1]) / 2
        centre = (middles * np.abs(rise)).sum() / max(np.abs(rise).sum(), 1e-12)
        weight = np.where(np.abs(middles - centre) < 4, rise, 0)
        if abs(weight.sum()) > 1e-9:
            mean = (weight * middles).sum() / weight.sum()
            widths.append((weight * (middles - mean) ** 2).sum() / weight.sum() - 1 / 12 - 0.5**2 / 12)
    return float(np.sqrt(np.clip(np.median(widths), 0.09, 16.0))) if widths else _ORDINARY


def _across(image: np.ndarray, corners: np.ndarray):
    """For each side 80 places on it (80, 2), its normal, offsets along it (T,), px, and grey levels there (80, T)."""
    layout = polygon_layout(corners, Optics(image.shape, _ORDINARY))
    offsets, levels = np.arange(-_REACH, _REACH + 0.01, 0.5), image.astype(np.float32)
    for (start, stop), normal in zip(layout.ends, layout.normals, strict=True):
        places = start + np.linspace(0.2, 0.8, 80)[:, None] * (stop - start)
        where = (places[:, None] + offsets[:, None] * normal).astype(np.float32)
        yield places, normal, offsets, cv2.remap(levels, where, None, cv2.INTER_CUBIC)
