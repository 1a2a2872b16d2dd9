"""Which parts of an edge a point in space can see: what the sensor sees, and what the light reaches.

A triangle between a viewpoint (e, s) and an edge AB hides an interval of it. In the plane through both a point is
A + b (B - A) + c (e - s A); the line of sight through it meets AB at the fraction b / (1 - s c), and it lies before the
edge where 0 < c and 0 < 1 - s c. So the interval is exact, and no ray has to be cast.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from imaging.geometry.projection import above
from scenes import Edge, Solid
from scenes.viewpoint import Viewpoint

_PAIRS = 20_000  # positions times triangles at once: what hides from one of many is looked for from each of them
_BEFORE = 1e-9  # a triangle that touches the edge does not hide it; nothing is seen through a gap of this size


def hidden_spans(solid: Solid, edge: Edge, positions: Viewpoint | np.ndarray) -> np.ndarray:
    """Fractions (from, to) of an edge that are hidden from positions.

    Parameters
    ----------
    solid : Solid
    edge : Edge
    positions : Viewpoint or ndarray, shape (..., 3)
        From where the sensor looks, or where a light stands, outside the solid.

    Returns
    -------
    ndarray, shape (..., K, 2)
        Fractions of the edge's length in space, rising and apart from each other; (1, 0) where a position has less than
        K hidden pieces. K is 0 for a convex solid.
    """
    view = Viewpoint.of(positions)
    if solid.is_convex:
        return np.empty((*view.shape, 0, 2))
    different, which = np.unique(view.at.reshape(-1, 3), axis=0, return_inverse=True)
    spans = _hidden(solid, edge, different.tobytes(), view.share)
    return spans[which].reshape(*view.shape, *spans.shape[1:])


@lru_cache(maxsize=128)  # asked for several times of each set of pictures
def _hidden(solid: Solid, edge: Edge, positions: bytes, share: float) -> np.ndarray:
    """The same for different viewpoints, shape (n, K, 2)."""
    rows = np.frombuffer(positions).reshape(-1, 3)
    size = max(1, _PAIRS // len(solid.triangles))
    parts = [
        _united(_by_triangle(solid, edge, Viewpoint(rows[at : at + size], share))) for at in range(0, len(rows), size)
    ]
    spans = np.empty((len(rows), max((part.shape[-2] for part in parts), default=0), 2))
    spans[:] = 1.0, 0.0
    for part, at in zip(parts, range(0, len(rows), size), strict=True):
        spans[at : at + size, : part.shape[-2]] = part
    return spans


def _by_triangle(solid: Solid, edge: Edge, view: Viewpoint) -> np.ndarray:
    """The interval that each of those triangles hides which may hide any; from > to for none; shape (n, T, 2).

    What is hidden from outside is hidden by a triangle that turns to the position: there the ray enters the solid.
    """
    towards = above(view, solid.normals, solid.offsets).any(0)
    towards[list(edge.faces)] = False
    first, last = (solid.vertices[end] for end in edge.ends)
    along, away = last - first, view.towards(first)
    normal = np.cross(along, away)
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = normal / np.einsum("...i,...i->...", normal, normal)[..., None]  # NaN where the edge is seen end-on
    points, corners = solid.triangle_corners
    points = points - first
    sides = _coordinates(points, normal)
    over = sides >= 0
    one, two, three = (over[..., each] for each in corners.T)
    some = (one != two) | (two != three)  # the others do not reach the plane of position and edge
    some = some.any(0) & towards[solid.triangle_faces]
    chosen = corners[some]
    b, c = (_coordinates(points[chosen], axis) for axis in (np.cross(away, normal), np.cross(normal, along)))
    return _merge(*_crossings(b, c, sides[..., chosen]), view.share)


def _coordinates(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Coordinates of points (..., 3) along axes (n, 3), shape (n, ...)."""
    return (axes @ points.reshape(-1, 3).T).reshape(len(axes), *points.shape[:-1])


def _united(spans: np.ndarray) -> np.ndarray:
    """Intervals (..., T, 2) as the fewest that cover the same, (..., K, 2)."""
    shape, rows = spans.shape[:-2], spans.reshape(math.prod(spans.shape[:-2]), *spans.shape[-2:])
    filled = rows[..., 0] < rows[..., 1]
    rows, filled = rows[:, filled.any(0)], filled[:, filled.any(0)]
    order = np.argsort(np.where(filled, rows[..., 0], np.inf), -1)
    starts, stops, filled = (np.take_along_axis(v, order, -1) for v in (rows[..., 0], rows[..., 1], filled))
    covered = np.maximum.accumulate(np.where(filled, stops, -np.inf), -1)
    begins = filled.copy()
    begins[:, 1:] &= starts[:, 1:] > covered[:, :-1] + _BEFORE
    piece = np.cumsum(begins, -1) - 1
    found = np.empty((len(rows), int(piece.max(initial=-1)) + 1, 2))
    found[:] = 1.0, 0.0
    row = np.broadcast_to(np.arange(len(rows))[:, None], filled.shape)
    found[row[begins], piece[begins], 0] = starts[begins]
    np.maximum.at(found[..., 1], (row[filled], piece[filled]), stops[filled])
    return found.reshape(*shape, *found.shape[1:])


def _crossings(b: np.ndarray, c: np.ndarray, above: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the three sides of each triangle cross the plane: b, c and whether they do, each (..., T, 3)."""
    onward = [np.roll(values, -1, -1) for values in (b, c, above)]
    crosses = (above >= 0) != (onward[2] >= 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        f = np.where(crosses, above / (above - onward[2]), 0.0)
    return b + f * (onward[0] - b), c + f * (onward[1] - c), crosses


def _merge(b: np.ndarray, c: np.ndarray, crosses: np.ndarray, share: float) -> np.ndarray:
    """The hidden interval from the two points in which a triangle's boundary crosses the plane."""
    first = np.argmax(crosses, -1)[..., None]
    last = 2 - np.argmax(crosses[..., ::-1], -1)[..., None]
    b1, b2, near, far = (np.take_along_axis(v, i, -1)[..., 0] for v in (b, c) for i in (first, last))
    low, high = _BEFORE, (1 - _BEFORE) / share if share > 0 else np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = far - near
        enter, leave = (low - near) / slope, (high - near) / slope
        flat = np.abs(slope) < 1e-12
        f1 = np.where(flat, 0.0, np.clip(np.minimum(enter, leave), 0, 1))
        f2 = np.where(flat, 1.0, np.clip(np.maximum(enter, leave), 0, 1))
        middle = near + (f1 + f2) / 2 * slope
        hit = crosses.any(-1) & (f2 > f1) & (middle > low) & (middle < high)
        t1, t2 = ((b1 + f * (b2 - b1)) / (1 - share * (near + f * slope)) for f in (f1, f2))
    start, stop = np.fmin(t1, t2), np.fmax(t1, t2)
    hit &= (stop > 0) & (start < 1) & (stop > start)
    return np.stack([np.where(hit, start, 1.0), np.where(hit, stop, 0.0)], -1)


def turned(solid: Solid, edge: Edge, positions: Viewpoint | np.ndarray) -> np.ndarray:
    """Which of an edge's two faces the position looks at, just beside the edge; bool, shape (..., 2).

    At an inner edge each face hides the other unless both are turned towards the position.
    """
    faces = list(edge.faces)
    towards = above(positions, solid.normals[faces], solid.offsets[faces])
    return towards if edge.convex else towards & towards.all(-1, keepdims=True)


def boundaries(solid: Solid, edges: Sequence[Edge], faces: np.ndarray) -> np.ndarray:
    """Which of E edges a picture shows as lines, bool, shape (..., E).

    A face of the edge is seen; of a slight bend inside of a curved surface (`Solid.slight`) one, and not the other.

    Parameters
    ----------
    edges : sequence of Edge
        Of the solid.
    faces : ndarray of bool, shape (..., F)
        The solid's faces that are seen.
    """
    sides = faces[..., np.array([edge.faces for edge in edges], int).reshape(-1, 2)]
    slight = np.array([edge.name in solid.slight for edge in edges], bool)
    return np.where(slight, sides.sum(-1) == 1, sides.any(-1))


def seen(solid: Solid, edge: Edge, positions: Viewpoint | np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Which points of an edge nothing hides from a position, whatever way the edge's own faces turn.

    Parameters
    ----------
    positions : Viewpoint or ndarray, shape (..., 3)
    fractions : ndarray, shape (n,) or (..., n)
        Of the edge's length in space.

    Returns
    -------
    ndarray of bool, shape (..., n)
    """
    positions = Viewpoint.of(positions)
    shape = np.broadcast_shapes((*positions.shape, 1), fractions.shape)
    clear = np.ones(shape, bool)
    for start, stop in np.moveaxis(hidden_spans(solid, edge, positions), (-2, -1), (0, 1)):
        clear &= (fractions <= start[..., None]) | (fractions >= stop[..., None])
    return clear


def visible_spans(solid: Solid, edge: Edge, position: Viewpoint | np.ndarray) -> list[tuple[float, float]]:
    """The parts of an edge that one position sees, as fractions (from, to) of its length in space.

    Examples
    --------
    >>> from scenes import block
    >>> visible_spans(block((1, 1, 1)), block((1, 1, 1)).edge("e4"), np.array([2.0, 2.0, 9.0]))
    [(0.0, 1.0)]
    """
    if not turned(solid, edge, position).any():
        return []
    spans = hidden_spans(solid, edge, position)
    free, at = [], 0.0
    for start, stop in spans[spans[:, 0] < spans[:, 1]].tolist():
        if start > at:
            free.append((at, start))
        at = stop
    return free + [(at, 1.0)] if at < 1 else free


def longest_span(
    solid: Solid, edge: Edge, positions: Viewpoint | np.ndarray, *more: Viewpoint | np.ndarray
) -> np.ndarray:
    """The longest part of an edge that nothing hides, (from, to) as fractions of its length in space, shape (..., 2).

    ``more`` are further positions (broadcast) from which the part has to be free too: sensor, then light.
    (0, 0) where nothing is left; the way the edge's own faces turn does not matter.
    """
    views = [Viewpoint.of(each) for each in (positions, *more)]
    shape = np.broadcast_shapes(*(view.shape for view in views))
    whole = np.broadcast_to(np.array([0.0, 1.0]), (*shape, 2))
    if solid.is_convex:
        return whole
    spans = [hidden_spans(solid, edge, view) for view in views]
    spans = np.concatenate([np.broadcast_to(s, (*shape, *s.shape[-2:])) for s in spans], -2)
    order = np.argsort(spans[..., 0], -1)[..., None]
    spans = np.take_along_axis(spans, order, -2)
    covered = np.maximum.accumulate(np.clip(spans[..., 1], 0, 1), -1) if spans.shape[-2] else spans[..., 1]
    starts = np.concatenate([np.zeros((*shape, 1)), covered], -1)
    stops = np.concatenate([np.clip(spans[..., 0], 0, 1), np.ones((*shape, 1))], -1)
    best = np.argmax(stops - starts, -1)[..., None]
    found = np.concatenate([np.take_along_axis(v, best, -1) for v in (starts, stops)], -1)
    return np.where(found[..., :1] < found[..., 1:], found, 0.0)
