"""Corners where two lines cross, and the derivative of a corner by its lines."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from measure.features.calipers import Caliper


def line_equations(
    calipers: tuple[Caliper, ...], level: np.ndarray, slope: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals and a point of each line, in image coordinates, both (n, E, 2)."""
    normals, directions, origins = (
        np.stack([getattr(f, name) for f in calipers]) for name in ("normal", "direction", "origin")
    )
    tilted = normals - slope[..., None] * directions
    return tilted / np.hypot(slope, 1.0)[..., None], origins + level[..., None] * normals


def intersect(normals: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Crossing of two lines.

    Parameters
    ----------
    normals, points : ndarray, shape (n, 2, 2)
        For each pair of lines its two unit normals and one point on each.

    Returns
    -------
    corner : ndarray, shape (n, 2)
        Solved relative to the first point, so a corner far from the image's origin loses no digits; NaN for parallels.
    sine : ndarray, shape (n,)
        Sine of the angle between the lines, 0 to 1.
    """
    (a1, b1), (a2, b2) = np.moveaxis(normals[:, 0], -1, 0), np.moveaxis(normals[:, 1], -1, 0)
    sine = a1 * b2 - a2 * b1
    reach = np.einsum("ni,ni->n", normals[:, 1], points[:, 1] - points[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(sine == 0, np.nan, reach / sine)
    return points[:, 0] + step[:, None] * np.stack([-b1, a1], -1), np.abs(sine)


def corners_through(sides: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Corners (k, 2) of a polygon of lines through points (m, 2) of each side, by Huber's weights, and their sines.

    Corner i is where the sides i - 1 and i meet; as of `intersect`.
    """
    lines = [cv2.fitLine(points.astype(np.float32), cv2.DIST_HUBER, 0, 0.01, 0.01).ravel() for points in sides]
    along, through = np.split(np.array(lines, float), 2, axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], 1)
    pairs = (np.stack([np.roll(each, 1, 0), each], 1) for each in (across, through))
    return intersect(*pairs)


def corner_response(calipers: tuple[Caliper, ...], pair: tuple[int, int]) -> np.ndarray:
    """Derivative of the expected corner of two edges by (level, slope) of all E edges, shape (2, 2 E).

    Infinite if the two expected edges are parallel.
    """
    first, second = calipers[pair[0]], calipers[pair[1]]
    whole = np.zeros((2, 2 * len(calipers)))
    (corner,), (sine,) = intersect(np.stack([[first.normal, second.normal]]), np.stack([[first.origin, second.origin]]))
    if sine < 1e-9:
        return np.full(whole.shape, np.inf)
    inverse = np.linalg.inv(np.stack([first.normal, second.normal]))
    for row, e in enumerate(pair):
        whole[:, 2 * e] = inverse[:, row]
        whole[:, 2 * e + 1] = inverse[:, row] * calipers[e].coordinates(corner)[0]
    return whole
