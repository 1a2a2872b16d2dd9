"""What a scene's pictures are expected to show of its measurands: values, derivatives, required edges.

To first order a measured quantity moves by gradient . errors, the errors being those of lines and circles as numbered
in `imaging.features.seen`. The same edge in several features is one line, not several.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from imaging.boards.seen import SeenBoard, seen_board
from imaging.features.kinds import Evaluated, in_image, on_plane
from imaging.features.placing import Placing
from imaging.features.projected_edges import ProjectedEdges, circles, corner_features, projected_edges
from imaging.features.seen import Seen, corner_response, half_angle_of, unit_normals
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import from_axis
from imaging.pictures import Pictures
from scenes import Centre, Corner, Quantity, Scene, Task
from scenes.measurands.features import is_line
from scenes.measurands.form import forms_of
from scenes.placement import components

__all__ = ["Measurand", "Measurands", "corner_response", "measurand", "measurands", "normals", "required_edges"]


@dataclass(frozen=True)
class Measurands:
    """All M quantities of a scene for sensor poses of leading shape (...).

    Values in the image are px, in the object the scene's unit; degrees for angles.

    Attributes
    ----------
    quantities : tuple of Quantity
    view : ProjectedEdges
        The E different straight edges that they depend on.
    seen : Seen
        What they are found from.
    placing : Placing, optional
        How they tell where the part lies, where that is not known.
    """

    quantities: tuple[Quantity, ...]
    view: ProjectedEdges
    seen: Seen
    placing: Placing | None = None

    @property
    def circles(self) -> tuple[str, ...]:
        """The C circles that they depend on."""
        return self.seen.circles

    @property
    def datums(self) -> tuple[str, ...]:
        """Names of what tells where the part lies: features of the part, or the board beside it."""
        return () if self.placing is None else self.placing.features

    @property
    def board(self) -> SeenBoard | None:
        """What stands beside the part and tells where it lies."""
        return None if self.placing is None else self.placing.board

    @property
    def value(self) -> np.ndarray:
        """In the image (ideal coordinates: the lens' distortion undone), shape (..., M)."""
        return self._image[0]

    @property
    def gradient(self) -> np.ndarray:
        """Derivatives of the values in the image by the parameters of `Seen`, shape (..., M, q)."""
        return self._image[1]

    @cached_property
    def value_object(self) -> np.ndarray:
        """In the object, shape (M,)."""
        found = self._plane[0].reshape(-1, len(self.quantities))
        return found[0] if len(found) else np.full(len(self.quantities), np.nan)

    @property
    def gradient_object(self) -> np.ndarray:
        """The same of the values on the planes of the features, shape (..., M, q), the part's place known."""
        return self._plane[1]

    @cached_property
    def _image(self) -> tuple[np.ndarray, np.ndarray]:
        return self._found(in_image)

    @cached_property
    def _plane(self) -> tuple[np.ndarray, np.ndarray]:
        return self._found(on_plane)

    def _found(self, kind: Callable[[Seen, Quantity], Evaluated]) -> tuple[np.ndarray, np.ndarray]:
        lead = self.seen.sensors.shape[:-1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            found = [kind(self.seen, quantity) for quantity in self.quantities]
            values = np.stack([np.broadcast_to(each.value, lead) for each in found], -1)
            return values, dense(found, lead, self.seen.count)

    def of_lines(self, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A gradient's parts by displacement and rotation of each line, each (..., M, E)."""
        last = 2 * len(self.view.names)
        return gradient[..., 0:last:2], gradient[..., 1:last:2]

    def of_circle(self, gradient: np.ndarray, c: int) -> np.ndarray:
        """A gradient's part by the parameters of the c-th circle, (..., M, 3) or (..., M, 4)."""
        return gradient[..., self.seen.numbers(c)]

    def depends(self) -> np.ndarray:
        """Which quantity needs which edges, then circles, bool, shape (M, E + C)."""
        names = [*self.view.names, *self.circles]
        return np.array([[name in quantity.edges for name in names] for quantity in self.quantities])


@dataclass(frozen=True, eq=False)
class Measurand:
    """One of them: that which the task is about, or the first.

    Attributes
    ----------
    view : ProjectedEdges
        The straight edges of all.
    value : ndarray, shape (...)
        px, or degrees.
    value_object : float
        The scene's unit, or degrees.
    offset, tilt, offset_object, tilt_object : ndarray, shape (..., E)
        Derivatives of the value in the image and in the object by d and theta.
    points : ndarray, shape (..., 2, 2)
        Images of its two features (x, y), ideal px; of an edge the first end; of one feature twice the same.
    """

    view: ProjectedEdges
    value: np.ndarray
    value_object: float
    offset: np.ndarray
    tilt: np.ndarray
    offset_object: np.ndarray
    tilt_object: np.ndarray
    points: np.ndarray


def measurands(pictures: Pictures) -> Measurands:
    """The scene's quantities as the sensors see them, found once for each set of pictures."""
    return pictures.once("measurands", lambda: _measurands(pictures))


def measurand(pictures: Pictures, number: int = 0) -> Measurand:
    """One of them by its number."""
    return pictures.once(("measurand", number), lambda: _one(measurands(pictures), number))


def _measurands(pictures: Pictures) -> Measurands:
    view = projected_edges(pictures)
    seen = expected(pictures, view)
    placing = Placing.of(pictures.scene, seen, seen_board(pictures, seen))
    return Measurands(pictures.scene.quantities, view, seen, placing)


def dense(found: list[Evaluated], lead: tuple[int, ...], count: int) -> np.ndarray:
    """Gradients of M quantities by all parameters, shape (*lead, M, count)."""
    whole = np.zeros((*lead, len(found), count))
    for m, each in enumerate(found):
        for k, value in each.gradient.items():
            whole[..., m, k] = value
    return whole


def expected(pictures: Pictures, view: ProjectedEdges) -> Seen:
    """What sensors see of an object that is as the scene says."""
    scene, solid, sensors = pictures.scene, pictures.scene.solid, pictures.sensors
    edges = [solid.edge(name) for name in view.names]
    starts = from_axis(solid.vertices[np.array([edge.ends[0] for edge in edges], int)], sensors, scene.camera)
    corners = corner_features(scene)
    images = from_axis(np.array([solid.vertex(c.vertex) for c in corners]).reshape(-1, 3), sensors, scene.camera)
    rims = [solid.round(name) for name in circles(scene)]
    lead = sensors.shape[:-1]
    return Seen(
        solid=solid,
        camera=scene.camera,
        sensors=sensors,
        names=view.names,
        start=starts,
        along=view.along,
        corners={corner: images[..., k, :] for k, corner in enumerate(corners)},
        circles=tuple(rim.name for rim in rims),
        centres=np.broadcast_to(np.array([rim.centre for rim in rims]).reshape(-1, 3), (*lead, len(rims), 3)),
        radii=np.broadcast_to(np.array([rim.radius for rim in rims]), (*lead, len(rims))),
        half_angles=np.broadcast_to(np.array([half_angle_of(rim) for rim in rims]), (*lead, len(rims))),
        expected=True,
        forms={quantity: np.zeros(lead) for quantity in forms_of(scene.quantities)},
        board=0 if scene.placement.board is None else len(components(scene)),
    )


def _one(known: Measurands, number: int) -> Measurand:
    (offset, tilt), (offset_object, tilt_object) = (
        (part[..., number, :] for part in known.of_lines(gradient))
        for gradient in (known.gradient, known.gradient_object)
    )
    return Measurand(
        view=known.view,
        value=known.value[..., number],
        value_object=float(known.value_object[number]),
        offset=offset,
        tilt=tilt,
        offset_object=offset_object,
        tilt_object=tilt_object,
        points=_points(known, known.quantities[number]),
    )


def _points(known: Measurands, quantity: Quantity) -> np.ndarray:
    seen = known.seen
    with np.errstate(divide="ignore", invalid="ignore"):
        places = [
            seen.line(feature, None).start.at if is_line(feature) else seen.point(feature, None).at
            for feature in (quantity.features * 2)[:2]
        ]
    return np.stack(places, -2) + image_centre(seen.camera)


def required_edges(scene: Scene) -> tuple[Task, ...]:
    """Every task that measures the same with other edges: the paper's required edge list (eq. 11).

    A corner can be found from any two edges that meet in it; the circle of a centre and the lines of an angle stay.
    None for a scene that lists measurands.

    Examples
    --------
    >>> import scenes
    >>> [" ".join(task.edges) for task in required_edges(scenes.load("task1"))][:3]
    ['e2 e4 e6 e7', 'e2 e4 e6 e11', 'e2 e4 e7 e11']
    """
    if scene.task is None:
        return ()
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
    return tuple(Task(start=start, end=end) for start, end in product(*options))


def normals(view: ProjectedEdges) -> np.ndarray:
    """Unit normal of each edge's image, (-t_y, t_x) of its direction t, shape (..., E, 2)."""
    return unit_normals(view.along)
