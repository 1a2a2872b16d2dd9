"""What a ray meets first: Embree finds it, in single precision, and double precision says where; or every triangle is
tried, where Embree has no wheel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array

from scenes import Solid
from scenes.materials.vectors import chosen, length, product
from scenes.parts.rows import different

try:  # has wheels for x86-64
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh
except ImportError:
    rtcore_scene = None

Own = tuple[int, ...] | np.ndarray
"""Faces that no ray, or rays (n, k) each, cannot meet."""

_AT_ONCE = 1 << 14  # rays
_CHUNK = 50_000  # ray-triangle pairs at a time
_BUNDLE = 1024  # rays for which triangles that none of them comes near are left out together
_MANY, _FEW = 2000, 64  # triangles from which on rays are sorted, and bundles of them divided into some of so few
_LEAST = 16  # rays from one place that are a bundle of their own
_CELLS = 32  # a bundle's rays end in one of so many strips across the part
_ROUND = 1e-9  # of the farthest coordinate: what rounding may make of a place
_HAIR = 1e-13  # the same, of a place on a plane: no ray passes between two triangles
_STEP = 1e-9  # of the ray's vector: a surface that the ray starts on is not met
_PAST = 1e-6  # of the part's size: how far behind what a ray has met from inside it is followed on
_BENT = 1e-4  # of the part's size: how far triangles stand off the plane of their face where they turn away from it
_MOST_PASSED = 10_000  # triangles that a ray passes from inside
_EACH = 4  # faces that are looked for one by one: faster than to sort them


def first_face(
    solid: Solid, origins: np.ndarray, vectors: np.ndarray, own: Own, *, margin: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """The first face whose outside a ray meets.

    Parameters
    ----------
    origins, vectors : ndarray, shape (..., 3)
        The ray is origin + t vector, t > 0.
    own : tuple of int, or ndarray of int, shape (..., k)
        Faces that cannot be met, by any ray or by each.
    margin : float
        Of the part's size. What passes a triangle's side more closely is decided in double precision: the same on every
        processor, where single precision alone may take either.

    Returns
    -------
    face : ndarray of int, shape (...)
        -1 where nothing is met.
    t : ndarray, shape (...)
        Infinite where nothing is met.
    """
    shape = origins.shape[:-1]
    rays = np.reshape(origins, (-1, 3)), np.reshape(vectors, (-1, 3))
    own = own.reshape(-1, own.shape[-1]) if isinstance(own, np.ndarray) else own
    face, t = (_in_parts if has_embree() else by_trial)(_plates(solid, margin), *rays, own)
    return face.reshape(shape), t.reshape(shape)


def has_embree() -> bool:
    """Whether Embree is there: a ray's cost then hardly grows with the number of triangles."""
    return rtcore_scene is not None


def by_trial(plates: Plates, origins: np.ndarray, vectors: np.ndarray, own: Own) -> tuple[np.ndarray, np.ndarray]:
    """`first_face` of rays (n, 3), every triangle tried that may be near."""
    if isinstance(own, np.ndarray):
        return _by_trial_of_each(plates, origins, vectors, own)
    if own:
        plates = plates.some(~np.isin(plates.faces, own))
    if len(plates.faces) <= _MANY:
        return _in_bundles(plates, origins, vectors, (_BUNDLE,))
    face, t = np.empty(len(origins), int), np.empty(len(origins))
    order = _alike(origins, vectors)
    face[order], t[order] = _in_bundles(plates, origins[order], vectors[order], (_BUNDLE, _FEW))
    return face, t


def _by_trial_of_each(
    plates: Plates, origins: np.ndarray, vectors: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The same where each ray has faces (n, k) that it cannot meet."""
    face, t = np.full(len(origins), -1), np.full(len(origins), np.inf)
    different, which = np.unique(own, axis=0, return_inverse=True)
    for number, faces in enumerate(different.tolist()):
        rays = np.flatnonzero(which == number)
        face[rays], t[rays] = by_trial(plates, origins[rays], vectors[rays], tuple(faces))
    return face, t


def _in_parts(plates: Plates, origins: np.ndarray, vectors: np.ndarray, own: Own) -> tuple[np.ndarray, np.ndarray]:
    """`by_embree` of so few rays at a time that what is made of them stays near to the processor."""
    if len(origins) <= _AT_ONCE:
        return by_embree(plates, origins, vectors, own)
    face, t = np.empty(len(origins), int), np.empty(len(origins))
    for at in range(0, len(origins), _AT_ONCE):
        part = slice(at, at + _AT_ONCE)
        face[part], t[part] = by_embree(plates, origins[part], vectors[part], _of_rays(own, part))
    return face, t


def by_embree(plates: Plates, origins: np.ndarray, vectors: np.ndarray, own: Own) -> tuple[np.ndarray, np.ndarray]:
    """`first_face` of rays (n, 3): Embree names triangles, one behind the other, until one is met from outside.

    Places are those of the triangles' planes in double precision. Rays begin where they enter the sphere about the
    part, so that single precision is that of the part and not of its distance: what passes an outer edge within about
    1e-7 of the part's size may count as met or not.
    """
    face, t = np.full(len(origins), -1), np.full(len(origins), np.inf)
    lengths = length(vectors)
    at, rays = _entries(plates, origins, vectors, lengths)
    last = np.full(len(origins), -1)
    step = np.full(len(origins), _PAST * plates.radius)
    for _ in range(_MOST_PASSED):
        if not rays.size:
            break
        begin, way, size = (_some(each, rays) for each in (origins, vectors, lengths))
        ways = way / size[:, None]
        starts = (begin + _some(at, rays)[:, None] * way - plates.centre) / plates.radius
        found = plates.tree.run(starts.astype(np.float32), ways.astype(np.float32), query="INTERSECT", output=1)
        met = np.flatnonzero(found["primID"] >= 0)
        each = (rays, begin, way, size, found["primID"], found["tfar"])
        rays, begin, way, size, which, away = (_some(values, met) for values in each)
        outside, place = plates.met(which, begin, way)
        outside &= ~_among(plates.faces[which], _of_rays(own, rays))
        ahead = np.arange(len(rays)) if plates.margin else np.flatnonzero(~outside)  # what is followed on, or may be
        some, passed = rays[ahead], which[ahead]
        step[some] = np.where(passed == last[some], 2 * step[some], _PAST * plates.radius)
        last[some] = passed
        at[some] += (away[ahead].astype(float) * plates.radius + step[some]) / size[ahead]
        if plates.margin:
            near = np.flatnonzero(~plates.well_within(which, begin + place[:, None] * way))
            some = rays[near]
            most = np.maximum(at[some], np.where(outside, place, 0.0)[near]) + _BENT * plates.radius / lengths[some]
            which[near], place[near] = plates.met_beside(
                which[near], begin.take(near, 0), way.take(near, 0), most, _of_rays(own, some)
            )
            outside[near] = np.isfinite(place[near])
        face[rays[outside]], t[rays[outside]] = plates.faces[which[outside]], place[outside]
        rays = rays[~outside]
    return face, t


def _some(values: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Those of different numbers in order; the values themselves where these are all."""
    return values if len(which) == len(values) else values.take(which, 0)


def _of_rays(own: Own, rays: np.ndarray | slice) -> Own:
    """Faces that some of the rays cannot meet."""
    return own[rays] if isinstance(own, np.ndarray) else own


def _among(faces: np.ndarray, some: Own) -> np.ndarray:
    """Whether faces (n,) are among some others, bool (n,); of the few that meet in an edge each is looked for."""
    if isinstance(some, np.ndarray):
        return (faces[:, None] == some).any(1)
    if len(some) > _EACH:
        return np.isin(faces, some)
    found = np.zeros(len(faces), bool)
    for face in some:
        found |= faces == face
    return found


def _entries(
    plates: Plates, origins: np.ndarray, vectors: np.ndarray, lengths: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where rays enter the sphere about the triangles, t (n,), and the indices of those that do or begin in it."""
    with np.errstate(all="ignore"):
        away = plates.centre - origins
        along = product(away, vectors) / lengths
        aside2 = product(away, away) - along**2
        half = np.sqrt(1.1 * plates.radius**2 - aside2)  # NaN for rays that pass it
        at = np.maximum(along - half, 0.0) / lengths
        return at, np.flatnonzero((along + half > 0) & np.isfinite(at))


def _alike(origins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """An order of rays (n, 3) in which those that follow each other begin at one place and run close together."""
    ends = origins + vectors
    low, high = (end(ends, axis=0) for end in (np.nanmin, np.nanmax)) if len(ends) else (np.zeros(3), np.ones(3))
    one, two = np.argsort(low - high)[:2]  # the part's two largest extents
    with np.errstate(divide="ignore", invalid="ignore"):
        strip = np.floor(_CELLS * np.nan_to_num((ends[:, one] - low[one]) / (high - low)[one]))
    return np.lexsort((ends[:, two], strip, *origins.T))


def _in_bundles(
    plates: Plates, origins: np.ndarray, vectors: np.ndarray, sizes: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """`_first`, for bundles of rays of the first size, each divided into some of the next."""
    face, t = np.full(len(origins), -1), np.full(len(origins), np.inf)
    for bundle in _bundles(origins, sizes[0]):
        rays = origins[bundle], vectors[bundle]
        near = plates.some(_may_meet(plates, *rays))
        face[bundle], t[bundle] = _in_bundles(near, *rays, sizes[1:]) if sizes[1:] else _first(near, *rays)
    return face, t


def _bundles(origins: np.ndarray, size: int) -> Iterator[slice]:
    """Rays that follow each other, at most ``size``; from two places only where one has but few."""
    onward = np.flatnonzero((origins[1:] != origins[:-1]).any(-1)) + 1
    start = 0
    for stop in (*onward.tolist(), len(origins)):
        if stop - start < _LEAST and stop < len(origins):
            continue
        for at in range(start, stop, size):
            yield slice(at, min(at + size, stop))
        start = stop


def _first(plates: Plates, origins: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Face and t of what rays (n, 3) meet first, as `first_face` gives them."""
    face, t = np.full(len(origins), -1), np.full(len(origins), np.inf)
    size = max(1, _CHUNK // max(len(plates.faces), 1))
    for at in range(0, len(origins), size):
        part = slice(at, at + size)
        faces, ts = _meet(plates, origins[part], vectors[part])
        if not len(faces):
            continue
        which = ts.argmin(1)
        t[part] = ts[np.arange(len(ts)), which]
        face[part] = np.where(np.isfinite(t[part]), faces[which], -1)
    return face, t


def _may_meet(plates: Plates, origins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Triangles that a bundle of rays (n, 3) comes near: within the box across their mean direction that they fill from
    the nearest to the farthest triangle, bool (T,). All of them where the rays do not run one way."""
    every = np.ones(len(plates.faces), bool)
    toward = vectors.sum(0)
    if not every.size or not np.isfinite(toward).all() or not toward.any():
        return every
    frame = np.linalg.qr(np.column_stack([toward, np.eye(3)]))[0][:, :3]
    frame[:, 0] *= np.sign(frame[:, 0] @ toward)
    start, step = origins @ frame, vectors @ frame
    if not (step[:, 0] > 0).all():
        return every
    ends = plates.corners @ frame[:, 0]
    low, high = ends.min(0), ends.max(0)
    away = _ROUND * max(plates.farthest, np.abs(start).max())
    found = np.flatnonzero(high >= start[:, 0].min() - away)
    depths = np.maximum([low.min(), high.max()], start[:, :1])  # (n, 2)
    reached = start[:, None, 1:] + ((depths - start[:, :1]) / step[:, :1])[..., None] * step[:, None, 1:]
    for k in (0, 1):
        ends = plates.corners[:, found] @ frame[:, k + 1]
        low, high = ends.min(0), ends.max(0)
        found = found[(high >= reached[..., k].min() - away) & (low <= reached[..., k].max() + away)]
    every[:] = False
    every[found] = True
    return every


def reaches(solid: Solid, points: np.ndarray, faces: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Whether points (..., 3) on the given faces (...) see a position (broadcast): bool, shape (...)."""
    points, position = np.broadcast_arrays(points, position)
    normals = solid.normals.take(faces, 0)
    found = product(normals, position) > solid.offsets[faces]
    doubtful = found & ~solid.outer[faces]  # nothing stands over an outer face
    start = chosen(points, doubtful) + 1e-7 * solid.extent * chosen(normals, doubtful)
    origin = chosen(position, doubtful)
    blocker, t = first_face(solid, origin, start - origin, ())
    found[doubtful] = (blocker < 0) | (t >= 1)
    return found


@dataclass(frozen=True, eq=False)
class Plates:
    """T triangles: their face, corners (3, T, 3), plane, and (x - corner) . dual, coordinates of a place x along two
    sides."""

    faces: np.ndarray
    corners: np.ndarray
    normals: np.ndarray
    heights: np.ndarray
    duals: np.ndarray
    shifts: np.ndarray
    margin: float = 0.0

    @cached_property
    def farthest(self) -> float:
        """Largest coordinate of a corner."""
        return float(np.abs(self.corners).max(initial=0.0))

    @cached_property
    def centre(self) -> np.ndarray:
        """Of the box about them, (3,)."""
        return (self.corners.min((0, 1)) + self.corners.max((0, 1))) / 2

    @cached_property
    def radius(self) -> float:
        """Of the sphere about that box."""
        return float(np.linalg.norm(np.ptp(self.corners, (0, 1)))) / 2

    @cached_property
    def tree(self) -> Any:
        """Embree's, of the triangles in a sphere of radius 1, each wider by the margin."""
        scene = rtcore_scene.EmbreeScene(robust=True)
        corners = (self.corners.swapaxes(0, 1) - self.centre) / self.radius
        if self.margin:
            sides = np.linalg.norm(np.roll(corners, -1, 1) - np.roll(corners, 1, 1), axis=-1, keepdims=True)
            middle = (corners * sides).sum(1, keepdims=True) / sides.sum(1, keepdims=True)  # of the circle within
            radius = self._heights.T[:, :1] * sides[:, 0] / sides.sum(1) / self.radius
            corners = middle + (corners - middle) * (1 + self.margin / np.maximum(radius, self.margin))[..., None]
        TriangleMesh(scene, corners.astype(np.float32))
        return scene

    @cached_property
    def _heights(self) -> np.ndarray:
        """Of each corner over the side across, (3, T); none of a triangle without area."""
        side = np.linalg.norm(self.corners[2] - self.corners[1], axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = 1 / np.linalg.norm(self.duals, axis=-1)
            across = one * np.linalg.norm(self.corners[2] - self.corners[0], axis=-1)
            return np.nan_to_num(np.stack([across / side, one, two]), posinf=0.0)

    def well_within(self, which: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Whether places (n, 3) in the planes of triangles (n,) lie on them, farther within than twice the margin."""
        return (self._shares(which, places) * self._heights[:, which]).min(0) > 2 * self.margin * self.radius

    def _shares(self, which: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Of the three corners in places (n, 3) of triangles' planes (n,), (3, n); none is negative on a triangle."""
        one, two = (
            product(places, dual.take(which, 0)) - shift[which]
            for dual, shift in zip(self.duals, self.shifts, strict=True)
        )
        return np.stack([1 - one - two, one, two])

    def met(self, which: np.ndarray, origins: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whether rays (n, 3) meet the planes of triangles (n,) from outside, and t."""
        normals = self.normals.take(which, 0)
        fall, over = product(vectors, normals), product(origins, normals) - self.heights[which]
        with np.errstate(divide="ignore", invalid="ignore"):
            place = -over / fall
            return (fall < 0) & (over > 0) & (place > _STEP), place

    def met_beside(
        self, which: np.ndarray, origins: np.ndarray, vectors: np.ndarray, most: np.ndarray, own: Own
    ) -> tuple[np.ndarray, np.ndarray]:
        """What rays (n, 3) meet first, in double precision, of triangles (n,) and those that share a corner with them.

        The triangle, (n,), and t, (n,): at most ``most``, infinite where nothing is; faces ``own`` are not met.
        """
        triangle, place = which.copy(), np.full(len(which), np.inf)
        starts, corners = self._at_corners, self._corner_numbers[which].ravel()
        counts = starts.indptr[corners + 1] - starts.indptr[corners]
        ray = np.repeat(np.arange(len(corners)) // 3, counts)
        onward = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
        other = starts.indices[np.repeat(starts.indptr[corners], counts) + onward]
        hit, t = self.met(other, origins[ray], vectors[ray])
        with np.errstate(invalid="ignore"):
            within = self._shares(other, origins[ray] + t[:, None] * vectors[ray]) * self._heights[:, other]
            hit &= (within.min(0) >= -_HAIR * self.farthest) & (t <= most[ray])
            hit &= ~_among(self.faces[other], _of_rays(own, ray))
        ray, other, t = ray[hit], other[hit], t[hit]
        order = np.lexsort((other, t, ray))[::-1]  # the first of each ray is written last
        triangle[ray[order]], place[ray[order]] = other[order], t[order]
        return triangle, place

    @cached_property
    def _corner_numbers(self) -> np.ndarray:
        """Of each triangle's corners among the different places, (T, 3)."""
        return different(self.corners.reshape(-1, 3))[1].reshape(3, -1).T

    @cached_property
    def _at_corners(self) -> csr_array:
        """Which triangles have which of the different places for a corner, (places, T)."""
        place = self._corner_numbers
        return coo_array((np.ones(place.size), (place.ravel(), np.repeat(np.arange(len(place)), 3)))).tocsr()

    def some(self, which: np.ndarray) -> Plates:
        """Those of them."""
        planes = self.normals[which], self.heights[which]
        return Plates(self.faces[which], self.corners[:, which], *planes, self.duals[:, which], self.shifts[:, which])


@lru_cache(maxsize=16)
def _plates(solid: Solid, margin: float = 0.0) -> Plates:
    corner, one, two = solid.triangles[:, 0], *(solid.triangles[:, k] - solid.triangles[:, 0] for k in (1, 2))
    gram = np.einsum("ti,ti->t", one, one), np.einsum("ti,ti->t", one, two), np.einsum("ti,ti->t", two, two)
    size = gram[0] * gram[2] - gram[1] ** 2
    duals = np.stack([gram[2][:, None] * one - gram[1][:, None] * two, gram[0][:, None] * two - gram[1][:, None] * one])
    with np.errstate(all="ignore"):
        duals = duals / size[:, None]
    some = (np.abs(duals).max((0, 2)) > 0) & np.isfinite(duals).all((0, 2))  # the others have no area
    faces, normals = solid.triangle_faces[some], solid.normals[solid.triangle_faces[some]]
    corner, duals = corner[some], duals[:, some]
    shifts = np.einsum("kti,ti->kt", duals, corner)
    corners = np.ascontiguousarray(solid.triangles[some].swapaxes(0, 1))
    heights = np.einsum("ti,ti->t", normals, corner)
    return Plates(faces, corners, normals, heights, duals, shifts, margin)


def _meet(plates: Plates, origins: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces (T,) of triangles whose outside a ray may meet, and each ray's t, infinite where it misses, (rays, T)."""
    fall, over = vectors @ plates.normals.T, origins @ plates.normals.T - plates.heights
    some = ((fall < 0) & (over > 0)).any(0)
    plates, fall, over = plates.some(some), fall[:, some], over[:, some]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -over / fall
        u, v = (
            origins @ dual.T - shift + t * (vectors @ dual.T)
            for dual, shift in zip(plates.duals, plates.shifts, strict=True)
        )
        hit = (fall < 0) & (t > _STEP) & (u >= 0) & (v >= 0) & (u + v <= 1)
    return plates.faces, np.where(hit, t, np.inf)
