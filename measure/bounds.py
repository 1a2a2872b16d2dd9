"""The Cramer-Rao bound: what no unbiased estimator of the lines, corners and the distance can beat."""

from __future__ import annotations

from typing import Any

import numpy as np

from measure import status
from measure.estimators.polygon import edge_derivatives
from measure.features.calipers import edge_calipers
from measure.features.corners import corner_response
from measure.features.layout import Layout, layout_of
from measure.measurement import distance, separation
from planner import predict
from scenes import Picture, Scene
from scenes.arrays import picture as one_picture


def bound(scene: Scene, sensor: Any, light: Any) -> float:
    """Smallest variance of the distance that any unbiased estimator can have in this setting, px^2.

    From the closed form: information C^2 / (2 sqrt(pi) s_e s_n^2) on the offset per px of edge, with the contrast C
    along each edge as the planner predicts it. Infinite where an edge cannot be seen. Good to 2 % for edges of 40 px
    and more; 12 % too large at 15 px, where `image_bound` should be used.

    Examples
    --------
    >>> import scenes
    >>> 4e-5 < bound(scenes.load("task1"), (30, 135), (15, 315)) < 6e-5
    True
    """
    return predict(scene, sensor, light, model="bound").variance_px2


def image_bound(clean: np.ndarray, scene: Scene, sensor: Any, light: Any) -> float:
    """The same bound from the Fisher information of every pixel of the noise-free image, px^2; infinite without edges.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
        Noise-free image, grey levels; the contrast along each edge is taken from it.
    scene, sensor, light
        As for `measure.distance`.
    """
    found = distance(one_picture(clean), scene, sensor, light, "polygon")
    if str(found.status) not in status.MEASURED:
        return float("inf")
    layout = layout_of(Picture.of(scene, sensor, light))
    covariance = corner_bound(layout, found.edge_contrast, scene.noise.variance)
    _, gradient = separation(found.corners[None])
    return float(gradient[0] @ covariance @ gradient[0])


def line_bound(layout: Layout, contrast: np.ndarray, noise_variance: float) -> np.ndarray:
    """Smallest covariance of (level, slope) of a ring of edges around one face, from the Fisher matrix, (2 E, 2 E).

    Parameters
    ----------
    layout : Layout
        Closed convex ring of edges.
    contrast : ndarray, shape (E,)
        Contrast of each edge, grey levels; grey levels and blur are taken as known.
    noise_variance : float
        Of a grey level.
    """
    calipers = edge_calipers(layout, 0.0, 0.0)
    slopes, levers = edge_derivatives(layout, calipers)
    edges = len(calipers)
    design = np.stack([slopes, levers], -1) * np.asarray(contrast, float)[:, None]
    design = design.reshape(-1, 2 * edges)
    about_middle = noise_variance * np.linalg.inv(design.T @ design)
    to_start = np.kron(np.eye(edges), np.eye(2))
    to_start[np.arange(0, 2 * edges, 2), np.arange(1, 2 * edges, 2)] = [-caliper.length / 2 for caliper in calipers]
    return to_start @ about_middle @ to_start.T


def corner_bound(layout: Layout, contrast: np.ndarray, noise_variance: float) -> np.ndarray:
    """Smallest joint covariance of the layout's corners (x, y), px^2, shape (2 C, 2 C)."""
    calipers = edge_calipers(layout, 0.0, 0.0)
    response = np.concatenate([corner_response(calipers, pair) for pair in layout.corners])
    return response @ line_bound(layout, contrast, noise_variance) @ response.T
