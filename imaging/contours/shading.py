"""The grey level beside a limb: how a matt surface darkens or brightens towards where it turns away.

A line d px inside the limb meets the surface sqrt(2 d / (m k)) before the limb's point along the line of sight, k the
normal curvature that way and m the magnification: the level is a0 + a1 sqrt(d) + a2 d + ..., steep at the limb itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from imaging.contours.limb import Strand
from imaging.geometry.projection import camera_frame, depth, from_axis, sensor_position
from scenes import Camera
from scenes.parts.surfaces import Surface

_ORDER, _NODES = 4, 12  # powers of sqrt(d), and places at which the level is found


class Lamps(NamedTuple):
    """Points that shine: places (k, 3), and grey levels (k,) of a surface that faces one at unit distance."""

    at: np.ndarray
    power: np.ndarray


class Profile(NamedTuple):
    """Level of the body d px inside its limb: sum of coefficients c_j sqrt(d)^j, at n points.

    Attributes
    ----------
    coefficients : ndarray, shape (n, order + 1)
        Grey levels over px^(j / 2).
    left_out : ndarray, shape (n,)
        Largest difference from the level itself where both were compared, grey levels; 0 where they were not.
    """

    coefficients: np.ndarray
    left_out: np.ndarray

    def levels(self, inside: np.ndarray) -> np.ndarray:
        """At distances (J,) px inside of the n points, (n, J)."""
        return polynomial.polyval(np.sqrt(inside), self.coefficients.T)


def lambert(surface: Surface, points: np.ndarray, lamps: Lamps) -> np.ndarray:
    """Level of points (..., 3) of a matt surface, its own attached shadow with it, grey levels, (...)."""
    toward = lamps.at - points[..., None, :]
    square = (toward**2).sum(-1)
    facing = np.maximum((surface.normals(points)[..., None, :] * toward).sum(-1), 0.0)
    return (lamps.power * facing / (square * np.sqrt(square))).sum(-1)


def levels_inside(
    surface: Surface, strand: Strand, sensor, camera: Camera, inside: np.ndarray, lamps: Lamps
) -> np.ndarray:
    """Exact level at distances (J,) px inside a strand's n points along the image's normal, (n, J); 0 past the body."""
    pose = np.array(list(sensor), float)
    axes, eye = camera_frame(camera, pose), sensor_position(camera, pose)
    at = strand.at[:, None] - np.asarray(inside)[None, :, None] * strand.outward[:, None]
    way = at[..., :1] * axes.right + at[..., 1:] * axes.down + camera.focal_px * axes.forward
    met = surface.intersections(eye, way)
    first = np.where(met > 0, met, np.inf).min(-1)
    hit = np.isfinite(first)
    points = eye + np.where(hit, first, 0.0)[..., None] * way
    found = np.zeros(hit.shape)
    found[hit] = lambert(surface, points[hit], lamps)
    return found


def sampled_profile(surface: Surface, strand: Strand, sensor, camera: Camera, lamps: Lamps, reach: float) -> Profile:
    """The profile over ``reach`` px, nearly best: through the exact level at Chebyshev's places of sqrt(d)."""
    places = (chebyshev.chebpts1(_NODES) + 1) / 2
    return fitted(places, levels_inside(surface, strand, sensor, camera, reach * places**2, lamps), reach)


def fitted(places: np.ndarray, levels: np.ndarray, reach: float) -> Profile:
    """The profile over ``reach`` px through levels (n, J) at ``places`` (J,), roots of shares of the reach."""
    scaled = np.vander(places, _ORDER + 1, increasing=True)
    solved = np.linalg.lstsq(scaled, levels.T)[0]
    left_out = np.abs(levels.T - scaled @ solved).max(0)
    return Profile((solved / np.sqrt(reach) ** np.arange(_ORDER + 1)[:, None]).T, left_out)


def limb_profile(surface: Surface, strand: Strand, sensor, camera: Camera, lamps: Lamps) -> Profile:
    """a0, a1, a2 in closed form, from the surface's curvatures and their change, for lamps that shine on the limb.

    A lamp from which the limb is turned away adds nothing, although it may shine on what is a little inside.
    """
    pose = np.array(list(sensor), float)
    eye = sensor_position(camera, pose)
    away = strand.points - eye
    far = np.linalg.norm(away, axis=1)
    sight, normal = away / far[:, None], strand.normals
    aside = np.cross(sight, normal)
    operator = surface.shape_operator(strand.points)
    bent = np.einsum("nij,nj->ni", operator, sight)
    bend, twist = strand.bend, (bent * aside).sum(1)
    third = surface.third(strand.points, sight)
    mixed = (
        surface.third(strand.points, sight + aside) - surface.third(strand.points, sight - aside)
        - 2 * surface.third(strand.points, aside)
    ) / 6  # fmt: skip
    turning = -third[:, None] * sight - mixed[:, None] * aside - (bent**2).sum(1)[:, None] * normal
    slip = _slip(strand, normal, aside, pose, camera)
    onward = (1 / far - twist * slip + third / (3 * bend)) / bend
    level, by_sight, twice, by_aside = _derivatives(strand, lamps, sight, aside, operator, turning)
    coefficients = [
        level,
        -by_sight * np.sqrt(2 / (bend * strand.magnification)),
        (by_sight * onward + by_aside * slip + twice / bend) / strand.magnification,
    ]
    return Profile(np.stack(coefficients, -1), np.zeros(len(level)))


def _slip(strand: Strand, normal: np.ndarray, aside: np.ndarray, pose: np.ndarray, camera: Camera) -> np.ndarray:
    """Part of ``aside`` for one against the normal in a step whose image runs along the image's normal."""
    tangent = np.stack([-strand.outward[:, 1], strand.outward[:, 0]], -1)
    moved = [(_image_of(step, strand, pose, camera) * tangent).sum(1) for step in (normal, aside)]
    return moved[0] / moved[1]


def _image_of(step: np.ndarray, strand: Strand, pose: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivative of the image of the strand's points by a step (n, 3), px, (n, 2)."""
    axes = camera_frame(camera, pose)
    z = depth(strand.points, pose, camera)[:, None]
    screen = np.stack([axes.right, axes.down])
    at = from_axis(strand.points, pose, camera)
    return (camera.focal_px * step @ screen.T - at * (step @ axes.forward)[:, None]) / z


def _derivatives(strand, lamps: Lamps, sight, aside, operator, turning) -> list[np.ndarray]:
    """Level, first and second derivative along the line of sight, and first aside, over the surface; each (n,)."""
    normal, bend = strand.normals[:, None], strand.bend[:, None]
    toward = lamps.at - strand.points[:, None]

    def dot(vectors):
        return (vectors[:, None] * toward).sum(-1)

    square, facing = (toward**2).sum(-1), (normal * toward).sum(-1)
    by_sight, by_aside = (dot(np.einsum("nij,nj->ni", operator, way)) for way in (sight, aside))
    twice = dot(turning) - bend
    near, beside = -2 * dot(sight), -2 * dot(aside)
    nearer = 2 + 2 * bend * facing
    power = np.where(facing > 0, lamps.power, 0.0)
    one, three, five = (power * square ** (-k / 2) for k in (3, 5, 7))
    return [
        (one * facing).sum(-1),
        (one * by_sight - 1.5 * three * facing * near).sum(-1),
        (one * twice - 3 * three * by_sight * near + facing * (3.75 * five * near**2 - 1.5 * three * nearer)).sum(-1),
        (one * by_aside - 1.5 * three * facing * beside).sum(-1),
    ]
