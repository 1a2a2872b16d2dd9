"""Light that the wall of a round through hole sends to itself: radiosity of a cylinder that is open at both ends.

Points of the wall see each other, however far apart, so its form factors are closed: with R the radius and d^2 = 4 R^2
sin^2(phi / 2) + z^2 between two of them, 4 R^2 sin^4(phi / 2) / (pi d^4) for a unit of area. They depend on the
difference of the angles alone, so that a Fourier transform around the axis leaves one small system a frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from planner.features.seen import plane_axes
from planner.imaging.irradiance import beam
from planner.imaging.pictures import Pictures
from planner.imaging.rays import first_face
from planner.imaging.reflectance import diffuse
from scenes import Circle, Solid

_AROUND, _DEEP = 48, 24  # patches
_FINE = 5  # places in a patch, around, over which a form factor is averaged
_NODES = 13  # depths at which the light is told
_ALIKE = 1e-3  # of the radius: by how much the two rims of one wall may differ
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
            if rim.hole and other.hole and length > 0 and not unlike and rim.axis @ other.axis < _ALIKE - 1:
                found.append(_bore(solid, rim, length))
    return tuple(found)


def _bore(solid: Solid, rim: Circle, length: float) -> Bore:
    edges = [solid.edge(name) for name in rim.edges]
    middles = solid.vertices[[edge.ends for edge in edges]].mean(1)
    faces = {face for edge in edges for face in edge.faces} - {rim.face}
    return Bore(rim, length, tuple(sorted(faces)), float(np.linalg.norm(middles - rim.centre, axis=1).min()))


def light_between_walls(pictures: Pictures, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Signal that points (..., 3) on faces (...) have from the wall that they lie on; 0 outside bores; one picture."""
    found = np.zeros(faces.shape)
    for bore in bores(pictures.scene.solid):
        inside = np.isin(faces, bore.faces)
        if inside.any():
            told = pictures.once(("bore", bore.rim.name), lambda bore=bore: _exchanged(pictures, bore))
            one, two = plane_axes(bore.rim.axis)
            away = points[inside] - bore.rim.centre
            angle = np.arctan2(away @ two, away @ one) % (2 * np.pi)
            found[inside] = told.ev(angle, np.clip(-away @ bore.rim.axis, 0, bore.length))
    return found


def _exchanged(pictures: Pictures, bore: Bore) -> RectBivariateSpline:
    """Signal of the light exchanged, over the angle and the depth below the rim."""
    white = diffuse(pictures.scene.material)
    form, gather, depths = _form_factors(bore.rim.radius / bore.length)
    direct = np.fft.fft(_direct(pictures, bore), axis=0)
    whole = np.linalg.solve(np.eye(_DEEP) - white * form, direct[..., None])
    found = np.fft.ifft((white * gather @ whole)[..., 0], axis=0).real
    around = np.concatenate([found[-3:], found, found[:4]])
    angle = (np.arange(-3, _AROUND + 4) + 0.5) * 2 * np.pi / _AROUND
    return RectBivariateSpline(angle, depths * bore.length, around)


def _direct(pictures: Pictures, bore: Bore) -> np.ndarray:
    """Diffuse signal of the wall's patches by the lights alone, whether the sensor sees them or not, (around, deep)."""
    scene, rim, bodies = pictures.scene, bore.rim, pictures.scene.bodies
    white = scene.camera.exposure * diffuse(scene.material, scene.camera.analyser_deg is not None)
    angle, depth = (np.arange(_AROUND) + 0.5) * 2 * np.pi / _AROUND, (np.arange(_DEEP) + 0.5) / _DEEP * bore.length
    one, two = plane_axes(rim.axis)
    radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
    points = rim.centre + _WITHIN * bore.free_radius * radial[:, None] - depth[:, None] * rim.axis
    points, normals, found = points.reshape(-1, 3), np.repeat(-radial, _DEEP, 0), 0.0
    for light, at in zip(scene.lights, pictures.lights_at, strict=True):
        blocker, t = first_face(bodies, np.broadcast_to(at, points.shape), points - at, ())
        arriving = beam(light, at, points)
        cosine = np.einsum("ni,ni->n", arriving.to_light, normals)
        found = found + np.where((blocker < 0) | (t >= 1), arriving.strength * np.maximum(cosine, 0), 0.0)
    return white * found.reshape(_AROUND, _DEEP)


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
