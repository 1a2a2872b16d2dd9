"""Which fine pixels may show light that surfaces send to each other: others need no rays for it.

From a face on the convex hull of all bodies no other is seen. Before a floor that holds for faces that look up. A face
that is seen nearly edge-on may lie between the middles of pixels: pixels that its edges cross may show it, too.
"""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np

from imaging.geometry.looked_at import looked_at
from imaging.geometry.projection import facing, project_ideal, viewpoint
from render.adaptive import dilated, places
from scenes import Picture

_UP = 1 - 1e-9  # cosine to the vertical
_FARTHEST = 1 << 20  # fine pixels from the frame


def lent_to(picture: Picture, marked: np.ndarray, start: tuple[int, int], supersample: int) -> np.ndarray:
    """Those of some fine pixels in which, or in a neighbour of which, a face is seen that others may send light to.

    Parameters
    ----------
    picture : Picture
        Of a part of plane faces.
    marked : ndarray of bool
        Which fine pixels are asked for, not bent by the lens.
    start : tuple of int
        Row and column of the first one in the whole frame.
    supersample : int

    Returns
    -------
    ndarray of bool, as ``marked``
        Not to be changed: renders of other rays from the same place ask for the same.
    """
    bits = np.packbits(marked).tobytes()
    return _lent_to(picture.unlit(), bits, marked.shape, start, supersample)


@lru_cache(maxsize=2)
def _lent_to(
    picture: Picture, bits: bytes, shape: tuple[int, int], start: tuple[int, int], supersample: int
) -> np.ndarray:
    """The same of a mask as bits, so that it can be told whether it is asked for again."""
    marked = np.unpackbits(np.frombuffer(bits, np.uint8), count=math.prod(shape)).reshape(shape).astype(bool)
    bodies, asked = picture.scene.bodies, dilated(marked, 3)
    pixels = places(asked).T
    face, _ = looked_at(picture, ((pixels + start + 0.5) / supersample - 0.5)[:, ::-1])
    lent = np.append(~bodies.outer, False)  # the last is what no body is seen in: darkness
    if picture.scene.bright_floor is not None:
        lent[:-1] |= bodies.normals[:, 2] < _UP
        lent[-1] = True
    found = np.zeros(marked.shape, bool)
    found[asked] = lent[face]
    found |= edges_of(picture, lent[:-1], marked.shape, start, supersample)
    lent = dilated(found, 3) & marked
    lent.flags.writeable = False
    return lent


def edges_of(
    picture: Picture,
    faces: np.ndarray,
    shape: tuple[int, int],
    start: tuple[int, int],
    supersample: int,
    *,
    creases: bool = False,
) -> np.ndarray:
    """Which fine pixels the edges of some faces (F,) that look at the sensor may cross, hidden or not, a mask.

    With ``creases`` edges between facets of curved surfaces, over which brightness runs on, are left out.
    """
    bodies, camera, sensor = picture.scene.bodies, picture.scene.camera, np.array(list(picture.sensor))
    seen = faces & facing(bodies, viewpoint(camera, sensor))
    left = ~bodies.plane if creases else np.zeros(len(bodies.faces), bool)
    edges = [e.ends for e in bodies.edges if seen[list(e.faces)].any() and not left[list(e.faces)].all()]
    found = np.zeros(shape, np.uint8)
    if not edges:
        return found.astype(bool)
    corners = (project_ideal(bodies.vertices, sensor, camera) + 0.5) * supersample - 0.5 - np.array(start)[::-1]
    if np.isnan(corners).any():  # what stands behind the sensor
        return np.ones(shape, bool)
    lines = np.rint(np.clip(corners, -_FARTHEST, _FARTHEST)).astype(np.int32)[np.array(edges)]
    cv2.polylines(found, list(lines[:, :, None]), isClosed=False, color=1)
    return found.astype(bool)
