"""Which fine pixels may show light that surfaces send to each other: others need no rays for it.

From a face on the convex hull of all bodies no other is seen. Before a floor that holds for faces that look up.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter

from imaging.geometry.lens import image_centre
from imaging.geometry.projection import camera_frame, sensor_position
from imaging.geometry.rays import first_face
from scenes import Picture

_MARGIN = 1e-7  # of the part's size: what passes a triangle's side more closely is decided in double precision
_UP = 1 - 1e-9  # cosine to the vertical


def lent_to(picture: Picture, marked: np.ndarray, start: tuple[int, int], supersample: int) -> np.ndarray:
    """Those of some fine pixels in whose middle, or in a neighbour's, a face is seen that others may send light to.

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
    """
    bodies, camera, sensor = picture.scene.bodies, picture.scene.camera, np.array(list(picture.sensor))
    asked = maximum_filter(marked, 3)
    pixels = np.argwhere(asked)
    down, right = ((pixels + start + 0.5) / supersample - 0.5 - image_centre(camera)[::-1]).T
    axes = camera_frame(camera, sensor)
    ways = camera.focal_px * axes.forward + right[:, None] * axes.right + down[:, None] * axes.down
    origins = np.broadcast_to(sensor_position(camera, sensor), ways.shape)
    face, _ = first_face(bodies, origins, ways, (), margin=_MARGIN)
    lent = np.append(~bodies.outer, False)  # the last is what no body is seen in: darkness
    if picture.scene.bright_floor is not None:
        lent[:-1] |= bodies.normals[:, 2] < _UP
        lent[-1] = True
    found = np.zeros(marked.shape, bool)
    found[tuple(pixels.T)] = lent[face]
    return maximum_filter(found, 3) & marked
