"""How OpenCV is asked to read square markers: its parameters, in an image whose cells have enough pixels."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from measure.boards.approximate import eight_bits

_LONGEST = 2000  # px; a smaller image is enlarged twice, which lets cells of 1.5 px be read
_LEAST_SIDE = 12.0  # px of a marker
_STEP, _CELL = 4, 8  # px between the windows of its thresholds, and of a cell as it is sampled


class Legible(NamedTuple):
    """An image as markers are read in it, grey levels of 8 bits, how often it was enlarged, and OpenCV's parameters."""

    grey: np.ndarray
    scale: int
    parameters: cv2.aruco.DetectorParameters

    @classmethod
    def of(cls, image: np.ndarray) -> Legible:
        """Of an image (height, width) of grey levels."""
        grey = eight_bits(image)
        scale = 2 if max(grey.shape) <= _LONGEST else 1
        if scale > 1:
            grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        how = cv2.aruco.DetectorParameters()
        how.adaptiveThreshWinSizeStep, how.perspectiveRemovePixelPerCell = _STEP, _CELL
        how.minMarkerPerimeterRate = min(how.minMarkerPerimeterRate, 4 * _LEAST_SIDE / max(image.shape))
        return cls(grey, scale, how)

    def back(self, places: np.ndarray) -> np.ndarray:
        """Places (..., 2) in the image as it was, px."""
        return (np.asarray(places, float) + 0.5) / self.scale - 0.5
