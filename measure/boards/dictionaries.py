"""Dictionaries of square markers, ArUco's and AprilTag's, by OpenCV's names."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from scenes.errors import InvalidInput


def check_marker(marker: Any) -> None:
    """See that a marker's side over its square's is a number between.

    Raises
    ------
    InvalidInput
        If not.
    """
    number = isinstance(marker, int | float | np.number) and not isinstance(marker, bool)
    if not (number and 0 < marker < 1):
        raise InvalidInput(f"marker must be a number more than 0 and less than 1, got {marker!r}")


def read_dictionary(name: Any, needed: int) -> cv2.aruco.Dictionary:
    """A dictionary of OpenCV's, by its name, that has so many markers.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    known = sorted(each for each in dir(cv2.aruco) if each.startswith("DICT_"))
    if name not in known:
        raise InvalidInput(f"dictionary must be one of {', '.join(known)}, got {str(name)[:80]!r}")
    found = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    if len(found.bytesList) < needed:
        raise InvalidInput(
            f"dictionary must have the board's {needed} markers, got {name}, which has {len(found.bytesList)}"
        )
    return found
