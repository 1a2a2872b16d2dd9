"""Edge points of one edge in a stack of images."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from scipy import sparse

DECIDED = 0.25  # of an edge's points must be certain (of a faint one alone half are): else noise decides between two


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
    trend : ndarray, shape (n,)
        Change of the contrast per px of length, grey levels a px.
    weights : ndarray, shape (m,) or (n, m)
        How much of the edge each point stands for.
    sure : ndarray of bool, shape (n,)
        Whether the points are those that any picture of this edge would show, whatever its noise.
    certain : ndarray, shape (n,)
        Part of the valid points, by how much they count, of which noise does not decide which of two edges they are on.
    """

    along: np.ndarray
    offset: np.ndarray
    valid: np.ndarray
    contrast: np.ndarray
    reversed: np.ndarray
    trend: np.ndarray | float = 0.0
    weights: np.ndarray | float = 1.0
    sure: np.ndarray | bool = True
    certain: np.ndarray | float = 1.0


class UnitNoise(NamedTuple):
    """How edge points at places ``along`` (m,), px, with ``weights`` (m,), answer to noise at unit contrast.

    ``response`` (m, pixels) is the derivative of their offsets by the pixels, px per grey level.
    """

    along: np.ndarray
    weights: np.ndarray
    response: sparse.csr_array


class EachPoint(NamedTuple):
    """Edge points of n images at m places, each with its own contrast.

    ``offset`` (n, m), px, 0 where not ``valid``; ``contrast`` (n, m), without its sign, grey levels.
    """

    offset: np.ndarray
    valid: np.ndarray
    contrast: np.ndarray
