"""Where on a face light is told: nodes of a grid in the rectangle about it, denser at its ends.

Nodes that are not on the face see what the nearest place of it does; none stands on its rim, for in an inner edge light
comes from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from scenes import Solid

_LEAST = 6  # nodes along a side of a rectangle at least, fewer where it is smaller than a cell,
_ACROSS = 3  # and a cell across facets of a curved surface, from one to the next of which light changes little
_ALONG_RIM = 400  # places


@dataclass(frozen=True, eq=False)
class Frame:
    """A rectangle about a face, in its plane: a corner (3,), its unit sides (2, 3) and their lengths (2,)."""

    corner: np.ndarray
    sides: np.ndarray
    size: np.ndarray
    closed: ClassVar[bool] = False

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, 3) along the sides, (n, 2); outside those of the nearest place."""
        return np.clip((points - self.corner) @ self.sides.T, 0, self.size)


def along(size: float, goes_on: bool, cell: float) -> np.ndarray:
    """Places of nodes along a side of a face's rectangle, denser at its ends; where the surface goes on beyond a side
    that is shorter than a cell, the middles of equal pieces."""
    if size < cell and goes_on:
        count = int(np.ceil(_ACROSS * size / cell))
        return (np.arange(count) + 0.5) * size / count
    count = max(int(np.ceil(size / cell)), _LEAST) if size >= cell else int(np.ceil(_LEAST * size / cell))
    return size * (1 - np.cos(np.pi * np.arange(count + 2) / (count + 1))) / 2


def goes_on(solid: Solid, face: int, frame: Frame) -> tuple[bool, bool]:
    """Along which sides of a facet's rectangle its surface goes on: smooth edges run across them."""
    ends = _smooth(solid).get(face, ())
    across = np.abs((solid.vertices[[b for _, b in ends]] - solid.vertices[[a for a, _ in ends]]) @ frame.sides.T)
    return bool((across[:, 1] > across[:, 0]).any()), bool((across[:, 0] > across[:, 1]).any())


@lru_cache(maxsize=4)
def _smooth(solid: Solid) -> dict[int, list[tuple[int, int]]]:
    """Ends of the smooth edges of each facet of a curved surface."""
    found: dict[int, list[tuple[int, int]]] = {}
    for edge in solid.edges:
        for face in edge.faces if edge.kind == "smooth" else ():
            if not solid.plane[face]:
                found.setdefault(face, []).append(edge.ends)
    return found


def frame_of(solid: Solid, face: int) -> Frame:
    """Along a face's longest edge."""
    corners, normal = solid.vertices[list(solid.faces[face])], solid.normals[face]
    ways = np.roll(corners, -1, 0) - corners
    one = max(ways, key=np.linalg.norm)
    one = one / np.linalg.norm(one)
    sides = np.stack([one, np.cross(normal, one)])
    low, high = (end(corners @ sides.T, axis=0) for end in (np.min, np.max))
    return Frame(normal * solid.offsets[face] + low @ sides, sides, high - low)


def onto(solid: Solid, face: int, points: np.ndarray, within: float) -> np.ndarray:
    """Points of a face's plane, those outside of it brought to the nearest place a little within its rim."""
    from scipy.spatial import KDTree  # slow to load, and rarely needed

    away = ~_on(solid.triangles[solid.triangle_faces == face], points)
    if not away.any():
        return points
    rim = _rim(solid, face, within)
    found = points.copy()
    found[away] = rim[KDTree(rim).query(points[away])[1]]
    return found


def _rim(solid: Solid, face: int, within: float) -> np.ndarray:
    """Places a little within a face's boundaries, those on the face, (n, 3)."""
    loops = [solid.faces[face], *(solid.holes[face] if solid.holes else ())]
    start = np.concatenate([solid.vertices[list(loop)] for loop in loops])
    way = np.concatenate([solid.vertices[np.roll(loop, -1)] for loop in loops]) - start
    length = np.linalg.norm(way, axis=1)
    each = np.maximum(np.ceil(_ALONG_RIM * length / length.sum()).astype(int), 1)
    side = np.repeat(np.arange(len(each)), each)
    share = (np.arange(len(side)) - np.repeat(np.cumsum(each) - each, each) + 0.5) / each[side]
    inwards = np.cross(solid.normals[face], way / length[:, None])
    places = start[side] + share[:, None] * way[side] + within * inwards[side]
    inside = _on(solid.triangles[solid.triangle_faces == face], places)
    return places[inside] if inside.any() else solid.triangles[solid.triangle_faces == face].mean(1)


def _on(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which points (n, 3) of their plane lie on triangles (t, 3, 3)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inside = np.ones((len(points), len(triangles)), bool)
    for k in range(3):
        across = np.cross(normals, triangles[:, (k + 1) % 3] - triangles[:, k])
        inside &= points @ across.T >= np.einsum("ti,ti->t", across, triangles[:, k])
    return inside.any(1)
