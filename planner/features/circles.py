"""A circular edge as the sensor sees it, and how well the centre of its image is found.

The image of a circle is an ellipse. Moving it by (x, y) and straining it by a symmetric matrix reaches every ellipse
near by, so these five are the parameters of the fit; a point's residual is its distance along the normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.imaging.appearance import behind, of_sides, signal
from planner.imaging.lens import image_centre
from planner.imaging.pictures import Pictures
from planner.imaging.projection import frame, project_ideal
from planner.imaging.rays import first_face
from scenes import Circle, Scene, Solid

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
    noise_variance : ndarray, shape (..., n), or float
        Mean of both sides, grey levels^2.
    """

    design: np.ndarray
    arc: np.ndarray
    squared: np.ndarray
    noise_variance: np.ndarray | float

    @property
    def counted(self) -> np.ndarray:
        """Which points have any contrast."""
        return self.squared > 0


def rim(pictures: Pictures, circle: Circle, *, fall_off: bool = True) -> Rim:
    """Sample a circular edge at equal angles."""
    scene, sensors = pictures.scene, pictures.sensors
    angle = 2 * np.pi * (np.arange(RIM_POINTS) + 0.5) / RIM_POINTS
    one, two = _axes(circle.axis)
    radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
    points = circle.centre + circle.radius * radial
    step = circle.radius * (np.cos(angle)[:, None] * two - np.sin(angle)[:, None] * one)
    image = project_ideal(points, sensors, scene.camera)
    tangent = (project_ideal(points + 1e-4 * step, sensors, scene.camera) - image) / 1e-4
    speed = np.linalg.norm(tangent, axis=-1)
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], -1) / speed[..., None]
    x, y = np.moveaxis(image - ellipse_centre(scene, circle, sensors)[..., None, :], -1, 0)
    nx, ny = normal[..., 0], normal[..., 1]
    design = np.stack([nx, ny, nx * x, ny * y, nx * y + ny * x], -1)
    sides = _sides(pictures, circle, points, radial, fall_off)
    if not fall_off:
        squared, noise = (sides[..., 0, :] - sides[..., 1, :]) ** 2, scene.noise.variance
    else:
        squared, noise = of_sides(scene, sides)
    return Rim(design, speed * 2 * np.pi / RIM_POINTS, squared, noise)


def ellipse_centre(scene: Scene, circle: Circle, sensors: np.ndarray) -> np.ndarray:
    """Centre of the ellipse that is the image of a circle, px; not the image of the circle's centre."""
    axes, camera = frame(sensors), scene.camera
    centre = circle.centre - np.array(camera.look_at)
    columns = np.stack([circle.radius * axis for axis in _axes(circle.axis)] + [centre], -1)
    rows = np.stack([camera.focal_px * axes.right, camera.focal_px * axes.down, axes.forward], -2) @ columns
    rows[..., 2, 2] += camera.distance
    dual = rows @ np.diag([1.0, 1.0, -1.0]) @ np.swapaxes(rows, -1, -2)
    return dual[..., :2, 2] / dual[..., 2:, 2] + image_centre(camera)


def fisher_centre(circle: Rim, weights: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    """Covariance of the centre from independent points of the given inverse variances (..., n), px^2."""
    information = np.einsum("...n,...ni,...nj->...ij", weights, circle.design, circle.design)
    enough = np.ones(information.shape[:-2], bool) if counted is None else counted.sum(-1) > 5
    return _centre(information, None, enough)


def calibrated_centre(circle: Rim, kappa2: float, correlation_length: float, weakest: float) -> np.ndarray:
    """Covariance of the centre found by least squares from dense points with correlated errors, px^2.

    ``kappa2`` is a point's variance over that of the noise at unit contrast. Points of a squared contrast below
    ``weakest`` times the noise's variance are left out; a tenth of the rim must be left.
    """
    used = np.where(circle.squared >= weakest * circle.noise_variance, circle.arc, 0.0)
    variance = (
        kappa2 * circle.noise_variance * correlation_length / np.where(circle.squared > 0, circle.squared, np.inf)
    )
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


def _sides(pictures: Pictures, circle: Circle, points, radial, fall_off) -> np.ndarray:
    """Signals (..., 2, n) of the plane face and of the wall, or what is seen past the rim; 0 at hidden points."""
    bodies, sensor_at = pictures.scene.bodies, pictures.sensor_at[..., None, :]
    wall = -radial if circle.hole else radial
    chord = np.cos(np.pi / len(circle.edges)) if circle.hole else 1.0  # the mesh's facets reach into the hole
    probe = circle.centre + chord * (points - circle.centre)
    lit = tuple(_free(bodies, probe, at[..., None, :]) for at in pictures.lights_at)
    sides = []
    for normal in (np.broadcast_to(circle.axis, points.shape), wall):
        turned = np.einsum("...i,...i->...", normal, sensor_at - points) > 0
        sides.append((turned, signal(pictures, points, normal, 1, lit, fall_off=fall_off)))
    seen = _free(bodies, probe, sensor_at) & (sides[0][0] | sides[1][0])
    levels = []
    for turned, level in sides:
        wanted = seen & ~turned
        past = behind(pictures, probe, wanted, (circle.face,), fall_off=fall_off)
        levels.append(np.where(seen, np.where(wanted, past, level), 0.0))
    return np.stack(np.broadcast_arrays(*levels), -2)


def _free(bodies: Solid, probe, position) -> np.ndarray:
    """Whether nothing stands between the rim's points and a position (..., 1, 3)."""
    if bodies.is_convex:
        return np.ones((*position.shape[:-2], len(probe)), bool)
    vectors = probe - position
    _, t = first_face(bodies, np.broadcast_to(position, vectors.shape), vectors, ())
    return t > 1 - 1e-6
