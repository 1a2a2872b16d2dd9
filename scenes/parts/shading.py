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
    found, facet, faces = np.broadcast_to(found, (*shape, 3)).copy(), *(np.broadcast_to(v, shape) for v in (facet, faces))
    found[facet] = _within(solid, faces[facet], np.broadcast_to(points, (*shape, 3))[facet])
    return found


@lru_cache(maxsize=8)
def corner_normals(solid: Solid) -> np.ndarray:
    """Unit normals at the corners of the solid's triangles, shape (T, 3, 3)."""
    found = np.repeat(solid.normals[solid.triangle_faces][:, None], 3, 1)
    if solid.plane.all():
        return found
    facet = ~solid.plane[solid.triangle_faces]
    points, number = np.unique(np.concatenate([solid.vertices, solid.triangles[facet].reshape(-1, 3)]), axis=0, return_inverse=True)
    place, corner = np.split(number, [len(solid.vertices)])
    surface, means = _means(solid, place, len(points))
    face = np.repeat(solid.triangle_faces[facet], 3)
    made = means[surface[face] * len(points) + corner]
    own = solid.normals[face]
    found[facet] = np.where(((made * own).sum(1) >= _MOST)[:, None], made, own).reshape(-1, 3, 3)
    for each in solid.curved:
        here = np.isin(solid.triangle_faces, each.faces)
        found[here] = each.surface.normals(solid.triangles[here])
    return found


def _means(solid: Solid, place: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The surface of each face, (F,), and unit normals of each surface's corners, row surface x count + place; 0 elsewhere."""
    smooth = np.array([edge.faces for edge in solid.edges if edge.kind == "smooth"], int).reshape(-1, 2)
    surface = components(len(solid.faces), smooth[~solid.plane[smooth].any(1)])
    many = np.array([len(loop) for loop in solid.faces])
    face = np.repeat(np.arange(len(many)), many)
    here = np.concatenate([np.array(loop) for loop in solid.faces])
    ahead, back = (np.concatenate([np.roll(loop, step) for loop in solid.faces]) for step in (-1, 1))
    one, two = (solid.vertices[v] - solid.vertices[here] for v in (ahead, back))
    with np.errstate(divide="ignore", invalid="ignore"):
        sine = np.linalg.norm(np.cross(one, two), axis=1)
        weight = sine / ((one**2).sum(1) * (two**2).sum(1))
        longest = np.maximum.reduceat(np.linalg.norm(one, axis=1), np.cumsum(many) - many)
        unsure = SINGLE * np.abs(solid.vertices).max() * longest / solid.areas
        weight = np.nan_to_num(weight / (1 + (unsure / _UNSURE) ** 2)[face])
    facet = ~solid.plane[face]
    means = np.zeros((count * (surface.max() + 1), 3))
    np.add.at(means, (surface[face] * count + place[here])[facet], (weight[:, None] * solid.normals[face])[facet])
    flat = np.zeros_like(means)
    for edge in solid.edges:
        if edge.kind == "smooth" and solid.plane[list(edge.faces)].sum() == 1:
            plane, other = sorted(edge.faces, key=lambda f: not solid.plane[f])
            flat[surface[other] * count + place[list(edge.ends)]] += solid.normals[plane]
    means = np.where(flat.any(1)[:, None], flat, means)
    size = np.linalg.norm(means, axis=1, keepdims=True)
    return surface, means / np.where(size > 0, size, 1.0)


def _within(solid: Solid, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Of facets (n,) at points (n, 3): between the corners of that triangle of each in which the point lies."""
    order, first, many = _triangles_of(solid)
    inside, triangle, share = np.full(len(faces), -np.inf), np.zeros(len(faces), int), np.zeros((len(faces), 3))
    for k in range(many[faces].max()):
        some = np.flatnonzero((many[faces] > k) & (inside < 0))
        which = order[first[faces[some]] + k]
        shares = _shares(solid.triangles[which], points[some])
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


def _shares(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (n, 3) of points (n, 3) in triangles (n, 3, 3); NaN in those of no area."""
    one, two, away = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], points - triangles[:, 0]
    across = np.cross(one, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        across /= (across**2).sum(1, keepdims=True)
        second, third = ((np.cross(*pair) * across).sum(1) for pair in ((away, two), (one, away)))
    return np.stack([1 - second - third, second, third], 1)
