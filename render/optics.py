"""From a supersampled image to the sensor's pixels: the lens' distortion and blur, then the pixel's own box."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from imaging.geometry.lens import undistorted
from scenes import Camera, Scene

_SOFT = 1.0  # fine pixels: a blur with which an image can be interpolated without ringing


def lens_alone(scene: Scene) -> Camera:
    """The scene's camera with its lens' blur, without what demosaicing adds to that of the picture."""
    colour, camera = scene.noise.colour, scene.camera
    if colour is None or not colour.interpolates:
        return camera
    return camera.tried(blur_px=math.sqrt(max(camera.blur_px**2 - colour.blur_px**2, 0.0)))


def blur_and_bin(fine: np.ndarray, camera: Camera, supersample: int, start: tuple[int, int]) -> np.ndarray:
    """Distort, blur by the lens' Gaussian, and average an image of ``supersample`` x finer pixels to pixels.

    Outside, the image goes on as at its border. The blur acts on the fine image, so that the result depends on the
    edge's place within a pixel only as in a real camera, and the noise of pixels stays independent. ``start`` is the
    (x, y) of the first fine pixel in the whole frame. A fine pixel of the blur goes before the distortion, which
    interpolates, the rest behind it.
    """
    blur, soft = camera.blur_px * supersample, 0.0
    if camera.lens.bends:
        soft = min(_SOFT, blur)
        fine = distort(_blurred(fine, soft), camera, start, supersample)
    fine = _blurred(fine, np.sqrt(blur**2 - soft**2))
    height, width = fine.shape[0] // supersample, fine.shape[1] // supersample
    return fine.reshape(height, supersample, width, supersample).mean(axis=(1, 3))


def distort(fine: np.ndarray, camera: Camera, start: tuple[int, int], supersample: int) -> np.ndarray:
    """The fine image as the lens records it: each fine pixel takes its value from where a pinhole camera has it.

    0 where the lens records nothing.
    """
    y, x = np.mgrid[: fine.shape[0], : fine.shape[1]]
    seen = (np.stack([x, y], -1) + np.array(start) + 0.5) / supersample - 0.5
    source = undistorted(seen, camera)
    lost = ~np.isfinite(source).all(-1)
    at = np.where(lost[..., None], 0.0, (source + 0.5) * supersample - 0.5 - np.array(start))
    order = 3 if camera.blur_px > 0 else 1
    return np.where(lost, 0.0, map_coordinates(fine, [at[..., 1], at[..., 0]], order=order, mode="nearest"))


def _blurred(fine: np.ndarray, sigma: float) -> np.ndarray:
    return gaussian_filter(fine, sigma, mode="nearest", truncate=6) if sigma > 0 else fine
