"""Which fine pixels may show light that surfaces send to each other: others need no rays for it.

From a face on the convex hull of all bodies no other is seen. Before a floor that holds for faces that look up.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter

from imaging.geometry.looked_at import looked_at
from scenes import Picture

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
    bodies, asked = picture.scene.bodies, maximum_filter(marked, 3)
    pixels = np.argwhere(asked)
    face, _ = looked_at(picture, ((pixels + start + 0.5) / supersample - 0.5)[:, ::-1])
    lent = np.append(~bodies.outer, False)  # the last is what no body is seen in: darkness
    if picture.scene.bright_floor is not None:
        lent[:-1] |= bodies.normals[:, 2] < _UP
        lent[-1] = True
    found = np.zeros(marked.shape, bool)
    found[tuple(pixels.T)] = lent[face]
    return maximum_filter(found, 3) & marked
