"""What is measured, as a function of the edges' lines: its value, its derivatives, and its scale in the object.

An edge's line is found with two errors: d, its displacement along its normal (px) at the edge's first end, and theta,
its rotation (rad). To first order a measured quantity moves by the sum over edges of offset d + tilt theta, and by
pull . (error of the centre) for each circle. The same edge in both corners is one line, not two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.features.projected_edges import ProjectedEdges, projected_edges, straight
from planner.imaging.lens import image_centre
from planner.imaging.pictures import Pictures
from planner.imaging.projection import from_axis, jacobian_ideal, project_ideal
from scenes import Centre, Corner, Edge, Scene, Task

_DEGREE = float(np.degrees(1.0))


@dataclass(frozen=True)
class Measurand:
    """The measurand for sensor poses of leading shape (...); px and cm for a distance, degrees for an angle.

    Attributes
    ----------
    view : ProjectedEdges
        The E different straight edges that it depends on.
    value : ndarray, shape (...)
        In the image (ideal coordinates: the lens' distortion undone).
    value_object : float
        In the object.
    scale : ndarray, shape (...)
        Derivative of the value in the image by the value in the object: px / cm, or 1.
    offset, tilt : ndarray, shape (..., E)
        Derivatives of the value in the image by d and theta.
    pull : ndarray, shape (..., 2)
        Unit vector along a distance; the derivative by the position of the end, its negative by that of the start.
    points : ndarray, shape (..., 2, 2)
        Images of the two features (x, y), ideal px; of the edges' middles for an angle.
    """

    view: ProjectedEdges
    value: np.ndarray
    value_object: float
    scale: np.ndarray
    offset: np.ndarray
    tilt: np.ndarray
    pull: np.ndarray
    points: np.ndarray


def measurand(pictures: Pictures) -> Measurand:
    """The task's measurand as the sensors see it, found once for each set of pictures."""
    return pictures.once("measurand", lambda: _measurand(pictures))


def _measurand(pictures: Pictures) -> Measurand:
    scene = pictures.scene
    view = projected_edges(pictures, tuple(dict.fromkeys(straight(scene))))
    with np.errstate(divide="ignore", invalid="ignore"):
        return (_distance if scene.task.kind == "distance" else _angle)(scene, pictures.sensors, view)


def required_edges(scene: Scene) -> tuple[Task, ...]:
    """Every task that measures the same with other edges: the paper's required edge list (eq. 11).

    A corner can be found from any two edges that meet in it; the circle of a centre and the lines of an angle stay.

    Examples
    --------
    >>> import scenes
    >>> [" ".join(task.edges) for task in required_edges(scenes.load("task1"))][:3]
    ['e2 e4 e6 e7', 'e2 e4 e6 e11', 'e2 e4 e7 e11']
    """
    if scene.task.kind == "angle":
        return (scene.task,)
    options = []
    for feature in scene.task.corners:
        if isinstance(feature, Centre):
            options.append([feature])
            continue
        there = [edge.name for edge in scene.solid.edges_at(feature.vertex)]
        pairs = [(a, b) for i, a in enumerate(there) for b in there[i + 1 :]]
        options.append([Corner(vertex=feature.vertex, edges=pair) for pair in pairs])
    return tuple(Task(start=start, end=end) for start in options[0] for end in options[1])


def _distance(scene: Scene, sensors: np.ndarray, view: ProjectedEdges) -> Measurand:
    solid = scene.solid
    places = np.array([_place(scene, feature) for feature in scene.task.corners])
    points = from_axis(places, sensors, scene.camera)
    across = points[..., 1, :] - points[..., 0, :]
    points = points + image_centre(scene.camera)
    value = np.linalg.norm(across, axis=-1)
    pull = across / value[..., None]
    offset = np.zeros((*value.shape, len(view.names)))
    tilt = np.zeros_like(offset)
    for sign, feature in zip((-1, 1), scene.task.corners, strict=True):
        if isinstance(feature, Corner):
            _add_corner(sign * pull, view, [solid.edge(name) for name in feature.edges], feature, solid, offset, tilt)
    length = float(np.linalg.norm(places[1] - places[0]))
    derivative = jacobian_ideal(places, sensors, scene.camera).sum(-3) / 2 @ ((places[1] - places[0]) / length)
    scale = np.einsum("...i,...i->...", pull, derivative)
    return Measurand(view, value, length, scale, offset, tilt, pull, points)


def _add_corner(gradient, view: ProjectedEdges, edges: list[Edge], feature: Corner, solid, offset, tilt) -> None:
    """Add a corner's part to the derivatives: it moves by N^-1 (d1, d2), the rows of N being the two normals."""
    index = [view.names.index(edge.name) for edge in edges]
    response = np.einsum("...i,...ij->...j", gradient, corner_response(normals(view)[..., index, :]))
    for k, (i, edge) in enumerate(zip(index, edges, strict=True)):
        last = edge.ends.index(solid.vertex_names.index(feature.vertex)) == 1
        offset[..., i] += response[..., k]
        tilt[..., i] += response[..., k] * (view.lengths[..., i] if last else 0.0)


def normals(view: ProjectedEdges) -> np.ndarray:
    """Unit normal of each edge's image, (-t_y, t_x) of its direction t, shape (..., E, 2)."""
    along = view.along / np.where(view.lengths > 0, view.lengths, np.nan)[..., None]
    return np.stack([-along[..., 1], along[..., 0]], -1)


def corner_response(pair: np.ndarray) -> np.ndarray:
    """Derivative of the crossing of two lines by their displacements: the inverse of their normals (..., 2, 2)."""
    (a1, b1), (a2, b2) = (np.moveaxis(pair[..., k, :], -1, 0) for k in (0, 1))
    rows = np.stack([np.stack([b2, -b1], -1), np.stack([-a2, a1], -1)], -2)
    return rows / (a1 * b2 - a2 * b1)[..., None, None]


def _place(scene: Scene, feature: Corner | Centre) -> np.ndarray:
    if isinstance(feature, Centre):
        return scene.solid.circle(feature.circle).centre
    return scene.solid.vertex(feature.vertex)


def _angle(scene: Scene, sensors: np.ndarray, view: ProjectedEdges) -> Measurand:
    """Angle between two edges, from their common vertex if they have one; both turn by half in their common plane."""
    solid = scene.solid
    edges = [solid.edge(name) for name in scene.task.lines]
    ends = [list(edge.ends) for edge in edges]
    shared = set(ends[0]) & set(ends[1])
    ends = [e if not shared or e[0] in shared else e[::-1] for e in ends]
    lines = np.array([solid.vertices[e[1]] - solid.vertices[e[0]] for e in ends])
    lines /= np.linalg.norm(lines, axis=1, keepdims=True)
    axis = np.cross(*lines)
    inside = _DEGREE * np.arctan2(np.linalg.norm(axis), lines[0] @ lines[1])
    pivots = np.array([solid.vertices[e[0]] if shared else solid.vertices[e].mean(0) for e in ends])
    derivative = jacobian_ideal(pivots, sensors, scene.camera)
    images = np.einsum("...kij,kj->...ki", derivative, lines)
    turning = np.cross(axis / max(np.linalg.norm(axis), np.finfo(float).tiny), lines)
    moved = np.einsum("...kij,kj->...ki", derivative, turning)
    rates = _cross(images, moved) / (images**2).sum(-1)
    crossing = _cross(images[..., 0, :], images[..., 1, :])
    value = _DEGREE * np.arctan2(np.abs(crossing), (images[..., 0, :] * images[..., 1, :]).sum(-1))
    sign = np.sign(crossing)
    scale = sign * rates.sum(-1) / 2
    tilt = _DEGREE * np.stack([-sign, sign], -1)
    points = project_ideal(pivots, sensors, scene.camera)
    return Measurand(view, value, float(inside), scale, np.zeros_like(tilt), tilt, np.zeros((*value.shape, 2)), points)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
