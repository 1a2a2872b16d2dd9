"""The Cramer-Rao bound: what no unbiased estimator of the lines, corners and the distance can beat."""

from __future__ import annotations

from typing import Any

import numpy as np

from imaging.blurred.arrangement import near_pixels, near_vertices
from imaging.blurred.model import BlurredModel, State
from imaging.models.bound import REACH, Information, fisher, known
from imaging.models.bound import bound as errors_at_the_bound
from imaging.pictures import Pictures
from measure.features.layout import Layout, layout_of
from measure.features.locating import locate
from measure.features.shape import prepared
from measure.measurement import distance, separation
from scenes import InvalidInput, Noise, Picture, Scene, status
from scenes.arrays import picture as one_picture


def bound(scene: Scene | Picture, sensor: Any = None, light: Any = None) -> float:
    """Smallest variance of the distance that any unbiased estimator can have in this setting, px^2.

    From the model of the whole picture around the required edges: free are all vertices there, the levels of
    the faces and the background. Infinite where an edge cannot be seen.

    Examples
    --------
    >>> import scenes
    >>> 4e-5 < bound(scenes.load("task1"), (30, 135), (15, 315)) < 6e-5
    True
    """
    picture = Picture.of(scene, sensor, light)
    if not picture.lights:
        raise InvalidInput("light must be a pose, got nothing")
    kind = picture.scene.quantities[0].kind
    if kind != "distance":
        raise InvalidInput(f"task.kind must be distance for a bound in px^2, got {kind!r}")
    return float(errors_at_the_bound(Pictures.of(picture)).variances[0])


def image_bound(clean: np.ndarray, scene: Scene | Picture, sensor: Any = None, light: Any = None) -> float:
    """The same bound with positions and levels as an image shows them, px^2; infinite where it shows none.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
        Noise-free image, grey levels.
    scene, sensor, light
        As for `measure.distance`.

    Raises
    ------
    InvalidInput
        If things hide or shade each other in the scene.
    """
    picture = Picture.of(scene, sensor, light)
    layout, name = layout_of(picture), picture.scene.name
    if layout.arrangement is None:
        raise InvalidInput(f"scene must be a convex body before darkness for a bound from an image, got {name}")
    tool = prepared(layout, "arrangement", 1.0)
    clean = one_picture(clean)
    if str(distance(clean, picture, estimator="arrangement").status) not in status.MEASURED:
        return float("inf")
    state = locate(tool, layout, tool.taken(clean[None])[0], clean).state
    covariance = _corners(layout, state, picture.scene.noise)
    _, gradient = separation(state.vertices[tool.arrangement.corners[:2]][None])
    return float(gradient[0] @ covariance[:4, :4] @ gradient[0])


def corner_bound(layout: Layout, contrast: float, noise_variance: float) -> np.ndarray:
    """Smallest joint covariance of the corners (x, y) of a polygon of uniform contrast, px^2, shape (2 C, 2 C)."""
    arrangement = layout.arrangement
    levels = np.zeros(arrangement.level_slices[-1].stop)
    levels[arrangement.level_slices[1].start] = contrast
    state = State(arrangement.vertices, levels, arrangement.blur_px)
    return _corners(layout, state, Noise(sigma=float(np.sqrt(noise_variance))))


def _corners(layout: Layout, state: State, noise: Noise) -> np.ndarray:
    arrangement = layout.arrangement
    y, x = near_pixels(arrangement, layout.optics.shape, REACH)
    model = BlurredModel(arrangement, x, y, near_vertices(arrangement, REACH + 6 * arrangement.blur_px))
    told = Information(model, fisher(model, noise, False, state), known(model).precision)
    index = (2 * arrangement.corners[:, None] + [0, 1]).ravel()
    return told.vertices()[np.ix_(index, index)]
