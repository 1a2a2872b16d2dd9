"""Light that the wall of a round through hole sends to itself: radiosity of a cylinder that is open at both ends.

Points of the wall see each other, however far apart, so its form factors are closed: with R the radius and d^2 = 4 R^2
sin^2(phi / 2) + z^2 between two of them, 4 R^2 sin^4(phi / 2) / (pi d^4) for a unit of area. They depend on the
difference of the angles alone, so that a Fourier transform around the axis leaves one small system a frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from imaging.geometry.rays import first_face
from imaging.light.emitters import Emitter
from imaging.light.exchange import Exchange, Hits
from imaging.light.exchanged import Exchanged
from imaging.light.irradiance import beam
from imaging.light.places import in_unit_square, shifts, ways_about
from scenes import Circle, Floor, Scene, Solid

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline

_AROUND, _DEEP = 48, 24  # patches
_FINE = 5  # places in a patch, around, over which a form factor is averaged
_FROM_WALL, _ROUGHLY = 256, 32  # rays; where the light is told roughly
_LOOKS = 8  # rays from each patch that look for anything but the wall
_NODES = 13  # depths at which the light is told
_ALIKE = 1e-3  # of the radius: by how much the two rims of one wall may differ
_SLANTED = 0.02  # sine of the angle between a facet of a wall and the axis
_LACKS = 0.05  # of the cylinder's area, of which twelve facets lack 1.2 %
_WITHIN = 1 - 1e-4  # of the radius of the widest free cylinder: where it is asked what reaches a facet


@dataclass(frozen=True, eq=False)
class Bore:
    """A round through hole: one of its rims, its wall's length, its faces, and the widest cylinder free of them."""

    rim: Circle
    length: float
    faces: tuple[int, ...]
    free_radius: float


@lru_cache(maxsize=64)
def bores(solid: Solid) -> tuple[Bore, ...]:
    """The through holes whose both ends are circles of the solid, each once."""
    found = []
    for i, rim in enumerate(solid.circles):
        for other in solid.circles[i + 1 :]:
            away = other.centre - rim.centre
            length = -float(away @ rim.axis)
            aside = float(np.linalg.norm(away + length * rim.axis))
            unlike = max(aside, abs(rim.radius - other.radius)) > _ALIKE * rim.radius
            facing = rim.hole and other.hole and length > 0 and rim.axis @ other.axis < _ALIKE - 1
            if facing and not unlike and _is_wall(solid, bore := _bore(solid, rim, other, length)):
                found.append(bore)
    return tuple(found)


def _is_wall(solid: Solid, bore: Bore) -> bool:
    """Whether facets are all of a cylinder from rim to rim: those of chamfers at either end are not, nor is a wall in
    which another hole ends."""
    faces = list(bore.faces)
    along = np.abs(solid.normals[faces] @ bore.rim.axis).max() <= _SLANTED
    whole = 2 * np.pi * bore.rim.radius * bore.length
    return bool(along and abs(solid.areas[faces].sum() - whole) <= _LACKS * whole)


def _beside(solid: Solid, rim: Circle) -> tuple[int, ...]:
    """The facets of a rim's wall that end at it."""
    return tuple(sorted({face for name in rim.edges for face in solid.edge(name).faces} - {rim.face}))


def _bore(solid: Solid, rim: Circle, other: Circle, length: float) -> Bore:
    """Of all facets of the surfaces that end at both rims, also those that reach neither."""
    faces = np.array(sorted({*_beside(solid, rim), *_beside(solid, other)}))
    if solid.regions is not None:
        faces = np.flatnonzero(np.isin(solid.regions, solid.regions[faces]))
    middles = solid.vertices[[solid.edge(name).ends for name in rim.edges]].mean(1)
    free = float(np.linalg.norm(middles - rim.centre, axis=1).min())
    return Bore(rim, length, tuple(faces.tolist()), free)


@lru_cache(maxsize=8)
def alone(bodies: Solid, solid: Solid, floor: Floor | None) -> tuple[int, ...]:
    """Facets of a solid's bores that see nothing but their own wall and darkness, of some bodies on a floor."""
    return tuple(sorted({face for bore in bores(solid) if _is_alone(bodies, bore, floor) for face in bore.faces}))


def _is_alone(bodies: Solid, bore: Bore, floor: Floor | None) -> bool:
    points, normals = (part.reshape(-1, 3) for part in _on_wall(bore, (np.arange(_DEEP) + 0.5) / _DEEP * bore.length))
    ways = ways_about(normals, (in_unit_square(_LOOKS) + shifts(len(points))[:, None]) % 1.0)
    face, _ = first_face(bodies, np.broadcast_to(points[:, None], ways.shape), ways, ())
    out = ~np.isin(face, bore.faces)
    return not (out & ((face >= 0) | (floor is not None) & (ways[..., 2] < 0))).any()


def light_in_bore(
    scene: Scene, emitters: tuple[Emitter, ...], bore: Bore, others: Exchanged | None
) -> RectBivariateSpline:
    """Light that a wall has from itself and from the faces outside, over the angle and the depth below the rim.

    Irradiance in units of the signal of a white face. ``others`` sends what comes from outside.
    """
    from scipy.interpolate import RectBivariateSpline  # slow to load, and rarely needed

    white = scene.surfaces.of(bore.faces[0]).diffuse()
    form, gather, nodes = _form_factors(bore.rim.radius / bore.length)
    outside = 0.0, 0.0
    if others is not None:
        outside = [
            others.gathered(each, _AROUND * deep, _rays(others.exchange)).reshape(_AROUND, deep)
            for each, deep in zip(_from_outside(bore, others.exchange), (_DEEP, _NODES), strict=True)
        ]
    direct = np.fft.fft(white * (_direct(scene, emitters, bore) + outside[0]), axis=0)
    whole = np.linalg.solve(np.eye(_DEEP) - white * form, direct[..., None])
    found = np.fft.ifft((gather @ whole)[..., 0], axis=0).real + outside[1]
    around = np.concatenate([found[-3:], found, found[:4]])
    angle = (np.arange(-3, _AROUND + 4) + 0.5) * 2 * np.pi / _AROUND
    return RectBivariateSpline(angle, nodes * bore.length, around)


def place_in(bore: Bore, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle and depth below the rim of points (..., 3) on the wall."""
    one, two = bore.rim.axes
    away = points - bore.rim.centre
    return np.arctan2(away @ two, away @ one) % (2 * np.pi), np.clip(-away @ bore.rim.axis, 0, bore.length)


def _on_wall(bore: Bore, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places before the facets at the patches' angles and some depths, and the wall's normals, (around, depths, 3)."""
    angle = (np.arange(_AROUND) + 0.5) * 2 * np.pi / _AROUND
    one, two = bore.rim.axes
    radial = np.cos(angle)[:, None, None] * one + np.sin(angle)[:, None, None] * two
    points = bore.rim.centre + _WITHIN * bore.free_radius * radial - depth[:, None] * bore.rim.axis
    return points, np.broadcast_to(-radial, points.shape)


def _direct(scene: Scene, emitters: tuple[Emitter, ...], bore: Bore) -> np.ndarray:
    """What arrives on the wall's patches from the lights, (around, deep)."""
    points, normals = _on_wall(bore, (np.arange(_DEEP) + 0.5) / _DEEP * bore.length)
    found = np.zeros(points.shape[:-1])
    for emitter in emitters:
        at = np.array(emitter.at)
        blocker, t = first_face(scene.bodies, np.broadcast_to(at, points.shape), points - at, ())
        arriving = beam(emitter, points)
        cosine = np.einsum("...i,...i->...", arriving.to_light, normals)
        found += np.where((blocker < 0) | (t >= 1), arriving.strength * np.maximum(cosine, 0), 0.0)
    return found


@lru_cache(maxsize=4)
def _from_outside(bore: Bore, exchange: Exchange) -> tuple[Hits, Hits]:
    """What rays from the wall's patches and from its nodes meet outside."""
    found = []
    for depth in ((np.arange(_DEEP) + 0.5) / _DEEP, _form_factors(bore.rim.radius / bore.length)[2]):
        points, normals = (part.reshape(-1, 3) for part in _on_wall(bore, depth * bore.length))
        found.append(exchange.met(points, normals, _rays(exchange), shifts(len(points)), bore.faces))
    return found[0], found[1]


def _rays(exchange: Exchange) -> int:
    return _ROUGHLY if exchange.roughly else _FROM_WALL


@lru_cache(maxsize=64)
def _form_factors(radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a wall of length 1: transforms around the axis of the form factors from patches to patches (around, deep,
    deep) and to depths (around, nodes, deep), and those depths (nodes,)."""
    depth = (np.arange(_DEEP) + 0.5) / _DEEP
    nodes = (1 - np.cos(np.pi * np.arange(_NODES) / (_NODES - 1))) / 2
    fine = (np.arange(_FINE) - _FINE // 2) / _FINE
    angle = (np.arange(_AROUND)[:, None] + fine) * 2 * np.pi / _AROUND
    area = radius * 2 * np.pi / _AROUND / _DEEP
    found = []
    for at in (depth, nodes):
        sine2 = np.sin(angle / 2)[:, :, None, None] ** 2
        distance2 = 4 * radius**2 * sine2 + (at[:, None] - depth) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            each = 4 * radius**2 * sine2**2 / (np.pi * distance2**2)
        each = np.where(distance2 > 0, each, 1 / (8 * np.pi * radius**2))  # beside itself: half of what is round it
        found.append(np.fft.fft(each.mean(1) * area, axis=0))
    return found[0], found[1], nodes
