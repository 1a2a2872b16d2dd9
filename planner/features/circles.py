"""A circular edge as the sensor sees it, and how well the circle is found from its rim.

The pose tells in which plane the circle lies, so its parameters are three: two shifts of its centre in that plane and the
change of its radius. A point's residual is its distance from the rim's image along the normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.features.locator import reach
from planner.features.seen import plane_axes
from planner.imaging.appearance import behind, of_sides, signal
from planner.imaging.pictures import Pictures
from planner.imaging.projection import from_axis, jacobian_ideal
from planner.imaging.rays import first_face
from scenes import Circle, Solid

RIM_POINTS = 64
LEAST_CLEAR = 0.25  # part of the seen rim that must be undisturbed, or all of it is taken and its circle is `clutter`
LEAST_SEEN = 0.1  # part of the rim that must have contrast
_STRAIGHT = 9  # places on a straight edge to which a rim's distance is taken


@dataclass(frozen=True)
class Rim:
    """Points on the image of a circle, for settings of leading shape (...).

    Attributes
    ----------
    design : ndarray, shape (..., n, 3)
        Derivative of each point's place along its normal by the circle's three parameters (`planner.features.seen`), px
        for the scene's unit.
    arc : ndarray, shape (..., n)
        Length of image that each point stands for, px.
    squared : ndarray, shape (..., n)
        Squared contrast, 0 at hidden points.
    noise_variance : ndarray, shape (..., n), or float
        Mean of both sides, grey levels^2.
    clear : ndarray of bool, shape (..., n)
        Whether the locator is undisturbed there: the far rim of the wall beside, where the wall is seen, and the straight
        edges around the circle's face are `locator.reach` away.
    """

    design: np.ndarray
    arc: np.ndarray
    squared: np.ndarray
    noise_variance: np.ndarray | float
    clear: np.ndarray

    @property
    def crowded(self) -> np.ndarray:
        """Whether so little of what is seen is undisturbed that all of it has to be taken, bool, shape (...)."""
        seen = self.squared > 0
        return (seen & self.clear).mean(-1) < LEAST_CLEAR * np.maximum(seen.mean(-1), LEAST_CLEAR)

    @property
    def counted(self) -> np.ndarray:
        """Which points have any contrast."""
        return self.squared > 0


def equal_angles(count: int = RIM_POINTS) -> np.ndarray:
    """Angles all around a rim."""
    return 2 * np.pi * (np.arange(count) + 0.5) / count


def radials(circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Unit vectors from a circle's centre, shape (n, 3)."""
    one, two = plane_axes(circle.axis)
    return np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two


def rim(pictures: Pictures, circle: Circle, *, fall_off: bool = True) -> Rim:
    """Sample a circular edge at equal angles."""
    scene, sensors = pictures.scene, pictures.sensors
    angle = equal_angles()
    one, two = plane_axes(circle.axis)
    radial = radials(circle, angle)
    points = circle.centre + circle.radius * radial
    slope = jacobian_ideal(points, sensors, scene.camera)
    step = circle.radius * (np.cos(angle)[:, None] * two - np.sin(angle)[:, None] * one)
    tangent = np.einsum("...nij,nj->...ni", slope, step)
    speed = np.linalg.norm(tangent, axis=-1)
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], -1) / speed[..., None]
    across = np.einsum("...ni,...nij->...nj", normal, slope)
    design = np.stack([across @ one, across @ two, np.einsum("...nj,nj->...n", across, radial)], -1)
    sides = _sides(pictures, circle, points, radial, fall_off)
    if not fall_off:
        squared, noise = (sides[..., 0, :] - sides[..., 1, :]) ** 2, scene.noise.variance
    else:
        squared, noise = of_sides(scene, sides)
    clear = clearance(pictures, circle, angle) >= reach(scene.locator.scale_px, scene.camera.blur_px)
    return Rim(design, speed * 2 * np.pi / RIM_POINTS, squared, noise, clear)


def contrast_along(pictures: Pictures, circle: Circle, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
    """Squared contrast at angles of a rim, 0 where it is hidden, and the noise's variance there."""
    radial = radials(circle, angle)
    points = circle.centre + circle.radius * radial
    return of_sides(pictures.scene, _sides(pictures, circle, points, radial, True))


def seen_along(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Whether the sensor sees a rim at angles, whatever the light, bool, shape (..., n)."""
    radial = radials(circle, angle)
    points = circle.centre + circle.radius * radial
    sensor_at = pictures.sensor_at[..., None, :]
    turned = [
        np.einsum("...i,...i->...", normal, sensor_at - points) > 0
        for normal in (np.broadcast_to(circle.axis, points.shape), -radial if circle.hole else radial)
    ]
    return (turned[0] | turned[1]) & _free(pictures.scene.bodies, _probe(circle, points), sensor_at)


def clearance(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Distance in the image from places of a rim to the nearest boundary that disturbs them, px, shape (..., n).

    Boundaries are the wall's other rim, where the wall beside the place is seen, and straight edges of the face.
    """
    solid, radial = pictures.scene.solid, radials(circle, angle)
    points = circle.centre + circle.radius * radial
    there = _image(pictures, points)
    nearest = np.full(there.shape[:-1], np.inf)
    for other in solid.circles:
        if _coaxial(circle, other):
            wall = -radial if circle.hole else radial
            turned = np.einsum("...i,...i->...", wall, pictures.sensor_at[..., None, :] - points) > 0
            away = _to_curve(there, _image(pictures, other.centre + other.radius * radials(other, equal_angles())))
            nearest = np.where(turned, np.minimum(nearest, away), nearest)
    own = {name for rim in solid.circles for name in rim.edges}
    for edge in solid.edges:
        if circle.face in edge.faces and edge.name not in own:
            start, stop = solid.vertices[list(edge.ends)]
            places = start + np.linspace(0, 1, _STRAIGHT)[:, None] * (stop - start)
            nearest = np.minimum(nearest, _to_curve(there, _image(pictures, places), closed=False))
    return nearest


def _image(pictures: Pictures, points: np.ndarray) -> np.ndarray:
    return from_axis(points, pictures.sensors, pictures.scene.camera)


def _coaxial(circle: Circle, other: Circle) -> bool:
    """Whether another circle is the far rim of the same wall, or may be: on the same axis, about as wide."""
    across = other.centre - circle.centre
    along = across @ circle.axis
    near = 1e-3 * circle.radius
    return (
        other is not circle
        and other.hole == circle.hole
        and abs(along) > near
        and np.linalg.norm(across - along * circle.axis) < near
        and abs(other.radius - circle.radius) < circle.radius / 2
    )


def _to_curve(points: np.ndarray, curve: np.ndarray, *, closed: bool = True) -> np.ndarray:
    """Distance of points (..., n, 2) from the pieces between points (..., k, 2) of a curve, shape (..., n)."""
    start, stop = (curve, np.roll(curve, -1, -2)) if closed else (curve[..., :-1, :], curve[..., 1:, :])
    nearest = np.full(points.shape[:-1], np.inf)
    for k in range(start.shape[-2]):
        a, along = start[..., k : k + 1, :], stop[..., k : k + 1, :] - start[..., k : k + 1, :]
        size = np.maximum((along**2).sum(-1), np.finfo(float).tiny)
        share = np.clip(((points - a) * along).sum(-1) / size, 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - share[..., None] * along, axis=-1))
    return nearest


def _probe(circle: Circle, points: np.ndarray) -> np.ndarray:
    """Places that stand for those of a rim where it is asked what they see: the mesh's facets reach into a hole."""
    chord = np.cos(np.pi / len(circle.edges)) if circle.hole else 1.0
    return circle.centre + chord * (points - circle.centre)


def fisher_circle(circle: Rim, weights: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    """Covariance of the three parameters from independent points of the given inverse variances (..., n), unit^2."""
    information = np.einsum("...n,...ni,...nj->...ij", weights, circle.design, circle.design)
    enough = np.ones(information.shape[:-2], bool) if counted is None else counted.sum(-1) > 3
    return _covariance(information, None, enough)


def calibrated_circle(circle: Rim, kappa2: float, correlation_length: float, weakest: float) -> np.ndarray:
    """Covariance of the three parameters found by least squares from dense points with correlated errors, unit^2.

    ``kappa2`` is a point's variance over that of the noise at unit contrast. Disturbed points and those of a squared
    contrast below ``weakest`` times the noise's variance are left out; a tenth of the rim must be left.
    """
    taken = circle.clear | circle.crowded[..., None]
    used = np.where(taken & (circle.squared >= weakest * circle.noise_variance), circle.arc, 0.0)
    variance = (
        kappa2 * circle.noise_variance * correlation_length / np.where(circle.squared > 0, circle.squared, np.inf)
    )
    information = np.einsum("...n,...ni,...nj->...ij", used, circle.design, circle.design)
    spread = np.einsum("...n,...ni,...nj->...ij", used * variance, circle.design, circle.design)
    return _covariance(information, spread, (used > 0).mean(-1) >= LEAST_SEEN)


def _covariance(information: np.ndarray, spread: np.ndarray | None, enough: np.ndarray) -> np.ndarray:
    """information^-1 [spread information^-1]; infinite diagonal where singular."""
    enough = enough & np.isfinite(information).all((-1, -2))
    size = np.sqrt(np.abs(np.diagonal(information, axis1=-2, axis2=-1)))
    enough &= (size > 0).all(-1)
    size = np.where(enough[..., None], size, 1.0)
    scaled = np.where(enough[..., None, None], information / (size[..., None] * size[..., None, :]), np.eye(3))
    enough &= np.linalg.eigvalsh(scaled)[..., 0] > 1e-10
    scaled = np.where(enough[..., None, None], scaled, np.eye(3))
    inverse = np.linalg.inv(scaled) / (size[..., None] * size[..., None, :])
    covariance = inverse if spread is None else inverse @ np.where(enough[..., None, None], spread, 0.0) @ inverse
    return np.where(enough[..., None, None], covariance, np.diag(np.full(3, np.inf)))


def _sides(pictures: Pictures, circle: Circle, points, radial, fall_off) -> np.ndarray:
    """Signals (..., 2, n) of the plane face and of the wall, or what is seen past the rim; 0 at hidden points."""
    bodies, sensor_at = pictures.scene.bodies, pictures.sensor_at[..., None, :]
    wall = -radial if circle.hole else radial
    probe = _probe(circle, points)
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
