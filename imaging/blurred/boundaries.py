"""The boundaries of brightness near places of the image: the edges' images, with the levels on both sides.

A face's brightness is taken as linear over the few px that a blur reaches: its level and gradient are those where the
ray through the place meets the face's plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from imaging.blurred.segment import Segments
from imaging.geometry.lens import image_centre, recorded
from imaging.geometry.projection import camera_frame, divisor, edge_points, facing, from_axis, in_space
from imaging.geometry.visibility import boundaries
from imaging.geometry.visibility import seen as visible_at
from imaging.light.appearance import face_signal, is_plain
from imaging.light.between import light_between
from imaging.light.edge_sides import side_signals, sides_of_one
from imaging.light.illumination import fall
from imaging.pictures import Pictures
from scenes import Edge, Solid

_MAGNIFIED = 2.0  # by a lens that bends, at most, where boundaries are looked for
_STEP = 0.01  # px; levels are differentiated forwards
_SUPPORT = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2  # fractions of an edge's image at which levels are computed


@dataclass(frozen=True, eq=False)
class Places:
    """Places (N, E, n) on the images of E edges in N pictures.

    Attributes
    ----------
    names : tuple of str
        The edges.
    fractions : ndarray, shape (N, E, n)
        Of the edge's length in the image.
    axes : ndarray, shape (N, E, n, 2, 2)
        Rows: unit directions in the recorded image along the edge and across it.
    lens : ndarray, shape (N, E, n, 2, 2)
        Derivative of the recorded by the ideal coordinates.
    """

    names: tuple[str, ...]
    fractions: np.ndarray
    axes: np.ndarray
    lens: np.ndarray


@dataclass(frozen=True, eq=False)
class Boundaries:
    """P segments near places.

    Attributes
    ----------
    place : ndarray of int, shape (P,)
        Flat index of the place (N * E * n).
    own : ndarray of bool, shape (P,)
        Whether it is the image of the edge that the place lies on.
    segments : Segments
        Seen from the place, n being the direction across the place's edge; recorded px.
    sides, kinks : ndarray, shape (P, 2)
        Levels at the place nearest to it and their derivatives along n, on the side opposite to the segment's normal
        and on the normal's; grey levels and grey levels a px.
    unknown : ndarray of bool, shape (N * E * n,)
        Places near an edge of an obstacle, whose levels are not asked for.
    """

    place: np.ndarray
    own: np.ndarray
    segments: Segments
    sides: np.ndarray
    kinks: np.ndarray
    unknown: np.ndarray


def boundaries_near(pictures: Pictures, places: Places, far: float, close: float) -> Boundaries:
    """The visible edges of the object within ``far`` px of places, in pictures with one leading axis.

    Edges of obstacles make a place ``unknown`` where they are within ``close`` px.

    In a plain scene a side's level is its face's, or darkness; else it is what `side_signals` says at the nearest point
    of the edge. Edges of obstacles, and of shadows on other faces or the floor, are not among them.
    """
    solid = pictures.scene.solid
    pairs = _pairs(pictures, places, far)
    start, along = _seen_from(pictures, places, pairs)
    length = np.linalg.norm(along, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = along / length[..., None]
        foot = -(start * unit).sum(-1)
        apart = unit[..., 0] * start[..., 1] - unit[..., 1] * start[..., 0]
        distance = np.hypot(apart, np.maximum(np.maximum(-foot, foot - length), 0.0))
    picture, edge, other = pairs
    count = distance.shape[1]
    place = (picture * len(places.names) + edge)[:, None] * count + np.arange(count)
    ours = other < len(solid.edges)
    unknown = np.zeros(places.fractions.size, bool)
    pair, which = np.nonzero((distance < close) & ~ours[:, None])
    nearest = np.clip(foot[pair, which] / length[pair, which], 0, 1)
    unknown[place[pair, which][_shown(pictures, picture[pair], other[pair], nearest)]] = True
    pair, which = np.nonzero((distance < far) & ours[:, None])
    unit, foot, apart, length = unit[pair, which], foot[pair, which], apart[pair, which], length[pair, which]
    at = picture[pair], edge[pair], which
    sides, gradients = _sides(pictures, places, at, other[pair], np.clip(foot / length, 0, 1))
    jump = gradients[:, 1] - gradients[:, 0]
    slope = (unit * jump).sum(-1)
    level = sides[:, 1] - sides[:, 0]
    if is_plain(pictures.scene):  # levels are those of the place, and change on the way to the foot
        level = level + apart * (unit[:, 0] * jump[:, 1] - unit[:, 1] * jump[:, 0])
    else:
        level = level - slope * (np.clip(foot, 0, length) - foot)
    segments = Segments(-foot, length - foot, apart, unit[:, 0], unit[:, 1], level, slope, jump[:, 1])
    own = np.array([solid.edges.index(solid.edge(name)) for name in places.names])[edge] == other
    return Boundaries(place[pair, which], own[pair], segments, sides, gradients[..., 1], unknown)


def _pairs(pictures: Pictures, places: Places, far: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(picture, edge with places, visible edge of the bodies that may be near it), each (K,): some are not near."""
    solid, bodies = pictures.scene.solid, pictures.scene.bodies
    far = far * (_MAGNIFIED if pictures.scene.camera.lens.bends else 1)
    images = from_axis(bodies.vertices, pictures.sensors, pictures.scene.camera)
    first, last = (images[:, [solid.edge(name).ends[k] for name in places.names], None] for k in (0, 1))
    ends = [images[:, None, [edge.ends[k] for edge in bodies.edges]] - first for k in (0, 1)]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (last - first) / np.linalg.norm(last - first, axis=-1, keepdims=True)
    lengths = ((last - first) * t).sum(-1)
    along = [end[..., 0] * t[..., 0] + end[..., 1] * t[..., 1] for end in ends]
    across = [end[..., 1] * t[..., 0] - end[..., 0] * t[..., 1] for end in ends]
    seen = boundaries(bodies, bodies.edges, facing(bodies, pictures.viewpoint))[:, None]
    beside = (np.minimum(*across) < far) & (np.maximum(*across) > -far)
    reached = (np.maximum(*along) > places.fractions.min(-1)[..., None] * lengths - far) & (
        np.minimum(*along) < places.fractions.max(-1)[..., None] * lengths + far
    )
    return np.nonzero(seen & beside & reached)


def _seen_from(pictures: Pictures, places: Places, pairs) -> tuple[np.ndarray, np.ndarray]:
    """First end of each pair's other edge and the way to its other end, (K, n, 2), in the places' axes, px."""
    picture, edge, other = pairs
    solid, bodies = pictures.scene.solid, pictures.scene.bodies
    images = from_axis(bodies.vertices, pictures.sensors, pictures.scene.camera)
    own = np.array([solid.edge(name).ends for name in places.names])[edge]
    ends = np.array([edge.ends for edge in bodies.edges])[other]
    first, last, start, stop = (images[picture, end][:, None] for end in (*own.T, *ends.T))
    here = first + places.fractions[picture, edge][..., None] * (last - first)
    turn = (places.axes @ places.lens)[picture, edge]
    return _turned(turn, start - here), _turned(turn, stop - start)


def _turned(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Products of (..., 2, 2) and (..., 2)."""
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([matrices[..., i, 0] * x + matrices[..., i, 1] * y for i in (0, 1)], -1)


def _sides(pictures: Pictures, places: Places, at: tuple[np.ndarray, ...], other: np.ndarray, nearest: np.ndarray):
    """Levels (P, 2) on both sides of edges ``other`` and their gradients (P, 2, 2) in the axes of the places ``at``."""
    solid, (picture, edge, which) = pictures.scene.solid, at
    faces = sided(solid)[other]
    seen = facing(solid, pictures.viewpoint)[picture[:, None], faces]
    found = np.zeros((*faces.shape, 3))
    for side in (0, 1):
        rows = seen[:, side]
        found[rows, side] = _of_face(pictures, places, picture[rows], edge[rows], which[rows], faces[rows, side])
    turn = places.axes[at]
    if pictures.scene.camera.lens.bends:
        turn = turn @ np.swapaxes(np.linalg.inv(places.lens[at]), -1, -2)
    gradients = _turned(turn[:, None], found[..., 1:])
    if is_plain(pictures.scene):
        return found[..., 0], gradients
    levels = _looked_at(pictures, picture, other, nearest)
    if pictures.scene.camera.is_dimmed:  # what is seen past an edge changes as the lens' light does
        falls = _turned(places.axes[at], fall(pictures.scene.camera, _recorded(pictures, places, at)))
        gradients = np.where(seen[..., None], gradients, levels[..., None] * falls[:, None])
    return levels, np.where((levels > 0)[..., None], gradients, 0.0)


def _recorded(pictures: Pictures, places: Places, at: tuple[np.ndarray, ...]) -> np.ndarray:
    """Where the places ``at`` are recorded, (P, 2), px."""
    solid, camera, (picture, edge, _) = pictures.scene.solid, pictures.scene.camera, at
    images = image_centre(camera) + from_axis(solid.vertices, pictures.sensors, camera)
    own = np.array([solid.edge(name).ends for name in places.names])[edge]
    first, last = (images[picture, end] for end in own.T)
    return recorded(first + places.fractions[at][:, None] * (last - first), camera)


def _of_face(pictures: Pictures, places: Places, picture, edge, which, face) -> np.ndarray:
    """Signal of faces (P,) at places, and its derivatives by x and y, (P, 3): a cubic along each edge."""
    faces = len(pictures.scene.solid.faces)
    asked, back = np.unique((picture * len(places.names) + edge) * faces + face, return_inverse=True)
    of_edge, of_face = np.divmod(asked, faces)
    fields = _face_fields(pictures, places.names, *np.divmod(of_edge, len(places.names)), of_face)
    weights = _interpolation(places.fractions[picture, edge, which])
    return (weights[:, None] @ fields[back])[:, 0]


def _face_fields(pictures: Pictures, names: tuple[str, ...], picture, edge, face) -> np.ndarray:
    """Signal of faces (T,) where rays through edges meet their planes, and its derivatives by x and y (ideal px).

    Shape (T, support, 3); whether the face is seen does not matter.
    """
    solid, camera = pictures.scene.solid, pictures.scene.camera
    of_each = pictures.at(*_of_each(pictures, picture))
    axes = camera_frame(camera, of_each.sensors)
    ends = np.array([solid.edge(name).ends for name in names])
    near, far = (divisor(solid.vertices[ends[:, k]], pictures.sensors, camera)[picture, edge][:, None] for k in (0, 1))
    spatial = in_space(_SUPPORT, near, far)
    start, stop = (solid.vertices[ends[edge, k]][:, None] for k in (0, 1))
    points = start + spatial[..., None] * (stop - start)
    pixel = (near + spatial * (far - near))[..., None] / camera.focal_px
    steps = np.stack([0 * points, *(_STEP * pixel * axis[:, None] for axis in (axes.right, axes.down))], -2)
    places = points[..., None, :] + steps
    rays = -of_each.viewpoint.widened(2).towards(places)
    normal = solid.normals[face][:, None, None]
    heights = solid.offsets[face][:, None, None] - (places * normal).sum(-1)
    with np.errstate(all="ignore"):
        met = places + (heights / (rays * normal).sum(-1))[..., None] * rays
        values = face_signal(of_each, met, face[:, None, None], 2, prints=False) + light_between(
            of_each, met, face[:, None, None]
        )
        values = np.nan_to_num(values, posinf=0.0, neginf=0.0)
    return np.concatenate([values[..., :1], (values[..., 1:] - values[..., :1]) / _STEP], -1)


@lru_cache(maxsize=16)
def sided(solid: Solid) -> np.ndarray:
    """Faces on both sides of each edge, (J, 2): opposite to the normal (-t_y, t_x) of its image, and on the normal's.

    Seen from outside, a face lies to the left of an edge that runs around it counter-clockwise: opposite to that normal
    in an image whose y axis points down.
    """
    faces = np.array([edge.faces for edge in solid.edges])
    ends = solid.vertices[[edge.ends for edge in solid.edges]]
    inwards = np.cross(solid.normals[faces[:, 0]], ends[:, 1] - ends[:, 0])
    below = (inwards * solid.normals[faces[:, 1]]).sum(-1) < 0
    left = below == np.array([edge.convex for edge in solid.edges])
    return np.where(left[:, None], faces, faces[:, ::-1])


def _interpolation(fractions: np.ndarray) -> np.ndarray:
    """Lagrange's weights of the values at `_SUPPORT`, one more axis."""
    apart = fractions[..., None] - _SUPPORT
    others = ~np.eye(_SUPPORT.size, dtype=bool)
    return np.stack([(apart[..., o] / (s - _SUPPORT[o])).prod(-1) for s, o in zip(_SUPPORT, others, strict=True)], -1)


def _looked_at(pictures: Pictures, picture: np.ndarray, other: np.ndarray, nearest: np.ndarray) -> np.ndarray:
    """Levels (P, 2) beside edges ``other`` at fractions of their images, as the sensor sees them."""
    solid = pictures.scene.solid
    beside, levels = sided(solid), np.empty((other.size, 2))
    numbers, which = np.unique(other, return_inverse=True)
    edges = [solid.edges[number] for number in numbers]
    if len(pictures.sensors) == 1:
        levels = _in_one(pictures, edges, which, nearest)
    else:
        for number, edge in enumerate(edges):
            rows = np.flatnonzero(which == number)
            spatial = _in_space(pictures, solid, edge, picture[rows], nearest[rows])
            alone = pictures.at(*_of_each(pictures, picture[rows]))
            points = edge_points(solid, (edge.name,), spatial[:, None, None])
            levels[rows] = side_signals(alone, (edge.name,), points)[:, 0, :, 0]
    first = np.array([edge.faces[0] for edge in edges], int)[which]
    return np.where((beside[other, 0] == first)[:, None], levels, levels[:, ::-1])


def _in_one(pictures: Pictures, edges: Sequence[Edge], which: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """The same of one picture, all edges at once: levels (P, 2) of the sides of edges, ``which`` (P,)."""
    vertices, alone = pictures.scene.solid.vertices, pictures.at(*_of_each(pictures, 0))
    ends = vertices[np.array([edge.ends for edge in edges], int).reshape(-1, 2)]
    near, far = np.moveaxis(divisor(ends, alone.sensors, pictures.scene.camera)[which], 1, 0)
    start, stop = np.moveaxis(ends[which], 1, 0)
    return sides_of_one(alone, edges, which, start + in_space(fractions, near, far)[:, None] * (stop - start)).T


def _shown(pictures: Pictures, picture: np.ndarray, other: np.ndarray, nearest: np.ndarray) -> np.ndarray:
    """Whether the sensor sees edges ``other`` of the bodies at fractions of their images, bool (P,)."""
    bodies, found = pictures.scene.bodies, np.zeros(other.size, bool)
    for which in np.unique(other):
        edge, rows = bodies.edges[which], np.flatnonzero(other == which)
        spatial = _in_space(pictures, bodies, edge, picture[rows], nearest[rows])
        found[rows] = visible_at(bodies, edge, pictures.viewpoint[picture[rows]], spatial[:, None])[:, 0]
    return found


def _in_space(pictures: Pictures, solid: Solid, edge: Edge, picture: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Fractions (P,) of an edge's length in space from those of its image's."""
    near, far = (
        divisor(solid.vertices[[end]], pictures.sensors, pictures.scene.camera)[picture, 0] for end in edge.ends
    )
    return in_space(fractions, near, far)


def _of_each(pictures: Pictures, picture: np.ndarray):
    """Poses of the sensor and of each light for pictures (P,)."""
    return pictures.sensors[picture], tuple(poses[picture] for poses in pictures.lights)
