"""From a triangle mesh to a solid: coplanar triangles become faces, what separates them edges and circles."""

from __future__ import annotations

import io
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from scenes.errors import InvalidInput
from scenes.files import Unreadable, read_bytes
from scenes.parts.solid import Circle, Edge, Solid

FORMATS = (".stl", ".ply", ".obj")
MOST_BYTES = 32 << 20
MOST_TRIANGLES = 20_000
MOST_FACES = 2_000  # plane ones: what is computed grows with the square of their edges
_FARTHEST = 1e9  # beyond, its faces cannot be told to be flat
_PLAIN = {"obj": {"skip_materials": True}}
_FLAT = 1e-4  # rad; single-precision files are flat to about 1e-6
_MIN_SEGMENTS = 12  # a loop of fewer straight edges is a polygon, not a circle
_ROUND = 1e-3  # of the radius: how far a circle's vertices may be off it


def read(path: Path, scale: float = 1.0) -> Solid:
    """Solid from an STL, PLY or OBJ file, its lengths multiplied by ``scale``.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or its surface is not closed.
    """
    if path.suffix.lower() not in FORMATS:
        raise InvalidInput(f"object.file must be one of {', '.join(FORMATS)}, got {path.name!r}")
    try:
        data, kind = read_bytes(path, MOST_BYTES), path.suffix.lower()[1:]
    except Unreadable as error:
        raise InvalidInput(f"object.file must be a readable mesh, got {path} ({error.reason})") from None
    _check_told(path, data, kind)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            # without a resolver: a texture or a material beside the file is none of our business
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, resolver=None, **_PLAIN.get(kind, {}))
    except ImportError:  # the reader's guess at the text's encoding
        raise InvalidInput(f"object.file must be a readable mesh, got {path} (text that is not UTF-8)") from None
    except Exception as error:  # every reader raises its own
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InvalidInput(f"object.file must be a readable mesh, got {path} ({reason})") from None
    if isinstance(mesh, trimesh.Trimesh):
        _check_mesh(path, mesh)
        if scale != 1:
            mesh.vertices *= scale
    with np.errstate(all="ignore"):
        return solid(mesh)


def _check_told(path: Path, data: bytes, kind: str) -> None:
    """Refuse what says of itself that it is too large, before memory is taken for it."""
    told = 0
    if kind == "stl" and len(data) >= 84 and data.lstrip()[:5].lower() != b"solid":
        told = int.from_bytes(data[80:84], "little")
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
    if len(mesh.vertices) and not (np.isfinite(mesh.vertices).all() and np.abs(mesh.vertices).max() <= _FARTHEST):
        raise InvalidInput(f"object.file must have coordinates up to {_FARTHEST:g}, got others in {path}")


def solid(mesh: trimesh.Trimesh) -> Solid:
    """Solid from a closed mesh.

    Vertices are named v1, v2, ... in the order of their (x, y, z), edges e1, e2, ... in the order of their ends,
    circles c1, c2, ... in the order of their centres. Collinear pieces of an edge become one edge.

    Raises
    ------
    InvalidInput
        If the surface is not closed and consistently oriented.

    Examples
    --------
    >>> box = solid(trimesh.creation.box((2, 2, 2)))
    >>> len(box.vertices), len(box.faces), len(box.edges), box.is_convex
    (8, 6, 12, True)
    """
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InvalidInput("object.file must hold triangles, got none")
    mesh.merge_vertices()
    if not mesh.is_volume:
        raise InvalidInput("object.file must be a closed surface with outward normals, got an open or inverted one")
    group = _planes(mesh)
    if group.max() >= MOST_FACES:
        raise InvalidInput(f"object.file must have at most {MOST_FACES} plane faces, got {group.max() + 1}")
    pieces = _pieces(mesh, group)
    chains = _straight_chains(mesh.vertices, pieces)
    used = np.unique([end for chain in chains for end in chain[0]])
    used = used[np.lexsort(np.round(mesh.vertices[used], 9).T[::-1])]
    number = {int(old): new for new, old in enumerate(used)}
    raw = sorted((tuple(sorted((number[a], number[b]))), faces, convex) for (a, b), faces, convex in chains)
    edges = tuple(Edge(f"e{i}", *facts) for i, facts in enumerate(raw, 1))
    vertices = np.array(mesh.vertices[used])
    loops = [_loops(mesh.faces[group == f], number, vertices) for f in range(group.max() + 1)]
    bare = Solid(
        vertex_names=tuple(f"v{i}" for i in range(1, len(used) + 1)),
        vertices=vertices,
        faces=tuple(face[0] for face in loops),
        edges=edges,
        triangles=np.array(mesh.triangles),
        triangle_faces=group,
    )
    return replace(bare, circles=_circles(bare, loops))


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
    flat = mesh.face_adjacency[mesh.face_adjacency_angles < _FLAT]
    count = len(mesh.faces)
    graph = coo_array((np.ones(len(flat)), flat.T), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _pieces(mesh: trimesh.Trimesh, group: np.ndarray) -> dict[tuple[int, int], tuple[tuple[int, int], bool]]:
    """Mesh edges between two faces: ends to (faces, convex)."""
    pairs = group[mesh.face_adjacency]
    sharp = pairs[:, 0] != pairs[:, 1]
    return {
        (int(a), int(b)): (tuple(sorted(map(int, faces))), bool(convex))
        for (a, b), faces, convex in zip(
            mesh.face_adjacency_edges[sharp], pairs[sharp], mesh.face_adjacency_convex[sharp], strict=True
        )
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


def _loops(triangles: np.ndarray, number: dict[int, int], vertices: np.ndarray) -> list[tuple[int, ...]]:
    """Boundaries of a face, the outer (longest) one first, as numbers of the solid's vertices."""
    halves = {(int(a), int(b)) for t in triangles for a, b in zip(t, np.roll(t, -1), strict=True)}
    after: dict[int, list[int]] = {}
    for a, b in halves:
        if (b, a) not in halves:
            after.setdefault(a, []).append(b)
    loops = []
    while after:
        start = here = next(iter(after))
        loop = []
        while here in after:
            loop.append(here)
            onward = after[here].pop()
            if not after[here]:
                del after[here]
            here = onward
            if here == start:
                break
        loops.append(tuple(number[v] for v in loop if v in number))
    return sorted(loops, key=lambda loop: -_length(vertices[list(loop)]))


def _length(points: np.ndarray) -> float:
    return float(np.linalg.norm(points - np.roll(points, 1, 0), axis=1).sum())


def _circles(bare: Solid, loops: list[list[tuple[int, ...]]]) -> tuple[Circle, ...]:
    """Loops of a face whose vertices lie on a circle."""
    names = {frozenset(edge.ends): edge for edge in bare.edges}
    found = []
    for face, boundaries in enumerate(loops):
        for loop in boundaries:
            if len(loop) < _MIN_SEGMENTS:
                continue
            points = bare.vertices[list(loop)]
            centre = points.mean(0)
            away = np.linalg.norm(points - centre, axis=1)
            if np.ptp(away) > _ROUND * away.mean():
                continue
            edges = [names[frozenset(pair)] for pair in zip(loop, loop[1:] + loop[:1], strict=True)]
            wall = next(f for f in edges[0].faces if f != face)
            towards = (centre - bare.vertices[edges[0].ends[0]]) @ bare.normals[wall] > 0
            found.append((tuple(np.round(centre, 9)), centre, away.mean(), face, edges, bool(towards)))
    found.sort(key=lambda facts: facts[0])
    return tuple(
        Circle(f"c{i}", centre, bare.normals[face], float(radius), face, tuple(e.name for e in edges), hole)
        for i, (_, centre, radius, face, edges, hole) in enumerate(found, 1)
    )
