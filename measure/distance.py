"""The measured distance between two corners, in one image or in a stack."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from measure import status
from measure.canny import CannyLocator
from measure.corners import corner_response, intersect, line_equation
from measure.frames import EdgeFrame, edge_frames
from measure.gradient import GradientLocator
from measure.lines import Lines, fit_lines, unit_covariance
from planner.locator import MIN_CONTRAST, kappa2
from planner.propagation import distance_variance
from scenes import InvalidInput, Pose, Scene

LOCATORS = ("gradient", "canny")
_MIN_FOUND = 0.5  # part of an edge's stations at which a point must be found
_MIN_SINE = 0.02  # of the angle between the lines of a corner


@dataclass(frozen=True)
class Measurement:
    """Distances measured in images of leading shape (...); one image has the shape ().

    Attributes
    ----------
    value_px : ndarray, shape (...)
        Distance, px; NaN where `status` is neither ``ok`` nor ``clutter``.
    variance_px2 : ndarray, shape (...)
        Its variance (not sigma) as told by the image itself: the locator's closed form at the measured contrast.
    status : ndarray of str, shape (...)
    corners : ndarray, shape (..., 2, 2)
        Start and end corner (x, y), px; (0, 0) is the centre of the first pixel.
    covariances : ndarray, shape (..., 2, 2, 2)
        Of the two corners, px^2.
    edge_names : tuple of str
    edge_status : ndarray of str, shape (..., E)
    edge_points : ndarray of int, shape (..., E)
        Number of edge points used.
    edge_contrast : ndarray, shape (..., E)
        Measured contrast, grey levels.
    """

    value_px: np.ndarray
    variance_px2: np.ndarray
    status: np.ndarray
    corners: np.ndarray
    covariances: np.ndarray
    edge_names: tuple[str, ...]
    edge_status: np.ndarray
    edge_points: np.ndarray
    edge_contrast: np.ndarray


def distance(
    image: np.ndarray,
    scene: Scene,
    sensor: Any,
    light: Any = None,
    locator: str = "gradient",
    threshold: float | None = None,
) -> Measurement:
    """Measure the task's distance.

    Parameters
    ----------
    image : array_like, shape (..., height, width)
        One image or a stack, grey levels.
    scene : Scene
    sensor : Pose or pair of float
        Where the image was taken from; edges are sought where this pose projects them.
    light : Pose or pair of float, optional
        Only checked; the measurement does not depend on it.
    locator : {"gradient", "canny"}
        ``gradient``: zero crossing of the Gaussian second derivative. ``canny``: the classic pipeline, edge
        pixels above a gradient threshold refined by a parabola.
    threshold : float, optional
        Gradient threshold of ``canny``, grey levels a pixel; the scene's first when not given.

    Raises
    ------
    InvalidInput
        If the image has not the camera's size or holds a number that is not finite, or another argument is bad.
    """
    sensor = scene.check_pose("sensor", sensor)
    if light is not None:
        scene.check_pose("light", light)
    images = _checked(image, scene)
    stack = images.reshape(-1, *images.shape[-2:])
    parts = [_measure(stack[i : i + 50], scene, sensor, locator, threshold) for i in range(0, len(stack), 50)]
    lead = images.shape[:-2]
    whole = [np.concatenate(part).reshape((*lead, *part[0].shape[1:])) for part in zip(*parts, strict=True)]
    value, variance, state, corners, covariances, edge_status, points, contrast = whole
    return Measurement(value, variance, state, corners, covariances, scene.task.edges, edge_status, points, contrast)


def _checked(image: Any, scene: Scene) -> np.ndarray:
    images, size = np.asarray(image, float), (scene.camera.height, scene.camera.width)
    if images.ndim < 2 or images.shape[-2:] != size or images.size == 0:
        raise InvalidInput(f"image must be of the camera's size {size[1]} x {size[0]}, got shape {images.shape}")
    if not np.isfinite(images).all():
        raise InvalidInput("image must be of finite numbers, got NaN or infinity")
    return images


@lru_cache(maxsize=8)
def prepare(scene: Scene, sensor: Pose, locator: str, threshold: float | None):
    """The locator of each edge, made once for a scene and a pose; None for an edge that cannot be measured."""
    if locator not in LOCATORS:
        raise InvalidInput(f"locator must be one of {', '.join(LOCATORS)}, got {locator!r}")
    if threshold is not None and not threshold > 0:
        raise InvalidInput(f"threshold must be greater than 0, got {threshold!r}")
    threshold = scene.locator.thresholds[0] if threshold is None else threshold
    frames = edge_frames(scene, sensor)
    makers = {"gradient": GradientLocator.of, "canny": lambda s, f: CannyLocator.of(s, f, threshold)}
    return tuple((f, makers[locator](scene, f) if f.status in status.MEASURED else None) for f in frames)


def _measure(
    images: np.ndarray, scene: Scene, sensor: Pose, locator: str, threshold: float | None
) -> tuple[np.ndarray, ...]:
    """All columns of a Measurement for a small stack (n, height, width)."""
    edges = [_edge(images, scene, *pair) for pair in prepare(scene, sensor, locator, threshold)]
    frames, lines = [e[0] for e in edges], [e[1] for e in edges]
    edge_status = np.stack([e[2] for e in edges], -1)
    contrast = np.stack([e[3] for e in edges], -1)
    found = [_corner(scene, frames[k : k + 2], lines[k : k + 2], contrast[:, k : k + 2]) for k in (0, 2)]
    corners, covariances = np.stack([f[0] for f in found], 1), np.stack([f[1] for f in found], 1)
    parallel = np.where(np.stack([f[2] for f in found], -1) < _MIN_SINE, status.ILL_CONDITIONED, status.OK)
    state = np.array([status.worst(*row) for row in np.concatenate([edge_status, parallel], 1)])
    measured = np.isin(state, status.MEASURED)
    value = np.where(measured, np.linalg.norm(corners[:, 1] - corners[:, 0], axis=-1), np.nan)
    variance = np.where(measured, distance_variance(corners, covariances), np.inf)
    return (
        value,
        variance,
        state,
        corners,
        covariances,
        edge_status,
        np.stack([line.count for line in lines], -1),
        contrast,
    )


def _edge(
    images: np.ndarray, scene: Scene, frame: EdgeFrame, locator
) -> tuple[EdgeFrame, Lines, np.ndarray, np.ndarray]:
    """Line, status and contrast of one edge in each image."""
    n = len(images)
    if locator is None:
        nothing = np.full(n, np.nan)
        return frame, Lines(nothing, nothing, nothing, np.zeros(n, int)), np.full(n, frame.status, object), np.zeros(n)
    points = locator.locate(images)
    enough = points.valid.sum(1) >= np.maximum(_MIN_FOUND * frame.stations.size, 3)
    clear = points.contrast > MIN_CONTRAST * np.sqrt(scene.noise.variance)
    state = np.where(enough & clear, frame.status, status.LOW_CONTRAST).astype(object)
    return frame, fit_lines(points), state, points.contrast


def _corner(scene: Scene, frames: list[EdgeFrame], lines: list[Lines], contrast: np.ndarray):
    """Corner (n, 2), its covariance (n, 2, 2) and the sine of its angle (n,)."""
    equations = [line_equation(*pair) for pair in zip(frames, lines, strict=True)]
    corner, sine = intersect(*(np.stack([e[i] for e in equations], 1) for i in (0, 1)))
    sine = np.nan_to_num(sine, nan=1.0)  # without a line its own status says so, not the corner's
    unknown = np.broadcast_to(np.diag([np.inf, np.inf]), (len(corner), 2, 2))
    if any(frame.stations.size == 0 for frame in frames):
        return corner, unknown, sine
    expected, angle = intersect(np.stack([[f.normal for f in frames]]), np.stack([[f.origin for f in frames]]))
    if angle[0] < _MIN_SINE:
        return corner, unknown, sine
    alongs = np.array([f.stations.mean() for f in frames])
    response = corner_response(tuple(frames), alongs, expected[0])
    point_variance = kappa2(scene.locator.scale_px, scene.camera.blur_px) * scene.noise.variance
    seen = (contrast > 0).all(1)
    covariance = np.zeros((len(corner), 2, 2))
    for k, frame in enumerate(frames):
        part = response[:, 2 * k : 2 * k + 2]
        unit = part @ unit_covariance(frame.stations, scene.locator.scale_px) @ part.T
        covariance += unit * (point_variance / np.where(seen, contrast[:, k], 1) ** 2)[:, None, None]
    return corner, np.where(seen[:, None, None], covariance, unknown), sine
