"""What is found in images: lines, corners, and what can be said of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MIN_SINE = 0.02  # of the angle between the lines of a corner: about a degree


@dataclass(frozen=True)
class Shape:
    """Lines and corners in n images.

    Attributes
    ----------
    corners : ndarray, shape (n, C, 2)
        (x, y), px; NaN where `status` is neither ``ok`` nor ``clutter``.
    covariance : ndarray, shape (n, 2 C, 2 C)
        Joint covariance of all corners' (x, y), px^2.
    normals, points : ndarray, shape (n, E, 2)
        Unit normal and one point of each line, px.
    tilt_covariance : ndarray, shape (n, E, E)
        Covariance of the lines' angles, rad^2.
    status : ndarray of str, shape (n,)
    edge_status : ndarray of str, shape (n, E)
    edge_contrast : ndarray, shape (n, E)
        Contrast at the middle of the edge, absolute, grey levels.
    used, rejected : ndarray of int, shape (n, E)
        Edge points, or pixels for the likelihood estimators.
    p_value : ndarray, shape (n,)
        Probability of a residual at least as unlikely in an image that is what the model says; NaN for estimators that
        have no model of the image.
    """

    corners: np.ndarray
    covariance: np.ndarray
    normals: np.ndarray
    points: np.ndarray
    tilt_covariance: np.ndarray
    status: np.ndarray
    edge_status: np.ndarray
    edge_contrast: np.ndarray
    used: np.ndarray
    rejected: np.ndarray
    p_value: np.ndarray


def gather(parts: list[Shape], source: np.ndarray, rows: np.ndarray) -> Shape:
    """One Shape of which image i is row ``rows[i]`` of part ``source[i]``."""
    columns = {}
    for name in vars(parts[0]):
        first = np.array(getattr(parts[0], name), dtype=object if name.endswith("status") else None)
        column = first[np.where(source == 0, rows, 0)]
        for k, part in enumerate(parts[1:], 1):
            column[source == k] = getattr(part, name)[rows[source == k]]
        columns[name] = column.astype(str) if name.endswith("status") else column
    return Shape(**columns)
