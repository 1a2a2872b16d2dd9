"""Light that other things send to a limb and no formula knows: from a floor, obstacles, other faces of the part."""

from __future__ import annotations

import numpy as np

from imaging.features.limb_outline import LimbOutline
from imaging.light.between import reflected_share
from imaging.light.revolved import rings_of
from imaging.pictures import Pictures
from scenes import Curved, Scene

_MOST = 5e-3  # of the light that arrives: a fifth of it moves a ball's limb by some 5 sigma of its diameter


def unlent(pictures: Pictures, outline: LimbOutline) -> np.ndarray:
    """Which places have next to no light from a floor or obstacles, bool, shape (..., n).

    By bounds of form factors: (1 - n_z) / 2 for a floor below, sin^2 of its height over the tangent plane for a body.
    """
    scene, normals = pictures.scene, np.nan_to_num(outline.normals)
    lent = np.zeros(normals.shape[:-1])
    if scene.floor is not None:
        lent = lent + scene.floor.reflectance * (1 - normals[..., 2]) / 2
    for obstacle in scene.obstacles:
        highest = np.zeros(normals.shape[:-1])
        for vertex in obstacle.solid.vertices:
            away = vertex - np.nan_to_num(outline.points)
            sine = (away * normals).sum(-1) / np.linalg.norm(away, axis=-1)
            highest = np.maximum(highest, sine)
        lent = lent + _white(scene) * highest**2
    return lent <= _MOST


def unlent_by_faces(pictures: Pictures, curved: Curved, outline: LimbOutline) -> np.ndarray:
    """Which places have next to no light from the part's other faces, bool, shape (..., n).

    Of a part that is turned as a whole that light is known (`imaging.light.revolved`); it is looked for in pictures
    that are looked at closely.
    """
    scene, found = pictures.scene, np.ones(outline.arc.shape, bool)
    if not pictures.closely or scene.bodies.is_convex or rings_of(scene.solid) is not None:
        return found
    there = outline.seen
    share = reflected_share(pictures, outline.points[there], outline.normals[there], curved.faces)
    found[there] = share <= _MOST
    return found


def _white(scene: Scene) -> float:
    """Of obstacles."""
    return scene.material.diffuse(scene.camera.analyser_deg is not None)
