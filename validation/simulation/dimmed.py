"""What a render changes by of a part all of whose surfaces, of one material, reflect less.

Direct light is less by the same part everywhere, which moves no edge. Light that has met more surfaces is less by more:
how much, closed form tells place by place, of how much of it there is in the render. So nothing is rendered anew, and
the difference has none of the noise of two renders' light between surfaces.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy import sparse
from scipy.ndimage import gaussian_filter, maximum_filter

from imaging.features.locator import edge_blur
from imaging.geometry.lens import undistorted
from imaging.geometry.looked_at import looked_at
from imaging.light.between import light_of_dimmed
from imaging.pictures import Pictures
from measure.correction import mean_of
from render.adaptive import places
from render.surroundings import near_required
from scenes import Picture

_LEAST = 1e-6  # of the brightest pixel: less from other surfaces moves nothing
_BLURRED = 6.0  # standard deviations: light of a pixel farther off is none
_FELT = 4.0  # standard deviations beyond which a blurred pixel is not felt
_NEIGHBOURS, _RARELY = 1.5, 1e-6  # px, standard deviation: pixels that show no such face take after those beside them


def of_one_surface(
    picture: Picture, renders: Sequence[np.ndarray], direct: Callable[[], np.ndarray], part: float
) -> sparse.csr_array | None:
    """By how much pixels of the first render change where every surface reflects less by a part, near what is measured.

    Parameters
    ----------
    picture : Picture
    renders : sequence of ndarray, shape (height, width)
        Grey levels, each of other rays: together they tell light between surfaces.
    direct : callable
        To the same image without light between surfaces.
    part : float
        0 to 1.

    Returns
    -------
    csr_array, shape (1, height * width), or None
        None where surfaces are of several materials or closed form does not tell.
    """
    scene = picture.scene
    if part == 0 or scene.materials or scene.bright_floor is not None or scene.solid.curved:
        return None
    between = mean_of(renders) - direct()
    lent = places((np.abs(between) > _LEAST * renders[0].max()) & _asked(picture, between.shape)).T
    faces, met = looked_at(picture, undistorted(lent[:, ::-1].astype(float), scene.camera))
    inner = (faces >= 0) & ~np.append(scene.bodies.outer, True)[faces]
    told = light_of_dimmed(Pictures.of(picture), part, met[inner], faces[inner])
    if told is None:
        return None
    box = _about(lent[inner], between.shape, edge_blur(scene.camera.blur_px))
    before, after = (_seen(light, lent[inner], box, edge_blur(scene.camera.blur_px)) for light in told)
    once, least = (1 - part) ** 2, 1e-12 * max(float(before.max(initial=0.0)), np.finfo(float).tiny)
    left = np.clip((after + once * least) / (before + least), (1 - part) ** 8, once)
    less = (1 - part - once) * between
    less[box] = (1 - part - left) * between[box]
    less += part * (renders[0] - scene.noise.dark_level)
    return sparse.csr_array(-less.reshape(1, -1))


def _asked(picture: Picture, shape: tuple[int, int]) -> np.ndarray:
    """Pixels of an image that what is measured is found from, and those whose light is blurred into them; bool."""
    near = near_required(picture, (slice(0, shape[0]), slice(0, shape[1])), 1)
    return maximum_filter(near, 2 * math.ceil(_BLURRED * edge_blur(picture.scene.camera.blur_px)) + 1)


def _about(pixels: np.ndarray, shape: tuple[int, ...], blur: float) -> tuple[slice, slice]:
    """Rows and columns of an image that light at some pixels (n, 2) is blurred into."""
    if not len(pixels):
        return slice(0, 0), slice(0, 0)
    away = math.ceil(_FELT * max(blur, _NEIGHBOURS)) + 1
    low, high = np.maximum(pixels.min(0) - away, 0), np.minimum(pixels.max(0) + away + 1, shape)
    return slice(low[0], high[0]), slice(low[1], high[1])


def _seen(light: np.ndarray, pixels: np.ndarray, box: tuple[slice, slice], blur: float) -> np.ndarray:
    """Part of an image, blurred as the camera's, of light at the middles of some pixels (n, 2), and a trace of it
    farther off."""
    sharp = np.zeros([part.stop - part.start for part in box])
    sharp[tuple((pixels - [part.start for part in box]).T)] = light
    return gaussian_filter(sharp, blur, truncate=_FELT) + _RARELY * gaussian_filter(sharp, _NEIGHBOURS, truncate=_FELT)
