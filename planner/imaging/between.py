"""Light that surfaces of the object send to each other, in pictures that are looked at closely."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from planner.imaging.bore import Bore, bores, light_in_bore, place_in
from planner.imaging.exchange import Exchanged, exchanged
from planner.imaging.pictures import Pictures
from planner.imaging.reflectance import diffuse
from scenes import Scene


def light_between(pictures: Pictures, points: np.ndarray, faces: np.ndarray) -> np.ndarray | float:
    """Signal that points (..., 3) on faces (...) of the object have from its other faces.

    Diffuse light alone; 0 on faces of obstacles and in pictures that are not looked at closely.
    """
    scene = pictures.scene
    if not pictures.closely or scene.solid.is_convex or not points.size:
        return 0.0
    lights_at = tuple(tuple(map(float, at.reshape(-1, 3)[0])) for at in pictures.lights_at)
    shape = np.broadcast_shapes(np.shape(faces), points.shape[:-1])
    points, faces = np.broadcast_to(points, (*shape, 3)), np.broadcast_to(faces, shape)
    lent = _of_faces(scene, lights_at)
    found = np.zeros(shape) if lent is None else lent.at(points, faces)
    for bore in bores(scene.solid):
        inside = np.isin(faces, bore.faces)
        if inside.any():
            found[inside] = _of_wall(scene, lights_at, bore).ev(*place_in(bore, points[inside]))
    analysed = scene.camera.analyser_deg is not None
    white = np.array([diffuse(material, analysed) for material in scene.surfaces.materials])
    return scene.camera.exposure * white[scene.surfaces.kinds[faces]] * found


def _of_faces(scene: Scene, lights_at: tuple[tuple[float, ...], ...]) -> Exchanged | None:
    """Light between plane faces."""
    return exchanged(scene, lights_at, tuple(sorted({face for bore in bores(scene.solid) for face in bore.faces})))


@lru_cache(maxsize=64)
def _of_wall(scene: Scene, lights_at: tuple[tuple[float, ...], ...], bore: Bore) -> RectBivariateSpline:
    """Light that a bore's wall has."""
    return light_in_bore(scene, np.array(lights_at), bore, _of_faces(scene, lights_at))
