"""Square markers, ArUco's and AprilTag's: dictionaries by OpenCV's names, and the cells of each."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.errors import InvalidInput

if TYPE_CHECKING:
    import cv2


def read_dictionary(name: Any, needed: int) -> cv2.aruco.Dictionary:
    """A dictionary of OpenCV's, by its name, that has so many markers.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    import cv2  # slow to load, and rarely needed

    known = sorted(each for each in dir(cv2.aruco) if each.startswith("DICT_"))
    if name not in known:
        raise InvalidInput(f"dictionary must be one of {', '.join(known)}, got {str(name)[:80]!r}")
    found = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    if len(found.bytesList) < needed:
        raise InvalidInput(
            f"dictionary must have the board's {needed} markers, got {name}, which has {len(found.bytesList)}"
        )
    return found


@lru_cache(maxsize=16)
def bright_cells(name: str, count: int) -> np.ndarray:
    """Which cells of the first markers of a dictionary are bright, bool (count, cells, cells), row by row from the top;
    the outer ones, the border, are dark.

    >>> bright_cells("DICT_4X4_50", 2).shape
    (2, 6, 6)
    """
    import cv2  # as above

    dictionary = read_dictionary(name, count)
    cells = dictionary.markerSize + 2
    return np.array([cv2.aruco.generateImageMarker(dictionary, n, cells) > 0 for n in range(count)])
