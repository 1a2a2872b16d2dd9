"""What is seen of the features - lines, corners, circles - in the image and, back-projected, on their planes.

The state of a picture is small errors of what was found: of each edge's line the displacement d along its normal (px)
at the edge's first end and the rotation theta (rad); of each circle two shifts of its centre in its plane and the
change of its radius (the scene's unit); of each curved surface, which counts as a circle, the three of
`Curved.parameters`, of a cone four; of each form (`scenes.measurands.form`) its size, which is found from points that
no line or circle stands for (the scene's unit); of a board beside the part the numbers that tell its place
(`imaging.boards.seen`). They are numbered in that order: 2 e, 2 e + 1 for the edge e of E, then the circles
(`Seen.numbers`), then the forms, then the board's. Image coordinates are ideal px from the image's middle, in which
lines are straight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from imaging.geometry.projection import Frame, camera_frame, ray_origins, rays, sensor_position, viewpoint
from scenes import Camera, Centre, Circle, Corner, Curved, Side, Solid, Wall
from scenes.measurands.evaluated import Evaluated, Line, Moves, Point, mean, shared
from scenes.measurands.features import Between, along_of, ends_of, face_beside, place_of, point_of
from scenes.measurands.kind import turn
from scenes.measurands.measurands import Quantity
from scenes.viewpoint import Viewpoint


@dataclass(frozen=True, eq=False)
class Seen:
    """What is seen from sensors of leading shape (...) or found in as many images.

    Attributes
    ----------
    solid : Solid
    camera : Camera
    sensors : ndarray, shape (..., 2)
        Poses, degrees.
    names : tuple of str
        The E edges.
    start, along : ndarray, shape (..., E, 2)
        First end of each edge's line, px from the image's middle, and from there to its last end.
    corners : dict
        Image of each `Corner`, (..., 2), px from the image's middle.
    circles : tuple of str
        The C circles.
    centres : ndarray, shape (..., C, 3)
        Their centres.
    radii, half_angles : ndarray, shape (..., C)
        The latter, rad, of cones; else 0.
    expected : bool
        Whether this is the object itself, whose points need not be sought along the rays.
    forms : dict
        Size (...) of the zone of each `Quantity` that is a form, the scene's unit: 0 of the object itself.
    board : int
        How many parameters a board beside the part has.
    """

    solid: Solid
    camera: Camera
    sensors: np.ndarray
    names: tuple[str, ...]
    start: np.ndarray
    along: np.ndarray
    corners: Mapping[Corner, np.ndarray]
    circles: tuple[str, ...]
    centres: np.ndarray
    radii: np.ndarray
    half_angles: np.ndarray
    expected: bool
    forms: Mapping[Quantity, np.ndarray] = field(default_factory=dict)
    board: int = 0

    @property
    def count(self) -> int:
        """Number of parameters, q."""
        return self.of_forms.stop + self.board

    @property
    def of_forms(self) -> slice:
        """Which parameters are the forms'."""
        first = 2 * len(self.names) + sum(self.sizes)
        return slice(first, first + len(self.forms))

    @property
    def of_board(self) -> slice:
        """Which parameters are the board's."""
        return slice(self.count - self.board, self.count)

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """How many parameters each circle has."""
        each = (self.solid.round(name) for name in self.circles)
        return tuple(one.count if isinstance(one, Curved) else 3 for one in each)

    def numbers(self, c: int) -> slice:
        """Which parameters are those of the c-th circle."""
        first = 2 * len(self.names) + sum(self.sizes[:c])
        return slice(first, first + self.sizes[c])

    def of_features(self, some: np.ndarray) -> np.ndarray:
        """Which parameters, bool (q,), are those of some edges and circles, bool (E + C,)."""
        which, edges = np.zeros(self.count, bool), len(self.names)
        which[: 2 * edges] = np.repeat(some[:edges], 2)
        for c in range(len(self.circles)):
            which[self.numbers(c)] = some[edges + c]
        return which

    def counted(self, some: np.ndarray) -> np.ndarray:
        """The same, and those of a board, which counts wherever it is found."""
        which = self.of_features(some)
        which[self.of_board] = True
        return which

    def features_of(self, some: np.ndarray) -> np.ndarray:
        """Which edges and circles, bool (E + C,), have one of some parameters, bool (q,), at least."""
        edges = some[: 2 * len(self.names)].reshape(-1, 2).any(1)
        return np.array([*edges, *(some[self.numbers(c)].any() for c in range(len(self.circles)))], bool)

    @property
    def normals(self) -> np.ndarray:
        """Unit normal (-t_y, t_x) of each line, shape (..., E, 2)."""
        return unit_normals(self.along)

    def line_errors(self, start: np.ndarray, along: np.ndarray) -> np.ndarray:
        """How far other lines, through points and along directions (..., E, 2), are off these, (..., 2 E): d, theta."""
        normal = unit_normals(along)
        same = np.einsum("...ei,...ei->...e", normal, self.normals)
        off = np.einsum("...ei,...ei->...e", normal, start - self.start)
        sine = np.einsum("...ei,...ei->...e", self.normals[..., ::-1] * [-1, 1], normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            errors = np.stack([off / same, np.arctan2(sine, same)], -1)
        return errors.reshape(*errors.shape[:-2], -1)

    @cached_property
    def eye(self) -> np.ndarray:
        """Where the sensors stand, shape (..., 3)."""
        return sensor_position(self.camera, self.sensors)

    @cached_property
    def viewpoint(self) -> Viewpoint:
        """From where they look."""
        return viewpoint(self.camera, self.sensors)

    @cached_property
    def axes(self) -> Frame:
        return camera_frame(self.camera, self.sensors)

    def point(self, feature: Corner | Centre | Wall | Between, plane: np.ndarray | None) -> Point:
        """A corner, a centre or a point between others: in the image, or on the plane of a unit normal (..., 3)."""
        if isinstance(feature, Between):
            return feature.made(self, plane)
        if isinstance(feature, Centre | Wall):
            return self._centre(feature, plane is not None)
        at, moves = self.corners[feature], self._corner_moves(feature)
        found = Point(at, moves)
        return found if plane is None else self.onto(found, plane, point_of(self.solid, feature))

    def line(self, side: Side | Between, plane: np.ndarray | None) -> Line:
        """The line of an edge, or between others: in the image, or on a plane."""
        if isinstance(side, Between):
            return side.made(self, plane)
        e = self.names.index(side.edge)
        normal, along = self.normals[..., e, :], self.along[..., e, :]
        length = np.linalg.norm(along, axis=-1)[..., None]
        start = Point(self.start[..., e, :], {2 * e: normal})
        stop = Point(start.at + along, {2 * e: normal, 2 * e + 1: normal * length})
        if plane is None:
            return Line(start, stop)
        ends = self.solid.vertices[list(self.solid.edge(side.edge).ends)]
        return Line(*(self.onto(end, plane, place) for end, place in zip((start, stop), ends, strict=True)))

    def left(self, parts: tuple, plane: np.ndarray | None) -> np.ndarray:
        """+1 or -1 (...): whether `across` of a direction in the plane of features is to its left, from outside."""
        return turn(self, Quantity("", "", parts), in_space=plane is not None)

    def middle(self, side: Side | Between, plane: np.ndarray | None) -> Point:
        """The place on a line where the image of its middle is expected."""
        if isinstance(side, Between):
            line = side.made(self, plane)
            if plane is not None:
                return mean([line.start, line.stop])
            over = self._divisors(ends_of(self.solid, side))
            return shared(line, over[..., 0] / over.sum(-1))
        e = self.names.index(side.edge)
        ends = self.solid.vertices[list(self.solid.edge(side.edge).ends)]
        over = np.moveaxis(self._divisors(ends), -1, 0)
        share = (over[1] / (over[0] + over[1]))[..., None]  # of the image's length, by perspective
        normal, along = self.normals[..., e, :], self.along[..., e, :]
        at = self.start[..., e, :] + share * along
        moves = {2 * e: normal, 2 * e + 1: normal * share * np.linalg.norm(along, axis=-1)[..., None]}
        found = Point(at, moves)
        return found if plane is None else self.onto(found, plane, ends.mean(0))

    def circle(self, feature: Centre | Wall) -> tuple[Circle | Curved, Point, np.ndarray, int]:
        """A circle or a curved surface, its centre, its radius (...) and the number of that among the parameters."""
        c = self.circles.index(place_of(feature))
        circle, first = self.solid.round(place_of(feature)), self.numbers(c).start
        moves = {first + i: axis for i, axis in enumerate(self.sideways(circle))}
        return circle, Point(self.centres[..., c, :], moves), self.radii[..., c], first + 2

    def form(self, quantity: Quantity) -> Evaluated:
        """The size of a form, the scene's unit."""
        size = np.asarray(self.forms[quantity], float)
        return Evaluated(size, {self.of_forms.start + list(self.forms).index(quantity): np.ones(size.shape)})

    def magnified(self, feature: Side | Centre | Wall) -> np.ndarray:
        """Image of a unit length across a feature at its middle, px, shape (...): of an edge in its face's plane."""
        if isinstance(feature, Side):
            middle = ends_of(self.solid, feature).mean(0)[None]
            return self.per_unit(feature, middle, self.normals[..., self.names.index(feature.edge), :])[..., 0]
        return self.camera.focal_px / self.divisor(self.solid.round(place_of(feature)).centre)

    def per_unit(self, side: Side, places: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The same at places (..., n, 3) of an edge whose image has a unit normal (..., 2), shape (..., n)."""
        step = np.cross(face_beside(self.solid, side), along_of(self.solid, side))
        slope = self.slopes(places) @ step
        return np.abs(np.einsum("...ni,...i->...n", slope, normal))

    def slopes(self, places: np.ndarray) -> np.ndarray:
        """Derivative of the images of places (n, 3) by the places, px for the scene's unit, (..., n, 2, 3)."""
        return self._slopes(places - self.eye[..., None, :])

    def _slopes(self, away: np.ndarray) -> np.ndarray:
        """Derivative of the image by places that are so far from the sensor (..., n, 3), px, (..., n, 2, 3)."""
        axes, focal = self.axes, self.camera.focal_px
        over = self.camera.divisor(np.einsum("...ni,...i->...n", away, axes.forward))[..., None, None]
        screen = np.stack([axes.right, axes.down], -2)[..., None, :, :]
        at = focal * np.einsum("...nki,...ni->...nk", np.broadcast_to(screen, (*away.shape[:-1], 2, 3)), away)
        at = self.camera.perspective * at
        return (focal * screen - at[..., None] / over * axes.forward[..., None, None, :]) / over

    def half_angle(self, wall: Wall) -> tuple[np.ndarray, int]:
        """Of a cone (...), rad, and its number among the parameters."""
        c = self.circles.index(wall.surface)
        return self.half_angles[..., c], self.numbers(c).start + 3

    def sideways(self, each: Circle | Curved) -> tuple[np.ndarray, np.ndarray]:
        """The two directions (..., 3) in which the centre of a circle or a curved surface is found."""
        return each.sideways(self.viewpoint) if isinstance(each, Curved) else each.axes

    def divisor(self, places: np.ndarray) -> np.ndarray:
        """What ``focal_px`` is divided by for the px of a unit length at places (..., 3), scene units, shape (...).

        A pinhole's is the distance from the sensor along its axis.
        """
        return self.camera.divisor(np.einsum("...i,...i->...", places - self.eye, self.axes.forward))

    def slid(self, place: np.ndarray, step: np.ndarray) -> np.ndarray:
        """How the image of a place (3,) moves when it moves by a step (3,), to first order, px, shape (..., 2)."""
        return np.einsum("...ij,j->...i", self._slope(place - self.eye)[1], step)

    def _slope(self, away: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Image (..., 2) of what is that far from the sensor (..., 3), and its derivative (..., 2, 3), px."""
        axes, focal, share = self.axes, self.camera.focal_px, self.camera.perspective
        over = self.camera.divisor(np.einsum("...i,...i->...", away, axes.forward))[..., None]
        screen = np.stack([axes.right, axes.down], -2)
        at = focal * np.einsum("...ki,...i->...k", screen, away) / over
        return at, (focal * screen - share * at[..., None] * axes.forward[..., None, :]) / over[..., None]

    def _divisors(self, points: np.ndarray) -> np.ndarray:
        """The same of points (n, 3), shape (..., n)."""
        return self.camera.divisor(np.einsum("...ni,...i->...n", points - self.eye[..., None, :], self.axes.forward))

    def _centre(self, feature: Centre | Wall, in_space: bool) -> Point:
        _, point, _, _ = self.circle(feature)
        if in_space:
            return point
        at, slope = self._slope(point.at - self.eye)
        return Point(at, {k: np.einsum("...ij,...j->...i", slope, move) for k, move in point.moves.items()})

    def _corner_moves(self, corner: Corner) -> Moves:
        """A corner moves by N^-1 (d1, d2), the rows of N being the two normals, d at the corner's own place."""
        index = [self.names.index(name) for name in corner.edges]
        response = corner_response(self.normals[..., index, :])
        moves: dict[int, np.ndarray] = {}
        for k, e in enumerate(index):
            along = self.along[..., e, :]
            away = self.corners[corner] - self.start[..., e, :]
            lever = np.einsum("...i,...i->...", away, along) / np.linalg.norm(along, axis=-1)
            moves[2 * e] = response[..., :, k]
            moves[2 * e + 1] = response[..., :, k] * lever[..., None]
        return moves

    def onto(self, image: Point, plane: np.ndarray, place: np.ndarray) -> Point:
        """Where the ray of an image point meets the plane of a unit normal through a place; moves go along."""
        axes, focal = self.axes, self.camera.focal_px
        if self.expected:
            ray = -self.viewpoint.towards(place)
            at = np.broadcast_to(place, ray.shape)
        else:
            ray, start = (make(image.at, self.sensors, self.camera) for make in (rays, ray_origins))
            reach = np.einsum("...i,...i->...", plane, place - start) / np.einsum("...i,...i->...", plane, ray)
            at = start + ray * reach[..., None]
        over = self.divisor(at)[..., None]
        through = np.einsum("...i,...i->...", plane, ray)[..., None]
        columns = [
            over / focal * (axis - ray * np.einsum("...i,...i->...", plane, axis)[..., None] / through)
            for axis in (axes.right, axes.down)
        ]
        found = {k: columns[0] * move[..., :1] + columns[1] * move[..., 1:] for k, move in image.moves.items()}
        return Point(at, found)


def unit_normals(along: np.ndarray) -> np.ndarray:
    """Unit normals (-t_y, t_x) of lines that go (..., 2); NaN where they go nowhere."""
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    direction = along / np.where(length > 0, length, np.nan)
    return np.stack([-direction[..., 1], direction[..., 0]], -1)


def corner_response(pair: np.ndarray) -> np.ndarray:
    """Derivative of the crossing of two lines by their displacements: the inverse of their normals (..., 2, 2)."""
    (a1, b1), (a2, b2) = (np.moveaxis(pair[..., k, :], -1, 0) for k in (0, 1))
    rows = np.stack([np.stack([b2, -b1], -1), np.stack([-a2, a1], -1)], -2)
    return rows / (a1 * b2 - a2 * b1)[..., None, None]


def half_angle_of(each: Circle | Curved) -> float:
    """Of a cone, rad; else 0."""
    return each.half_angle if isinstance(each, Curved) else 0.0
