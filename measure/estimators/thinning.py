"""Canny's choice of edge pixels, made once for all edges in a window of the image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from measure.features.rim_noise import Drawn

TRUNCATE = 3  # standard deviations at which the gradient's kernel ends: it only has to find the pixels
_FIXED_POINT = 1024  # Canny takes gradients as 16-bit integers: so many units are the threshold
_LARGEST = 32767
_SINGLE = 2.0**16  # grey levels that single precision resolves to 1/256; darkness is brought below


class Thinned(NamedTuple):
    """The window in n images, single precision less a whole darkness, and its edge pixels, both (n, height, width)."""

    parts: np.ndarray
    kept: np.ndarray


@dataclass(frozen=True, eq=False)
class Thinning:
    """Gaussian gradient, threshold and non-maximum suppression.

    Attributes
    ----------
    rows, columns : slice
        The window, px.
    threshold : float
        Smallest gradient of an edge pixel, grey levels a pixel (no hysteresis: one threshold, as in the paper).
    smooth, derive : ndarray
        Sampled Gaussian and its derivative.
    """

    rows: slice
    columns: slice
    threshold: float
    smooth: np.ndarray
    derive: np.ndarray

    @classmethod
    def of(cls, window: tuple[slice, slice], scale: float, threshold: float) -> Thinning:
        """Prepare for a window (rows, columns)."""
        x = np.arange(-int(np.ceil(TRUNCATE * scale)), int(np.ceil(TRUNCATE * scale)) + 1)
        gauss = np.exp(-(x**2) / (2 * scale**2))
        gauss /= gauss.sum()
        derive = x * gauss / (x**2 * gauss).sum()  # exactly 1 on a ramp of 1 grey level a pixel
        return cls(*window, threshold, gauss, derive)

    @property
    def reach(self) -> int:
        """How far a pixel's choice depends on others, px: the kernel, and the neighbours that it is compared with."""
        return len(self.smooth) // 2 + 1

    def __call__(self, images: np.ndarray) -> Thinned:
        """Choose the edge pixels of each image of a stack, (n, height, width)."""
        window = images[:, self.rows, self.columns]
        parts = np.ascontiguousarray(window, dtype=np.float32)
        low, high = (part.astype(float) for part in (parts.min((1, 2)), parts.max((1, 2))))
        base = _SINGLE * np.rint(low / _SINGLE)  # 0 for 8 and 16 bit images
        if base.any():
            parts = np.ascontiguousarray(window - base[:, None, None], dtype=np.float32)
        steepest = (high - low) * np.maximum(self.derive, 0).sum()
        # coarser in a picture so bright that the integers would saturate
        units = np.minimum(_FIXED_POINT / self.threshold, _LARGEST / np.maximum(steepest, self.threshold))
        if (units == units[0]).all():
            return Thinned(parts, self._edge_pixels(parts, units[0]))
        return Thinned(parts, np.stack([self._edge_pixels(*one)[0] for one in zip(parts[:, None], units, strict=True)]))

    def of_drawn(self, images: Drawn, shape: tuple[int, int]) -> Thinned:
        """The same of drawn images of this height and width."""
        height, width = self.rows.stop - self.rows.start, self.columns.stop - self.columns.start
        pixels = np.arange(shape[0] * shape[1]).reshape(shape)[self.rows, self.columns]
        window = images.at(pixels.ravel()).reshape(len(images), height, width)
        return replace(self, rows=slice(0, height), columns=slice(0, width))(window)

    def _edge_pixels(self, parts: np.ndarray, unit: float) -> np.ndarray:
        """Pixels that Canny keeps: gradient above the threshold and largest along its direction.

        The images are filtered as one tall one: what is chosen near a window's border is not to be used.
        """
        tall = parts.reshape(-1, parts.shape[2])
        gx = cv2.sepFilter2D(tall, cv2.CV_16S, unit * self.derive, self.smooth)
        gy = cv2.sepFilter2D(tall, cv2.CV_16S, self.smooth, unit * self.derive)
        limit = self.threshold * unit
        return (cv2.Canny(gx, gy, limit, limit, L2gradient=True) > 0).reshape(parts.shape)
