"""Circular arcs among the boundaries of plane faces: ends of slots, rounded corners, half bores.

An arc is a chain of pieces of curved edges along one boundary of a plane face whose vertices lie on a circle, as long
as can be, and on no whole one. How far its vertices may be off counts beside the height over its chord (sagitta), not
beside the radius: that height is what tells the radius.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from scenes.parts.chains import SINGLE
from scenes.parts.rims import circle_through, stepped
from scenes.parts.solid import Circle, Edge, Solid

MIN_PIECES = 4
LEAST_TURN = np.radians(30.0)  # a shorter one says little about its centre
_ROUND = 1e-3  # of the height over the chord, or of a smaller radius: how far vertices may be off
_ROUNDED = 1e-2  # the same, where single precision leaves no more
_NEARLY = 0.03  # the same of four vertices that may begin one, the last beside the circle through three
_WHOLE = np.radians(359.0)
_DIGITS = 5  # of the part's size, by which arcs are put in order


def arcs(solid: Solid) -> tuple[Circle, ...]:
    """The arcs of a solid with its whole circles, in the order of their middles (x, y, z), numbered after these.

    Examples
    --------
    >>> import trimesh
    >>> from scenes.parts.mesh import solid
    >>> t = np.linspace(0, np.pi, 25)
    >>> half = [[2 * np.cos(t), 2 * np.sin(t), z + 0 * t] for z in (0.0, 5.0)]
    >>> found = arcs(solid(trimesh.PointCloud(np.concatenate(half, 1).T).convex_hull))
    >>> [arc.name for arc in found], [round(float(np.degrees(arc.turn))) for arc in found], found[0].hole
    (['c1', 'c2'], [180, 180], False)
    """
    whole = {name for circle in solid.circles for name in circle.edges}
    curved = (edge for edge in solid.edges if edge.kind == "rim" and edge.name not in whole)
    owner = {frozenset(edge.ends): edge for edge in curved if not set(edge.faces) & set(solid.caps)}
    found: list[tuple[tuple[float, ...], Circle]] = []
    for face in np.flatnonzero(solid.plane).tolist() if owner else ():
        loops = (solid.faces[face], *(solid.holes[face] if solid.holes else ()))
        for chain in (chain for loop in loops for chain in _chains(solid, face, loop, owner)):
            arc = _arc(solid, face, [owner[frozenset(pair)] for pair in pairwise(chain)], chain)
            if LEAST_TURN <= arc.turn < _WHOLE:
                middle = solid.vertices[list(chain)].mean(0) / solid.extent
                found.append(((*np.round(middle, _DIGITS).tolist(), face), arc))
    first = len(solid.circles) + 1
    ordered = (arc for _, arc in sorted(found, key=lambda each: each[0]))
    return tuple(replace(arc, name=f"c{i}") for i, arc in enumerate(ordered, first))


def _chains(solid: Solid, face: int, loop: tuple[int, ...], owner: dict[frozenset, Edge]) -> Iterator[tuple[int, ...]]:
    """Vertices of each arc of a boundary."""
    if len(loop) < MIN_PIECES:
        return
    curved = np.array([frozenset(pair) in owner for pair in pairwise((*loop, loop[0]))])
    if not curved.any():
        return
    if curved.all():
        first = next(_of_run(solid, face, (*loop, loop[0])), None)
        start = 0 if first is None else loop.index(first[-1])
    else:
        start = int(np.flatnonzero(~curved)[0]) + 1
    order = np.roll(np.arange(len(loop)), -start)
    turned, along = [loop[i] for i in order], curved[order]
    breaks = np.flatnonzero(~along).tolist()
    for begin, end in pairwise([-1, *breaks, len(loop)]):
        run = tuple((turned * 2)[begin + 1 : end + 1])  # one vertex more than pieces
        if len(run) > MIN_PIECES:
            yield from _of_run(solid, face, run)


def _of_run(solid: Solid, face: int, run: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Vertices of the arcs of a run of pieces of curved edges, the longest that begin as early as can be."""
    points, normal = solid.vertices[list(run)], solid.normals[face]
    unsure = 2 * SINGLE * float(np.abs(solid.vertices).max())
    likely = _likely(points, unsure)
    begin = 0
    while begin + MIN_PIECES < len(run):
        if not likely[begin : begin + MIN_PIECES - 2].all():
            begin += 1
            continue
        limit = begin + int(np.argmin(np.append(likely[begin:], False))) + 3
        end = _farthest(points, normal, unsure, begin, limit)
        if end is None:
            begin += 1
            continue
        yield run[begin:end]
        begin = end - 1


def _likely(points: np.ndarray, unsure: float) -> np.ndarray:
    """Whether of each four points (n, 3) in a row the last may lie on the circle through the others, (n - 3,)."""
    one, two = points[1:-2] - points[:-3], points[2:-1] - points[:-3]
    across = np.cross(one, two)
    size = np.maximum((across**2).sum(1), np.finfo(float).tiny)[:, None]
    beside = (one**2).sum(1)[:, None] * np.cross(two, across) + (two**2).sum(1)[:, None] * np.cross(across, one)
    centre = points[:-3] + beside / (2 * size)
    radius = np.linalg.norm(points[:-3] - centre, axis=1)
    off = np.abs(np.linalg.norm(points[3:] - centre, axis=1) - radius)
    height = (np.linalg.norm(points[3:] - points[:-3], axis=1) ** 2) / (8 * np.maximum(radius, np.finfo(float).tiny))
    return off <= _NEARLY * height + 6 * unsure


def _farthest(points: np.ndarray, normal: np.ndarray, unsure: float, begin: int, limit: int) -> int | None:
    """The largest end up to which points from a first one on lie on a circle, by bisection; None of fewer pieces."""
    if _fits(points[begin:limit], normal, unsure):
        return limit
    good, bad = begin + MIN_PIECES + 1, limit
    if bad <= good or not _fits(points[begin:good], normal, unsure):
        return None
    while bad - good > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if _fits(points[begin:middle], normal, unsure) else (good, middle)
    return good


def _fits(points: np.ndarray, normal: np.ndarray, unsure: float) -> bool:
    """Whether points lie on an arc, each a step from the one before in the same sense."""
    centre, radius, off = circle_through(points, normal)
    away = (points - centre) / radius
    steps = np.arctan2(np.cross(away[:-1], away[1:]) @ normal, (away[:-1] * away[1:]).sum(1))
    if not ((steps > 0).all() or (steps < 0).all()):
        return False
    height = radius * (1 - np.cos(min(float(np.abs(steps).sum()) / 2, np.pi / 2)))
    near = max(_ROUND * height, min(unsure, _ROUNDED * height))
    return bool(off <= near and stepped(2 * np.sin(np.abs(steps) / 2)))


def _arc(solid: Solid, face: int, pieces: list[Edge], chain: tuple[int, ...]) -> Circle:
    normal, points = solid.normals[face], solid.vertices[list(chain)]
    centre, radius, _ = circle_through(points, normal)
    wall = next(f for f in pieces[0].faces if f != face)
    hole = bool((centre - points[0]) @ solid.normals[wall] > 0)
    if np.cross(points[0] - centre, points[1] - centre) @ normal < 0:
        pieces, points = pieces[::-1], points[::-1]
    return Circle("", centre, normal, radius, face, tuple(p.name for p in pieces), hole, points[[0, -1]])
