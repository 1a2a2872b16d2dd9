"""Straight pieces between the plane faces of a mesh, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Chain = tuple[tuple[int, int], tuple[int, int], bool]  # ends, faces, convex
SINGLE = 3e-7  # of the largest coordinate: what single precision leaves of a place
_MOST = np.radians(10.0)  # that a bend may be off: or an edge with a sliver beside it would be none


@dataclass(frozen=True, eq=False)
class Chains:
    """C pieces: their ends (C, 2), the faces (C, 2) that meet in each, whether these look away from each other (C,).

    Attributes
    ----------
    along : ndarray, shape (C, 3)
    length, bend : ndarray, shape (C,)
        The bend is the angle between the faces' normals, rad.
    areas : ndarray, shape (F,)
        Of the faces.
    unsure : float
        How far two places may be off each other in single precision.
    """

    ends: np.ndarray
    faces: np.ndarray
    convex: np.ndarray
    along: np.ndarray
    length: np.ndarray
    bend: np.ndarray
    areas: np.ndarray
    unsure: float  # how far two places may be off each other in single precision

    @classmethod
    def of(cls, vertices, chains, normals, areas) -> Chains:
        ends = np.array([chain[0] for chain in chains]).reshape(-1, 2)
        faces = np.array([chain[1] for chain in chains]).reshape(-1, 2)
        along = vertices[ends[:, 1]] - vertices[ends[:, 0]]
        length = np.linalg.norm(along, axis=1)
        one, two = normals[faces[:, 0]], normals[faces[:, 1]]
        bend = np.arctan2(np.linalg.norm(np.cross(one, two), axis=1), (one * two).sum(1))
        convex = np.array([chain[2] for chain in chains], bool)
        unsure = 2 * SINGLE * float(np.abs(vertices).max())
        return cls(ends, faces, convex, along, length, bend, areas, unsure)

    @cached_property
    def border(self) -> np.ndarray:
        """How long the two faces meet in all, shape (C,): holes, and corners not quite in line, divide that."""
        _, both = np.unique(np.sort(self.faces, 1) @ [len(self.areas), 1], return_inverse=True)
        return np.bincount(both, self.length)[both]

    @property
    def height(self) -> np.ndarray:
        """Of a curve over its chords (sagitta), were each chain a bend of one, shape (C,)."""
        return self.bend * self.areas[self.faces].min(1) / self.border / 8

    @property
    def certain(self) -> np.ndarray:
        """The bends less what single precision may make of them at slivers, shape (C,)."""
        longest = np.zeros(len(self.areas))
        for side in (0, 1):
            np.maximum.at(longest, self.faces[:, side], self.length)
        unsure = self.unsure / 2 * longest / self.areas
        return self.bend - np.minimum(unsure[self.faces].sum(1), _MOST)


def pairs_of(number: np.ndarray, most: int = 64) -> np.ndarray:
    """Pairs (n, 2) of places at which the same number stands; none of one that stands at more than ``most``."""
    order = np.argsort(number, kind="stable")
    count = np.bincount(number)
    first = np.cumsum(count) - count
    found = [np.zeros((0, 2), int)]
    for size in range(2, most + 1):
        starts = first[count == size]
        if starts.size:
            one, two = np.triu_indices(size, 1)
            found.append(np.stack([order[starts[:, None] + one].ravel(), order[starts[:, None] + two].ravel()], 1))
    return np.concatenate(found)


def components(count: int, pairs: np.ndarray) -> np.ndarray:
    """Number of the connected component of each of ``count`` things."""
    graph = coo_array((np.ones(len(pairs)), np.asarray(pairs).reshape(-1, 2).T), shape=(count, count))
    return connected_components(graph, directed=False)[1]
