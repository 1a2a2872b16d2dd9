"""Light that surfaces send to each other, in pictures that are looked at closely."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from imaging.light.bore import Bore, alone, bores, light_in_bore, place_in
from imaging.light.emitters import Emitter, emitters, plain
from imaging.light.exchanged import Exchanged, exchanged, once_reflected, white_of
from imaging.light.illumination import dimming_of_one
from imaging.light.irradiance import beam
from imaging.pictures import Pictures
from scenes import Scene, Solid
from scenes.lights import GLANCE

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline


def light_between(
    pictures: Pictures, points: np.ndarray, faces: np.ndarray, *, finely: bool = False
) -> np.ndarray | float:
    """Signal that points (..., 3) on faces (...) of the bodies have from other faces, and from the floor.

    On the floor, too, whose number is that after the last of the faces. Diffuse light alone; 0 on round walls that are
    measured as such, whose limbs have a model of their own, and in pictures that are not looked at closely. ``finely``
    is for levels that are compared with an image; the closed form of a bias takes light to be even beside an edge.
    """
    scene = pictures.scene
    round_walls = [face for each in scene.solid.curved for face in each.faces]
    asked = ~np.isin(faces, round_walls)
    if not pictures.closely or not is_exchanged(scene) or not points.size or not asked.any():
        return 0.0
    shining = tuple(plain(emitter) for emitter in emitters(scene, pictures.lights, GLANCE))
    shape = np.broadcast_shapes(np.shape(faces), points.shape[:-1])
    points, faces = np.broadcast_to(points, (*shape, 3)), np.broadcast_to(faces, shape)
    lent, found = _of_faces(scene, shining, pictures.roughly), np.zeros(shape)
    for bore in bores(scene.solid):
        inside = np.isin(faces, bore.faces)
        if inside.any():
            found[inside] = _of_wall(scene, shining, bore, pictures.roughly).ev(*place_in(bore, points[inside]))
    others = ~np.isin(faces, _walls(scene.solid))
    if lent is not None and others.any():
        found[others] = (lent.fine if finely else lent).at(points[others], faces[others])
    white = white_of(scene, faces, analysed=scene.camera.analyser_deg is not None)
    found = scene.camera.exposure * white * np.where(asked, found, 0.0)
    return found * dimming_of_one(pictures, points)


def light_of_dimmed(
    pictures: Pictures, part: float, points: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Signals by others' light as it is, and where all surfaces reflect less by ``part``, at points (n, 3) on faces.

    Of light that met m surfaces (1 - part)^m is left; how much has met how many, patches of the faces tell. None where
    it is not known at all: where there are turned parts, or no two faces see each other.
    """
    scene = pictures.scene
    dimmed = scene.material.dimmed(part)
    if scene.solid.curved or not is_exchanged(scene) or dimmed is None or not pictures.closely:
        return None
    before = light_between(pictures, points, faces)
    return before, light_between(pictures.with_scene(scene.tried(material=dimmed)), points, faces)


def reflected_share(pictures: Pictures, points: np.ndarray, normals: np.ndarray, own: tuple[int, ...]) -> np.ndarray:
    """Light that met one other face of the bodies over what comes from the lights themselves where nothing is in their
    way, at points (n, 3) of unit normals, (n,); ``own`` are the facets of the surface that they lie on."""
    shining = tuple(plain(emitter) for emitter in emitters(pictures.scene, pictures.lights, GLANCE))
    direct = sum(beam(emitter, points).strength for emitter in shining)
    return once_reflected(pictures.scene, shining, points, normals, own) / direct


def is_exchanged(scene: Scene) -> bool:
    """Whether any two surfaces see each other."""
    return not scene.bodies.is_convex or scene.bright_floor is not None


def _of_faces(scene: Scene, shining: tuple[Emitter, ...], roughly: bool) -> Exchanged | None:
    """Light between all faces but walls of bores that see themselves alone."""
    return exchanged(scene, shining, roughly, alone(scene.bodies, scene.solid, scene.bright_floor))


@lru_cache(maxsize=4)
def _walls(solid: Solid) -> np.ndarray:
    """Facets of all bores, (n,)."""
    return np.array(sorted({face for bore in bores(solid) for face in bore.faces}), int)


@lru_cache(maxsize=64)
def _of_wall(scene: Scene, shining: tuple[Emitter, ...], bore: Bore, roughly: bool) -> RectBivariateSpline:
    """Light that a bore's wall has."""
    return light_in_bore(scene, shining, bore, _of_faces(scene, shining, roughly))
