"""The geometry of an object: vertices, plane faces, and the edges where two faces meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Edge:
    """A straight edge: its two end vertices and the two faces that meet in it (indices)."""

    name: str
    ends: tuple[int, int]
    faces: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex solid with plane faces, in object coordinates (cm).

    Attributes
    ----------
    vertex_names : tuple of str
        One name a vertex.
    vertices : ndarray, shape (V, 3)
        Positions, cm.
    faces : tuple of tuple of int
        Vertex indices of each face, counter-clockwise seen from outside.
    edges : tuple of Edge
    """

    vertex_names: tuple[str, ...]
    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    edges: tuple[Edge, ...]

    @property
    def normals(self) -> np.ndarray:
        """Outward unit normal of each face, shape (F, 3)."""
        corners = np.array([[self.vertices[i] for i in face[:3]] for face in self.faces])
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    @property
    def offsets(self) -> np.ndarray:
        """Distance of each face's plane from the origin along its normal, cm, shape (F,)."""
        anchors = self.vertices[[face[0] for face in self.faces]]
        return np.einsum("fi,fi->f", self.normals, anchors)

    def height_above(self, point: np.ndarray) -> float:
        """How far a point lies outside the solid's nearest plane, cm; zero or less inside or on it."""
        return float(np.max(self.normals @ point - self.offsets))

    def vertex(self, name: str) -> np.ndarray:
        """Position of the named vertex, cm, shape (3,)."""
        return self.vertices[self.vertex_names.index(name)]

    def edge(self, name: str) -> Edge:
        """The named edge."""
        return next(edge for edge in self.edges if edge.name == name)

    def edges_at(self, vertex: str) -> tuple[Edge, ...]:
        """All edges that end in the named vertex."""
        index = self.vertex_names.index(vertex)
        return tuple(edge for edge in self.edges if index in edge.ends)


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
    opposite corners of the top face, whose sides are e4, e9, e7 and e11.

    Parameters
    ----------
    size : tuple of float
        Lengths along x, y and z, cm.

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
    )
