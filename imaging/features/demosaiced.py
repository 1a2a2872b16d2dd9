"""What bilinear demosaicing does to an edge that lies nearly along the rows, columns or diagonals of a mosaic.

A colour's pixels are every other one of each row and column. Interpolated, they leave parts of the image's spectrum
moved by half a period of the pixels, as sampling by pixels does by a whole one (`imaging.features.sampling`, whose
derivation this is): a straight edge is moved by sines of its place in the mosaic, which average out along one that
crosses many rows.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from imaging.features.sampling import crossing_gain, frequencies, line_through
from scenes.cameras.colour import COLOURS, Colour

_ORDERS = np.array([[0.5, 0.0], [0.0, 0.5], [0.5, 0.5], [0.5, -0.5]])  # in periods of the pixels
_ANGLES = np.linspace(0, 2 * np.pi, 1441)  # of the edge's normal
_QUINCUNX = (False, False, True, True)  # in which orders the green pixels have a part


def line_shift(
    colour: Colour | None, middle: np.ndarray, tangent: np.ndarray, length: np.ndarray, blur_px: float, scale: float
) -> tuple[np.ndarray, np.ndarray]:
    """Mean shift along the normal (-t_y, t_x), px, and its slope, of the line through the crossings of a lone edge.

    Parameters
    ----------
    colour : Colour or None
        Nothing moves without demosaicing.
    middle : ndarray, shape (..., 2)
        Middle of the used part of the edge, px from the centre of a pixel.
    tangent : ndarray, shape (..., 2)
        Unit direction t.
    length : ndarray, shape (...)
        Of the used part, px.
    blur_px, scale : float
        Of the picture, demosaicing included, and of the locator, px.
    """
    if colour is None or not colour.interpolates:
        return np.zeros(np.shape(length)), np.zeros(np.shape(length))
    normal = np.stack([-tangent[..., 1], tangent[..., 0]], -1)
    sine, cosine = _waves(colour, middle, normal, blur_px, scale)
    return line_through(sine, cosine, tangent @ _ORDERS.T, length)


def place_shifts(
    colour: Colour | None, places: np.ndarray, normals: np.ndarray, blur_px: float, scale: float
) -> np.ndarray | float:
    """Shift (...) along unit normals (..., 2), px, of a lone edge's crossing at places (..., 2), px."""
    if colour is None or not colour.interpolates:
        return 0.0
    return _waves(colour, places, normals, blur_px, scale)[0].sum(-1)


def _waves(
    colour: Colour, places: np.ndarray, normals: np.ndarray, blur_px: float, scale: float
) -> tuple[np.ndarray, np.ndarray]:
    """Shifts by each of `_ORDERS` at places (..., 2), and what they are a quarter of a period on, px, (..., 4)."""
    angle = np.arctan2(normals[..., 1], normals[..., 0]) % (2 * np.pi)
    table, sine, cosine = _amplitudes(colour, float(blur_px), scale), 0.0, 0.0
    for letter, weight in colour.weights.items():
        row, column = divmod(colour.pattern.index(letter), 2)
        phase = 2 * np.pi * (places - [column, row]) @ _ORDERS.T
        each = weight * np.stack([np.interp(angle, _ANGLES, row) for row in table[COLOURS.index(letter)]], -1)
        sine, cosine = sine + each * np.sin(phase), cosine + each * np.cos(phase)
    return sine, cosine


@lru_cache(maxsize=16)
def _amplitudes(colour: Colour, blur_px: float, scale: float) -> np.ndarray:
    """Largest shift, px, of the crossing by each colour and order for the normals of `_ANGLES`, (3, 4, 1441).

    As of `imaging.features.sampling`, with the interpolation's own spectrum at the moved frequency.
    """
    w, spacing = frequencies(scale)
    lens = max(blur_px**2 - colour.blur_px**2, 0.0)
    normal = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], -1)
    box = np.sinc(w[:, None, None] * normal / (2 * np.pi)).prod(-1)
    step = np.exp(-lens * w[:, None] ** 2 / 2) * box / w[:, None]
    lone = crossing_gain(blur_px, scale)
    found = np.zeros((len(COLOURS), len(_ORDERS), len(_ANGLES)))
    for number, order in enumerate(_ORDERS):
        k = w[:, None, None] * normal + 2 * np.pi * order
        kernel = (k * normal).sum(-1) ** 2 * np.exp(-(scale**2) * (k**2).sum(-1) / 2)
        tent, cross = ((1 + np.cos(k)) / 2).prod(-1), (2 + np.cos(k).sum(-1)) / 4
        for letter, spectrum in (("R", tent), ("B", tent), *([("G", cross)] if _QUINCUNX[number] else ())):
            total = -(step * kernel * spectrum).sum(0) * spacing / (2 * np.pi)
            found[COLOURS.index(letter), number] = 2 * total * lone
    return found
