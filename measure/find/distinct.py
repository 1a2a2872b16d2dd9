"""Of several candidates for one outline the best remains."""

from __future__ import annotations

import cv2
import numpy as np

from measure.find.candidate import CHESSBOARD, TAG, Candidate

_OVERLAP = 0.6  # intersection over union of two that may be the same
_APART = 3.0  # px between outlines that are two everywhere: those of a frame


def distinct(candidates: list[Candidate], pixel: float) -> list[Candidate]:
    """The best first, each outline once.

    Parameters
    ----------
    candidates : list of Candidate
    pixel : float
        Side of the pixels in which they were found, px: outlines nearer than 3 of them are one.
    """
    kept: list[Candidate] = []
    for one in sorted(candidates, key=lambda each: -each.score):
        if not any(same(one, other, pixel) for other in kept):
            kept.append(one)
    return kept


def same(one: Candidate, other: Candidate, pixel: float) -> bool:
    """Whether two convex outlines overlap, but for the inner and the outer outline of a frame."""
    a, b = one.outline.astype(np.float32), other.outline.astype(np.float32)
    if (a.max(0) < b.min(0)).any() or (b.max(0) < a.min(0)).any():
        return False
    small, large = sorted((cv2.contourArea(a), cv2.contourArea(b)))
    if small < _OVERLAP * large:
        return False
    common, _ = cv2.intersectConvexConvex(a, b)
    if common < _OVERLAP * (small + large - common):
        return False
    inner, outer = (a, b) if cv2.contourArea(a) < cv2.contourArea(b) else (b, a)
    depth = min(cv2.pointPolygonTest(outer, tuple(map(float, place)), True) for place in _along(inner))
    return depth < _APART * pixel


def _along(outline: np.ndarray) -> np.ndarray:
    """Corners of an outline and the middles of its sides."""
    return np.concatenate([outline, (outline + np.roll(outline, -1, 0)) / 2])


def outside(candidates: list[Candidate], wholes: list[Candidate]) -> list[Candidate]:
    """Without what is part of a tag's or a chessboard's own pattern."""
    return [one for one in candidates if not any(_part(one, whole) for whole in wholes)]


def _part(one: Candidate, whole: Candidate) -> bool:
    if whole is one or whole.kind not in (TAG, CHESSBOARD):
        return False
    margin = max(whole.sizes) / (max(whole.grid.shape[:2]) - 1) if whole.grid is not None else 2.0
    return all(whole.distance(place) < 1.1 * margin for place in one.outline) and one.area < 1.5 * whole.area
