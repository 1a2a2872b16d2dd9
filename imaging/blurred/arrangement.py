"""What the picture shows around the required edges: regions of smooth brightness and the straight pieces between them.

Positions of vertices are ideal image coordinates, in which the pieces are straight; brightness is a function of the
recorded coordinates, those of the pixels. `imaging.blurred.model` makes the image of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from imaging.features.projected_edges import corner_features, straight
from imaging.geometry.blur import blur_in_focus, signed_confusion
from imaging.geometry.lens import recorded
from imaging.geometry.projection import depth, facing, project_ideal
from imaging.geometry.segments import distance_to_segment, pixels_along
from imaging.light.appearance import face_signal, is_plain
from imaging.pictures import Pictures
from scenes import Camera, Edge, Solid

BACKGROUND = 0  # the region outside everything
_DEGREE = 4  # of the polynomial that a known shading is told by
_WIDE, _NARROW = 6.0, 2.0  # px: half widths of a face from which its shading has degree 4 and 2 across it, else 1
_SQUARE = np.cos(np.pi * np.arange(9) / 8)  # places that tell a polynomial of degree 4 well
_GRID = np.linspace(0.02, 0.98, 7)
_CURVED = (
    60.0  # px: faces larger than this may shade quadratically where the light is not known; it costs a tenth there
)
_OUTSIDE = 2.0  # reaches from the middle, beyond which a level is held: it counts for nothing there
_FAINT = 1e-6  # of the brightest signal: a face below is dark


@dataclass(frozen=True, eq=False)
class Region:
    """Brightness of one region: free polynomial of ``order`` times a known shading.

    Attributes
    ----------
    middle, reach : ndarray, shape (2,), and float
        Recorded px; polynomials are of (x - middle) / reach.
    shade : ndarray
        Coefficients of the known shading (grey levels above darkness), by `_terms`; (1,) where nothing is known.
    order : int
        0: one level; 1: linear; 2: quadratic.
    known : bool
        Whether the shading's size is known, not its form alone.
    """

    middle: np.ndarray
    reach: float
    shade: np.ndarray
    order: int
    known: bool = False

    @property
    def count(self) -> int:
        """How many coefficients the level has."""
        return (self.order + 1) * (self.order + 2) // 2

    def basis(self, points: np.ndarray) -> np.ndarray:
        """Basis functions of the level at recorded places (n, 2), shape (count, n)."""
        terms = self._terms(points)
        return terms[: self.count] * (self.shade @ terms[: self.shade.size])

    def slope(self, points: np.ndarray) -> np.ndarray:
        """Their derivatives by x and y, grey levels a px, shape (count, 2, n)."""
        terms = self._terms(points)
        known, free = self.shade @ terms[: self.shade.size], terms[: self.count]
        slopes = []
        for axis in (0, 1):
            d_known = self.shade @ _derivatives(self.shade.size, axis) @ terms[: self.shade.size]
            d_free = _derivatives(self.count, axis) @ free
            slopes.append(d_free * known + free * d_known)
        return np.stack(slopes, 1) / self.reach

    def _terms(self, points: np.ndarray) -> np.ndarray:
        x, y = np.clip((points - self.middle) / self.reach, -_OUTSIDE, _OUTSIDE).T
        return _terms(x, y, max(_degree(self.shade.size), self.order))

    @classmethod
    def flat(cls, points: np.ndarray, order: int) -> Region:
        """A region of which nothing is known but where it lies: around recorded points (n, 2)."""
        middle = (points.min(0) + points.max(0)) / 2
        return cls(middle, float(np.abs(points - middle).max()) or 1.0, np.ones(1), order)

    @classmethod
    def shaded(cls, points: np.ndarray, levels: np.ndarray) -> Region:
        """A region with known levels (n,) at recorded places (n, 2)."""
        plain = cls.flat(points, 1)
        axes = np.linalg.svd(points - points.mean(0), full_matrices=False)[2] / plain.reach
        across = (points - plain.middle) @ axes.T
        most = [_degree_across(half * plain.reach) for half in np.ptp(across, axis=0) / 2]
        kept = [i <= most[0] and j <= most[1] for i, j in _powers(_DEGREE)]
        told = np.linalg.lstsq(_terms(*across.T, _DEGREE)[kept].T, levels, rcond=None)[0]
        square = np.stack(np.meshgrid(_SQUARE, _SQUARE), -1).reshape(-1, 2)  # the same polynomial in x and y
        values = told @ _terms(*(square @ (axes * plain.reach).T).T, _DEGREE)[kept]
        shade = np.linalg.lstsq(_terms(*square.T, _DEGREE).T, values, rcond=None)[0]
        return replace(plain, shade=shade, known=True)


@dataclass(frozen=True, eq=False)
class Arrangement:
    """V vertices, N straight pieces between them, R regions beside the pieces.

    Attributes
    ----------
    vertices : ndarray, shape (V, 2)
        Ideal px.
    defocus : ndarray, shape (V,)
        Signed radius of the circle of confusion, px; it changes linearly along a piece.
    pieces : ndarray of int, shape (N, 2)
        Vertices from which and to which each piece runs.
    sides : ndarray of int, shape (N, 2)
        Region on the side that the normal (-t_y, t_x) points to, and on the other.
    regions : tuple of Region
        The first is the background.
    required : ndarray of int, shape (E, 2)
        For each required edge the vertices of its ends, in the edge's own direction; -1 where it is not seen.
    edges : ndarray of int, shape (N,)
        The required edge that a piece belongs to, -1 for others.
    corners : ndarray of int, shape (C,)
        The vertices that are measured.
    camera : Camera, optional
        Whose lens bends and blurs; an ideal one with ``blur_px`` when not given.
    blur_px : float
        Standard deviation of the lens' blur in focus, px; where it varies over the image, the mean along what is
        required.
    """

    vertices: np.ndarray
    defocus: np.ndarray
    pieces: np.ndarray
    sides: np.ndarray
    regions: tuple[Region, ...]
    required: np.ndarray
    edges: np.ndarray
    corners: np.ndarray
    camera: Camera | None
    blur_px: float

    def moved(self, shift: tuple[float, float], turn: float, middle: np.ndarray) -> Arrangement:
        """Turned by ``turn`` (rad, x towards y) about ``middle`` and shifted (px)."""
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return replace(self, vertices=(self.vertices - middle) @ rotation.T + middle + np.asarray(shift))

    def only(self, edges: np.ndarray, corners: np.ndarray) -> Arrangement:
        """With some of the required edges and of the corners, by their numbers; the rest is seen as before."""
        number = np.full(len(self.required) + 1, -1)  # the last is of pieces of no required edge
        number[edges] = np.arange(len(edges))
        return replace(self, required=self.required[edges], edges=number[self.edges], corners=self.corners[corners])

    def recorded(self, ideal: np.ndarray) -> np.ndarray:
        """Where ideal image points (..., 2) are recorded, px."""
        return ideal if self.camera is None else recorded(ideal, self.camera)

    def beside_blur(self, ideal: np.ndarray) -> np.ndarray:
        """Variance that the field adds to that of ``blur_px`` at ideal points (..., 2), px^2; less than 0 where it is
        sharper."""
        if self.camera is None or self.camera.blur_field is None:
            return np.zeros(np.shape(ideal)[:-1])
        return np.nan_to_num(blur_in_focus(self.camera, self.recorded(ideal)) ** 2 - self.blur_px**2)

    @property
    def level_slices(self) -> tuple[slice, ...]:
        """Where each region's coefficients stand among all."""
        ends = np.cumsum([0, *(region.count for region in self.regions)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))


def arrangement_of(pictures: Pictures) -> Arrangement:
    """The arrangement of one picture; without lights the brightness of every face is free.

    Faces on which no light falls are the background.
    """
    return pictures.once("arrangement", lambda: _arrangement(pictures))


def _arrangement(pictures: Pictures) -> Arrangement:
    scene, solid, pose = pictures.scene, pictures.scene.bodies, pictures.sensors
    if not is_plain(scene):
        raise NotImplementedError("arrangement of scenes in which things hide or shade each other")
    camera = scene.camera
    image = project_ideal(solid.vertices, pose, camera)
    seen = facing(solid, pictures.viewpoint)
    regions, place = [Region.flat(np.zeros((1, 2)), 0)], {}
    for face in np.flatnonzero(seen):
        region = _region(pictures, solid, int(face))
        if region is not None:
            place[int(face)] = len(regions)
            regions.append(region)
    pieces, sides, owners = [], [], []
    names = straight(scene)
    for edge in solid.edges:
        pair = faces_beside(solid, edge, image, place)
        if pair[0] != pair[1] and np.isfinite(image[list(edge.ends)]).all():
            pieces.append(edge.ends)
            sides.append(pair)
            owners.append(names.index(edge.name) if edge.name in names else -1)
    required = [scene.solid.edge(name) for name in names]
    vertices = [scene.solid.vertex_names.index(corner.vertex) for corner in corner_features(scene)]
    radii = signed_confusion(camera, depth(solid.vertices, pose, camera))
    drawn = set(owners)
    return Arrangement(
        vertices=image,
        defocus=radii,
        pieces=np.array(pieces, int).reshape(-1, 2),
        sides=np.array(sides, int).reshape(-1, 2),
        regions=tuple(regions),
        required=np.array([edge.ends if i in drawn else (-1, -1) for i, edge in enumerate(required)]),
        edges=np.array(owners, int),
        corners=np.array(vertices, int),
        camera=camera if camera.lens.bends or camera.aperture_radius > 0 or camera.blur_field is not None else None,
        blur_px=along_blur(image[np.array([edge.ends for edge in required], int).reshape(-1, 2)], camera),
    )


def along_blur(ends: np.ndarray, camera: Camera) -> float:
    """The blur in focus along lines between ideal places (E, 2, 2): the root of its mean square, px."""
    if camera.blur_field is None or not np.isfinite(ends).all((1, 2)).any():
        return camera.blur_px
    seen = ends[np.isfinite(ends).all((1, 2))]
    places = seen[:, :1] + np.linspace(0, 1, 9)[:, None] * (seen[:, 1:] - seen[:, :1])
    return float(np.sqrt(np.nanmean(blur_in_focus(camera, recorded(places, camera)) ** 2)))


def polygon_arrangement(corners: np.ndarray, blur_px: float) -> Arrangement:
    """A convex polygon alone on a background, from its corners (k, 2), px, in order around it; its light not known."""
    corners, count = np.asarray(corners, float), len(corners)
    ends = np.stack([np.arange(count), (np.arange(count) + 1) % count], 1)
    x, y = corners.T
    inside_first = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0
    return Arrangement(
        vertices=corners,
        defocus=np.zeros(count),
        pieces=ends,
        sides=np.tile([1, BACKGROUND] if inside_first else [BACKGROUND, 1], (count, 1)),
        regions=(Region.flat(np.zeros((1, 2)), 0), Region.flat(corners, _order(corners))),
        required=ends,
        edges=np.arange(count),
        corners=np.arange(count),
        camera=None,
        blur_px=blur_px,
    )


def _order(corners: np.ndarray) -> int:
    return 2 if np.ptp(corners, 0).min() > _CURVED else 1


def _region(pictures: Pictures, solid: Solid, face: int) -> Region | None:
    """Brightness of a face, None where it is as dark as the background."""
    camera = pictures.scene.camera
    points = spread(solid.vertices[list(solid.faces[face])])
    places = recorded(project_ideal(points, pictures.sensors, camera), camera)
    good = np.isfinite(places).all(1)
    if not good.any():
        return None
    if not pictures.lights:
        return Region.flat(places[good], _order(places[good]))
    levels = face_signal(pictures, points, face, 1)
    if not levels.max() > _FAINT * camera.exposure:
        return None
    return Region.shaded(places[good], levels[good])


def faces_beside(
    solid: Solid, edge: Edge, image: np.ndarray, place: dict[int, int], none: int = BACKGROUND
) -> tuple[int, int]:
    """What ``place`` says of the faces on both sides of a convex body's edge in an image, told by their middles.

    First that on the side of the edge's normal (-t_y, t_x); ``none`` where it says nothing.
    """
    start, stop = image[list(edge.ends)]
    normal = np.array([-(stop - start)[1], (stop - start)[0]])
    sides = [none, none]
    for face in edge.faces:
        if face in place:
            sides[0 if (image[list(solid.faces[face])].mean(0) - start) @ normal > 0 else 1] = place[face]
    return sides[0], sides[1]


def spread(corners: np.ndarray) -> np.ndarray:
    """Points spread over a convex polygon (k, 3), (k * 49, 3): each triangle of a fan about its middle, on a grid.

    Whichever corner comes first, and whichever way round they go, they are the same points.
    """
    u, v = (part.ravel()[:, None] for part in np.meshgrid(_GRID, _GRID))
    middle, pairs = corners.mean(0), pairwise([*corners, corners[0]])
    return np.concatenate([middle + u * ((1 - v) * (a - middle) + v * (b - middle)) for a, b in pairs])


def _degree_across(half: float) -> int:
    """Degree of a shading along an axis on which a face is twice so many px wide: no more than its width can tell."""
    return _DEGREE if half >= _WIDE else 2 if half >= _NARROW else 1


def _degree(count: int) -> int:
    """Degree of a polynomial in two variables with so many terms."""
    return round((np.sqrt(8 * count + 1) - 3) / 2)


def _powers(degree: int) -> list[tuple[int, int]]:
    return [(total - j, j) for total in range(degree + 1) for j in range(total + 1)]


def _terms(x: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """x^i y^j for i + j <= degree, the lowest first, shape (terms, n)."""
    found = np.empty(((degree + 1) * (degree + 2) // 2, x.size))
    found[0], first = 1.0, 0
    for total in range(1, degree + 1):
        found[first + total : first + 2 * total] = found[first : first + total] * x
        found[first + 2 * total] = found[first + total - 1] * y
        first += total
    return found


@lru_cache(maxsize=32)
def _derivatives(count: int, axis: int) -> np.ndarray:
    """Matrix (count, count) that makes of the `_terms` their derivatives by x (axis 0) or y."""
    powers = _powers(_degree(count))
    matrix = np.zeros((count, count))
    for k, pair in enumerate(powers):
        if pair[axis]:
            matrix[k, powers.index((pair[0] - (axis == 0), pair[1] - (axis == 1)))] = pair[axis]
    return matrix


def near_pixels(
    arrangement: Arrangement, shape: tuple[int, int], reach: float, pairs: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (y, x) of an image (height, width) within ``reach`` px of lines between pairs of vertices as recorded.

    The pairs are those of the required edges where none are given.
    """
    wanted = np.zeros(shape, bool)
    pairs = arrangement.required[arrangement.required[:, 0] >= 0] if pairs is None else pairs
    for start, stop in _segments(arrangement, pairs):
        if np.isfinite([start, stop]).all():
            y, x = pixels_along(start, stop, reach, shape)
            near = distance_to_segment(np.stack([x, y], -1), start, stop) <= reach
            wanted[y[near], x[near]] = True
    return np.nonzero(wanted)


def near_vertices(arrangement: Arrangement, reach: float) -> np.ndarray:
    """Vertices of all pieces that come within ``reach`` px of a required edge, sorted."""
    required = [pair for pair in arrangement.required if pair[0] >= 0]
    found = set()
    for piece in arrangement.pieces:
        start, stop = arrangement.vertices[piece]
        points = start + np.linspace(0, 1, 33)[:, None] * (stop - start)
        near = (distance_to_segment(points, *arrangement.vertices[pair]).min() <= reach for pair in required)
        if any(near):
            found |= set(piece.tolist())
    return np.array(sorted(found), int)


def _segments(arrangement: Arrangement, pairs: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Recorded pieces of the lines between pairs of vertices, short enough to be straight."""
    t = np.linspace(0, 1, 2 if arrangement.camera is None else 9)[:, None]
    found = []
    for a, b in pairs:
        start, stop = arrangement.vertices[[a, b]]
        found += list(pairwise(arrangement.recorded(start + t * (stop - start))))
    return found
