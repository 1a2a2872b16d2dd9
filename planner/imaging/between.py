"""Light that surfaces of the object send to each other, in pictures that are looked at closely."""

from __future__ import annotations

from dataclasses import dataclass
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
    known = _known(scene, tuple(tuple(map(float, at.reshape(-1, 3)[0])) for at in pictures.lights_at))
    shape = np.broadcast_shapes(np.shape(faces), points.shape[:-1])
    points, faces = np.broadcast_to(points, (*shape, 3)), np.broadcast_to(faces, shape)
    found = np.zeros(shape) if known.faces is None else known.faces.at(points, faces)
    for bore, told in known.walls:
        inside = np.isin(faces, bore.faces)
        if inside.any():
            found[inside] = told.ev(*place_in(bore, points[inside]))
    return scene.camera.exposure * diffuse(scene.material, scene.camera.analyser_deg is not None) * found


@dataclass(frozen=True, eq=False)
class _Light:
    """Light between plane faces and in bores, of one scene under its lights."""

    faces: Exchanged | None
    walls: tuple[tuple[Bore, RectBivariateSpline], ...]


@lru_cache(maxsize=32)
def _known(scene: Scene, lights_at: tuple[tuple[float, ...], ...]) -> _Light:
    holes = bores(scene.solid)
    faces = exchanged(scene, lights_at, tuple(sorted({face for bore in holes for face in bore.faces})))
    return _Light(faces, tuple((bore, light_in_bore(scene, np.array(lights_at), bore, faces)) for bore in holes))
