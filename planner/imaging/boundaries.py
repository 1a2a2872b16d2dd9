"""The boundaries of brightness near places of the image: the edges' images, with the levels on both sides.

A face's brightness is taken as linear over the few px that a blur reaches: its level and gradient are those where the
ray through the place meets the face's plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.imaging.appearance import is_plain, side_signals, signal
from planner.imaging.blurred_segment import Segments
from planner.imaging.pictures import Pictures
from planner.imaging.projection import depth, edge_points, facing, frame, from_axis
from scenes import Solid

_STEP = 0.01  # px; levels are differentiated forwards
_SUPPORT = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2  # fractions of an edge's image at which levels are computed


@dataclass(frozen=True)
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


@dataclass(frozen=True)
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


def boundaries_near(pictures: Pictures, places: Places, far: float) -> Boundaries:
    """The visible edges of the object within ``far`` px of places, in pictures with one leading axis.

    In a plain scene a side's level is its face's, or darkness; else it is what `side_signals` says at the nearest point
    of the edge. Edges of obstacles, and of shadows on other faces or the floor, are not among them.
    """
    solid, bodies = pictures.scene.solid, pictures.scene.bodies
    start, along = _seen_from(pictures, places)
    length = np.linalg.norm(along, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = along / length[..., None]
        foot = -(start * unit).sum(-1)
        apart = unit[..., 0] * start[..., 1] - unit[..., 1] * start[..., 0]
        distance = np.hypot(apart, np.maximum(np.maximum(-foot, foot - length), 0.0))
    seen = facing(bodies, pictures.sensor_at)[:, [edge.faces for edge in bodies.edges]].any(-1)
    near, ours = (distance < far) & seen[:, None, None], np.arange(len(bodies.edges)) < len(solid.edges)
    index = np.nonzero(near & ours)
    unit, foot, apart, length = unit[index], foot[index], apart[index], length[index]
    sides, gradients = _sides(pictures, places, index, np.clip(foot / length, 0, 1))
    jump = gradients[:, 1] - gradients[:, 0]
    slope = (unit * jump).sum(-1)
    level = sides[:, 1] - sides[:, 0]
    if is_plain(pictures.scene):  # levels are those of the place, and change on the way to the foot
        level = level + apart * (unit[:, 0] * jump[:, 1] - unit[:, 1] * jump[:, 0])
    else:
        level = level - slope * (np.clip(foot, 0, length) - foot)
    segments = Segments(-foot, length - foot, apart, unit[:, 0], unit[:, 1], level, slope, jump[:, 1])
    own = np.array([solid.edges.index(solid.edge(name)) for name in places.names])[index[1]] == index[3]
    return Boundaries(
        np.ravel_multi_index(index[:3], distance.shape[:3]), own, segments, sides, gradients[..., 1],
        (near & ~ours).any(-1).ravel(),
    )  # fmt: skip


def _seen_from(pictures: Pictures, places: Places) -> tuple[np.ndarray, np.ndarray]:
    """First end of each edge of the bodies and the way to its other end, (N, E, n, J, 2), in the places' axes, px."""
    scene, solid = pictures.scene, pictures.scene.bodies
    images = from_axis(solid.vertices, pictures.sensors, scene.camera)
    first, last = (images[:, [solid.edge(name).ends[k] for name in places.names], None] for k in (0, 1))
    here = first + places.fractions[..., None] * (last - first)
    ends = images[:, [edge.ends for edge in solid.edges]]
    away = np.einsum(
        "neaij,neajk,neavlk->neavli", places.axes, places.lens, ends[:, None, None] - here[:, :, :, None, None]
    )
    return away[..., 0, :], away[..., 1, :] - away[..., 0, :]


def _sides(pictures: Pictures, places: Places, index: tuple[np.ndarray, ...], nearest: np.ndarray):
    """Levels (P, 2) on both sides of edges ``index[3]`` and their gradients (P, 2, 2) in the places' axes."""
    solid = pictures.scene.solid
    seen = facing(solid, pictures.sensor_at)
    shown, face_of = np.unique(np.array([_sided(solid)]), return_inverse=True)
    face_of = face_of.reshape(-1, 2)[index[3]]
    fields = _face_fields(pictures, places, shown)
    found = fields[(*(i[:, None] for i in index[:3]), face_of)]
    found = np.where(seen[index[0][:, None], shown[face_of], None], found, 0.0)
    back = np.linalg.inv(places.lens[index[:3]]) if pictures.scene.camera.lens.bends else places.lens[index[:3]]
    gradients = np.einsum("pij,pkj,pak->pai", places.axes[index[:3]], np.swapaxes(back, -1, -2), found[..., 1:])
    if is_plain(pictures.scene):
        return found[..., 0], gradients
    levels = _looked_at(pictures, index, nearest)
    return levels, np.where((levels > 0)[..., None], gradients, 0.0)


def _sided(solid: Solid) -> np.ndarray:
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


def _face_fields(pictures: Pictures, places: Places, faces: np.ndarray) -> np.ndarray:
    """Signal of faces where the rays through the places meet their planes, and its derivatives by x and y (ideal px).

    Shape (N, E, n, F, 3); whether the face is seen does not matter. A cubic in the fraction of the edge's length.
    """
    scene, solid, camera = pictures.scene, pictures.scene.solid, pictures.scene.camera
    at, axes = pictures.sensor_at[:, None, None, None], frame(pictures.sensors)
    ends = solid.vertices[[solid.edge(name).ends for name in places.names]]
    near, far = (depth(ends[:, k], pictures.sensors, camera)[..., None] for k in (0, 1))
    spatial = _SUPPORT * near / (far + _SUPPORT * (near - far))
    points = edge_points(solid, places.names, spatial)
    pixel = (near + spatial * (far - near))[..., None] / camera.focal_px
    steps = [0 * points, *(_STEP * pixel * axis[:, None, None] for axis in (axes.right, axes.down))]
    rays = (points[..., None, :] + np.stack(steps, -2))[..., None, :] - at[..., None, :]
    heights = solid.offsets[faces] - pictures.sensor_at @ solid.normals[faces].T
    with np.errstate(all="ignore"):
        reach = heights[:, None, None, None] / (rays[..., 0, :] @ solid.normals[faces].T)
        met = at[..., None, :] + reach[..., None] * rays
        values = np.nan_to_num(signal(pictures, met, solid.normals[faces], 4), posinf=0.0, neginf=0.0)
    values = np.moveaxis(values, -2, -1)  # (N, E, support, F, 3)
    fields = np.concatenate([values[..., :1], (values[..., 1:] - values[..., :1]) / _STEP], -1)
    return np.einsum("neas,nesfc->neafc", _interpolation(places.fractions), fields)


def _interpolation(fractions: np.ndarray) -> np.ndarray:
    """Lagrange's weights of the values at `_SUPPORT`, one more axis."""
    apart = fractions[..., None] - _SUPPORT
    others = ~np.eye(_SUPPORT.size, dtype=bool)
    return np.stack(
        [(apart[..., o] / (s - _SUPPORT[o])).prod(-1) for s, o in zip(_SUPPORT, others, strict=True)], -1
    )


def _looked_at(pictures: Pictures, index: tuple[np.ndarray, ...], nearest: np.ndarray) -> np.ndarray:
    """Levels (P, 2) beside edges ``index[3]`` at fractions of their images, as the sensor sees them."""
    scene, solid = pictures.scene, pictures.scene.solid
    sided, levels = _sided(solid), np.empty((index[0].size, 2))
    for which in np.unique(index[3]):
        edge, rows = solid.edges[which], np.flatnonzero(index[3] == which)
        picture = index[0][rows]
        near, far = (depth(solid.vertices[[end]], pictures.sensors, scene.camera)[picture, 0] for end in edge.ends)
        spatial = nearest[rows] * near / (far + nearest[rows] * (near - far))
        alone = Pictures(scene, *_of_each(pictures, picture))
        found = side_signals(alone, (edge.name,), edge_points(solid, (edge.name,), spatial[:, None, None]))[:, 0, :, 0]
        levels[rows] = found if sided[which, 0] == edge.faces[0] else found[:, ::-1]
    return levels


def _of_each(pictures: Pictures, picture: np.ndarray):
    """Poses of the sensor and of each light for pictures (P,)."""
    return pictures.sensors[picture], tuple(poses[picture] for poses in pictures.lights)
