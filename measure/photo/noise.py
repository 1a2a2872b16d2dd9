"""How much noise a photograph has, from itself."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.special import ndtr, ndtri

_CUT = 2.5  # standard deviations beyond which a second difference is no noise
_ENOUGH, _BAND = 1_000_000, 64  # pixels that tell the noise to 0.1 %; rows taken together
_CUTS = 8  # times that the cut is made anew


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
