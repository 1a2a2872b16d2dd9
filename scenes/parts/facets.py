"""Which faces of a mesh stand for a curved surface: rims of circles, and chains of narrow faces that bend alike.

A face is a facet if two bends of the surface, both outwards or both inwards and at most 31 degrees (a prism of 12 sides
is a cylinder), follow each other across it and it is not much wider than what lies beyond them: the plane between two
rounded edges is no facet. A chain of at least four bends is a curved surface; three are a polygon's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from scenes.parts.rims import Rim

Chain = tuple[tuple[int, int], tuple[int, int], bool]  # ends, faces, convex
_BEND = np.radians(31)  # a polygon of at least 12 sides is a circle
_LEAST_BENDS = 4
_WIDER = 5.0  # than its neighbours: the steps of a curve may be unequal
_TANGENT = 1.25  # of the largest bend between facets: what continues a curve smoothly
_CURVE = np.cos(np.radians(60))  # pieces of a curved edge turn by less
_MANY = 64  # bends of one face; a plane with more is no facet


@dataclass(frozen=True)
class Facets:
    """What is no sharp edge.

    Attributes
    ----------
    region : ndarray of int, shape (F,)
        Number of the curved surface that each face is a part of, -1 for plane faces.
    smooth, rim : ndarray of bool, shape (C,)
        Chains inside a curved surface or where a plane continues it, and pieces of curved edges.
    """

    region: np.ndarray
    smooth: np.ndarray
    rim: np.ndarray


def facets(
    vertices: np.ndarray, chains: list[Chain], normals: np.ndarray, areas: np.ndarray, rims: Iterable[Rim]
) -> Facets:
    """Find them.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
    chains : list
        Straight edges: (ends, faces, convex).
    normals, areas : ndarray, shape (F, 3), (F,)
    rims : iterable of Rim
        The circles.
    """
    shape = _Shape.of(vertices, chains, normals, areas)
    around, edging = _of_rims(chains, rims)
    linked = _linked(shape, ~around & ~edging)
    inner = linked.copy()
    facet = np.zeros(len(normals), bool)
    facet[shape.faces[around].ravel()] = True
    facet[_crossed(shape, linked)] = True
    inner &= facet[shape.faces].all(1)
    smooth = around | inner | _continued(shape, linked & ~inner, inner)
    joins = shape.faces[smooth & facet[shape.faces].all(1)]
    region = np.where(facet, _components(len(normals), joins), -1)
    return Facets(region, smooth, edging | _curved(shape, region, ~smooth & ~edging))


@dataclass(frozen=True)
class _Shape:
    """The chains as arrays."""

    ends: np.ndarray
    faces: np.ndarray
    convex: np.ndarray
    along: np.ndarray
    length: np.ndarray
    bend: np.ndarray
    areas: np.ndarray

    @classmethod
    def of(cls, vertices, chains, normals, areas) -> _Shape:
        ends = np.array([chain[0] for chain in chains]).reshape(-1, 2)
        faces = np.array([chain[1] for chain in chains]).reshape(-1, 2)
        along = vertices[ends[:, 1]] - vertices[ends[:, 0]]
        length = np.linalg.norm(along, axis=1)
        one, two = normals[faces[:, 0]], normals[faces[:, 1]]
        bend = np.arctan2(np.linalg.norm(np.cross(one, two), axis=1), (one * two).sum(1))
        return cls(ends, faces, np.array([chain[2] for chain in chains], bool), along, length, bend, areas)

    def beyond(self, chain: int, face: int) -> int:
        """The face on the other side of a chain."""
        one, two = self.faces[chain]
        return two if one == face else one


def _of_rims(chains: list[Chain], rims: Iterable[Rim]) -> tuple[np.ndarray, np.ndarray]:
    """Chains between two neighbours in the wall of a circle, and the circles' own pieces; bool, each (C,)."""
    known = {frozenset(ends): i for i, (ends, *_) in enumerate(chains)}
    pairs: dict[frozenset, list[int]] = {}
    for i, (_, faces, _) in enumerate(chains):
        pairs.setdefault(frozenset(faces), []).append(i)
    around, edging = np.zeros(len(chains), bool), np.zeros(len(chains), bool)
    for rim in rims:
        pieces = [known[frozenset(pair)] for pair in rim.pieces]
        edging[pieces] = True
        walls = [next(f for f in chains[i][1] if f != rim.face) for i in pieces]
        for pair in zip(walls, walls[1:] + walls[:1], strict=True):
            around[pairs.get(frozenset(pair), [])] = True
    return around, edging & ~around


def _linked(shape: _Shape, free: np.ndarray) -> np.ndarray:
    """Chains of which at least four follow each other across narrow faces, bending alike; bool, shape (C,)."""
    links = np.array(list(_links(shape, free)), int).reshape(-1, 3)
    group = _components(len(shape.bend), links[:, :2])
    many = np.bincount(group) >= _LEAST_BENDS
    return many[group] & free


def _links(shape: _Shape, free: np.ndarray):
    """Pairs of chains that follow each other across a facet, and that face."""
    at: dict[int, list[int]] = {}
    for i in np.flatnonzero(free & (shape.bend <= _BEND)):
        for face in shape.faces[i]:
            at.setdefault(int(face), []).append(int(i))
    for face, chains in at.items():
        if len(chains) > _MANY:
            continue
        for i, j in combinations(chains, 2):
            width = shape.areas[face] / max(shape.length[i], shape.length[j])
            others = [shape.areas[shape.beyond(k, face)] / shape.length[k] for k in (i, j)]
            if shape.convex[i] == shape.convex[j] and width <= _WIDER * max(others):
                yield i, j, face


def _crossed(shape: _Shape, linked: np.ndarray) -> list[int]:
    """The faces across which linked chains follow each other."""
    return [face for *_, face in _links(shape, linked)]


def _continued(shape: _Shape, ends: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Which chains at the end of a curved surface continue it smoothly; bool, shape (C,)."""
    largest = np.zeros(len(shape.areas))
    for i in np.flatnonzero(inner):
        np.maximum.at(largest, shape.faces[i], shape.bend[i])
    return ends & (shape.bend <= _TANGENT * largest[shape.faces].max(1))


def _curved(shape: _Shape, region: np.ndarray, open_: np.ndarray) -> np.ndarray:
    """Which chains are pieces of a curved edge, between a curved surface and the same other one; bool, (C,)."""
    sides = np.where(region[shape.faces] >= 0, region[shape.faces], -2 - shape.faces)
    candidates = np.flatnonzero(open_ & (region[shape.faces] >= 0).any(1))
    meeting: dict[tuple, list[int]] = {}
    for i in candidates:
        for end in shape.ends[i]:
            meeting.setdefault((int(end), *sorted(sides[i].tolist())), []).append(int(i))
    found = np.zeros(len(shape.bend), bool)
    for (end, *_), chains in meeting.items():
        for i, j in combinations(chains, 2):
            one, two = (shape.along[k] * (1 if shape.ends[k][0] == end else -1) for k in (i, j))
            if -(one @ two) >= _CURVE * shape.length[i] * shape.length[j]:
                found[[i, j]] = True
    return found


def _components(count: int, pairs: np.ndarray) -> np.ndarray:
    """Number of the connected component of each of ``count`` things."""
    graph = coo_array((np.ones(len(pairs)), np.asarray(pairs).reshape(-1, 2).T), shape=(count, count))
    return connected_components(graph, directed=False)[1]
