"""Derivatives, along one direction, of the Gaussian-blurred image of a straight piece of a boundary: in closed form.

Faces of nearly constant level meet along straight segments. With brightness L on a face and 0 elsewhere, the derivative
of the image along n is a line mass (n . m) L on the face's boundary, m its normal, and (n . grad L) inside; deriving
once more turns that, too, into a line mass. So every higher derivative of the blurred image is a sum over segments of
integrals of a Gaussian along a line: products of a normal density across the segment and of normal distributions and
densities along it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr


class Segments(NamedTuple):
    """Straight boundaries seen from places of their own; all arrays of the same shape (...).

    Attributes
    ----------
    start, stop : ndarray
        Where the segment begins and ends along its direction, from the foot of the place, px.
    apart : ndarray
        Signed distance of the segment's line from the place, along the segment's normal m, px.
    across, along : ndarray
        Cosines between the direction n, in which derivatives are taken, and the segment's normal and direction.
    level, slope : ndarray
        Brightness on m's side less that on the other, at the foot of the place on the segment's line, grey levels, and
        its change per px along the segment.
    kink : ndarray
        Derivative along n, grey levels a px, of the brightness on m's side less that on the other.
    """

    start: np.ndarray
    stop: np.ndarray
    apart: np.ndarray
    across: np.ndarray
    along: np.ndarray
    level: np.ndarray
    slope: np.ndarray
    kink: np.ndarray


def second_and_third(segments: Segments, moved: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Second and third derivative along n of the blurred image, the places moved along n, grey levels px^-2 and px^-3.

    Parameters
    ----------
    segments : Segments
    moved : ndarray, shape (...)
        px.
    width : ndarray, shape (...)
        Standard deviation of the whole blur, px.

    Notes
    -----
    With v = moved (n . t) and q = moved (n . m) - apart the line mass blurred is M(v) phi(q), where M is the integral
    over u of (level + slope u) phi(u - v).

    Examples
    --------
    An endless step: the zero crossing's slope is -1 / (sqrt(2 pi) width^3).

    >>> step = Segments(*np.array([-99.0, 99.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]))
    >>> round(float(second_and_third(step, 0.0, 1.0)[1]), 4)
    -0.3989
    """
    start, stop, apart, across, along, level, slope, kink = segments
    var, v, q = width**2, moved * along, moved * across - apart
    here = _density(q, width)
    near, far = (_density(u - v, width) for u in (start, stop))
    part = ndtr((stop - v) / width) - ndtr((start - v) / width)
    part_v = near - far
    at_near, at_far = (level + slope * u for u in (start, stop))
    mass = (level + slope * v) * part + slope * var * part_v
    mass_v = slope * part + at_near * near - at_far * far
    mass_vv = slope * part_v + (at_near * (start - v) * near - at_far * (stop - v) * far) / var
    falls = -q * across / var
    second = falls * mass + along * mass_v + kink * part
    third = (falls**2 - across**2 / var) * mass + 2 * falls * along * mass_v + along**2 * mass_vv
    third = third + kink * (falls * part + along * part_v)
    return across * here * second, across * here * third


def _density(x: np.ndarray, width: np.ndarray) -> np.ndarray:
    return np.exp(-((x / width) ** 2) / 2) / (np.sqrt(2 * np.pi) * width)
