"""Lights of some size as points that shine: quadrature over their surface.

Each kind of light becomes nodes in its own axes (`scenes.lights`) with normals and weights. Flat lights and domes are
Lambertian: a node sends as the cosine to its normal. A sphere is nodes within it that send alike into all directions,
so dense that from far away they look like its disc.

An integral over a light of half size h from a place at distance d is off by (h / (d + sqrt(d^2 + h^2)))^2n with n Gauss
nodes each way, so n follows from h / d, for the nearest place that is asked about. Where a horizon or a shadow's border
crosses the light the integrand has a kink, and what is left is of the order of one node's share: up to 1e-4 of what the
light gives to a surface that faces it for a disc, 4e-4 for a ring, 8e-4 for a bar and 3e-3 for a dome at a horizon,
and several times that in a penumbra (`python -m tests.proofs lights`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import light_frame, light_position
from scenes import Camera, Luminaire, Scene, Solid
from scenes.lights import FULL, Nodes


class Emitter(NamedTuple):
    """A point that shines for a light.

    Attributes
    ----------
    light : Luminaire
        Whose spectrum and polarisation it has.
    which : int
        Its place among the scene's lights.
    at : ndarray, shape (..., 3)
        Where it is, scene units.
    axis : ndarray, shape (..., 3), or None
        Normal of the surface that it stands for, None where it shines alike into all directions.
    power : float
        Irradiance across its beam times squared distance, on its axis, over the camera's exposure, scene units^2.
    """

    light: Luminaire
    which: int
    at: np.ndarray
    axis: np.ndarray | None
    power: float
    distance: float


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
    """How far from the reference point the object's vertices are, scene units."""
    return _reach(scene.solid, scene.camera.look_at)


@lru_cache(maxsize=64)  # asked for with each set of pictures
def _reach(solid: Solid, look_at: tuple[float, float, float]) -> float:
    return float(np.linalg.norm(solid.vertices - np.array(look_at), axis=1).max())


def _placed(camera: Camera, light: Luminaire, which: int, poses: np.ndarray, made: Nodes) -> list[Emitter]:
    middle = light_position(camera, light, poses)
    axes = np.stack(light_frame(camera, light, poses), -2)  # (..., 3 axes, 3)
    found = []
    for k, power in enumerate(made.powers.tolist()):
        normal = None if made.normals is None else np.einsum("a,...ai->...i", made.normals[k], axes)
        place = middle if not made.places[k].any() else middle + np.einsum("a,...ai->...i", made.places[k], axes)
        away = float(np.linalg.norm(made.places[k] - light.target))
        found.append(Emitter(light, which, place, normal, power, away))
    return found


def is_point(lights: tuple[Luminaire, ...]) -> bool:
    """Whether there is one light, a point or so small that it is taken for one."""
    return len(lights) == 1 and lights[0].is_point


@lru_cache(maxsize=64)
def nodes(light: Luminaire, reach: float, fewest: int = FULL) -> Nodes:
    """A light's nodes for places up to ``reach`` from the reference point; at least ``fewest`` each way."""
    return light.nodes(reach, fewest)


def plain(emitter: Emitter) -> Emitter:
    """The emitter of one picture as a record that can be compared."""
    at, axis = (None if v is None else tuple(v.reshape(-1, 3)[0].tolist()) for v in (emitter.at, emitter.axis))
    return emitter._replace(at=at, axis=axis)
