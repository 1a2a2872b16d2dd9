"""From a supersampled image to the sensor's pixels: lens blur, then the pixel's own box."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter


def blur_and_bin(fine: np.ndarray, blur_px: float, supersample: int) -> np.ndarray:
    """Blur an image of ``supersample`` x finer pixels by a Gaussian of ``blur_px`` and average to pixels.

    Outside the image it is dark. The blur acts on the fine image, so that the result depends on the edge's
    place within a pixel only as in a real camera, and the noise of pixels stays independent.
    """
    if blur_px > 0:
        fine = gaussian_filter(fine, blur_px * supersample, mode="constant", truncate=6)
    height, width = fine.shape[0] // supersample, fine.shape[1] // supersample
    return fine.reshape(height, supersample, width, supersample).mean(axis=(1, 3))
