"""A photograph at about half a megapixel, smoothed, with its gradient and noise: what shapes are sought in."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from measure.photo.noise import noise_sigma

_ENOUGH = 500_000  # pixels in which shapes are sought; up to 2.25 times as many
_SMOOTHING = 1.0  # px
_LEAST_NOISE = 1e-3  # of the range of grey levels, where the noise is less


@dataclass(frozen=True, eq=False)
class Coarse:
    """The image or means of squares of its pixels; lengths in its own, coarse px.

    Attributes
    ----------
    smooth, gx, gy : ndarray of float32, shape (height, width)
        Smoothed grey levels, and their derivatives by x and y.
    factor : int
        Side of the squares in px of the photograph.
    noise : float
        Standard deviation of a pixel before smoothing.
    gradient_noise, smooth_noise : float
        Of a derivative, and of a smoothed level.
    """

    smooth: np.ndarray
    gx: np.ndarray
    gy: np.ndarray
    factor: int
    noise: float
    gradient_noise: float
    smooth_noise: float

    @classmethod
    def of(cls, image: np.ndarray) -> Coarse:
        """Of an image, shape (height, width)."""
        factor = max(round(float(np.sqrt(image.size / _ENOUGH))), 1)
        height, width = (size // factor for size in image.shape)
        whole = np.asarray(image[: height * factor, : width * factor], np.float32)
        small = whole if factor == 1 else cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
        noise = max(noise_sigma(small), _LEAST_NOISE * float(np.ptp(small)))
        smooth, gx, gy = _filtered(small)
        impulse = np.zeros((21, 21), np.float32)
        impulse[10, 10] = 1
        level, slope, _ = (float(np.linalg.norm(each)) for each in _filtered(impulse))
        return cls(smooth, gx, gy, factor, noise, noise * slope, noise * level)

    @property
    def size(self) -> np.ndarray:
        """(width, height)."""
        return np.array(self.smooth.shape[::-1])

    def fine(self, points: np.ndarray) -> np.ndarray:
        """Places (..., 2) in px of the photograph."""
        return np.asarray(points, float) * self.factor + (self.factor - 1) / 2

    def slopes(self, places: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, ...]:
        """Derivatives by x and y at offsets (t,) along unit normals (m, 2) from places (m, 2), each of shape (m, t)."""
        where = (places[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
        return tuple(cv2.remap(each, where, None, cv2.INTER_LINEAR) for each in (self.gx, self.gy))

    def across(self, places: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """Derivative along the normals there, shape (m, t)."""
        gx, gy = self.slopes(places, normals, offsets)
        return gx * normals[:, :1] + gy * normals[:, 1:]

    def levels(self, places: np.ndarray) -> np.ndarray:
        """Smoothed grey levels at places (m, 2), shape (m,)."""
        return cv2.remap(self.smooth, places[:, None].astype(np.float32), None, cv2.INTER_LINEAR)[:, 0]


def _filtered(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    smooth = cv2.GaussianBlur(levels, (0, 0), _SMOOTHING)
    return smooth, cv2.Scharr(smooth, cv2.CV_32F, 1, 0) / 32, cv2.Scharr(smooth, cv2.CV_32F, 0, 1) / 32
