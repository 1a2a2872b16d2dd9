"""Corners where two lines cross, the distance between them, and the derivatives of both."""

from __future__ import annotations

import numpy as np

from measure.frames import EdgeFrame
from measure.lines import Lines


def line_equation(frame: EdgeFrame, lines: Lines) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (n, 2) and a point (n, 2) of lines, in image coordinates."""
    sine, cosine = np.sin(lines.tilt)[:, None], np.cos(lines.tilt)[:, None]
    return cosine * frame.normal - sine * frame.direction, frame.at(lines.mean_along, lines.mean_offset)


def intersect(normals: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Crossing of two lines.

    Parameters
    ----------
    normals, points : ndarray, shape (n, 2, 2)
        For each pair of lines its two unit normals and one point on each.

    Returns
    -------
    corner : ndarray, shape (n, 2)
        Relative to the first point the system is solved, so a corner far from the image's origin loses no digits.
    sine : ndarray, shape (n,)
        Sine of the angle between the lines; 0 for parallel ones, whose corner is NaN.
    """
    (a1, b1), (a2, b2) = np.moveaxis(normals[:, 0], -1, 0), np.moveaxis(normals[:, 1], -1, 0)
    sine = a1 * b2 - a2 * b1
    reach = np.einsum("ni,ni->n", normals[:, 1], points[:, 1] - points[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(sine == 0, np.nan, reach / sine)
    return points[:, 0] + step[:, None] * np.stack([-b1, a1], -1), np.abs(sine)


def corner_response(frames: tuple[EdgeFrame, EdgeFrame], alongs: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Derivative of the corner by (mean offset, slope) of its first line, then of its second, shape (2, 4).

    Parameters
    ----------
    alongs : ndarray, shape (2,)
        Mean place of the points along each edge.
    corner : ndarray, shape (2,)
    """
    inverse = np.linalg.inv(np.stack([frame.normal for frame in frames]))
    levers = [frame.coordinates(corner)[0] - along for frame, along in zip(frames, alongs, strict=True)]
    return np.stack([inverse[:, 0], inverse[:, 0] * levers[0], inverse[:, 1], inverse[:, 1] * levers[1]], -1)
