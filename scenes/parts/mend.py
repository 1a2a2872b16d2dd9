"""Triangles as files have them, brought to a closed surface: doubled ones, gaps, T-junctions, slits, holes, shells
turned."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from scenes.errors import InvalidInput
from scenes.parts.caps import SAID, caps, listed
from scenes.parts.rows import different

_GAP = 1e-5  # of the part's size: open edges that lie closer are one
_SLIT = 3e-4  # of the part's size: what is open and narrower is filled
_MOST_AROUND = 64  # corners of a slit
_NO_AREA = 1e-14  # of the part's size, squared: a triangle of less has no plane
_MOST_OPEN = 10_000  # edges: more are no seams between triangles that were meant to meet
_SAME = 1e-5  # rad, between triangles of one plane


def mended(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, tuple[str, ...]]:
    """A closed, outwards oriented surface in which every edge belongs to two triangles, and what was done to get it.

    Its ``face_attributes["source"]`` are the numbers of the triangles that were there, those beside them for what
    fills holes; ``["cap"]`` are which place that the file leaves open (`scenes.parts.caps`) a triangle closes, from 1,
    or 0.

    Raises
    ------
    InvalidInput
        If too much is open, or it cannot be closed; the message says where. If it encloses nothing.

    Examples
    --------
    >>> box = trimesh.creation.box((1, 2, 3))
    >>> _ = box.invert()
    >>> mended(box)[1]
    ('inverted shells turned: 1',)
    """
    mesh.merge_vertices()
    mesh.face_attributes.update(source=np.arange(len(mesh.faces)), cap=np.zeros(len(mesh.faces), int))
    said: list[str] = []
    whole = mesh.is_watertight and mesh.is_winding_consistent
    ways = _without_doubled, _closed_gaps, _divided, _filled, _one_way, _capped, _parted, _outwards
    for step in ways[-1:] if whole else ways:
        mesh, done = step(mesh)
        said += done
    if not len(mesh.faces):
        raise InvalidInput("object.file must be a body of some thickness, got a surface that encloses nothing")
    return mesh, tuple(said)


def _without_doubled(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Triangles of two corners left out, of doubled ones one, of those that look at each other both: bodies that touch
    become one.
    """
    whole = np.flatnonzero((mesh.faces != np.roll(mesh.faces, 1, 1)).all(1))
    faces, flat = mesh.faces[whole], len(mesh.faces) - len(whole)
    turn = np.take_along_axis(faces, (faces.argmin(1)[:, None] + np.arange(3)) % 3, 1)  # the least corner first
    looks = np.where(turn[:, 1] < turn[:, 2], 1, -1)
    _, which = different(np.sort(faces, 1))
    balance, many = np.bincount(which, looks), np.bincount(which)
    kept = np.zeros(len(faces), bool)
    for sign in (1, -1):
        wanted = np.flatnonzero(looks == sign)
        groups, at = np.unique(which[wanted], return_index=True)
        kept[wanted[at[balance[groups] * sign > 0]]] = True
    if kept.all() and not flat:
        return mesh, []
    touching = int((many[balance == 0]).sum()) // 2
    doubled = len(faces) - int(kept.sum()) - 2 * touching
    said = [
        f"{what}: {count}"
        for what, count in (
            ("triangles of two corners left out", flat),
            ("doubled triangles left out", doubled),
            ("pairs of triangles where bodies touch left out", touching),
        )
        if count
    ]
    return _of(mesh, mesh.vertices, faces[kept], whole[kept]), said


def _closed_gaps(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Vertices of open edges that are near to each other joined."""
    rim = np.unique(_open(mesh.faces))
    if not rim.size:
        return mesh, []
    near = KDTree(mesh.vertices[rim]).query_pairs(_GAP * mesh.extents.max(), output_type="ndarray")
    graph = coo_array((np.ones(len(near)), rim[near].reshape(-1, 2).T), shape=(len(mesh.vertices),) * 2)
    group = connected_components(graph, directed=False)[1]
    first = np.unique(group, return_index=True)[1]
    faces = group[mesh.faces]
    whole = (faces != np.roll(faces, 1, 1)).all(1)
    joined = _of(mesh, mesh.vertices[first], faces[whole], np.flatnonzero(whole))
    return joined, [f"vertices of open edges joined: {len(mesh.vertices) - len(first)}"] if len(near) else []


def _divided(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Triangles divided where corners of others lie on their open edges."""
    halves = np.sort(_halves(mesh.faces), 1)
    edges, which = different(halves)
    alone = np.flatnonzero(np.bincount(which) % 2)
    if not 0 < alone.size <= _MOST_OPEN:
        return mesh, []
    faces, sources, count = mesh.faces.tolist(), list(range(len(mesh.faces))), 0
    pieces = {i: [i] for i in range(len(faces))}
    for edge, between in zip(alone, _between(mesh.vertices, edges[alone]), strict=True):
        start, stop = edges[edge].tolist()
        count += len(between)
        for face in np.flatnonzero(which == edge) % len(mesh.faces) if between else ():
            for last, corner in pairwise([start, *between]):
                _halved(faces, pieces[face], {last, stop}, corner)
                sources.append(int(face))
    if not count:
        return mesh, []
    found = _of(mesh, mesh.vertices, np.array(faces), np.array(sources))
    return found, [f"corners on open edges, whose triangles were divided there: {count}"]


def _between(vertices: np.ndarray, edges: np.ndarray) -> Iterator[list[int]]:
    """Of open edges (n, 2) each the ends of others that lie on it, from its first end to its second."""
    rim, near = np.unique(edges), _GAP * float(np.ptp(vertices, axis=0).max())
    start, way = vertices[edges[:, 0]], np.diff(vertices[edges], axis=1)[:, 0]
    length = np.linalg.norm(way, axis=1)
    for row, some in enumerate(KDTree(vertices[rim]).query_ball_point(start + way / 2, length / 2)):
        away = vertices[rim[some]] - start[row]
        along = away @ way[row] / length[row]
        aside = np.linalg.norm(away - along[:, None] * way[row] / length[row], axis=1)
        on = (aside <= near) & (along > near) & (along < length[row] - near)
        yield rim[some][on][np.argsort(along[on])].tolist()


def _filled(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Slits closed by triangles, each a part of the face beside its longest edge."""
    halves = _halves(mesh.faces)
    _, which = different(np.sort(halves, 1))
    alone = np.flatnonzero(np.bincount(which)[which] == 1)
    if not 0 < alone.size <= _MOST_OPEN:
        return mesh, []
    beside = {tuple(half): int(k) % len(mesh.faces) for half, k in zip(halves[alone].tolist(), alone, strict=True)}
    added, sources, widths = [mesh.faces], list(range(len(mesh.faces))), []
    for loop in _loops(list(beside)):
        corners = mesh.vertices[loop]
        lengths = np.linalg.norm(np.roll(corners, -1, 0) - corners, axis=1)
        area, fan = _fan(corners)
        width = 2 * area / lengths.sum()
        if width <= _SLIT * mesh.extents.max():
            longest = int(lengths.argmax())
            added.append(np.array(loop)[fan])
            sources += [beside[loop[(longest + 1) % len(loop)], loop[longest]]] * len(fan)
            widths.append(width)
    if not widths:
        return mesh, []
    found = _of(mesh, mesh.vertices, np.concatenate(added), np.array(sources))
    return found, [f"slits filled, {max(widths):.2g} wide at most: {len(widths)}"]


def _loops(halves: list[tuple[int, int]]) -> Iterator[list[int]]:
    """Closed ways around what is open, against the edges of the triangles beside it; no long ones."""
    onward: dict[int, list[int]] = defaultdict(list)
    for start, stop in halves:
        onward[stop].append(start)
    for _, first in halves:
        way = [first]
        while onward[way[-1]] and (len(way) == 1 or way[-1] != first):
            way.append(onward[way[-1]].pop())
        if 1 < len(way) <= _MOST_AROUND and way[-1] == first:
            yield way[:-1]


def _fan(corners: np.ndarray) -> tuple[float, np.ndarray]:
    """The area of the triangles (n - 2, 3) from one corner of a loop (n, 3) to the others: from that of the least."""
    n = len(corners)
    turns = (np.arange(n) + np.arange(n)[:, None]) % n
    fans = np.stack([np.broadcast_to(turns[:, :1], (n, n - 2)), turns[:, 1:-1], turns[:, 2:]], -1)
    a, b, c = np.moveaxis(corners[fans], 2, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum(1) / 2
    return float(areas.min()), fans[areas.argmin()]


def _one_way(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Triangles turned that look the other way than their neighbours."""
    if not len(_open(mesh.faces)):
        return mesh, []
    turned = _of(mesh, mesh.vertices, mesh.faces.copy(), np.arange(len(mesh.faces)))
    trimesh.repair.fix_winding(turned)
    count = int((mesh.faces != turned.faces).any(1).sum())
    count = min(count, len(mesh.faces) - count)
    return turned, [f"triangles that looked the other way turned: {count}"] if count else []


def _capped(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """What is open closed by triangles of which nobody knows whether they are there."""
    left = _open(mesh.faces)
    if not len(left):
        return mesh, []
    added = caps(mesh.vertices, left[:, ::-1]) if len(left) <= _MOST_OPEN else []
    new, whole = np.concatenate([np.zeros((0, 3), int), *added]), np.arange(len(mesh.faces))
    beside = np.zeros(len(mesh.vertices), int)
    beside[mesh.faces] = whole[:, None]
    rows = np.append(whole, beside[new[:, 0]])
    found = _of(mesh, mesh.vertices, np.concatenate([mesh.faces, new]), rows)
    found.face_attributes["cap"][len(whole) :] = np.repeat(range(1, len(added) + 1), [len(cap) for cap in added])
    is_flat = (found.area_faces[len(whole) :] <= _NO_AREA * mesh.extents.max() ** 2).any()
    if is_flat or len(_open(found.faces)):
        raise InvalidInput(f"object.file must be a closed surface, got open edges: {_places(mesh, left)}")
    return found, [f"holes closed: {len(added)}, of open edges: {_places(mesh, left)}"]


def _outwards(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Shells of no thickness left out; those turned that are inside out, but for cavities, which lie in another one."""
    shell = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(mesh.faces))
    first, second, third = mesh.triangles.swapaxes(0, 1)
    volumes = np.bincount(shell, np.einsum("ti,ti->t", first, np.cross(second, third))) / 6
    flat = 2 * np.abs(volumes) < _GAP * mesh.extents.max() * np.bincount(shell, mesh.area_faces)
    others = np.flatnonzero(volumes > 0)
    wrong = [
        k
        for k in np.flatnonzero((volumes < 0) & ~flat)
        if sum(_within(first[shell == k][0], mesh.triangles[shell == j]) for j in others) % 2 == 0
    ]
    if not wrong and not flat.any():
        return mesh, []
    faces = mesh.faces.copy()
    faces[np.isin(shell, wrong)] = faces[np.isin(shell, wrong)][:, ::-1]
    said = {"shells of no thickness left out": int(flat.sum()), "inverted shells turned": len(wrong)}
    thick = np.flatnonzero(~flat[shell])
    return _of(mesh, mesh.vertices, faces[thick], thick), [f"{what}: {n}" for what, n in said.items() if n]


def _within(point: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether a point is inside of closed triangles, by the angle that they fill (van Oosterom and Strackee 1983)."""
    a, b, c = (triangles - point).swapaxes(0, 1)
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    dots = [np.einsum("ti,ti->t", *pair) for pair in ((a, b), (b, c), (c, a))]
    below = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    filled = 2 * np.arctan2(np.einsum("ti,ti->t", a, np.cross(b, c)), below).sum()
    return abs(filled) > 2 * np.pi


def _parted(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """Where surfaces touch in an edge each gets a vertex of its own in its middle, so that an edge has two sides.

    Around an edge the triangles between which there is material belong together.
    """
    halves = np.sort(_halves(mesh.faces), 1)
    edges, which = different(halves)
    touching = np.flatnonzero(np.bincount(which) > 2)
    if not touching.size:
        return mesh, []
    faces, vertices = mesh.faces.tolist(), mesh.vertices.tolist()
    pieces, sources = {i: [i] for i in range(len(faces))}, list(range(len(faces)))
    for edge in touching:
        middle = mesh.vertices[edges[edge]].mean(0).tolist()
        for pair in _around(mesh, np.flatnonzero(which == edge)):
            for face in pair:
                _halved(faces, pieces[face], set(edges[edge].tolist()), len(vertices))
                sources.append(face)
            vertices.append(middle)
    found = _of(mesh, np.array(vertices), np.array(faces), np.array(sources))
    return found, [f"edges in which surfaces touch parted: {touching.size}"]


def _halved(faces: list[list[int]], pieces: list[int], edge: set[int], middle: int) -> None:
    """Of pieces of a triangle the one at an edge is halved by a vertex in its middle."""
    at = next(i for i in pieces if edge <= set(faces[i]))
    k = next(k for k in range(3) if faces[at][k] not in edge)
    apex, start, stop = faces[at][k], faces[at][k - 2], faces[at][k - 1]
    pieces.append(len(faces))
    faces[at] = [start, middle, apex]
    faces.append([middle, stop, apex])


def _around(mesh: trimesh.Trimesh, halves: np.ndarray) -> Iterator[tuple[int, int]]:
    """Pairs of triangles between which there is material, of the half edges of one edge."""
    face, side = halves % len(mesh.faces), halves // len(mesh.faces)
    start, stop, apex = (mesh.vertices[mesh.faces[face, (side + k) % 3]] for k in range(3))
    forward = mesh.faces[face, side] == mesh.faces[face[0], side[0]]
    along = (stop - start)[0] / np.linalg.norm((stop - start)[0])
    away = apex - start
    away = away - (away @ along)[:, None] * along
    beside = np.cross(along, away[0])
    angle = np.arctan2(away @ beside / np.linalg.norm(beside), away @ away[0] / np.linalg.norm(away[0]))
    angle = np.round(angle % (2 * np.pi) / _SAME) % np.round(2 * np.pi / _SAME)
    waiting: list[int] = []
    paired = np.zeros(len(halves), bool)
    for k in 2 * np.lexsort([forward, -angle]).tolist():  # behind a triangle that passes forward there is material
        if paired[k]:
            continue
        if forward[k]:
            waiting += [k] * (k not in waiting)
        elif waiting:
            paired[[k, waiting[-1]]] = True
            yield int(face[waiting.pop()]), int(face[k])


def _of(mesh: trimesh.Trimesh, vertices: np.ndarray, faces: np.ndarray, rows: np.ndarray) -> trimesh.Trimesh:
    """Triangles that were made of those of a mesh in ``rows``."""
    carried = {name: values[rows] for name, values in mesh.face_attributes.items()}
    found = trimesh.Trimesh(vertices, faces, face_attributes=carried, process=False)
    found.remove_unreferenced_vertices()
    return found


def _halves(faces: np.ndarray) -> np.ndarray:
    """Edges of each triangle the way around it, those from the first corners first, (3 F, 2)."""
    return np.concatenate([faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])


def _open(faces: np.ndarray) -> np.ndarray:
    """Edges that triangles pass one way more often than the other, that way, (n, 2)."""
    halves = _halves(faces)
    way = np.where(halves[:, 0] < halves[:, 1], 1, -1)
    edges, which = different(np.sort(halves, 1))
    balance = np.bincount(which, way)
    return np.where(balance[:, None] > 0, edges, edges[:, ::-1])[balance != 0]


def _places(mesh: trimesh.Trimesh, edges: np.ndarray) -> str:
    """How many, and where the longest of them are."""
    length = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    longest = mesh.vertices[edges[np.argsort(-length, kind="stable")[:SAID]]].mean(1)
    return f"{len(edges)}, at {listed(longest)}"
