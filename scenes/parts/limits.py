"""Limits of sizes that a drawing does not write as numbers: fits (ISO 286-1) and general tolerances (ISO 2768-1).

Tables of the standards up to 500 mm and 4000 mm; sizes in mm, deviations in micrometres and mm.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from typing import Literal, get_args

General = Literal["f", "m", "c", "v"]
CLASSES: tuple[General, ...] = get_args(General)

_RANGES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)  # mm: up to and including
_GRADES = {  # micrometres, by the ranges
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
}
_AWAY = {  # micrometres from the nominal size to the nearer limit: below it of a shaft, above it of a hole
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
_INTO = {  # micrometres from the nominal size to the nearer limit, above it: of a shaft, grades 5 to 7 of k
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
_K_GRADES = (5, 6, 7)
_LENGTHS = (3, 6, 30, 120, 400, 1000, 2000, 4000)  # mm: up to and including, from 0.5 on
_LEAST = 0.5
_GENERAL: dict[str, tuple[float | None, ...]] = {  # mm on both sides
    "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None),
    "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0),
    "c": (0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0),
    "v": (None, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 8.0),
}


def of_fit(size: float, fit: str) -> tuple[float, float] | None:
    """How far above and below its nominal value a size may be, both positive where it may lie on either side.

    Parameters
    ----------
    size : float
        Nominal size [mm].
    fit : str
        ``H7``, ``g6``, ``js6``: capitals of holes.

    Returns
    -------
    plus, minus : float, or None
        [mm]; None where the table has no such fit or size.

    Examples
    --------
    >>> of_fit(20, "H7"), of_fit(20, "g6"), of_fit(20, "k6"), of_fit(20, "F8"), of_fit(20, "js7"), of_fit(20, "ZA7")
    ((0.021, 0.0), (-0.007, 0.02), (0.015, -0.002), (0.053, -0.02), (0.0105, 0.0105), None)
    """
    told = re.fullmatch(r"([A-Za-z]{1,2})(\d{1,2})", fit.replace(" ", ""))
    place = bisect_left(_RANGES, size)
    if told is None or not size > 0 or place == len(_RANGES) or int(told[2]) not in _GRADES:
        return None
    letter, grade, is_hole = told[1].lower(), int(told[2]), told[1][0].isupper()
    width = _GRADES[grade][place]
    if letter == "js":
        return width / 2000, width / 2000
    if letter in _AWAY:
        near = _AWAY[letter][place]
        return ((near + width) / 1000, -near / 1000) if is_hole else (-near / 1000, (near + width) / 1000)
    if letter in _INTO and not is_hole and (letter != "k" or grade in _K_GRADES):
        near = _INTO[letter][place]
        return (near + width) / 1000, -near / 1000
    return None


def general(size: float, of_class: General) -> float | None:
    """By how much a length without a tolerance of its own may be larger or smaller (ISO 2768-1, table 1) [mm].

    None where the table says nothing: below 0.5 mm, above 4000 mm, and at the ends of fine and very coarse.

    Examples
    --------
    >>> general(50, "m"), general(2000, "f"), general(3000, "f"), general(0.3, "m")
    (0.3, 0.5, None, None)
    """
    place = bisect_left(_LENGTHS, size)
    return None if size < _LEAST or place == len(_LENGTHS) else _GENERAL[of_class][place]
