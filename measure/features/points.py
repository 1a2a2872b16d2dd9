"""Edge points of one edge in a stack of images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class EdgePoints(NamedTuple):
    """Edge points of n images in the caliper of one edge.

    Attributes
    ----------
    along, offset : ndarray, shape (n, m)
        Place along the expected edge and distance from it, px.
    valid : ndarray of bool, shape (n, m)
        Which of them were found.
    contrast : ndarray, shape (n,)
        Mean contrast of the edge as the locator saw it, grey levels.
    reversed : ndarray of bool, shape (n,)
        Whether the contrast of the edge's second half has the other sign than that of its first.
    """

    along: np.ndarray
    offset: np.ndarray
    valid: np.ndarray
    contrast: np.ndarray
    reversed: np.ndarray
