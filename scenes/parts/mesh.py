"""From a triangle mesh to a solid: coplanar triangles become faces, what separates them edges and circles."""

from __future__ import annotations

import gc
import io
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count, pairwise
from pathlib import Path

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from scenes.errors import InvalidInput
from scenes.files.door import Unreadable, read_bytes
from scenes.parts import bodies, caps
from scenes.parts.arcs import arcs
from scenes.parts.chains import Chain
from scenes.parts.facets import Facets, facets
from scenes.parts.joined import joined
from scenes.parts.mend import mended
from scenes.parts.mesh_file import SAY_UNIT
from scenes.parts.rims import Rim, boundaries, rims
from scenes.parts.solid import Circle, Edge, Solid, summed_areas
from scenes.units import Unit, in_unit

_PLAINLY = (".stl", ".ply", ".obj")  # one body, in no unit
FORMATS = (*_PLAINLY, *SAY_UNIT)
MOST_BYTES = 64 << 20
MOST_TRIANGLES = 1_000_000
_FARTHEST = 1e9  # beyond, its faces cannot be told to be flat
_PLAIN = {"obj": {"skip_materials": True}}
_STL_HEAD, _STL_TRIANGLE = 84, 50  # bytes of a binary file
_FLAT = 1e-4  # rad; single-precision files are flat to about 1e-6
_SINGLE = 3e-7  # of the largest coordinate: what single precision leaves of a height


def read(path: Path, scale: float | None = 1.0, unit: Unit = "mm", body: str | int | None = None) -> Solid:
    """Solid from an STL, PLY, OBJ, GLB or 3MF file.

    Parameters
    ----------
    path : Path
    scale : float, optional
        What its lengths are multiplied by. None: GLB and 3MF files say their unit, and are brought to ``unit``; others
        stay as they are.
    unit : {"mm", "cm", "m", "inch"}
    body : str or int, optional
        Name or number of one of several bodies (GLB, 3MF); all where not given.

    Raises
    ------
    InvalidInput
        If the file cannot be read, there is no such body, or its surface is not closed.
    """
    if path.suffix.lower() not in FORMATS:
        raise InvalidInput(f"object.file must be one of {', '.join(FORMATS)}, got {path.name!r}")
    try:
        data, kind = read_bytes(path, MOST_BYTES), path.suffix.lower()[1:]
    except Unreadable as error:
        raise InvalidInput(f"object.file must be a readable mesh, got {path} ({error.reason})") from None
    if body is not None and f".{kind}" in _PLAINLY:
        raise InvalidInput(f"object.body must be left out for a {kind.upper()} file, which is one body, got {body!r}")
    _check_told(path, data, kind)
    told = 1.0
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            if f".{kind}" in SAY_UNIT:
                several, millimetres = bodies.read(path, data, MOST_TRIANGLES)
                mesh, told = bodies.chosen(several, body) if several else None, in_unit(millimetres, "mm", unit)
            else:  # without a resolver: a texture or a material beside the file is none of our business
                mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, resolver=None, **_PLAIN.get(kind, {}))
    except InvalidInput:
        raise
    except ImportError:  # the reader's guess at the text's encoding
        raise InvalidInput(f"object.file must be a readable mesh, got {path} (text that is not UTF-8)") from None
    except Exception as error:  # every reader raises its own
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InvalidInput(f"object.file must be a readable mesh, got {path} ({reason})") from None
    if isinstance(mesh, trimesh.Trimesh):
        _check_mesh(path, mesh)
        factor = told if scale is None else scale
        if factor != 1:
            mesh.vertices *= factor
    with np.errstate(all="ignore"):
        return solid(mesh)


def _check_told(path: Path, data: bytes, kind: str) -> None:
    """Refuse what says of itself that it is too large, before memory is taken for it, and what is cut off."""
    told = 0
    if kind == "stl" and len(data) >= _STL_HEAD and (data.lstrip()[:5].lower() != b"solid" or data[_STL_HEAD - 1] == 0):
        told = int.from_bytes(data[80:_STL_HEAD], "little")
        there = (len(data) - _STL_HEAD) // _STL_TRIANGLE
        if there < told <= MOST_TRIANGLES:
            raise InvalidInput(
                f"object.file must be a whole file, got {path}, cut off after {there} of {told} triangles"
            )
    if kind == "ply":
        counts = re.findall(rb"element\s+\w+\s+(\d{1,20})", data[:10_000])
        told = max(map(int, counts), default=0)
    if told > MOST_TRIANGLES:
        raise InvalidInput(f"object.file must be of at most {MOST_TRIANGLES} triangles, got {path} with {told}")


def _check_mesh(path: Path, mesh: trimesh.Trimesh) -> None:
    if len(mesh.faces) > MOST_TRIANGLES:
        raise InvalidInput(
            f"object.file must be of at most {MOST_TRIANGLES} triangles, got {path} with {len(mesh.faces)}"
        )
    if mesh.vertices.shape[1] != 3:
        raise InvalidInput(
            f"object.file must have places of three coordinates, got {path} with {mesh.vertices.shape[1]} of each"
        )
    if len(mesh.vertices) and not (np.isfinite(mesh.vertices).all() and np.abs(mesh.vertices).max() <= _FARTHEST):
        raise InvalidInput(f"object.file must have coordinates up to {_FARTHEST:g}, got others in {path}")


Told = Callable[[np.ndarray, np.ndarray, np.ndarray], Facets]


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without a search for cycles among the many small records that are made: it takes up to a third of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


@_uncollected()
def solid(mesh: trimesh.Trimesh, told: Told | None = None) -> Solid:
    """Solid from a mesh, mended where it is clear how (`scenes.parts.mend`).

    Coplanar triangles become faces, collinear pieces one edge. Vertices where sharp edges meet are named v1, v2, ... in
    the order of their (x, y, z), sharp edges e1, e2, ... in the order of their ends, circles c1, c2, ... in that of
    their centres, then arcs of circles in that of their middles, plane faces f1, f2, ... in that of their centroids.
    The rest is there to hide, shade and be seen, but to measure nothing by: pieces of a circle c1.1, c1.2, ..., of
    other curved edges r1, ..., edges inside curved surfaces s1, ..., their vertices p1, ...

    Raises
    ------
    InvalidInput
        If the surface cannot be closed; the message says where.

    Examples
    --------
    >>> box = solid(trimesh.creation.box((2, 2, 2)))
    >>> len(box.vertices), len(box.faces), len(box.sharp), box.is_convex
    (8, 6, 12, True)
    >>> rod = solid(trimesh.creation.cylinder(1, 4, sections=96))
    >>> len(rod.sharp), [circle.name for circle in rod.circles], round(rod.circle("c1").radius, 9)
    (0, ['c1', 'c2'], 1.0)
    """
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InvalidInput("object.file must hold triangles, got none")
    mesh, said = mended(mesh)
    group = _planes(mesh)
    chains = _straight_chains(np.asarray(mesh.vertices), _pieces(mesh, group))
    if not chains:  # nearly flat: all its triangles count as coplanar
        raise InvalidInput("object.file must have faces that meet at an angle, got triangles that are all coplanar")
    normals, areas = _normals(mesh, group)
    loops, vertices = _loops(mesh, group, chains, normals), np.asarray(mesh.vertices)  # a mesh tracks its arrays
    circular = sorted(rims(loops, vertices, normals), key=lambda rim: _place(rim.centre, mesh.extents.max()))
    if told is None:
        known = facets(vertices, chains, normals, areas, circular)
    else:
        known = _told(told, mesh, group, chains, circular)
    filled = ~np.isin(np.arange(len(loops)), group[mesh.face_attributes["cap"] == 0])
    capped = caps.unknown(chains, normals, filled)
    if capped.any():
        known, circular = caps.bordered(known, chains, capped), caps.clear_of(circular, chains, capped)
    circular = _edged(circular, chains, known.smooth)
    whole = joined(vertices, chains, normals, known.beside, known.kinds == "sharp")
    pieces = [(chain, "sharp") for chain in whole]
    pieces += [(chain, kind) for chain, kind in zip(chains, known.kinds.tolist(), strict=True) if kind != "sharp"]
    used = np.unique([end for chain in chains for end in chain[0]])
    plain = _assembled(mesh, group, used, pieces, loops, circular)
    found = replace(
        plain, mended=(*said, *caps.said(mesh, group, capped)), triangle_sources=mesh.face_attributes["source"],
        regions=known.region, caps=tuple(np.flatnonzero(capped).tolist()),
    )  # fmt: skip
    return replace(found, arcs=arcs(found))


def _edged(circular: list[Rim], chains: list[Chain], smooth: np.ndarray) -> list[Rim]:
    """Those circles that are edges, for most of their pieces are none between surfaces that continue each other."""
    none = {frozenset(chain[0]) for chain, flat in zip(chains, smooth, strict=True) if flat}
    return [rim for rim in circular if 2 * sum(frozenset(piece) in none for piece in rim.pieces) <= len(rim.pieces)]


def _told(told: Told, mesh: trimesh.Trimesh, group: np.ndarray, chains: list[Chain], circular: list[Rim]) -> Facets:
    """What is told of the chains; pieces of circles are none of straight edges."""
    beside, between = {}, np.sort(group[mesh.face_adjacency], 1).tolist()
    for (a, b), pair, faces in zip(
        mesh.face_adjacency_edges.tolist(), mesh.face_adjacency.tolist(), map(tuple, between), strict=True
    ):
        beside[a, faces] = beside[b, faces] = pair
    source = mesh.face_attributes["source"]
    sources = source[np.array([beside[ends[0], faces] for ends, faces, _ in chains])]
    first = np.unique(group, return_index=True)[1]
    found = told(mesh.vertices[np.array([chain[0] for chain in chains])], sources, source[first])
    of_circles = {frozenset(piece) for rim in circular for piece in rim.pieces}
    rim = np.array([frozenset(chain[0]) in of_circles for chain in chains])
    return replace(found, rim=found.rim | rim & ~found.smooth)


def _assembled(mesh, group: np.ndarray, used: np.ndarray, pieces, loops, circular: list[Rim]) -> Solid:
    """The solid, its parts numbered and named."""
    used = used[np.lexsort(np.round(mesh.vertices[used] / mesh.extents.max(), 7).T[::-1])]
    number = np.full(len(mesh.vertices), -1)
    number[used] = np.arange(len(used))
    edges = _edges(pieces, number, circular)
    corners = {v for v, many in Counter(end for e in edges if e.kind == "sharp" for end in e.ends).items() if many > 1}
    names, numbers = {"v": count(1), "p": count(1)}, number.tolist()
    bare = Solid(
        vertex_names=tuple(
            f"{kind}{next(names[kind])}" for kind in ("v" if v in corners else "p" for v in range(len(used)))
        ),
        vertices=np.array(mesh.vertices[used]),
        faces=tuple(tuple(numbers[v] for v in face[0]) for face in loops),
        holes=tuple(tuple(tuple(numbers[v] for v in hole) for hole in face[1:]) for face in loops),
        edges=edges,
        triangles=np.array(mesh.triangles),
        triangle_faces=group,
        face_names=_face_names(mesh, group),
    )
    return replace(bare, circles=_circles(bare, number, circular))


def _face_names(mesh: trimesh.Trimesh, group: np.ndarray) -> tuple[str, ...]:
    """f1, f2, ... in the order of the faces' centroids (x, y, z), then of their normals."""
    weights = np.bincount(group, mesh.area_faces)[:, None]
    sums = [np.zeros((len(weights), 3)) for _ in range(2)]
    for total, each in zip(sums, (mesh.triangles_center, mesh.face_normals), strict=True):
        np.add.at(total, group, each * mesh.area_faces[:, None])
    places = np.round(np.concatenate([sums[0] / weights / mesh.extents.max(), sums[1] / weights], 1), 6)
    names = np.empty(len(places), object)
    names[np.lexsort(places.T[::-1])] = [f"f{i}" for i in range(1, len(places) + 1)]
    return tuple(names.tolist())


def _edges(pieces: list[tuple[Chain, str]], number: np.ndarray, circular: list[Rim]) -> tuple[Edge, ...]:
    """The edges in the order of their ends, the sharp ones first."""
    piece = {frozenset(ends): (i, j) for i, rim in enumerate(circular, 1) for j, ends in enumerate(rim.pieces, 1)}
    found: dict[str, list] = {"sharp": [], "rim": [], "smooth": []}
    numbers = number.tolist()
    for (ends, faces, convex), kind in pieces:
        here = tuple(sorted(numbers[end] for end in ends))
        found[kind].append((here, faces, convex, piece.get(frozenset(ends))))
    edges = []
    for kind, letter in (("sharp", "e"), ("rim", "r"), ("smooth", "s")):
        onward = count(1)
        for ends, faces, convex, at in sorted(found[kind], key=lambda facts: facts[:3]):
            name = f"c{at[0]}.{at[1]}" if at and kind == "rim" else f"{letter}{next(onward)}"
            edges.append(Edge(name, ends, faces, convex, kind))
    return tuple(edges)


def _circles(bare: Solid, number: np.ndarray, circular: list[Rim]) -> tuple[Circle, ...]:
    found, owners = [], {frozenset(edge.ends): edge for edge in bare.edges}
    for i, rim in enumerate(circular, 1):
        pieces = [owners[frozenset(number[list(ends)].tolist())] for ends in rim.pieces]
        wall = next(f for f in pieces[0].faces if f != rim.face)
        hole = bool((rim.centre - bare.vertices[pieces[0].ends[0]]) @ bare.normals[wall] > 0)
        names = tuple(edge.name for edge in pieces)
        found.append(Circle(f"c{i}", rim.centre, bare.normals[rim.face], rim.radius, rim.face, names, hole))
    return tuple(found)


def _place(point: np.ndarray, size: float) -> tuple[float, ...]:
    """A position to sort by, the same for coaxial circles of a file in single precision."""
    return tuple(np.round(point / size, 6).tolist())


def renamed(plain: Solid, names: dict[str, tuple[float, float, float]]) -> Solid:
    """The same solid with the vertices nearest to the given positions named as wished."""
    vertex_names = list(plain.vertex_names)
    for name, position in names.items():
        away = np.linalg.norm(plain.vertices - np.array(position), axis=1)
        if away.min() > 1e-3 * np.ptp(plain.vertices, axis=0).max():
            raise InvalidInput(f"object.names.{name} must be the position of a vertex, got {list(position)}")
        vertex_names[int(away.argmin())] = name
    if len(set(vertex_names)) < len(vertex_names):
        raise InvalidInput(f"object.names must be names of their own, got {', '.join(names)}")
    return replace(plain, vertex_names=tuple(vertex_names))


def _planes(mesh: trimesh.Trimesh) -> np.ndarray:
    """Number of the plane face of each triangle."""
    pairs, apart = mesh.face_adjacency, mesh.face_adjacency_unshared
    heights = [
        np.einsum(
            "ti,ti->t", mesh.face_normals[pairs[:, k]], mesh.vertices[apart[:, 1 - k]] - mesh.vertices[apart[:, k]]
        )
        for k in (0, 1)
    ]  # of slivers the normal is uncertain in single precision, the height over the other triangle is not
    flat = mesh.face_adjacency_angles < _FLAT
    group = _connected(pairs[flat], len(mesh.faces))
    thin = (np.abs(heights).min(0) < _SINGLE * np.abs(mesh.vertices).max()) & (group[pairs[:, 0]] != group[pairs[:, 1]])
    return group if not thin.any() else _connected(_in_plane(mesh, group, group[pairs[thin]]), group.max() + 1)[group]


def _connected(pairs: np.ndarray, count: int) -> np.ndarray:
    """Number of the group of each of ``count`` things of which pairs (n, 2) belong together."""
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _in_plane(mesh: trimesh.Trimesh, group: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Which pairs (n, 2) of groups of triangles belong together: all of the smaller one lies in the larger one's plane.

    A sliver in the crease between two faces lies in both their planes; it becomes part of one, the larger.
    """
    from scipy.cluster.hierarchy import DisjointSet  # slow to load, and rarely needed

    normals, areas = _normals(mesh, group)
    middles = np.zeros_like(normals)
    np.add.at(middles, group, mesh.triangles_center * mesh.area_faces[:, None])
    middles /= np.bincount(group, mesh.area_faces)[:, None]
    order = np.argsort(group, kind="stable")
    starts = np.cumsum(np.bincount(group, minlength=len(areas)))[:-1].tolist()
    whole, parts = np.asarray(mesh.triangles)[order], pairwise([0, *starts, len(group)])
    corners = {number: whole[first:last] for number, (first, last) in enumerate(parts)}
    sets, largest, kept = DisjointSet(range(len(areas))), list(range(len(areas))), []
    unsure, size = 3 * _SINGLE * np.abs(mesh.vertices).max(), areas.tolist()
    for one, other in pairs[np.argsort(-areas[pairs].max(1), kind="stable")].tolist():
        large, small = sorted((largest[sets[each]] for each in (one, other)), key=lambda number: -size[number])
        if large == small:
            continue
        away = corners[small] - middles[large]
        near = unsure + _FLAT / 10 * np.sqrt((away**2).sum(-1))
        if (np.abs(away @ normals[large]) <= near).all() and not _folded(corners[small], normals[[large, small]], near):
            sets.merge(large, small)
            largest[sets[large]] = large
            corners[large] = np.concatenate([corners[large], corners.pop(small)])
            kept.append((one, other))
    return np.array(kept, int).reshape(-1, 2)


def _folded(triangles: np.ndarray, normals: np.ndarray, near: np.ndarray) -> bool:
    """Whether triangles (t, 3, 3) look back from the plane that they lie in; a sliver looks anywhere, and does not."""
    if normals[0] @ normals[1] >= 0:
        return False
    one, other = (triangles[:, k] - triangles[:, 0] for k in (1, 2))
    area = (np.cross(one, other) @ normals[1]).sum() / 2
    thin = near.max() * np.ptp(triangles.reshape(-1, 3), axis=0).max()
    return bool(area > thin)


def _normals(mesh: trimesh.Trimesh, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normal and area of each plane face, shape (F, 3) and (F,)."""
    sums = summed_areas(mesh.face_normals * mesh.area_faces[:, None], group, group.max() + 1)
    areas = np.linalg.norm(sums, axis=1)
    return sums / areas[:, None], areas


def _pieces(mesh: trimesh.Trimesh, group: np.ndarray) -> dict[tuple[int, int], tuple[tuple[int, int], bool]]:
    """Mesh edges between two faces: ends to (faces, convex)."""
    pairs = np.sort(group[mesh.face_adjacency], 1)
    sharp = pairs[:, 0] != pairs[:, 1]
    rows = (mesh.face_adjacency_edges[sharp], pairs[sharp], mesh.face_adjacency_convex[sharp])
    return {
        tuple(ends): (tuple(faces), convex)
        for ends, faces, convex in zip(*(each.tolist() for each in rows), strict=True)
    }


def _straight_chains(vertices: np.ndarray, pieces: dict) -> list[tuple[tuple[int, int], tuple[int, int], bool]]:
    """Pieces between the same two faces, joined where they meet in a straight line: (ends, faces, convex)."""
    chains = [(ends, *facts) for ends, facts in pieces.items()]
    meeting: dict[int, list[int]] = {}
    for i, (ends, *_) in enumerate(chains):
        for end in ends:
            meeting.setdefault(end, []).append(i)
    for vertex, found in meeting.items():
        if len(found) != 2 or chains[found[0]][1:] != chains[found[1]][1:]:
            continue
        (i, j), far = found, [next(e for e in chains[k][0] if e != vertex) for k in found]
        away = [vertices[f] - vertices[vertex] for f in far]
        if far[0] != far[1] and np.dot(*away) < -(1 - _FLAT**2) * np.prod(np.linalg.norm(away, axis=1)):
            chains[i] = (tuple(far), *chains[i][1:])
            chains[j] = None
            meeting[far[1]][meeting[far[1]].index(j)] = i
    return [chain for chain in chains if chain is not None]


def _loops(mesh: trimesh.Trimesh, group: np.ndarray, chains: list[Chain], normals: np.ndarray) -> list[list[tuple]]:
    """Boundaries of each face."""
    kept = np.zeros(len(mesh.vertices), bool)
    kept[[end for chain in chains for end in chain[0]]] = True
    vertices, there = np.asarray(mesh.vertices), kept.tolist()
    faces = mesh.faces[np.argsort(group, kind="stable")].tolist()
    ends = np.cumsum(np.bincount(group)).tolist()
    parts = (faces[first:last] for first, last in pairwise([0, *ends]))
    return [boundaries(part, there, vertices, normal) for part, normal in zip(parts, normals, strict=True)]
