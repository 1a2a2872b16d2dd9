"""Modulation transfer across a straight edge, by the slanted-edge method (ISO 12233), and how sure it is.

Pixels beside the edge, put in order by their distance from it, sample its spread function some eight times a pixel; its
derivative is the line spread function, and the size of that one's Fourier transform the modulation transfer: of lens,
motion and the pixel's own square together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure.estimators.strip_pixels import pixels_beside
from measure.features.calipers import edge_calipers
from measure.features.layout import Layout, polygon_layout
from measure.features.optics import Optics
from measure.photo.noise_curve import NoiseCurve, noise_curve
from scenes import InvalidInput
from scenes.arrays import finite, picture
from scenes.photograph import Photograph

STEP = 0.125  # px between samples of the edge spread
HALF = 12.0  # px to each side of the edge
_FEWEST = 24  # px of a side that tell it
_FREQUENCIES = np.arange(0, 1.0001, 0.01)  # cycles/px


@dataclass(frozen=True, eq=False)
class EdgeResponse:
    """What one side tells of the sharpness across it.

    Attributes
    ----------
    direction_deg : float
        Of the edge's normal, degrees from x towards y: the direction in which sharpness is told.
    offset, spread, spread_variance : ndarray, shape (T,)
        Distance from the edge, px; edge spread function from 0 to 1; its variance.
    line_offset, line : ndarray, shape (T - 1,)
        Line spread function, per px.
    frequency, mtf, mtf_variance : ndarray, shape (F,)
        Cycles/px; modulation transfer, 1 at frequency 0; its variance.
    mtf50, mtf50_error : float
        Frequency at which it is a half, cycles/px, and its standard error; NaN where it is nowhere below.
    """

    direction_deg: float
    offset: np.ndarray
    spread: np.ndarray
    spread_variance: np.ndarray
    line_offset: np.ndarray
    line: np.ndarray
    frequency: np.ndarray
    mtf: np.ndarray
    mtf_variance: np.ndarray
    mtf50: float
    mtf50_error: float


def mtf(image: np.ndarray | Photograph, corners: np.ndarray, side: int = 0) -> EdgeResponse:
    """Modulation transfer across a side of a convex polygon in an image.

    Parameters
    ----------
    image : array_like, shape (height, width), or Photograph
        Grey levels, linear in the light.
    corners : array_like, shape (k, 2)
        Of a polygon, in order around it, (x, y), px, to a tenth of a pixel (`measure_quadrilateral` gives them); two
        are the ends of one edge with nothing beside it.
    side : int
        From corner ``side`` to the next.

    Raises
    ------
    InvalidInput
        As `edge_response`, or if there is no such side.
    """
    photo = image if isinstance(image, Photograph) else Photograph(picture(image))
    corners = finite(corners, "corners")
    if corners.ndim != 2 or corners.shape[1] != 2 or not 0 <= side < max(len(corners) - (len(corners) == 2), 0):
        raise InvalidInput(f"side must be one of a polygon's of {len(corners)} corners, got {side}")
    if len(corners) == 2:
        across = np.array([-(corners[1] - corners[0])[1], (corners[1] - corners[0])[0]])
        corners = np.concatenate([corners, corners[::-1] + across])
    layout = polygon_layout(corners, Optics(photo.levels.shape))
    return edge_response(photo.levels, layout, side, noise_curve(photo.levels, photo.full))


def edge_response(image: np.ndarray, layout: Layout, side: int, curve: NoiseCurve) -> EdgeResponse:
    """Spread and modulation transfer across one side of a layout that lies on the image's sides.

    Raises
    ------
    InvalidInput
        If the side is too short, or so parallel to rows or columns of pixels that these do not tell all distances.
    """
    caliper = edge_calipers(layout, HALF, HALF + 1)[side]
    if caliper.positions.size < _FEWEST:
        raise InvalidInput(f"side {side + 1} must show at least {_FEWEST} px clear of corners and border, got less")
    flat, _, _, across = pixels_beside(caliper, HALF)
    bins = np.arange(-HALF, HALF + STEP / 2, STEP)
    which = np.rint((across + HALF) / STEP).astype(int)
    count = np.bincount(which, minlength=bins.size)[: bins.size]
    if (count[1:-1] == 0).any():
        raise InvalidInput(f"side {side + 1} must lean by some degrees against rows and columns, got one that does not")
    levels = image.flat[flat].astype(float)
    one = np.maximum(count, 1)
    seen, place, variance = (
        np.bincount(which, values, bins.size)[: bins.size] / one for values in (levels, across, curve.variance(levels))
    )
    low, high = (float(np.mean(part)) for part in (seen[1 : bins.size // 6], seen[-bins.size // 6 : -1]))
    place, seen = place[1:-1], (seen[1:-1] - low) / (high - low)
    variance = variance[1:-1] / one[1:-1] / (high - low) ** 2
    angle = float(np.degrees(np.arctan2(caliper.normal[1], caliper.normal[0])))
    return _response(angle, place, seen, variance)


def _response(angle: float, place: np.ndarray, seen: np.ndarray, variance: np.ndarray) -> EdgeResponse:
    middle, gap = (place[1:] + place[:-1]) / 2, np.maximum(np.diff(place), STEP / 4)
    rise = np.diff(seen)
    rows = _transform(middle, gap)
    window = _window(middle, rise)
    transform = rows @ (window * rise)
    size = np.abs(transform)
    # the transform's response to each sample of the edge spread, in the transform's own direction
    to_rise = np.real(np.conj(transform / np.maximum(size, 1e-12))[:, None] * rows) * window
    to_seen = np.pad(to_rise, ((0, 0), (1, 0))) - np.pad(to_rise, ((0, 0), (0, 1)))
    whole = size[0]
    relative = to_seen / whole - (size / whole**2)[:, None] * to_seen[0]
    mtf, spread = size / whole, (relative**2 * variance).sum(1)
    mtf50, error = _half(mtf, spread)
    return EdgeResponse(
        angle, place, seen, variance, middle, rise / gap, _FREQUENCIES, mtf, spread, mtf50, error
    )  # fmt: skip


def _transform(middle: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """Fourier transform of rises at places (T,), what samples of a width take from it put back; (F, T)."""
    return np.exp(-2j * np.pi * np.outer(_FREQUENCIES, middle)) / np.sinc(np.outer(_FREQUENCIES, gap))


def _window(middle: np.ndarray, rise: np.ndarray) -> np.ndarray:
    """1 around the edge, falling to 0 where nothing but noise is left."""
    centre = float((middle * rise**2).sum() / max((rise**2).sum(), 1e-30))
    return np.clip((HALF - 1 - np.abs(middle - centre)) / 3, 0, 1)


def _half(mtf: np.ndarray, variance: np.ndarray) -> tuple[float, float]:
    """Where the transfer first falls through a half, and the standard error."""
    below = np.flatnonzero(mtf < 0.5)
    if not below.size or below[0] == 0:
        return float("nan"), float("nan")
    k = int(below[0])
    slope = (mtf[k] - mtf[k - 1]) / (_FREQUENCIES[k] - _FREQUENCIES[k - 1])
    return float(_FREQUENCIES[k - 1] + (0.5 - mtf[k - 1]) / slope), float(np.sqrt(variance[k]) / abs(slope))
