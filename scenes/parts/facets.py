"""Which faces of a mesh stand for a curved surface: rims of circles, and chains of narrow faces that bend alike.

A face is a facet if two bends of the surface follow each other across it and it is not much wider than what lies beyond
them: the plane between two rounded edges is no facet. They bend the same way, by at most 31 degrees (a prism of 12
sides is a cylinder), or by at most 12 any way: so files divide surfaces that bend both ways. A chain of at least four
bends is a curved surface; three are a polygon's, and so are those whose height over the chords is many times that of
the file's other curves. Bends of less than a degree are none, beside facets of less than two, and an edge that ends
within a surface is none. Nor are those of small triangles that fill what is left between curved surfaces, and chords of
the borders of such.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scenes.parts.chains import Chain, Chains, components, pairs_of
from scenes.parts.cones import chords
from scenes.parts.curves import LONGER, curved, meetings, turning, turns_at
from scenes.parts.rims import Rim

_BEND = np.radians(31)  # a polygon of at least 12 sides is a circle
_LEAST_BENDS = 4
_WIDER = 5.0  # than its neighbours: the steps of a curve may be unequal
_TANGENT = 1.25  # of the largest bend between facets: what continues a curve smoothly
_TANGENT_BEND = np.radians(1.0)  # faces that bend by less are joined smoothly, whatever they stand for
_SLIGHT = np.radians(12.0)  # bends of less are those of curves as files divide them, whichever way they go
_TANGENT_SLIGHT = 1.6  # the same of slight bends: the steps of a curve may be unequal
_FINE = np.radians(3.0)  # a plane as narrow as a facet of a surface that bends by so little is not likely
_FULL = 0.7  # of the bend before: where a plane begins it is half of it, at a last facet all
_LAST = 1.5  # widths of the facet before
_ALONG, _SQUARE = np.cos(np.radians([30.0, 80.0]))  # angles between a straight border and the bends beside it
_MOSTLY = 0.5  # of a circle's length: its face goes on smoothly there
_COARSER = 5.0  # heights over chords: a polygon's beside those of the curves of its file


@dataclass(frozen=True, eq=False)
class Facets:
    """What is no sharp edge.

    Attributes
    ----------
    region : ndarray of int, shape (F,)
        Number of the curved surface that each face is a part of, -1 for plane faces.
    beside : ndarray of int, shape (F,)
        The same, with small triangles that fill what is left beside a curved surface as parts of it.
    smooth, rim : ndarray of bool, shape (C,)
        Chains inside a curved surface or where a plane continues it, and pieces of curved edges.
    """

    region: np.ndarray
    beside: np.ndarray
    smooth: np.ndarray
    rim: np.ndarray

    @property
    def kinds(self) -> np.ndarray:
        """``smooth``, ``rim`` or ``sharp`` of each chain, shape (C,)."""
        return np.where(self.smooth, "smooth", np.where(self.rim, "rim", "sharp"))


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
    shape = Chains.of(vertices, chains, normals, areas)
    known = {frozenset(ends): i for i, (ends, *_) in enumerate(chains)}
    pieces = [[known[frozenset(pair)] for pair in rim.pieces] for rim in rims]
    around, edging = _of_rims(chains, rims, pieces)
    linked, crossed = _linked(shape, ~around & ~edging)
    flush = _flush(shape, pieces, linked)
    edging &= ~flush
    facet = np.zeros(len(normals), bool)
    facet[shape.faces[around].ravel()] = True
    facet[crossed] = True
    least = np.where(facet[shape.faces].any(1), 2 * _TANGENT_BEND, _TANGENT_BEND)
    slight = (shape.certain <= least) & ~edging
    linked |= slight
    inner = linked & facet[shape.faces].all(1)
    smooth = around | flush | slight | inner | _continued(shape, linked & ~inner, inner)
    smooth |= _dangling(shape, ~smooth, facet)
    facet = _last(shape, facet, smooth)
    joins = shape.faces[smooth & facet[shape.faces].all(1)]
    region = np.where(facet, components(len(normals), joins), -1)
    curves = edging | turning(shape, region, smooth) | curved(shape, region, ~smooth & ~edging)
    unsure = _unsure(shape, facet)
    within = (facet | unsure)[shape.faces].all(1) & unsure[shape.faces].any(1)
    beside = _filled(shape, region, within)
    inside = (beside[shape.faces[:, 0]] == beside[shape.faces[:, 1]]) & (beside[shape.faces] >= 0).all(1)
    curves |= within | inside & (shape.bend <= 2 * _BEND) | _chords(shape, facet | unsure, smooth)
    curves |= chords(vertices, shape, normals, region, smooth, ~smooth & ~curves)
    return Facets(region, beside, smooth, _along_lines(shape, curves & ~smooth, ~smooth))


def _filled(shape: Chains, region: np.ndarray, within: np.ndarray) -> np.ndarray:
    """The curved surface of each face, and of what is joined to it by chains ``within``, (C,); int, shape (F,)."""
    group = components(len(region), shape.faces[within])
    found = np.full(group.max() + 1, -1)
    np.maximum.at(found, group, region)
    return np.where(region >= 0, region, found[group])


def _flush(shape: Chains, pieces: list[list[int]], linked: np.ndarray) -> np.ndarray:
    """Pieces of circles in which a curved surface continues the circle's face smoothly, as a fillet does; bool, (C,).

    What bends no more than within that surface, or hardly at all, is no edge: there is nothing to see.
    """
    of_rims = np.zeros(len(shape.bend), bool)
    of_rims[[i for each in pieces for i in each]] = True
    here = of_rims & (shape.bend <= _SLIGHT)
    here = _continued(shape, here, linked) | here & (shape.certain <= _TANGENT_BEND)
    found = np.zeros(len(shape.bend), bool)
    for each in pieces:
        found[each] = shape.length[each] @ here[each] > _MOSTLY * shape.length[each].sum()
    return found


def _of_rims(chains: list[Chain], rims: Iterable[Rim], pieces: list[list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Chains between two neighbours in the wall of a circle, and the circles' own pieces; bool, each (C,)."""
    pairs: dict[frozenset, list[int]] = {}
    for i, (_, faces, _) in enumerate(chains):
        pairs.setdefault(frozenset(faces), []).append(i)
    around, edging = np.zeros(len(chains), bool), np.zeros(len(chains), bool)
    for rim, each in zip(rims, pieces, strict=True):
        edging[each] = True
        walls = [next(f for f in chains[i][1] if f != rim.face) for i in each]
        for pair in zip(walls, walls[1:] + walls[:1], strict=True):
            around[pairs.get(frozenset(pair), [])] = True
    return around, edging & ~around


def _linked(shape: Chains, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chains of which at least four follow each other across narrow faces, bending alike (bool, (C,)); these faces."""
    for _ in range(2):  # what polygons there are is told from the curves found first
        links = _links(shape, free)
        group = components(len(shape.bend), links[:, :2])
        linked = (np.bincount(group) >= _LEAST_BENDS)[group] & free
        polygonal = linked & (_polygonal(shape, group, linked) | _standing_out(shape, links[:, :2]))
        if not polygonal.any():
            break
        free = free & ~polygonal
    linked &= free
    return linked, links[linked[links[:, :2]].all(1), 2]


def _polygonal(shape: Chains, group: np.ndarray, linked: np.ndarray) -> np.ndarray:
    """Which chains are those of polygons, among curves that are divided much more finely; bool, shape (C,).

    By the height of a curve over its chords (sagitta), by which files are divided: of a chain against the others of its
    surface, of a coarse surface against the fine ones.
    """
    rows = np.flatnonzero(linked)
    if not rows.size:
        return np.zeros(linked.size, bool)
    height = shape.height
    number = np.unique(group[rows], return_inverse=True)[1]
    order = np.lexsort([height[rows], number])
    count = np.bincount(number)
    first = np.cumsum(count) - count
    middle, high = (height[rows][order][first + (part * count).astype(int)] for part in (0.5, 0.75))
    largest = np.zeros(count.size)
    np.maximum.at(largest, number, shape.bend[rows])
    coarse = largest > _SLIGHT
    limit = _COARSER * middle[~coarse].max(initial=0.0) if (~coarse).any() else np.inf
    found = np.zeros(linked.size, bool)
    alone = (height[rows] > 2 * _COARSER * high[number]) & (shape.bend[rows] > _SLIGHT)
    found[rows] = alone | (coarse & (middle > limit))[number]
    return found


def _standing_out(shape: Chains, links: np.ndarray) -> np.ndarray:
    """Chains of which the height is larger by far than those of all that follow, and of the next; bool, shape (C,)."""
    height = shape.height
    here, there = np.concatenate([links, links[:, ::-1]]).T
    order = np.lexsort([-height[there], here])
    here, there = here[order], there[order]
    start = np.flatnonzero(np.diff(here, prepend=-1))
    second = np.minimum(start + 1, len(here) - 1)
    highest, which, next_ = (np.zeros(len(height)) for _ in range(3))
    highest[here[start]], which[here[start]] = height[there[start]], there[start]
    next_[here[start]] = np.where(here[second] == here[start], height[there[second]], 0.0) * (second > start)
    beyond = highest.copy()
    np.maximum.at(beyond, here, np.where(which[there] == here, next_[there], highest[there]))
    return height > 2 * _COARSER * beyond


def _links(shape: Chains, free: np.ndarray) -> np.ndarray:
    """Pairs of chains that follow each other across a facet, and that face, (n, 3)."""
    rows = np.flatnonzero(free & (shape.bend <= _BEND))
    chain, face, other = np.tile(rows, 2), shape.faces[rows].T.ravel(), shape.faces[rows][:, ::-1].T.ravel()
    pairs = pairs_of(face)
    one, two = chain[pairs].T
    here = face[pairs[:, 0]]
    width = shape.areas[here] / np.maximum(shape.border[one], shape.border[two])
    beyond = (shape.areas[other] / shape.border[chain])[pairs].max(1)
    alike = (shape.convex[one] == shape.convex[two]) | (np.maximum(shape.bend[one], shape.bend[two]) <= _SLIGHT)
    return np.column_stack([one, two, here])[alike & (width <= _WIDER * beyond)]


def _continued(shape: Chains, ends: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Which chains at the end of a curved surface continue it smoothly; bool, shape (C,).

    Beside the largest bend of a facet and the next: between triangles of a curve every second one is nearly flat.
    """
    largest = np.zeros(len(shape.areas))
    for side in (0, 1):
        np.maximum.at(largest, shape.faces[inner, side], shape.bend[inner])
    next_ = largest.copy()
    for side in (0, 1):
        np.maximum.at(next_, shape.faces[inner, side], largest[shape.faces[inner, 1 - side]])
    most = np.where(shape.bend <= _SLIGHT, _TANGENT_SLIGHT, _TANGENT)
    return ends & (shape.bend <= most * next_[shape.faces].max(1))


def _dangling(shape: Chains, edges: np.ndarray, facet: np.ndarray) -> np.ndarray:
    """Which of the chains that may be edges end in the middle of a surface, or follow such ones; bool, shape (C,).

    Only those that bend no more than the facets of a curve do: an edge ends where others do. Between two of the faces
    that are a ``facet``, (F,), twice as much: so far do files turn a triangle over where they divide a surface badly.
    """
    most = np.where(facet[shape.faces].all(1), 2 * _BEND, _BEND)
    left, size = edges.copy(), shape.ends.max(initial=0) + 1
    within = np.bincount(shape.ends.ravel(), minlength=size) > 2
    while True:
        alone = (np.bincount(shape.ends[left].ravel(), minlength=size) == 1) & within
        loose = left & alone[shape.ends].any(1) & (shape.bend <= most)
        if not loose.any():
            return edges & ~left
        left &= ~loose


def _unsure(shape: Chains, facet: np.ndarray) -> np.ndarray:
    """Triangles beside facets, and beside such ones, that are about as narrow; bool, shape (F,).

    With them files fill what is left between curved surfaces. They may look anywhere, and are no plane faces of a part;
    nor is a triangle of any size with facets on all three sides.
    """
    triangle = (np.bincount(shape.faces.ravel(), minlength=len(facet)) == 3) & ~facet
    narrow = shape.areas[shape.faces] <= _WIDER * shape.areas[shape.faces[:, ::-1]]
    found = triangle & (np.bincount(shape.faces.ravel(), facet[shape.faces[:, ::-1]].ravel(), len(facet)) == 3)
    while True:
        beside = (facet | found)[shape.faces[:, ::-1]] & narrow & triangle[shape.faces] & ~found[shape.faces]
        if not beside.any():
            return found
        found[shape.faces[beside]] = True


def _chords(shape: Chains, facet: np.ndarray, smooth: np.ndarray) -> np.ndarray:
    """Chains that are a side of a facet of three sides, and no straight line of its surface; bool, shape (C,).

    Along a straight line of a curved surface, or square to it, run the bends about it; where a file cuts the border of
    a surface into chords, its last triangles have bends at any angle. What goes on in a line is no chord.
    """
    triangle = facet & (np.bincount(shape.faces.ravel(), minlength=len(facet)) == 3)
    side = np.flatnonzero(triangle[shape.faces].ravel())
    pairs = side[pairs_of(shape.faces.ravel()[side])]
    here, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    cosine = np.abs((shape.along[here // 2] * shape.along[other // 2]).sum(1))
    cosine /= shape.length[here // 2] * shape.length[other // 2]
    fits = smooth[other // 2] & ((cosine >= _ALONG) | (cosine <= _SQUARE))
    straight = ~triangle[shape.faces].ravel()
    straight[here[fits]] = True
    straight = straight.reshape(-1, 2).all(1)
    rows, ends, _ = meetings(shape, ~smooth)
    goes_on = rows[turns_at(shape, rows, ends)[2]]
    straight[goes_on] = True
    return ~smooth & ~straight


def _along_lines(shape: Chains, curves: np.ndarray, open_: np.ndarray) -> np.ndarray:
    """Pieces of curved edges, and what continues them in a line where no other edge ends; bool, shape (C,).

    An edge of the part ends where others do: a straight one does not become a curve in between, if it is not much
    longer than the curve's pieces there, as beside a sliver.
    """
    pairs, ends, alone = meetings(shape, open_)
    run = components(len(shape.bend), pairs[alone & turns_at(shape, pairs, ends)[2]])
    of_curves = np.bincount(run, shape.length * curves)
    straight = np.bincount(run, shape.length * (open_ & ~curves))
    return curves | (straight <= LONGER * of_curves)[run] & open_ & (of_curves > 0)[run]


def _last(shape: Chains, facet: np.ndarray, smooth: np.ndarray) -> np.ndarray:
    """Facets, and those faces at the end of a curved surface that are its last ones; bool, shape (F,).

    They are about as wide as the one before, and the surface bends as before: towards a plane it does half as much.
    """
    width = shape.areas[shape.faces] / shape.border[:, None]
    curvature = shape.bend / width.sum(1)
    found, bent = facet.copy(), smooth & (shape.bend <= _SLIGHT)
    largest = np.zeros(len(shape.areas))
    inner = bent & facet[shape.faces].all(1)
    once = np.bincount(shape.faces[bent].ravel(), minlength=len(facet)) == 1
    for side in (0, 1):
        np.maximum.at(largest, shape.faces[inner, side], curvature[inner])
    for side in (0, 1):
        here, before = shape.faces[:, side], shape.faces[:, 1 - side]
        full = (curvature >= _FULL * largest[before]) | (shape.bend <= _FINE)
        rows = bent & facet[before] & ~facet[here] & once[here] & full
        found[here[rows & (width[:, side] <= _LAST * width[:, 1 - side])]] = True
    return found
