"""Pieces of faces, and the light that each sends on of what other faces sent it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from trimesh.remesh import subdivide_to_size

from imaging.light.emitters import emitters, plain
from imaging.light.exchange import exchanged
from imaging.pictures import Pictures
from scenes import Picture
from scenes.lights import GLANCE
from scenes.parts.shading import normals_at


@dataclass(frozen=True, eq=False)
class Senders:
    """All faces of the bodies, and the floor about them as one more, in pieces.

    Attributes
    ----------
    triangles : ndarray, shape (n, 3, 3)
        Scene units, counter-clockwise from outside.
    normals : ndarray, shape (n, 3, 3)
        Of the surfaces in their corners.
    faces : ndarray of int, shape (n,)
        The face of each.
    sent : ndarray, shape (n,)
        Grey levels: what of its light has met another face before it.
    """

    triangles: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    sent: np.ndarray


@lru_cache(maxsize=8)
def senders(picture: Picture) -> Senders | None:
    """Of diffuse faces under the picture's lights; None where no two of them see each other."""
    scene = picture.scene
    shining = tuple(plain(each) for each in emitters(scene, Pictures.of(picture).lights, GLANCE))
    light = exchanged(scene, shining, ())
    if light is None:
        return None
    solid = light.exchange.solid
    corners = np.arange(3 * len(solid.triangles)).reshape(-1, 3)
    vertices, corners, index = subdivide_to_size(
        solid.triangles.reshape(-1, 3), corners, light.exchange.cell, max_iter=20, return_index=True
    )
    triangles, faces = vertices[corners], solid.triangle_faces[index]
    normals = np.broadcast_to(normals_at(solid, faces[:, None], triangles), triangles.shape)
    return Senders(triangles, normals, faces, scene.camera.exposure * light.sent_at(triangles.mean(1), faces))
