"""A render of a part all of whose surfaces, of one material, reflect less than those of another render.

Direct light is less by the same part everywhere, which moves no edge. Light that has met more surfaces is less by more:
how much, closed form tells place by place, of how much of it there is in the render. So nothing is rendered anew, and
the difference has none of the noise of two renders' light between surfaces.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter

from imaging.geometry.lens import undistorted
from imaging.geometry.looked_at import looked_at
from imaging.light.between import left_of_dimmed
from imaging.pictures import Pictures
from scenes import Picture

_LEAST = 1e-6  # of the brightest pixel: less from other surfaces moves nothing
_NEIGHBOURS = 1.5  # px, standard deviation: pixels that show no such face take after those beside them


def of_one_surface(
    picture: Picture, render: np.ndarray, direct: Callable[[], np.ndarray], part: float
) -> np.ndarray | None:
    """The render with every surface reflecting less by a part.

    Parameters
    ----------
    picture : Picture
    render : ndarray, shape (height, width)
        Grey levels.
    direct : callable
        To the same image without light between surfaces.
    part : float
        0 to 1.

    Returns
    -------
    ndarray, shape (height, width), or None
        None where surfaces are of several materials or closed form does not tell.
    """
    scene = picture.scene
    if part == 0 or scene.materials or scene.bright_floor is not None or scene.solid.curved:
        return None
    alone = direct()
    between = render - alone
    lent = np.argwhere(np.abs(between) > _LEAST * render.max())
    faces, places = looked_at(picture, undistorted(lent[:, ::-1].astype(float), scene.camera))
    inner = (faces >= 0) & ~np.append(scene.bodies.outer, True)[faces]
    told = left_of_dimmed(Pictures.of(picture), part, places[inner], faces[inner])
    if told is None:
        return None
    left = _spread(told, lent[inner], render.shape, (1 - part) ** 2, part)
    return render - part * (alone - scene.noise.dark_level) - (1 - left) * between


def _spread(told: np.ndarray, pixels: np.ndarray, shape: tuple[int, ...], once: float, part: float) -> np.ndarray:
    """An image of what is told at some pixels (n, 2), NaN at others of them, and of ``once`` where nothing is near."""
    good = np.isfinite(told)
    at = tuple(pixels[good].T)
    weights, values = np.full(shape, 1e-12), np.full(shape, 1e-12 * once)
    weights[at], values[at] = 1.0, np.clip(told[good], (1 - part) ** 8, once)
    return gaussian_filter(values, _NEIGHBOURS) / gaussian_filter(weights, _NEIGHBOURS)
