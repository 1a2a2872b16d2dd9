"""What a ray meets first, by trying every triangle."""

from __future__ import annotations

import numpy as np

from scenes import Solid

_CHUNK = 400_000  # ray-triangle pairs at a time
_STEP = 1e-9  # of the ray's vector: a surface that the ray starts on is not met


def first_face(solid: Solid, origins: np.ndarray, vectors: np.ndarray, own: tuple[int, ...]):
    """The first face whose outside a ray meets.

    Parameters
    ----------
    origins, vectors : ndarray, shape (..., 3)
        The ray is origin + t vector, t > 0.
    own : tuple of int
        Faces that cannot be met.

    Returns
    -------
    face : ndarray of int, shape (...)
        -1 where nothing is met.
    t : ndarray, shape (...)
        Infinite where nothing is met.
    """
    keep = ~np.isin(solid.triangle_faces, own)
    triangles, faces = solid.triangles[keep], solid.triangle_faces[keep]
    shape = origins.shape[:-1]
    origins, vectors = origins.reshape(-1, 3), vectors.reshape(-1, 3)
    face, t = np.full(len(origins), -1), np.full(len(origins), np.inf)
    size = max(1, _CHUNK // max(len(triangles), 1))
    for at in range(0, len(origins), size):
        part = slice(at, at + size)
        ts = _meet(triangles, solid.normals[faces], origins[part], vectors[part])
        which = ts.argmin(1)
        t[part] = ts[np.arange(len(ts)), which]
        face[part] = np.where(np.isfinite(t[part]), faces[which], -1)
    return face.reshape(shape), t.reshape(shape)


def reaches(solid: Solid, points: np.ndarray, faces: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Whether points (..., 3) on the given faces (...) see a position (broadcast): bool, shape (...)."""
    points, position = np.broadcast_arrays(points, position)
    normals = solid.normals[faces]
    towards = np.einsum("...i,...i->...", normals, position) > solid.offsets[faces]
    start = points + 1e-7 * solid.extent * normals
    blocker, t = first_face(solid, position, start - position, ())
    return towards & ((blocker < 0) | (t >= 1))


def _meet(triangles: np.ndarray, normals: np.ndarray, origins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Parameter t of each ray at each triangle seen from outside, infinite where it misses; shape (rays, T)."""
    corner, one, two = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    gram = np.einsum("ti,ti->t", one, one), np.einsum("ti,ti->t", one, two), np.einsum("ti,ti->t", two, two)
    size = gram[0] * gram[2] - gram[1] ** 2
    dual1 = (gram[2][:, None] * one - gram[1][:, None] * two) / size[:, None]
    dual2 = (gram[0][:, None] * two - gram[1][:, None] * one) / size[:, None]
    fall = vectors @ normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (np.einsum("ti,ti->t", normals, corner) - origins @ normals.T) / fall
        u = origins @ dual1.T - np.einsum("ti,ti->t", dual1, corner) + t * (vectors @ dual1.T)
        v = origins @ dual2.T - np.einsum("ti,ti->t", dual2, corner) + t * (vectors @ dual2.T)
        hit = (fall < 0) & (t > _STEP) & (u >= 0) & (v >= 0) & (u + v <= 1)
    return np.where(hit, t, np.inf)
