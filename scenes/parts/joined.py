"""Straight edges in one piece: what follows in a line between the same surfaces is one edge, whatever divides them."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from itertools import combinations

import numpy as np

from scenes.materials.vectors import cross
from scenes.parts.chains import SINGLE, Chain, components

_FLAT = 1e-4  # rad, between the normals of one plane


def joined(
    vertices: np.ndarray, chains: list[Chain], normals: np.ndarray, region: np.ndarray, sharp: np.ndarray
) -> list[Chain]:
    """The straight edges, each whole.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
    chains : list
        Straight pieces: (ends, faces, convex).
    normals : ndarray, shape (F, 3)
        Of the faces.
    region : ndarray of int, shape (F,)
        Number of the curved surface that each face is a facet of, -1 for plane faces.
    sharp : ndarray of bool, shape (C,)
        Which pieces are those of sharp edges.

    Returns
    -------
    list
        As the chains; faces are those of the longest piece.
    """
    rows = np.flatnonzero(sharp)
    meeting: dict[int, list[int]] = defaultdict(list)
    for row in rows.tolist():
        for end in chains[row][0]:
            meeting[end].append(row)
    pairs = []
    for vertex, found in meeting.items():
        pairs += _clear(
            pair
            for pair in combinations(found, 2)
            if _in_line(vertices, vertex, *(chains[k] for k in pair))
            and _alike(normals, region, *(chains[k] for k in pair))
        )
    group = components(len(chains), np.array(pairs, int))
    parts: dict[int, list[Chain]] = defaultdict(list)
    for row in rows.tolist():
        parts[int(group[row])].append(chains[row])
    return [_one(vertices, each) for each in parts.values()]


def _clear(pairs: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Those of a vertex's pairs of which neither piece has another partner: where pieces lie upon each other, it is not
    said which of them goes on."""
    found = list(pairs)
    partners = Counter(piece for pair in found for piece in pair)
    return [pair for pair in found if all(partners[piece] == 1 for piece in pair)]


def _in_line(vertices: np.ndarray, vertex: int, one: Chain, other: Chain) -> bool:
    """Whether two pieces continue each other in a vertex."""
    away = [vertices[next(end for end in chain[0] if end != vertex)] - vertices[vertex] for chain in (one, other)]
    long, short = sorted(away, key=np.linalg.norm, reverse=True)
    size = np.linalg.norm(long)
    off = np.linalg.norm(cross(short, long)) / size
    return bool(short @ long < 0 and off <= 2 * SINGLE * np.abs(vertices).max())


def _alike(normals: np.ndarray, region: np.ndarray, one: Chain, other: Chain) -> bool:
    """Whether two pieces lie between the same two surfaces."""

    def same(f: int, g: int) -> bool:
        return bool(region[f] == region[g] >= 0 or np.linalg.norm(normals[f] - normals[g]) <= _FLAT)

    (a, b), (c, d) = one[1], other[1]
    return one[2] == other[2] and ((same(a, c) and same(b, d)) or (same(a, d) and same(b, c)))


def _one(vertices: np.ndarray, parts: list[Chain]) -> Chain:
    """Pieces of a line as one, with the faces of the longest."""
    if len(parts) == 1:
        return parts[0]
    ends = np.array([part[0] for part in parts])
    length = np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)
    once, many = np.unique(ends, return_counts=True)
    first, last = once[many == 1].tolist()
    return (first, last), *parts[int(length.argmax())][1:]
