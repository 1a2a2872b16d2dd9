"""A circular edge as the sensor sees it, and how well the centre of its image is found.

The image of a circle is an ellipse. Moving it by (x, y) and straining it by a symmetric matrix reaches every ellipse
near by, so these five are the parameters of the fit; a point's residual is its distance along the normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.imaging.contrast import behind
from planner.imaging.illumination import level as grey_level
from planner.imaging.projection import direction, frame, project
from planner.imaging.rays import first_face
from scenes import Circle, Scene

RIM_POINTS = 64


@dataclass(frozen=True)
class Rim:
    """Points on the image of a circle, for settings of leading shape (...).

    Attributes
    ----------
    design : ndarray, shape (..., n, 5)
        Derivative of each point's distance along its normal by the ellipse's five parameters, the centre first.
    arc : ndarray, shape (..., n)
        Length of image that each point stands for, px.
    squared : ndarray, shape (..., n)
        Squared contrast, 0 at hidden points.
    """

    design: np.ndarray
    arc: np.ndarray
    squared: np.ndarray

    @property
    def counted(self) -> np.ndarray:
        """Which points have any contrast."""
        return self.squared > 0


def rim(scene: Scene, circle: Circle, sensors: np.ndarray, lights: np.ndarray, *, fall_off: bool) -> Rim:
    """Sample a circular edge at equal angles."""
    angle = 2 * np.pi * (np.arange(RIM_POINTS) + 0.5) / RIM_POINTS
    one, two = _axes(circle.axis)
    radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
    points = circle.centre + circle.radius * radial
    step = circle.radius * (np.cos(angle)[:, None] * two - np.sin(angle)[:, None] * one)
    image = project(points, sensors, scene.camera)
    tangent = (project(points + 1e-4 * step, sensors, scene.camera) - image) / 1e-4
    speed = np.linalg.norm(tangent, axis=-1)
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], -1) / speed[..., None]
    x, y = np.moveaxis(image - ellipse_centre(scene, circle, sensors)[..., None, :], -1, 0)
    nx, ny = normal[..., 0], normal[..., 1]
    design = np.stack([nx, ny, nx * x, ny * y, nx * y + ny * x], -1)
    squared = _squared_contrast(scene, circle, points, radial, sensors, lights, fall_off)
    return Rim(design, speed * 2 * np.pi / RIM_POINTS, squared)


def ellipse_centre(scene: Scene, circle: Circle, sensors: np.ndarray) -> np.ndarray:
    """Centre of the ellipse that is the image of a circle, px; not the image of the circle's centre."""
    axes, camera = frame(sensors), scene.camera
    columns = np.stack([circle.radius * axis for axis in _axes(circle.axis)] + [circle.centre], -1)
    rows = np.stack([camera.focal_px * axes.right, camera.focal_px * axes.down, axes.forward], -2) @ columns
    rows[..., 2, 2] += camera.distance
    dual = rows @ np.diag([1.0, 1.0, -1.0]) @ np.swapaxes(rows, -1, -2)
    return dual[..., :2, 2] / dual[..., 2:, 2] + np.array([camera.width - 1, camera.height - 1]) / 2


def fisher_centre(circle: Rim, weights: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    """Covariance of the centre from independent points of the given inverse variances (..., n), px^2."""
    information = np.einsum("...n,...ni,...nj->...ij", weights, circle.design, circle.design)
    enough = np.ones(information.shape[:-2], bool) if counted is None else counted.sum(-1) > 5
    return _centre(information, None, enough)


def calibrated_centre(circle: Rim, per_point: float, correlation_length: float, weakest: float) -> np.ndarray:
    """Covariance of the centre found by least squares from dense points with correlated errors, px^2.

    Points of a squared contrast below ``weakest`` are left out; a tenth of the rim must be left.
    """
    used = np.where(circle.squared >= weakest, circle.arc, 0.0)
    variance = per_point * correlation_length / np.where(circle.squared > 0, circle.squared, np.inf)
    information = np.einsum("...n,...ni,...nj->...ij", used, circle.design, circle.design)
    spread = np.einsum("...n,...ni,...nj->...ij", used * variance, circle.design, circle.design)
    return _centre(information, spread, (used > 0).mean(-1) >= 0.1)


def _centre(information: np.ndarray, spread: np.ndarray | None, enough: np.ndarray) -> np.ndarray:
    """Upper left block of information^-1 [spread information^-1]; infinite diagonal where singular."""
    enough = enough & np.isfinite(information).all((-1, -2))
    size = np.sqrt(np.abs(np.diagonal(information, axis1=-2, axis2=-1)))
    enough &= (size > 0).all(-1)
    size = np.where(enough[..., None], size, 1.0)
    scaled = np.where(enough[..., None, None], information / (size[..., None] * size[..., None, :]), np.eye(5))
    enough &= np.linalg.eigvalsh(scaled)[..., 0] > 1e-10
    scaled = np.where(enough[..., None, None], scaled, np.eye(5))
    inverse = np.linalg.inv(scaled) / (size[..., None] * size[..., None, :])
    covariance = inverse if spread is None else inverse @ np.where(enough[..., None, None], spread, 0.0) @ inverse
    return np.where(enough[..., None, None], covariance[..., :2, :2], np.diag([np.inf, np.inf]))


def _axes(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    one = np.cross(axis, helper)
    one /= np.linalg.norm(one)
    return one, np.cross(axis, one)


def _squared_contrast(scene, circle, points, radial, sensors, lights, fall_off) -> np.ndarray:
    """Squared contrast between the plane face and the wall, or what is seen past the rim."""
    sensor_at = scene.camera.distance * direction(sensors)[..., None, :]
    light_at = scene.light.distance * direction(lights)[..., None, :]
    wall = -radial if circle.hole else radial
    chord = np.cos(np.pi / len(circle.edges)) if circle.hole else 1.0  # the mesh's facets reach into the hole
    probe = circle.centre + chord * (points - circle.centre)
    visible = _free(scene, circle, probe, sensor_at)
    lit = _free(scene, circle, probe, light_at)
    sides = []
    for normal in (np.broadcast_to(circle.axis, points.shape), wall):
        level = np.where(lit, _level(scene, points, normal, sensor_at, light_at, fall_off), 0.0)
        turned = np.einsum("...i,...i->...", normal, sensor_at - points) > 0
        sides.append((turned, np.where(turned, level, 0.0)))
    seen = visible & (sides[0][0] | sides[1][0])
    levels = []
    for turned, level in sides:
        wanted = seen & ~turned
        past = behind(scene, probe, sensor_at[..., 0, :], light_at[..., 0, :], wanted, (circle.face,), fall_off)
        levels.append(np.where(wanted, past, level))
    return np.where(seen, (levels[0] - levels[1]) ** 2, 0.0)


def _free(scene, circle, probe, position) -> np.ndarray:
    """Whether nothing stands between the rim's points and a position (..., 1, 3)."""
    if scene.solid.is_convex:
        return np.ones((*position.shape[:-2], len(probe)), bool)
    vectors = probe - position
    _, t = first_face(scene.solid, np.broadcast_to(position, vectors.shape), vectors, ())
    return t > 1 - 1e-6


def _level(scene, points, normal, sensor_at, light_at, fall_off) -> np.ndarray:
    to_light, to_sensor = light_at - points, sensor_at - points
    distance = np.linalg.norm(to_light, axis=-1, keepdims=True)
    to_sensor = to_sensor / np.linalg.norm(to_sensor, axis=-1, keepdims=True)
    level = grey_level(scene, normal, to_light / distance, to_sensor, light_at)
    return level * (scene.light.distance / distance[..., 0]) ** 2 if fall_off else level
