"""Normals by which curved surfaces are shaded: a facet's own turns from corner to corner as its surface does.

At a corner the facets of one surface have one normal: their mean with the weights of Max (1999), sin(angle) over the
product of both sides' lengths, which are exact on spheres and cylinders however unequal the facets are; that of a plane
which continues the surface smoothly there; or that of the surface itself, where it is measured as such. Between corners
it is interpolated in each triangle, in models and in renders alike. Plane faces keep their own.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import chain

import numpy as np

from scenes.materials.vectors import chosen, length, product
from scenes.parts.chains import SINGLE, components
from scenes.parts.rows import different
from scenes.parts.solid import Solid

_UNSURE = 1e-3  # rad: a facet that rounding may turn by so much counts half
_AT_ONCE = 1 << 16  # points
_MOST = np.cos(np.radians(31.0))  # what bends by more is no facet of the same surface


def normals_at(solid: Solid, faces: np.ndarray | int, points: np.ndarray) -> np.ndarray:
    """Unit normals (..., 3) at points (..., 3) on faces (...), broadcast against each other.

    Examples
    --------
    >>> import trimesh
    >>> from scenes.parts.mesh import solid
    >>> rod = solid(trimesh.creation.cylinder(2.0, 5.0, sections=48))
    >>> wall = np.flatnonzero(~rod.plane)[0]
    >>> place = rod.vertices[list(rod.faces[wall])].mean(0) + 0.05 * np.cross(rod.normals[wall], [0, 0, 1])
    >>> out = place * [1, 1, 0] / np.linalg.norm(place[:2])
    >>> bool(np.abs(normals_at(rod, wall, place) - out).max() < 1e-5 < np.abs(rod.normals[wall] - out).max())
    True
    """
    faces = np.asarray(faces)
    shape = np.broadcast_shapes(faces.shape, points.shape[:-1])
    found, facet = np.broadcast_to(solid.normals.take(faces, 0), (*shape, 3)), ~solid.plane[faces]
    if not facet.any():
        return found
    found = found.copy()
    facet, faces = np.broadcast_to(facet, shape), np.broadcast_to(faces, shape)
    places, faces, rows = chosen(np.broadcast_to(points, (*shape, 3)), facet), faces[facet], np.flatnonzero(facet)
    for at in range(0, len(rows), _AT_ONCE):  # in blocks, which bounds the memory
        part = slice(at, at + _AT_ONCE)
        found.reshape(-1, 3)[rows[part]] = _within(solid, faces[part], places[part])
    return found


@lru_cache(maxsize=8)
def corner_normals(solid: Solid) -> np.ndarray:
    """Unit normals at the corners of the solid's triangles, shape (T, 3, 3)."""
    found = np.repeat(solid.normals[solid.triangle_faces][:, None], 3, 1)
    facet = ~solid.plane[solid.triangle_faces]
    if not facet.any():
        return found
    corners = np.concatenate([solid.vertices, solid.triangles[facet].reshape(-1, 3)])
    _, number = different(corners)
    of_vertex, of_corner = np.split(number, [len(solid.vertices)])
    face = np.repeat(solid.triangle_faces[facet], 3)
    own, mean = solid.normals[face], _means(solid, face, of_corner, of_vertex)
    alike = (mean * own).sum(1) >= _MOST
    found[facet] = np.where(alike[:, None], mean, own).reshape(-1, 3, 3)
    for each in solid.curved:
        here = np.isin(solid.triangle_faces, each.faces)
        found[here] = each.surface.normals(solid.triangles[here])
    return found


def _smooth(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Faces and ends of the edges that are smooth, (n, 2) each."""
    rows = [(edge.faces, edge.ends) for edge in solid.edges if edge.kind == "smooth"]
    faces, ends = np.moveaxis(np.array(rows, int).reshape(-1, 2, 2), 1, 0)
    return faces, ends


def _surfaces(solid: Solid) -> np.ndarray:
    """Number of the curved surface that each facet is of, (F,): smooth edges join them."""
    faces, _ = _smooth(solid)
    return components(len(solid.faces), faces[~solid.plane[faces].any(1)])


def _means(solid: Solid, faces: np.ndarray, places: np.ndarray, of_vertex: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of the surfaces of facets (n,) at the numbers of places (n,); 0 where there is none.

    ``of_vertex`` (V,) is the place of each vertex.
    """
    surface = _surfaces(solid)
    face, here, weight = _weights(solid)
    facet = ~solid.plane[face]
    face, here, weight = face[facet], here[facet], weight[facet]
    beside, plane, ends = _smooth_to_planes(solid)
    wanted, summed, continued = _numbered(
        (surface[faces], places), (surface[face], of_vertex[here]), (surface[beside], of_vertex[ends])
    )
    found = np.zeros((1 + max(wanted.max(), summed.max(), continued.max(initial=0)), 3))
    of_planes = np.zeros_like(found)
    np.add.at(found, summed, weight[:, None] * solid.normals[face])
    np.add.at(of_planes, continued, solid.normals[plane])
    found = np.where(of_planes.any(1)[:, None], of_planes, found)[wanted]
    size = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(size > 0, size, 1.0)


def _smooth_to_planes(solid: Solid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of both ends of each smooth edge between a facet and a plane face: facet, plane face, vertex, (n,) each."""
    faces, ends = _smooth(solid)
    mixed = solid.plane[faces].sum(1) == 1
    faces, ends = faces[mixed], ends[mixed]
    plane = solid.plane[faces]
    return np.repeat(faces[~plane], 2), np.repeat(faces[plane], 2), ends.reshape(-1)


def _numbered(*pairs: tuple[np.ndarray, np.ndarray]) -> list[np.ndarray]:
    """Of several sets of pairs of numbers, (n,) and (n,), each pair's number among all that occur, (n,) of each set."""
    one, other = (np.concatenate(each) for each in zip(*pairs, strict=True))
    _, number = np.unique(one * (other.max() + 1) + other, return_inverse=True)
    return np.split(number, np.cumsum([len(each) for each, _ in pairs])[:-1])


def _weights(solid: Solid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each corner of each face's outline: the face, the vertex, and how much its normal counts there, (n,)."""
    many = np.array([len(loop) for loop in solid.faces])
    face, here = np.repeat(np.arange(len(many)), many), np.array([*chain.from_iterable(solid.faces)])
    last = np.cumsum(many) - 1
    first = last + 1 - many
    ahead = np.arange(1, len(here) + 1)
    ahead[last] = first
    back = np.arange(-1, len(here) - 1)
    back[first] = last
    one, two = (solid.vertices[here[other]] - solid.vertices[here] for other in (ahead, back))
    longest = np.maximum.reduceat(np.linalg.norm(one, axis=1), first)
    unsure = SINGLE * np.abs(solid.vertices).max() * longest / solid.areas
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = np.linalg.norm(np.cross(one, two), axis=1) / ((one**2).sum(1) * (two**2).sum(1))
    return face, here, np.nan_to_num(weight / (1 + (unsure / _UNSURE) ** 2)[face])


def _within(solid: Solid, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Of facets (n,) at points (n, 3): between the corners of that triangle of each in which the point lies."""
    order, first, many = _triangles_of(solid)
    count, triangle = many[faces], order.take(first[faces], mode="clip")
    share = _shares(solid, triangle, points)
    inside = share.min(0)
    none = ~(inside > -np.inf) | (count == 0)  # of no area, or without a triangle
    inside[none], share[:, none] = -np.inf, 0.0
    for k in range(1, count.max()):
        some = np.flatnonzero((count > k) & (inside < 0))
        which = order[first[faces[some]] + k]
        shares = _shares(solid, which, points.take(some, 0))
        least = shares.min(0)
        better = np.flatnonzero(least > inside[some])
        some = some[better]
        inside[some], triangle[some], share[:, some] = least[better], which[better], shares[:, better]
    corners, share = corner_normals(solid).take(triangle, 0), np.maximum(share, 0)[..., None]
    found = sum(share[k] * corners[:, k] for k in range(3))
    size = length(found)
    flat = np.flatnonzero(~(size > 0))
    found[flat], size[flat] = solid.normals.take(faces[flat], 0), 1.0
    return found / size[:, None]


@lru_cache(maxsize=8)
def _triangles_of(solid: Solid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles in the order of their faces, (T,), where each face's begin, and how many they are, (F,)."""
    many = np.bincount(solid.triangle_faces, minlength=len(solid.faces))
    return np.argsort(solid.triangle_faces, kind="stable"), np.cumsum(many) - many, many


@lru_cache(maxsize=8)
def _slopes(solid: Solid) -> np.ndarray:
    """Slopes (T, 2, 3) of the shares of each triangle's second and third corner; NaN in those of no area."""
    one, two = (solid.triangles[:, k] - solid.triangles[:, 0] for k in (1, 2))
    across = np.cross(one, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        across /= (across**2).sum(1, keepdims=True)
        return np.stack([np.cross(two, across), np.cross(across, one)], 1)


def _shares(solid: Solid, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (3, n) of points (n, 3) in triangles (n,); NaN in those of no area."""
    away, slopes = points - solid.triangles.take(triangles, 0)[:, 0], _slopes(solid).take(triangles, 0)
    second, third = (product(slopes[:, k], away) for k in (0, 1))
    return np.stack([1 - second - third, second, third])
