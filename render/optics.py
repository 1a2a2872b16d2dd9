"""From a supersampled image to the sensor's pixels: the lens' distortion and blur, then the pixel's own box."""

from __future__ import annotations

import math
from functools import reduce

import cv2
import numpy as np
from numpy.polynomial import chebyshev
from scipy.ndimage import map_coordinates

from imaging.geometry.blur import blur_in_focus, drift
from imaging.geometry.lens import undistorted
from imaging.light.illumination import illumination
from scenes import Camera, Scene

_SOFT = 1.0  # fine pixels: a blur with which an image can be interpolated without ringing
_EXACT = 1e-4  # of a step: by which a blur between those that are drawn may be off
_MOST_DRAWN = 16
_ROWS, _FAR = 512, 6.0  # fine rows that are blurred at a time; standard deviations beyond which they are not felt


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
    if camera.blur_field is not None and blur > 0:
        fine = _unevenly(fine, camera, supersample, start)
    else:
        if camera.lens.bends:
            soft = min(_SOFT, blur)
            fine = distort(_blurred(fine, soft), camera, start, supersample)
        fine = _blurred(_dimmed(fine, camera, supersample, start), np.sqrt(blur**2 - soft**2))
    rows = reduce(np.add, (fine[k::supersample] for k in range(supersample)))
    return reduce(np.add, (rows[:, k::supersample] for k in range(supersample))) / supersample**2


def _unevenly(fine: np.ndarray, camera: Camera, supersample: int, start: tuple[int, int]) -> np.ndarray:
    """Distorted and blurred by what varies over the field, rows after rows, for a whole image takes much memory."""
    soft = min(_SOFT, supersample * camera.blur_px * camera.blur_field.least)
    beyond = math.ceil(_FAR * supersample * camera.most_blur_px) + 2 * supersample
    if camera.lens.bends:
        fine = distort(_blurred(fine, soft), camera, start, supersample)
    found = np.empty(fine.shape)
    for first in range(0, len(fine), _ROWS):
        top, stop = max(first - beyond, 0), min(first + _ROWS, len(fine))
        part, corner = fine[top : stop + beyond], (start[0], start[1] + top)
        if not camera.lens.bends:
            part = distort(_blurred(part, soft), camera, corner, supersample)
        part = _dimmed(part, camera, supersample, corner)
        blur = blur_in_focus(camera, _places(part.shape, corner, supersample)) * supersample
        found[first:stop] = spread(part, blur, soft)[first - top : stop - top]
    return found


def _dimmed(fine: np.ndarray, camera: Camera, supersample: int, start: tuple[int, int]) -> np.ndarray:
    """As the lens passes its light."""
    if not camera.is_dimmed:
        return fine
    place = _places(fine.shape, start, supersample)
    return fine * illumination(camera, place[..., 0], place[..., 1])


def distort(fine: np.ndarray, camera: Camera, start: tuple[int, int], supersample: int) -> np.ndarray:
    """The fine image as the lens records it: each fine pixel takes its value from where a pinhole camera has it.

    That is of what will appear where blur that varies moves it to (`imaging.geometry.blur`). 0 where the lens records
    nothing.
    """
    seen = _places(fine.shape, start, supersample)
    source = undistorted(seen - drift(camera, seen), camera)
    lost = ~np.isfinite(source).all(-1)
    at = np.where(lost[..., None], 0.0, (source + 0.5) * supersample - 0.5 - np.array(start))
    order = 3 if camera.blur_px > 0 else 1
    return np.where(lost, 0.0, map_coordinates(fine, [at[..., 1], at[..., 0]], order=order, mode="nearest"))


def spread(fine: np.ndarray, blur: np.ndarray, soft: float) -> np.ndarray:
    """Each fine pixel's light spread by a Gaussian of its own, ``blur`` (standard deviations in fine pixels, of the
    image's shape), in an image that is blurred by ``soft`` already.

    An image blurred by a variance is a smooth function of that one's logarithm: a polynomial through some blurs of the
    range, Chebyshev's, tells those between. Light is spread by each in the part in which its polynomial takes it.
    """
    place = 2 * np.log(blur)
    low, high = float(place.min()), float(place.max())
    nodes = (low + high) / 2 + (high - low) / 2 * chebyshev.chebpts1(drawn(low, high))
    found = np.zeros(fine.shape)
    for each, node in enumerate(nodes):
        share = np.ones(fine.shape)
        for other in np.delete(nodes, each):
            share *= (place - other) / (node - other)
        found += _blurred(share * fine, np.sqrt(max(np.exp(node) - soft**2, 0.0)))
    return found


def drawn(low: float, high: float) -> int:
    """How many blurs tell all between: the least number with which no amplitude of any wave is more than `_EXACT` off.

    ``low`` and ``high`` are the logarithms of the variances.
    """
    if high - low < 1e-12:
        return 1
    from scipy.interpolate import BarycentricInterpolator  # slow to load, and rarely needed

    at = np.linspace(low, high, 65)
    waves = np.exp(np.linspace(-12, 3, 121)[:, None] - low)  # half the squared frequency
    for count in range(2, _MOST_DRAWN):
        nodes = (low + high) / 2 + (high - low) / 2 * chebyshev.chebpts1(count)
        told = BarycentricInterpolator(nodes, np.exp(-waves * np.exp(nodes)).T)(at)
        if np.abs(told.T - np.exp(-waves * np.exp(at))).max() <= _EXACT:
            return count
    return _MOST_DRAWN


def _places(shape: tuple[int, ...], start: tuple[int, int], supersample: int) -> np.ndarray:
    """The middles of fine pixels, recorded px, (height, width, 2)."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return (np.stack([x, y], -1) + np.array(start) + 0.5) / supersample - 0.5


def _blurred(fine: np.ndarray, sigma: float) -> np.ndarray:
    if not sigma > 0:
        return fine
    kernel = cv2.getGaussianKernel(2 * round(_FAR * sigma) + 1, sigma)
    return cv2.sepFilter2D(fine, -1, kernel, kernel, borderType=cv2.BORDER_REPLICATE)
