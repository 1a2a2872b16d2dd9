"""The image of a quadric's limb as a conic, and of a conic its ellipse.

Coordinates are ideal px from the image's middle, as those of `imaging.geometry.projection.from_axis`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import camera_frame, sensor_position
from scenes import Camera, InvalidInput
from scenes.parts.surfaces import Quadric

_ELLIPSE = 1e-12  # least share of the smaller curvature


class Ellipse(NamedTuple):
    """Centre (2,), half axes (larger first) and direction of the larger, rad from x towards y."""

    centre: np.ndarray
    half_axes: tuple[float, float]
    angle: float


def touching_cone(quadric: Quadric, eye: np.ndarray) -> np.ndarray:
    """M, shape (3, 3): d'Md >= 0 for the directions d of lines through the eye (3,) that meet the quadric."""
    half = quadric.gradient(eye) / 2
    return np.outer(half, half) - quadric.function(eye) * quadric.form


def image_conic(quadric: Quadric, sensor: np.ndarray, camera: Camera) -> np.ndarray:
    """C, shape (3, 3), of largest element 1: (x, y, 1) C (x, y, 1) is positive where a pixel's line meets the quadric.

    The same as the inverse of P Q* P' (Hartley and Zisserman, Multiple View Geometry, 8.2) up to a factor, but also
    for cylinders and cones, whose Q has no inverse. It is of the whole line, before and behind the eye.

    Parameters
    ----------
    quadric : Quadric
    sensor : array_like, shape (2,)
        Pose, degrees.
    camera : Camera
    """
    pose = np.array(list(sensor), float)
    axes = camera_frame(camera, pose)
    turned = np.stack([axes.right, axes.down, camera.focal_px * axes.forward], -1)
    found = turned.T @ touching_cone(quadric, sensor_position(camera, pose)) @ turned
    return found / np.abs(found).max()


def ellipse_of(conic: np.ndarray) -> Ellipse:
    """The ellipse of a conic (3, 3).

    Raises
    ------
    InvalidInput
        If it is none.

    Examples
    --------
    >>> found = ellipse_of(np.diag([-1.0, -4.0, 16.0]))
    >>> found.centre.tolist(), found.half_axes, found.angle
    ([0.0, 0.0], (4.0, 2.0), 0.0)
    """
    values, vectors = np.linalg.eigh(conic[:2, :2])
    order = np.abs(values).argsort()
    values, vectors = values[order], vectors[:, order]
    if not values[0] * values[1] > _ELLIPSE * values[1] ** 2:
        raise InvalidInput(f"conic must be an ellipse, got eigenvalues {values[0]:g} and {values[1]:g}")
    centre = -vectors @ ((vectors.T @ conic[:2, 2]) / values)
    level = conic[2, 2] + conic[:2, 2] @ centre
    squares = -level / values
    if not (squares > 0).all():
        raise InvalidInput(f"conic must be a real ellipse, got squared half axes {squares[0]:g} and {squares[1]:g}")
    angle = float(np.arctan2(vectors[1, 0], vectors[0, 0]))
    return Ellipse(centre + 0.0, tuple(np.sqrt(squares).tolist()), angle % np.pi + 0.0)
