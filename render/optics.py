"""From a supersampled image to the sensor's pixels: lens blur, then the pixel's own box."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from scenes import Camera


def blur_and_bin(
    fine: np.ndarray, blur_px: float, supersample: int, warp: Callable[[np.ndarray], np.ndarray] | None = None
) -> np.ndarray:
    """Blur an image of ``supersample`` x finer pixels by a Gaussian of ``blur_px`` and average to pixels.

    Outside, the image goes on as at its border. The blur acts on the fine image, so that the result depends on the
    edge's place within a pixel only as in a real camera, and the noise of pixels stays independent. ``warp`` acts
    between the two: a blurred image can be interpolated without ringing.
    """
    if blur_px > 0:
        fine = gaussian_filter(fine, blur_px * supersample, mode="nearest", truncate=6)
    if warp is not None:
        fine = warp(fine)
    height, width = fine.shape[0] // supersample, fine.shape[1] // supersample
    return fine.reshape(height, supersample, width, supersample).mean(axis=(1, 3))


def distorted(points: np.ndarray, camera: Camera) -> np.ndarray:
    """Where the lens' radial distortion puts image points (..., 2), px."""
    centre = np.array([camera.width - 1, camera.height - 1]) / 2
    away = points - centre
    r2 = (away**2).sum(-1, keepdims=True) / camera.focal_px**2
    return centre + away * (1 + camera.lens.distortion * r2)


def distort(fine: np.ndarray, camera: Camera, start: tuple[int, int], supersample: int) -> np.ndarray:
    """The fine image as the lens distorts it; ``start`` is the (x, y) of its first fine pixel in the whole frame.

    Each fine pixel takes its value from where the undistorted image has it, by fixed-point steps of the inverse
    (each shrinks the error by about 3 k1 r^2).
    """
    y, x = np.mgrid[: fine.shape[0], : fine.shape[1]]
    seen = (np.stack([x, y], -1) + np.array(start) + 0.5) / supersample - 0.5
    source = seen
    for _ in range(6):
        source = source + seen - distorted(source, camera)
    at = (source + 0.5) * supersample - 0.5 - np.array(start)
    return map_coordinates(fine, [at[..., 1], at[..., 0]], order=3, mode="nearest")
