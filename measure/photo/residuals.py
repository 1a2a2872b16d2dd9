"""How far the edge in a photograph is from the outline that was measured, place by place."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from measure.features.conic import around

_REACH, _STEP = 4.0, 0.5  # px across an outline
_NEAR = 1.5  # px: where the edge's sign is told
_MOST = 60  # places along a side
_SPLINE = 1 / 3  # px^2: variance of the cubic B-spline that levels between pixels are averaged with
_WIDTH = 3  # places along a side whose levels are averaged
_ORDINARY, _LEAST, _MOST_BLUR = 0.7, 0.3, 4.0  # px of lens blur


@dataclass(frozen=True, eq=False)
class Residuals:
    """Along one side, or a whole ellipse.

    Attributes
    ----------
    places, normals : ndarray, shape (m, 2)
        On the measured outline, (x, y), px, and unit normals there.
    offsets : ndarray, shape (m,)
        From the outline to where the image is steepest within 4 px along the normal, px.
    """

    places: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray

    @property
    def rms(self) -> float:
        """Root mean square of the offsets, px."""
        return float(np.sqrt(np.mean(self.offsets**2)))


def of_sides(image: np.ndarray, corners: np.ndarray) -> tuple[Residuals, ...]:
    """Of each side of a polygon (k, 2), (x, y) px, without a twentieth at both ends, or 4 px of a short side."""
    found = []
    for start, stop in zip(corners, np.roll(corners, -1, 0), strict=True):
        along = stop - start
        length = float(np.linalg.norm(along))
        end = np.clip(4 / max(length, 1e-9), 0.05, 0.35)
        count = int(np.clip(length * (1 - 2 * end), 3, _MOST))
        places = start + np.linspace(end, 1 - end, count)[:, None] * along
        normals = np.tile(np.array([-along[1], along[0]]) / max(length, 1e-9), (count, 1))
        found.append(_residuals(image, places, normals))
    return tuple(found)


def of_ellipse(image: np.ndarray, parameters: np.ndarray) -> Residuals:
    """Of an ellipse x, y, a, b, angle (degrees)."""
    places, normals = around(parameters, 2 * _MOST)
    return _residuals(image, places, normals)


def ellipse_blur(image: np.ndarray, parameters: np.ndarray) -> float:
    """Standard deviation of the lens blur at an ellipse, px, from the width of the mean edge; about."""
    places, normals = around(parameters, 2 * _MOST)
    offsets, rise = _rises(image, places, normals)
    peak = int(np.abs(rise.mean(0)).argmax())
    mean = rise.mean(0) * np.sign(rise.mean(0)[peak])
    weight = np.where(np.abs(offsets - offsets[peak]) < 3, np.clip(mean, 0, None), 0)
    if not weight.sum() > 0:
        return _ORDINARY
    middle = (weight @ offsets) / weight.sum()
    variance = weight @ (offsets - middle) ** 2 / weight.sum() - _SPLINE - 1 / 12 - _STEP**2 / 12
    return float(np.sqrt(np.clip(variance, _LEAST**2, _MOST_BLUR**2)))


def _residuals(image: np.ndarray, places: np.ndarray, normals: np.ndarray) -> Residuals:
    offsets, rise = _rises(image, places, normals)
    sign = np.sign(rise[:, np.abs(offsets) < _NEAR].sum()) or 1.0
    rise = sign * cv2.blur(rise, (1, _WIDTH), borderType=cv2.BORDER_REFLECT)
    weight = np.clip(rise, 0, None) ** 2
    middle = weight @ offsets / np.maximum(weight.sum(1), 1e-300)
    return Residuals(places, normals, middle)


def _rises(image: np.ndarray, places: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (t,) and the change of the grey level from step to step there, (m, t), smoothed by a cubic B-spline."""
    steps = np.arange(-_REACH, _REACH + 0.01, _STEP)
    low = np.maximum(np.floor(places.min(0) - _REACH - 3), 0).astype(int)
    high = np.ceil(places.max(0) + _REACH + 4).astype(int)
    where = places[:, None] + steps[:, None] * normals[:, None] - low
    part = image[low[1] : high[1], low[0] : high[0]]
    levels = map_coordinates(part, (where[..., 1], where[..., 0]), order=3, prefilter=False, mode="nearest")
    return (steps[1:] + steps[:-1]) / 2, np.diff(levels, axis=1).astype(float)
