"""Lights of some size as points that shine: quadrature over their surface.

Each kind of light becomes nodes in its own axes (right, down, towards the reference point; the light's middle is the
origin) with normals and weights. Flat lights and domes are Lambertian: a node sends as the cosine to its normal. A
sphere is nodes within it that send alike into all directions, so dense that from far away they look like its disc.

An integral over a light of half size h from a place at distance d is off by (h / (d + sqrt(d^2 + h^2)))^2n with n Gauss
nodes each way, so n follows from h / d, for the nearest place that is asked about. Where a horizon or a shadow's border
crosses the light the integrand has a kink, and what is left is of the order of one node's share: up to 1e-4 of what the
light gives to a surface that faces it for a disc, 4e-4 for a ring, 8e-4 for a bar and 3e-3 for a dome at a horizon,
and several times that in a penumbra (`python -m tests.proofs lights`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import light_frame, light_position
from scenes import AnyLight, Backlight, Bar, Camera, Disc, Dome, Light, Luminaire, Scene

ERROR = 1e-5  # of the irradiance, of a light that nothing hides a part of
GLANCE, SMOOTH, FULL, _MOST = 2, 4, 10, 24  # nodes each way: at least for many pictures, without a kink, and for one
_SHELLS = 3  # of a sphere
_FAR = 1e4  # distances, to where a node of a telecentric light stands
POINT = 7e-3  # half size over distance of a sphere that is taken for a point: its shading is off by 2 of its square


class Emitter(NamedTuple):
    """A point that shines for a light.

    Attributes
    ----------
    light : Luminaire
        Whose spectrum and polarisation it has.
    which : int
        Its place among the scene's lights.
    at : ndarray, shape (..., 3)
        Where it is, cm.
    axis : ndarray, shape (..., 3), or None
        Normal of the surface that it stands for, None where it shines alike into all directions.
    power : float
        Irradiance across its beam times squared distance, on its axis, over the camera's exposure, cm^2.
    """

    light: Luminaire
    which: int
    at: np.ndarray
    axis: np.ndarray | None
    power: float
    distance: float


@dataclass(frozen=True, eq=False)
class Nodes:
    """K points in a light's own axes: places (K, 3), normals (K, 3) or None, powers (K,), all as of `Emitter`.

    ``area`` is that of the surface that they stand for, cm^2; 0 for points and spheres.
    """

    places: np.ndarray
    normals: np.ndarray | None
    powers: np.ndarray
    area: float = 0.0


def emitters(scene: Scene, lights: tuple[np.ndarray, ...], fewest: int = FULL) -> tuple[Emitter, ...]:
    """All points that shine in pictures whose lights have poses (..., 2).

    ``fewest`` nodes each way of a light of some size: `FULL`, `SMOOTH` where nothing hides a part of it, or `GLANCE`.
    """
    found = []
    for which, (light, poses) in enumerate(zip(scene.lights, lights, strict=True)):
        if light.intensity > 0:
            found += _placed(scene.camera, light, which, poses, nodes(light, reach_of(scene), fewest))
    return tuple(found)


def reach_of(scene: Scene) -> float:
    """How far from the reference point the object's vertices are, cm."""
    return float(np.linalg.norm(scene.solid.vertices - np.array(scene.camera.look_at), axis=1).max())


def _placed(camera: Camera, light: Luminaire, which: int, poses: np.ndarray, made: Nodes) -> list[Emitter]:
    middle = light_position(camera, light, poses)
    axes = np.stack(light_frame(camera, light, poses), -2)  # (..., 3 axes, 3)
    found = []
    for k, power in enumerate(made.powers.tolist()):
        normal = None if made.normals is None else np.einsum("a,...ai->...i", made.normals[k], axes)
        place = middle if not made.places[k].any() else middle + np.einsum("a,...ai->...i", made.places[k], axes)
        away = float(np.linalg.norm(made.places[k] - np.array([*light.offset, light.distance]) * (-1, -1, 1)))
        found.append(Emitter(light, which, place, normal, power, away))
    return found


def is_point(lights: tuple[Luminaire, ...]) -> bool:
    """Whether there is one light, a point or so small a sphere that it is taken for one."""
    return len(lights) == 1 and isinstance(lights[0], Light) and lights[0].half_size <= POINT * lights[0].distance


@lru_cache(maxsize=64)
def nodes(light: AnyLight, reach: float, fewest: int = FULL) -> Nodes:
    """A light's nodes for places up to ``reach`` from the reference point, cm; at least ``fewest`` each way."""
    if is_point((light,)):
        return Nodes(np.zeros((1, 3)), None, np.array([light.intensity * light.distance**2]))
    count = fewest if fewest == GLANCE else max(_count(light, _nearest(light, reach)), fewest)
    if isinstance(light, Light):
        return _sphere(light, count)
    if isinstance(light, Backlight) and light.cone_deg < 90:
        return _cone(light, min(fewest, SMOOTH))
    places, normals, areas = _surface(light, count)
    if isinstance(light, Backlight):  # its radiance is given: that of a white surface, exposure / pi
        return Nodes(places, normals, light.intensity * areas / np.pi, float(areas.sum()))
    towards = np.array([0.0, 0.0, light.distance]) - places
    square = (towards**2).sum(1)
    facing = np.maximum(np.einsum("ki,ki->k", towards, normals), 0.0) * towards[:, 2] / square**2
    return Nodes(places, normals, light.intensity * areas / (areas @ facing), float(areas.sum()))


def _nearest(light: Luminaire, reach: float) -> float:
    return max(light.distance - reach, 0.05 * light.distance)


def _count(light: Luminaire, distance: float) -> int:
    """Gauss nodes each way for an error of `ERROR`; a sphere's field is told by powers of its radius over distance."""
    half = light.half_size
    ratio = half / (distance if isinstance(light, Light) else distance + np.hypot(distance, half))
    return int(min(np.ceil(np.log(ERROR) / (2 * np.log(ratio))), _MOST))


def _surface(light: AnyLight, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, normals and areas of the nodes of a Lambertian surface."""
    if isinstance(light, Bar | Backlight):
        return _rectangle(light, count)
    x, weight = np.polynomial.legendre.leggauss(count)
    share, weight = (x + 1) / 2, weight / 2
    angle = (np.arange(2 * count) + 0.5) * np.pi / count
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], -1)
    if isinstance(light, Dome):
        return _dome(light, share, weight, around)
    inner, outer, tilt = (0.0, light.radius, 0.0) if isinstance(light, Disc) else (
        light.inner_radius, light.outer_radius, np.radians(light.tilt_deg)
    )  # fmt: skip
    square = inner**2 + share * (outer**2 - inner**2)  # equal weights are equal areas
    radius = np.sqrt(square)
    height = (radius - (inner + outer) / 2) * np.tan(tilt)
    places = radius[:, None, None] * around + height[:, None, None] * np.array([0.0, 0.0, 1.0])
    normals = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) - np.sin(tilt) * around
    areas = weight * np.pi * (outer**2 - inner**2) / np.cos(tilt) / angle.size
    return places.reshape(-1, 3), np.tile(normals, (count, 1)), np.repeat(areas, angle.size)


def _rectangle(light: Bar | Backlight, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    sides = (2 * light.half_side,) * 2 if isinstance(light, Backlight) else (light.length, light.width)
    turn = 0.0 if isinstance(light, Backlight) else np.radians(light.turn_deg)
    x, weight = np.polynomial.legendre.leggauss(count)
    along, across = (part.ravel() for part in np.meshgrid(x * sides[0] / 2, x * sides[1] / 2, indexing="ij"))
    places = np.stack([along * np.cos(turn) - across * np.sin(turn), along * np.sin(turn) + across * np.cos(turn)], -1)
    areas = np.outer(weight, weight).ravel() * sides[0] * sides[1] / 4
    places = np.concatenate([places, np.zeros((len(places), 1))], 1)
    return places, np.tile([0.0, 0.0, 1.0], (len(places), 1)), areas


def _dome(light: Dome, share: np.ndarray, weight: np.ndarray, around: np.ndarray):
    """Gauss nodes in the cosine of the angle from the axis; normals towards the reference point."""
    low, high = np.cos(np.radians([light.half_angle_deg, light.opening_deg]))
    cosine = low + share * (high - low)
    away = -cosine[:, None, None] * np.array([0.0, 0.0, 1.0]) + np.sqrt(1 - cosine**2)[:, None, None] * around
    away = away.reshape(-1, 3)
    places = light.distance * (away + np.array([0.0, 0.0, 1.0]))
    areas = np.repeat(weight * 2 * np.pi * (high - low) * light.distance**2 / len(around), len(around))
    return places, -away, areas


def _sphere(light: Light, count: int) -> Nodes:
    """Gauss-Chebyshev shells of density 1 / sqrt(1 - r^2), whose projection is a disc, with Gauss nodes on each.

    The shells are turned against each other, so that a horizon meets their nodes one by one.
    """
    shells = np.sin((np.arange(_SHELLS) + 0.5) * np.pi / (2 * _SHELLS))[:, None, None]
    cosine, weight = np.polynomial.legendre.leggauss(count)
    angle = (np.arange(2 * count) + np.arange(1, _SHELLS + 1)[:, None, None] / (_SHELLS + 1)) * np.pi / count
    sine = np.sqrt(1 - cosine**2)[:, None]
    ways = np.stack(np.broadcast_arrays(sine * np.cos(angle), cosine[:, None], sine * np.sin(angle)), -1)
    powers = np.broadcast_to(shells**2 / (shells**2).sum() * weight[:, None] / (4 * count), ways.shape[:-1])
    power = light.intensity * light.distance**2
    return Nodes((light.radius * shells[..., None] * ways).reshape(-1, 3), None, power * powers.ravel())


def _cone(light: Backlight, count: int) -> Nodes:
    """Directions within the cone of a telecentric light, as points far behind it; equal radiance in all of them."""
    x, weight = np.polynomial.legendre.leggauss(count)
    sine2 = (x + 1) / 2 * np.sin(np.radians(light.cone_deg)) ** 2
    angle = (np.arange(2 * count) + 0.5) * np.pi / count
    sine = np.sqrt(sine2)[:, None]
    away = np.stack(np.broadcast_arrays(sine * np.cos(angle), sine * np.sin(angle), -np.sqrt(1 - sine**2)), -1)
    far = _FAR * light.distance
    # irradiance across the axis: radiance times the integral of the cosine, pi sin^2 of the half angle
    share = np.repeat(weight / 2 / angle.size, angle.size) * np.sin(np.radians(light.cone_deg)) ** 2
    away = away.reshape(-1, 3)
    return Nodes(far * away, None, light.intensity * share * far**2 / -away[:, 2])
