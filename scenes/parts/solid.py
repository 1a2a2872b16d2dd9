"""The geometry of an object: vertices, plane faces, the edges where two faces meet, and circular edges."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from scenes.parts.curved import Curved
from scenes.parts.rows import different
from scenes.parts.surfaces import axes_beside

if TYPE_CHECKING:
    import trimesh

_SLIGHT = np.cos(np.radians(6.0))  # facets of a round wall are told from its shading by the third digit
_MANY = 2000  # vertices, of which those on the convex hull are looked for; faces at a time
_AT_ONCE = 64  # vertices that are asked whether they stand over faces
_FLAT = 1e-7  # of the object's size: how far a vertex may stand over a face of a convex solid
_FOLDED = 1e-9  # of the area of the triangles of a face: area vectors of a face that add up to no more cancel


@dataclass(frozen=True)
class Edge:
    """A straight edge: its two end vertices and the two faces that meet in it (indices).

    ``convex`` is False for an inner edge, where the two faces look at each other. Only a ``sharp`` edge is one of the
    part; a ``rim`` stands for a piece of a curved edge, a ``smooth`` one lies inside a curved surface.
    """

    name: str
    ends: tuple[int, int]
    faces: tuple[int, int]
    convex: bool = True
    kind: Literal["sharp", "rim", "smooth"] = "sharp"


@dataclass(frozen=True, eq=False)
class Circle:
    """A circular edge: the rim of a hole, or the end of a cylinder; whole, or an arc of one.

    Attributes
    ----------
    name : str
    centre, axis : ndarray, shape (3,)
        Centre, and unit normal of the plane face that it bounds, outwards.
    radius : float
        Its length.
    face : int
        The plane face.
    edges : tuple of str
        The straight edges that stand for it in the mesh.
    hole : bool
        Whether the wall looks towards the axis.
    ends : ndarray, shape (2, 3), optional
        Of an arc the places where it begins and ends, counter-clockwise around the axis; None of a whole circle.
    """

    name: str
    centre: np.ndarray
    axis: np.ndarray
    radius: float
    face: int
    edges: tuple[str, ...]
    hole: bool
    ends: np.ndarray | None = None

    @cached_property
    def turn(self) -> float:
        """How much of a turn it takes, rad: 2 pi for a whole circle."""
        if self.ends is None:
            return 2 * math.pi
        first, last = self.ends - self.centre
        return math.atan2(np.cross(first, last) @ self.axis, first @ last) % (2 * math.pi)

    @cached_property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Two perpendicular unit vectors (3,) in its plane; angles go around it from the first to the second."""
        return axes_beside(self.axis)

    @cached_property
    def begin(self) -> float:
        """Angle at which it begins, rad: 0 for a whole circle."""
        if self.ends is None:
            return 0.0
        one, two = self.axes
        first = self.ends[0] - self.centre
        return math.atan2(first @ two, first @ one)

    def angles(self, count: int) -> np.ndarray:
        """The middles of so many equal steps all around it, or from one end to the other, rad, shape (count,)."""
        return self.begin + self.turn * (np.arange(count) + 0.5) / count

    def steps(self, angle: np.ndarray, count: int) -> np.ndarray:
        """Which of those middles angles are, numbers between too: beside a whole circle's last is its first, beyond an
        arc's last it is still that."""
        step = (angle - self.begin) / self.turn * count - 0.5
        return step % count if self.ends is None else np.clip(step, 0, count - 1)

    def spokes(self, angle: np.ndarray) -> np.ndarray:
        """Unit vectors from its centre at angles (n,), shape (n, 3)."""
        one, two = self.axes
        return np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Places of it at angles (n,), shape (n, 3)."""
        return self.centre + self.radius * self.spokes(angle)

    def joined(self, shown: np.ndarray) -> np.ndarray:
        """Which pieces from each of such places to the next count, bool (..., n), of places that do: an arc's last goes
        back to its first place and is none."""
        return shown if self.ends is None else np.append(shown[..., :-1], np.zeros_like(shown[..., -1:]), -1)

    def around(self, count: int) -> np.ndarray:
        """So many places around it, or from one end to the other, in equal steps, shape (count, 3)."""
        return self.at(self.begin + np.linspace(0, self.turn, count))


@dataclass(frozen=True, eq=False)
class Solid:
    """A polyhedron, in object coordinates; it may be hollow, not convex, or in several pieces.

    Attributes
    ----------
    vertex_names : tuple of str
        One name a vertex.
    vertices : ndarray, shape (V, 3)
        Positions.
    faces : tuple of tuple of int
        Vertex indices of each face's outer boundary, counter-clockwise seen from outside.
    edges : tuple of Edge
    triangles : ndarray, shape (T, 3, 3), optional
        Corners of triangles that cover the faces exactly, holes left out; fans of the boundaries when not given.
    triangle_faces : ndarray of int, shape (T,), optional
        The face of each triangle.
    circles : tuple of Circle
        Whole ones.
    holes : tuple of tuple of tuple of int
        Vertex indices of each face's inner boundaries, clockwise seen from outside; empty where no face has any.
    face_names : tuple of str
        One name a face; f1, f2, ... when not given.
    curved : tuple of Curved
        Surfaces that some of the faces stand for.
    triangle_sources : ndarray of int, shape (T,), optional
        Numbers of the file's triangles of which they are pieces.
    mended : tuple of str
        What was done to a file's triangles to make them a closed surface.
    regions : ndarray of int, shape (F,), optional
        Number of the curved surface that each face is a facet of, those that continue it smoothly among them; -1 for
        plane faces. Where not given, faces at a smooth edge are facets.
    arcs : tuple of Circle
        Circular edges that are no whole circles.
    caps : tuple of int
        Numbers of the faces that close what a file leaves open: nobody knows what is there.
    """

    vertex_names: tuple[str, ...]
    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    edges: tuple[Edge, ...]
    triangles: np.ndarray | None = None
    triangle_faces: np.ndarray | None = None
    circles: tuple[Circle, ...] = ()
    holes: tuple[tuple[tuple[int, ...], ...], ...] = ()
    face_names: tuple[str, ...] = ()
    curved: tuple[Curved, ...] = ()
    triangle_sources: np.ndarray | None = None
    mended: tuple[str, ...] = ()
    regions: np.ndarray | None = None
    arcs: tuple[Circle, ...] = ()
    caps: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not self.face_names:
            object.__setattr__(self, "face_names", tuple(f"f{i}" for i in range(1, len(self.faces) + 1)))
        if self.triangles is None:
            fans = np.array([(f, face[0], *pair) for f, face in enumerate(self.faces) for pair in pairwise(face[1:])])
            object.__setattr__(self, "triangles", self.vertices[fans[:, 1:]])
            object.__setattr__(self, "triangle_faces", fans[:, 0])

    @cached_property
    def normals(self) -> np.ndarray:
        """Outward unit normal of each face, shape (F, 3)."""
        return self._areas / np.linalg.norm(self._areas, axis=1, keepdims=True)

    @cached_property
    def areas(self) -> np.ndarray:
        """Of each face, shape (F,)."""
        return np.linalg.norm(self._areas, axis=1) / 2

    @cached_property
    def _areas(self) -> np.ndarray:
        """Along each face's normal, twice its area, shape (F, 3)."""
        corners = self.triangles
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
        return summed_areas(areas, self.triangle_faces, len(self.faces))

    @cached_property
    def triangle_corners(self) -> tuple[np.ndarray, np.ndarray]:
        """The different corners of all triangles, (P, 3), and which of them each triangle has, (T, 3)."""
        points, number = different(self.triangles.reshape(-1, 3))
        return points, number.reshape(-1, 3)

    @cached_property
    def offsets(self) -> np.ndarray:
        """Distance of each face's plane from the origin along its normal, shape (F,)."""
        anchors = self.vertices[[face[0] for face in self.faces]]
        return np.einsum("fi,fi->f", self.normals, anchors)

    @cached_property
    def extent(self) -> float:
        """Largest extent along an axis, wherever it stands."""
        return float(np.ptp(self.vertices, axis=0).max())

    @cached_property
    def outer(self) -> np.ndarray:
        """Which faces lie on the convex hull, so that no vertex stands over them; bool, shape (F,)."""
        corners = self.vertices
        if len(corners) > _MANY:
            from scipy.spatial import ConvexHull  # half a second to load, which a block does not need

            corners = corners[ConvexHull(corners).vertices]
        left, parts = np.arange(len(self.faces)), max(1, len(corners) // _AT_ONCE)
        for part in (corners[k::parts] for k in range(parts)):  # over most faces one of the first few stands
            some = (left[i : i + _MANY] for i in range(0, len(left), _MANY))
            highest = [(part @ self.normals[faces].T).max(0) for faces in some]
            left = left[np.concatenate(highest) - self.offsets[left] <= _FLAT * self.extent] if highest else left
        found = np.zeros(len(self.faces), bool)
        found[left] = True
        return found

    @cached_property
    def is_convex(self) -> bool:
        """Whether all faces are outer ones: nothing then hides or shadows another part."""
        return bool(self.outer.all())

    @cached_property
    def _hull(self) -> tuple[np.ndarray, np.ndarray]:
        """Planes (normals, offsets) of the convex hull."""
        if self.is_convex:
            return self.normals, self.offsets
        from scipy.spatial import ConvexHull

        planes = ConvexHull(self.vertices).equations
        return planes[:, :3], -planes[:, 3]

    def height_above(self, point: np.ndarray) -> float:
        """How far a point lies outside the nearest plane of the convex hull, scene units; zero or less in or on it."""
        normals, offsets = self._hull
        return float(np.max(normals @ point - offsets))

    def vertex(self, name: str) -> np.ndarray:
        """Position of the named vertex, shape (3,)."""
        return self.vertices[self.vertex_names.index(name)]

    @cached_property
    def _edge_of_name(self) -> dict[str, Edge]:
        return {edge.name: edge for edge in self.edges}

    def edge(self, name: str) -> Edge:
        """The named edge."""
        return self._edge_of_name[name]

    @cached_property
    def sharp(self) -> tuple[Edge, ...]:
        """The sharp edges: those of the part itself, by which it can be measured."""
        return tuple(edge for edge in self.edges if edge.kind == "sharp")

    @cached_property
    def lines(self) -> tuple[Edge, ...]:
        """The sharp edges, and pieces of curved ones that are no circular edges: with `rims` all edges of the part."""
        of_rims = {name for rim in self.rims for name in rim.edges}
        return tuple(e for e in self.edges if e.kind == "sharp" or (e.kind == "rim" and e.name not in of_rims))

    @cached_property
    def slight(self) -> frozenset[str]:
        """Names of the edges inside of curved surfaces at which it bends by less than 6 degrees.

        They are of the facets, not of the part: no boundary where both sides are seen.
        """
        smooth = [edge for edge in self.edges if edge.kind == "smooth"]
        one, two = self.normals[np.array([edge.faces for edge in smooth], int).reshape(-1, 2)].swapaxes(0, 1)
        return frozenset(
            edge.name for edge, cosine in zip(smooth, (one * two).sum(1), strict=True) if cosine >= _SLIGHT
        )

    def length(self, edge: Edge) -> float:
        """Of an edge, scene units."""
        return float(np.linalg.norm(np.subtract(*self.vertices[list(edge.ends)])))

    @cached_property
    def plane(self) -> np.ndarray:
        """Faces that are no facets of a curved surface; bool, shape (F,)."""
        if self.regions is not None:
            return self.regions < 0
        found = np.ones(len(self.faces), bool)
        found[[face for edge in self.edges if edge.kind == "smooth" for face in edge.faces]] = False
        return found

    @cached_property
    def meeting(self) -> dict[int, tuple[Edge, ...]]:
        """Of each vertex's number all edges that end there, those of curved surfaces too, in their order."""
        found: dict[int, list[Edge]] = {}
        for edge in self.edges:
            for end in edge.ends:
                found.setdefault(end, []).append(edge)
        return {end: tuple(edges) for end, edges in found.items()}

    @cached_property
    def faces_at(self) -> dict[int, set[int]]:
        """Of each vertex's number the faces whose outline has it."""
        found: dict[int, set[int]] = {}
        for face, loop in enumerate(self.faces):
            for vertex in loop:
                found.setdefault(vertex, set()).add(face)
        return found

    def edges_at(self, vertex: str) -> tuple[Edge, ...]:
        """All sharp edges that end in the named vertex."""
        index = self.vertex_names.index(vertex)
        return tuple(edge for edge in self.sharp if index in edge.ends)

    @cached_property
    def corner_names(self) -> tuple[str, ...]:
        """Names of the vertices in which sharp edges meet."""
        there = Counter(end for edge in self.sharp for end in edge.ends)
        return tuple(name for i, name in enumerate(self.vertex_names) if there[i] > 1)

    @property
    def rims(self) -> tuple[Circle, ...]:
        """The circular edges: whole circles, then arcs."""
        return self.circles + self.arcs

    def circle(self, name: str) -> Circle:
        """The named circular edge."""
        return next(circle for circle in self.rims if circle.name == name)

    def round(self, name: str) -> Circle | Curved:
        """The named circular edge or curved surface."""
        return next(each for each in (*self.rims, *self.curved) if each.name == name)

    def mesh(self) -> trimesh.Trimesh:
        """The surface as triangles, vertices merged, normals outwards."""
        import trimesh

        flat = self.triangles.reshape(-1, 3)
        return trimesh.Trimesh(flat, np.arange(len(flat)).reshape(-1, 3), process=True)


# Fig. 6 of the paper: v3 and v6 are opposite corners of the top face, e4 e9 e7 e11 its sides,
# e2 and e6 the vertical edges below v3 and v6.
_BLOCK_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1), (0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0))
_BLOCK_FACES = {
    "top": (3, 2, 6, 5),
    "bottom": (0, 4, 7, 1),
    "front": (0, 1, 2, 3),
    "back": (4, 5, 6, 7),
    "left": (0, 3, 5, 4),
    "right": (1, 7, 6, 2),
}
_BLOCK_EDGES = (
    (0, 1), (1, 2), (0, 3), (2, 3), (4, 7), (4, 5), (5, 6), (6, 7), (2, 6), (1, 7), (3, 5), (0, 4),
)  # fmt: skip


def block(size: tuple[float, float, float]) -> Solid:
    """Block with one corner at the origin and its sides along the axes.

    Vertices are v1 to v8, edges e1 to e12, numbered so that the paper's names hold: v3 and v6 are
    opposite corners of the top face, whose sides are e4, e9, e7 and e11. Faces are top, bottom, front (least y), back,
    left (least x) and right.

    Parameters
    ----------
    size : tuple of float
        Lengths along x, y and z.

    Examples
    --------
    >>> block((12.5, 7.5, 2.5)).vertex("v3").tolist()
    [12.5, 0.0, 2.5]
    >>> [edge.name for edge in block((1, 1, 1)).edges_at("v6")]
    ['e6', 'e7', 'e11']
    """
    faces = tuple(_BLOCK_FACES.values())
    return Solid(
        vertex_names=tuple(f"v{i}" for i in range(1, 9)),
        vertices=np.array(_BLOCK_CORNERS, float) * np.asarray(size, float),
        faces=faces,
        edges=tuple(
            Edge(f"e{i}", ends, tuple(f for f, face in enumerate(faces) if set(ends) <= set(face)))
            for i, ends in enumerate(_BLOCK_EDGES, 1)
        ),
        face_names=tuple(_BLOCK_FACES),
    )


def assembled(first: Solid, *others: Solid) -> Solid:
    """Several solids as one; names of the others' parts are marked by a number, circles and curved
    surfaces are those of the first.

    Examples
    --------
    >>> two = assembled(block((1, 1, 1)), block((2, 2, 2)))
    >>> len(two.faces), two.edge("e4").faces == block((1, 1, 1)).edge("e4").faces, two.edges[-1].name
    (12, True, 'e12@1')
    """
    if not others:
        return first
    names, vertices, faces, edges = list(first.vertex_names), [first.vertices], list(first.faces), list(first.edges)
    face_names = list(first.face_names)
    triangles, owners, regions = [first.triangles], [first.triangle_faces], [_numbers(first)]
    for number, other in enumerate(others, 1):
        corner, face = sum(map(len, vertices)), len(faces)
        names += [f"{name}@{number}" for name in other.vertex_names]
        face_names += [f"{name}@{number}" for name in other.face_names]
        edges += [
            Edge(
                f"{e.name}@{number}",
                (e.ends[0] + corner, e.ends[1] + corner),
                tuple(f + face for f in e.faces),
                e.convex,
                e.kind,
            )
            for e in other.edges
        ]
        faces += [tuple(v + corner for v in loop) for loop in other.faces]
        vertices.append(other.vertices)
        triangles.append(other.triangles)
        owners.append(other.triangle_faces + face)
        here, most = _numbers(other), max(part.max(initial=-1) for part in regions)
        regions.append(np.where(here < 0, -1, here + most + 1))
    return Solid(
        vertex_names=tuple(names),
        vertices=np.concatenate(vertices),
        faces=tuple(faces),
        edges=tuple(edges),
        triangles=np.concatenate(triangles),
        triangle_faces=np.concatenate(owners),
        circles=first.circles,
        arcs=first.arcs,
        curved=first.curved,
        face_names=tuple(face_names),
        regions=np.concatenate(regions),
    )


def _numbers(solid: Solid) -> np.ndarray:
    """Of the curved surfaces that faces are facets of."""
    return np.where(solid.plane, -1, 0) if solid.regions is None else solid.regions


def summed_areas(areas: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Area vectors (count, 3) of faces of triangles with area vectors (t, 3) on faces (t,).

    A sliver that is folded back onto itself has none, so the one of its largest triangle stands for it.

    Examples
    --------
    >>> areas = np.array([[0, 0, 2.0], [0, 0, 1.0], [0, 1.0, 0], [0, -1.0, 0]])
    >>> summed_areas(areas, np.array([0, 0, 1, 1]), 2).tolist()
    [[0.0, 0.0, 3.0], [0.0, 1.0, 0.0]]
    """
    found, sizes = np.zeros((count, 3)), np.linalg.norm(areas, axis=1)
    np.add.at(found, faces, areas)
    folded = np.linalg.norm(found, axis=1) <= _FOLDED * np.bincount(faces, sizes, count)
    for face in np.flatnonzero(folded):
        found[face] = areas[np.argmax(np.where(faces == face, sizes, -1.0))]
    return found
