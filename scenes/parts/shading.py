"""Normals by which curved surfaces are shaded: a facet's own turns from corner to corner as its surface does.

At a corner the facets of one surface have one normal: their mean with the weights of Max (1999), sin(angle) over the
product of both sides' lengths, which are exact on spheres and cylinders however unequal the facets are; that of a plane
which continues the surface smoothly there; or that of the surface itself, where it is measured as such. Between corners
it is interpolated in each triangle, in models and in renders alike. Plane faces keep their own.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from scenes.parts.chains import SINGLE, components
from scenes.parts.solid import Solid

_UNSURE = 1e-3  # rad: a facet that rounding may turn by so much counts half
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
    found = solid.normals[faces]
    facet = ~solid.plane[faces]
    if not facet.any():
        return found
    shape = np.broadcast_shapes(faces.shape, points.shape[:-1])
    found = np.broadcast_to(found, (*shape, 3)).copy()
    facet, faces = np.broadcast_to(facet, shape), np.broadcast_to(faces, shape)
    found[facet] = _within(solid, faces[facet], np.broadcast_to(points, (*shape, 3))[facet])
    return found


@lru_cache(maxsize=8)
def corner_normals(solid: Solid) -> np.ndarray:
    """Unit normals at the corners of the solid's triangles, shape (T, 3, 3)."""
    found = np.repeat(solid.normals[solid.triangle_faces][:, None], 3, 1)
    facet = ~solid.plane[solid.triangle_faces]
    if not facet.any():
        return found
    corners = np.concatenate([solid.vertices, solid.triangles[facet].reshape(-1, 3)])
    places, number = np.unique(corners, axis=0, return_inverse=True)
    of_vertex, of_corner = np.split(number, [len(solid.vertices)])
    surface = _surfaces(solid)
    means = _means(solid, surface, of_vertex, len(places))
    face = np.repeat(solid.triangle_faces[facet], 3)
    own, mean = solid.normals[face], means[surface[face] * len(places) + of_corner]
    alike = (mean * own).sum(1) >= _MOST
    found[facet] = np.where(alike[:, None], mean, own).reshape(-1, 3, 3)
    for each in solid.curved:
        here = np.isin(solid.triangle_faces, each.faces)
        found[here] = each.surface.normals(solid.triangles[here])
    return found


def _surfaces(solid: Solid) -> np.ndarray:
    """Number of the curved surface that each facet is of, (F,): smooth edges join them."""
    smooth = np.array([edge.faces for edge in solid.edges if edge.kind == "smooth"], int).reshape(-1, 2)
    return components(len(solid.faces), smooth[~solid.plane[smooth].any(1)])


def _means(solid: Solid, surface: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """Unit normals of surfaces at places, in the row surface x count + place, 0 where there is none.

    ``place`` (V,) is that of each vertex, of so many.
    """
    face, here, weight = _weights(solid)
    facet = ~solid.plane[face]
    rows = (surface[face] * count + place[here])[facet]
    found = np.zeros((count * (surface.max() + 1), 3))
    np.add.at(found, rows, (weight[:, None] * solid.normals[face])[facet])
    of_planes = np.zeros_like(found)
    for edge in solid.edges:
        if edge.kind == "smooth" and solid.plane[list(edge.faces)].sum() == 1:
            plane, facet = sorted(edge.faces, key=lambda each: not solid.plane[each])
            of_planes[surface[facet] * count + place[list(edge.ends)]] += solid.normals[plane]
    found = np.where(of_planes.any(1)[:, None], of_planes, found)
    size = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(size > 0, size, 1.0)


def _weights(solid: Solid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each corner of each face's outline: the face, the vertex, and how much its normal counts there, (n,)."""
    many = np.array([len(loop) for loop in solid.faces])
    face, here = np.repeat(np.arange(len(many)), many), np.concatenate([np.array(loop) for loop in solid.faces])
    ahead, back = (np.concatenate([np.roll(loop, step) for loop in solid.faces]) for step in (-1, 1))
    one, two = (solid.vertices[other] - solid.vertices[here] for other in (ahead, back))
    longest = np.maximum.reduceat(np.linalg.norm(one, axis=1), np.cumsum(many) - many)
    unsure = SINGLE * np.abs(solid.vertices).max() * longest / solid.areas
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = np.linalg.norm(np.cross(one, two), axis=1) / ((one**2).sum(1) * (two**2).sum(1))
    return face, here, np.nan_to_num(weight / (1 + (unsure / _UNSURE) ** 2)[face])


def _within(solid: Solid, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Of facets (n,) at points (n, 3): between the corners of that triangle of each in which the point lies."""
    order, first, many = _triangles_of(solid)
    inside, triangle, share = np.full(len(faces), -np.inf), np.zeros(len(faces), int), np.zeros((len(faces), 3))
    for k in range(many[faces].max()):
        some = np.flatnonzero((many[faces] > k) & (inside < 0))
        which = order[first[faces[some]] + k]
        shares = _shares(solid, which, points[some])
        better = shares.min(1) > inside[some]
        some, which, shares = some[better], which[better], shares[better]
        inside[some], triangle[some], share[some] = shares.min(1), which, shares
    found = np.einsum("nk,nki->ni", np.maximum(share, 0), corner_normals(solid)[triangle])
    size = np.linalg.norm(found, axis=1, keepdims=True)
    return np.where(size > 0, found / np.where(size > 0, size, 1.0), solid.normals[faces])


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
    """Barycentric coordinates (n, 3) of points (n, 3) in triangles (n,); NaN in those of no area."""
    away = points - solid.triangles[triangles, 0]
    second, third = np.moveaxis(np.einsum("nki,ni->nk", _slopes(solid)[triangles], away), 1, 0)
    return np.stack([1 - second - third, second, third], 1)
