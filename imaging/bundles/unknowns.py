"""The unknown numbers of several pictures of one part: its place, its features' places on it, the sensors' places.

Blocks, each of some full numbers of which directions are free: ``part`` a shift and a rotation vector (rad) about the
point that the camera looks at; ``sensor 1``, ... the same of each sensor; a vertex its three coordinates, a circle
those of its centre, two tilts of its axis about its plane's axes (rad) and its radius; ``camera`` the parameters of
its calibration (`imaging.bundles.cameras`), ``estimated`` what else is estimated of it (`scenes.cameras.estimated`);
``carrier`` errors of what carries sensor or part (`scenes.carriers`);
``board`` a shift and a turn of a board relative to the part, ``board pitch`` its scale, ``board points`` what print and
flatness leave open of each point. All are errors beside what the scene says, features' along the axes of the part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from imaging.bundles.cameras import root
from imaging.features.displaced import around, by_estimated
from imaging.features.seen import Seen
from imaging.geometry.projection import camera_frame, sensor_position
from imaging.pictures import Pictures
from scenes import Circle, InvalidInput, Scene, Side
from scenes.cameras import estimated
from scenes.cameras.lens_modes import LensMode
from scenes.carriers import Place, moved
from scenes.measurands.features import along_of, face_beside, plane_of
from scenes.placement import of_board, pitch_u, prior

BOARD, BOARD_PITCH, BOARD_POINTS = "board", "board pitch", "board points"
"""Blocks of a board beside the part."""
Sensors = Literal["known", "uncertain", "unknown"]
Shape = Literal["in_space", "in_plane"]
Axes = Literal["known", "unknown"]
Cameras = Literal["one", "each"]
_TURNS = slice(3, 6)
_FLAT = 1e-6  # sine of an angle that is none


@dataclass(frozen=True)
class Freedom:
    """What is not known before the pictures.

    Attributes
    ----------
    sensors : {"known", "uncertain", "unknown"} or tuple of these
        Where each sensor stands: as the scene says; to what its ``uncertainty`` says (``sensor_deg``,
        ``sensor_roll_deg``, ``sensor_distance``); not at all. One for all pictures, or one each.
    shape : {"in_space", "in_plane"}
        Whether features may lie anywhere beside where the model has them, or each in its plane there.
    axes : {"known", "unknown"}
        Whether circles' axes point on the part as the model says.
    cameras : {"one", "each"}
        Whether all pictures are of one camera, or each of its own, as to what ``uncertainty.covariance``,
        ``lens_modes`` and ``principal_point_px`` leave open of it.

    Raises
    ------
    InvalidInput
        If one is none of these.
    """

    sensors: Sensors | tuple[Sensors, ...] = "uncertain"
    shape: Shape = "in_space"
    axes: Axes = "known"
    cameras: Cameras = "one"

    def __post_init__(self) -> None:
        each = self.sensors if isinstance(self.sensors, tuple) else (self.sensors,)
        for name, told, choices in (
            *(("sensors", one, ("known", "uncertain", "unknown")) for one in each),
            ("shape", self.shape, ("in_space", "in_plane")),
            ("axes", self.axes, ("known", "unknown")),
            ("cameras", self.cameras, ("one", "each")),
        ):
            if told not in choices:
                raise InvalidInput(f"{name} must be one of {', '.join(choices)}, got {told!r}")

    def of_sensors(self, count: int) -> tuple[Sensors, ...]:
        """Of each of so many pictures."""
        if not isinstance(self.sensors, tuple):
            return (self.sensors,) * count
        if len(self.sensors) != count:
            raise InvalidInput(
                f"sensors must be one for all, or one for each of {count} pictures, got {len(self.sensors)}"
            )
        return self.sensors


@dataclass(frozen=True, eq=False)
class Block:
    """Some numbers that belong together.

    Attributes
    ----------
    name : str
    basis : ndarray, shape (f, k)
        Directions, among its f full numbers, that are free.
    sd : ndarray, shape (k,)
        Standard uncertainty of each before; infinite: nothing is known.
    turns : ndarray of bool, shape (k,)
        Which are turns, rad; the others are lengths.
    """

    name: str
    basis: np.ndarray
    sd: np.ndarray
    turns: np.ndarray

    @classmethod
    def of(cls, name: str, directions: np.ndarray, sd: np.ndarray, turns: slice) -> Block:
        """Of directions (f, f), some of which are turns, without those that are exact."""
        free, turned = sd > 0, np.zeros(len(sd), bool)
        turned[turns] = True
        return cls(name, directions[:, free], sd[free], turned[free])


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The n unknown numbers of V pictures.

    Attributes
    ----------
    scene : Scene
    vertices : tuple of int
        Of the part, at the ends of the edges that are used.
    circles : tuple of str
    blocks : tuple of Block
        The part, the V sensors, what carries them, the cameras, the vertices, the circles, a board.
    carried : dict of str to tuple of ndarray, shape (6, k)
        By block of a carrier's errors (`scenes.carriers`): how each picture's sensor moves by its k numbers.
    modes : tuple of tuple of LensMode
        Errors of each picture's lens where that is splined.
    """

    scene: Scene
    vertices: tuple[int, ...]
    circles: tuple[str, ...]
    blocks: tuple[Block, ...]
    carried: Mapping[str, tuple[np.ndarray, ...]]
    modes: tuple[tuple[LensMode, ...], ...]

    @classmethod
    def of(cls, scene: Scene, pictures: tuple[Pictures, ...], seen: Seen, freedom: Freedom) -> Unknowns:
        """Those of features as they are seen in pictures of a scene."""
        solid = scene.solid
        vertices = tuple(dict.fromkeys(end for name in seen.names for end in solid.edge(name).ends))
        sensors = freedom.of_sensors(len(pictures))
        blocks = [Block.of("part", np.eye(6), in_rad(prior(scene.uncertainty)), _TURNS)]
        blocks += [_sensor(k, told, each) for k, (told, each) in enumerate(zip(sensors, pictures, strict=True), 1)]
        carried = _carried(pictures) if "uncertain" in sensors else {}
        blocks += [_of_one(name, moves[0].shape[1]) for name, moves in carried.items()]
        blocks += [*_cameras(pictures, freedom), *_estimated(pictures, freedom)]
        blocks += [*_of_features(scene, vertices, seen, freedom), *_of_board(scene)]
        return cls(scene, vertices, seen.circles, tuple(blocks), carried, _modes(pictures, freedom))

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Which of the n numbers are each block's."""
        ends = np.cumsum([0, *(len(block.sd) for block in self.blocks)])
        return {b.name: slice(int(i), int(j)) for b, i, j in zip(self.blocks, ends, ends[1:], strict=False)}

    @property
    def count(self) -> int:
        """n."""
        return sum(len(block.sd) for block in self.blocks)

    def full(self, name: str, numbers: np.ndarray) -> np.ndarray:
        """A block's full numbers (f,) of all free ones (n,)."""
        return self._block(name).basis @ numbers[self.slices[name]]

    def numbers(self, full: Mapping[str, np.ndarray]) -> np.ndarray:
        """All free numbers (n,) of full ones (f,) of some blocks, as near to these as they can be; of others 0."""
        found = np.zeros(self.count)
        for name, numbers in full.items():
            found[self.slices[name]] = np.linalg.pinv(self._block(name).basis) @ numbers
        return found

    def basis(self, name: str) -> np.ndarray:
        """Derivatives (f, n) of a block's full numbers by all free ones."""
        whole = np.zeros((len(self._block(name).basis), self.count))
        whole[:, self.slices[name]] = self._block(name).basis
        return whole

    def sensor(self, number: int) -> np.ndarray:
        """Derivatives (6, n) of shift and turn of the sensor of a number: by its own block, and what carries it."""
        moves = (each[number - 1] @ self.basis(name) for name, each in self.carried.items())
        return sum(moves, self.basis(f"sensor {number}"))

    @cached_property
    def units(self) -> np.ndarray:
        """Changes (n,) that move a part of its size about alike: a length, and turns by it over the size."""
        return np.concatenate([np.where(each.turns, 1 / self.scene.solid.extent, 1.0) for each in self.blocks])

    def camera(self, number: int) -> np.ndarray:
        """Derivatives (9 + m, n) of errors of the calibration's parameters, and of a splined lens, of the camera of the
        picture of a number."""
        name = "camera" if "camera" in self.slices else f"camera {number}"
        by_own = np.pad(by_estimated(self.scene), ((0, len(self.modes[number - 1])), (0, 0)))
        return self.basis(name) + by_own @ self.basis(self.estimated(number))

    def estimated(self, number: int) -> str:
        """Name of the block of what is estimated of that camera."""
        return "estimated" if "estimated" in self.slices else f"estimated {number}"

    def placement(self, number: int) -> np.ndarray:
        """Derivatives (6 + c, n) of the part's shift and turn, and of what is estimated of the camera of that
        picture."""
        return np.concatenate([self.basis("part"), self.basis(self.estimated(number))])

    @property
    def all_estimated(self) -> tuple[str, ...]:
        """Of all cameras."""
        return tuple(name for name in self.slices if name.split()[0] == "estimated")

    def vertex(self, index: int) -> str:
        """Name of a vertex' block."""
        return self.scene.solid.vertex_names[index]

    def priors(self) -> tuple[np.ndarray, list[tuple[str, slice]]]:
        """Rows (m, n) of what is known before, in units of its standard uncertainty, and which are of what."""
        rows, owners = [], []
        for block in self.blocks:
            some = np.flatnonzero(np.isfinite(block.sd))
            own = np.zeros((len(some), self.count))
            own[np.arange(len(some)), self.slices[block.name].start + some] = 1 / block.sd[some]
            owners.append((block.name, slice(sum(map(len, rows)), sum(map(len, rows)) + len(some))))
            rows.append(own)
        return np.concatenate(rows), [(name, part) for name, part in owners if part.stop > part.start]

    def _block(self, name: str) -> Block:
        return self._by_name[name]

    @cached_property
    def _by_name(self) -> dict[str, Block]:
        return {block.name: block for block in self.blocks}


def in_rad(numbers: np.ndarray) -> np.ndarray:
    """A shift and a turn, (6,), of one in degrees."""
    return np.where(np.arange(6) < 3, numbers, np.radians(numbers))


def _sensor(number: int, told: Sensors, pictures: Pictures) -> Block:
    """Of a sensor's shift and turn, in the directions of its axes: right, down, forward."""
    axes = np.stack(camera_frame(pictures.scene.camera, pictures.sensors), -1)
    directions = np.zeros((6, 6))
    directions[:3, :3] = directions[3:, 3:] = axes
    if told == "unknown":
        return Block.of(f"sensor {number}", directions, np.full(6, np.inf), _TURNS)
    if told == "known":
        return Block.of(f"sensor {number}", directions, np.zeros(6), _TURNS)
    said, jitter = pictures.scene.uncertainty, pictures.scene.jitter.sensor_deg
    aside = said.sensor_deg.u if said.sensor_deg is not None else jitter
    turns = [aside, aside, 0.0 if said.sensor_roll_deg is None else said.sensor_roll_deg.u]
    reach = 0.0 if said.sensor_distance is None else said.sensor_distance.u
    return Block.of(f"sensor {number}", directions, in_rad(np.array([0.0, 0.0, reach, *turns])), _TURNS)


def _carried(pictures: tuple[Pictures, ...]) -> dict[str, tuple[np.ndarray, ...]]:
    """Of errors that pictures share, ``carrier``, and of those of their own, ``carrier 1``, ..."""
    of, places = [each.scene.uncertainty.carriers for each in pictures], [place_of(each) for each in pictures]
    found = {"carrier": tuple(moved(*one, own=False) for one in zip(of, places, strict=True))}
    for k, one in enumerate(zip(of, places, strict=True)):
        own = moved(*one, own=True)
        found[f"carrier {k + 1}"] = tuple(own if i == k else np.zeros_like(own) for i in range(len(pictures)))
    if len({each.shape[1] for each in found["carrier"]}) > 1:
        raise InvalidInput("pictures must be of the same hand_eye, stage and turntable, got others")
    return {name: moves for name, moves in found.items() if moves[0].shape[1]}


def place_of(pictures: Pictures) -> Place:
    """Where the sensor of one picture is said to stand."""
    camera, pose = pictures.scene.camera, pictures.sensors
    axes = np.stack(camera_frame(camera, pose))
    return Place(sensor_position(camera, pose), axes, np.array(camera.look_at), float(pose[..., 1]))


def _of_one(name: str, count: int) -> Block:
    """Numbers of variance 1."""
    return Block(name, np.eye(count), np.ones(count), np.zeros(count, bool))


def _cameras(pictures: tuple[Pictures, ...], freedom: Freedom) -> Iterator[Block]:
    """Of all pictures' camera, or of each its own."""
    for k, each in enumerate(pictures, 1):
        half = root(each.scene)
        name = "camera" if freedom.cameras == "one" else f"camera {k}"
        yield Block(name, half, np.ones(half.shape[1]), np.zeros(half.shape[1], bool))
        if freedom.cameras == "one":
            return


def _modes(pictures: tuple[Pictures, ...], freedom: Freedom) -> tuple[tuple[LensMode, ...], ...]:
    found = tuple(each.scene.uncertainty.lens_modes for each in pictures)
    if freedom.cameras == "one" and any(modes != found[0] for modes in found):
        raise InvalidInput("pictures of one camera must be of the same uncertainty.lens_modes, got others")
    return found


def _estimated(pictures: tuple[Pictures, ...], freedom: Freedom) -> Iterator[Block]:
    """What is estimated of all pictures' camera, or of each its own, beside what its calibration leaves open."""
    for k, each in enumerate(pictures, 1):
        sd = np.sqrt(estimated.uncalibrated(each.scene))
        yield Block.of("estimated" if freedom.cameras == "one" else f"estimated {k}", np.eye(len(sd)), sd, slice(0))
        if freedom.cameras == "one":
            return


def _of_features(scene: Scene, vertices: tuple[int, ...], seen: Seen, freedom: Freedom) -> Iterator[Block]:
    """Of datums what their manufacture leaves open; of others nothing is known, or that they lie in their planes."""
    solid, placement = scene.solid, scene.placement
    told = placement.datum_sd if placement.datum_sd is not None else np.inf
    planes = _planes(scene, seen.names) if freedom.shape == "in_plane" else {}
    for vertex in vertices:
        axes, sd = _across(planes.get(vertex, []), _datums_at(scene, vertex, seen.names), told)
        yield Block.of(solid.vertex_names[vertex], axes, sd, slice(0))
    for name in seen.circles:
        axes, sd = np.eye(6), np.full(6, told if name in placement.features else np.inf)
        one, two = solid.circle(name).axes
        axes[:3, :3] = np.stack([one, two, solid.circle(name).axis], 1)
        sd[2] = 0.0 if freedom.shape == "in_plane" else sd[2]
        sd[3:5] = 0.0 if freedom.axes == "known" or freedom.shape == "in_plane" else np.inf
        yield Block.of(name, axes, sd, slice(3, 5))


def _of_board(scene: Scene) -> Iterator[Block]:
    """Of a board beside the part, where there is one: the same numbers in all pictures."""
    board, still = scene.placement.board, slice(0)
    if board is not None:
        yield Block.of(BOARD, np.eye(6), in_rad(of_board(scene.uncertainty)), _TURNS)
        yield Block.of(BOARD_PITCH, np.eye(1), np.array([pitch_u(scene)]), still)
        yield Block.of(BOARD_POINTS, np.eye(3 * board.count), np.full(3 * board.count, board.point_sd), still)


def _planes(scene: Scene, edges: tuple[str, ...]) -> dict[int, list[np.ndarray]]:
    """Unit normals of the planes in which each vertex is measured, by its number."""
    solid, found = scene.solid, {}
    for quantity in scene.quantities:
        normal = plane_of(solid, quantity)
        for name in quantity.edges:
            if normal is not None and name in edges:
                for end in solid.edge(name).ends:
                    found.setdefault(end, []).append(normal)
    for name in scene.placement.features:
        if name in edges:
            for end in solid.edge(name).ends:
                found.setdefault(end, [face_beside(solid, Side(edge=name))])
    return found


def _datums_at(scene: Scene, vertex: int, edges: tuple[str, ...]) -> list[np.ndarray]:
    """Unit vectors along the datums that end in a vertex."""
    solid = scene.solid
    datums = [solid.edge(name) for name in scene.placement.features if name in edges]
    return [along_of(solid, Side(edge=each.name)) for each in datums if vertex in each.ends]


def _across(normals: list[np.ndarray], datums: list[np.ndarray], sd: float) -> tuple[np.ndarray, np.ndarray]:
    """Perpendicular axes (3, 3) of a vertex, in columns, and how well its place along each is known, (3,): exactly out
    of planes of some normals, to ``sd`` across datums, not at all along the only one."""
    plane, out, told = np.eye(3), 0, np.full(3, np.inf)
    if normals:
        _, sizes, axes = np.linalg.svd(np.array(normals))
        plane, out = axes.T, int((sizes > _FLAT).sum())
    if datums:
        told[:], level = sd, plane[:, out:]
        along = level @ (level.T @ datums[0])
        if (np.linalg.svd(np.array(datums))[1][1:] < _FLAT).all() and np.linalg.norm(along) > _FLAT:
            first = along / np.linalg.norm(along)
            rest = np.linalg.svd(np.concatenate([plane[:, :out], first[:, None]], 1))[0][:, out + 1 :]
            plane, told[out] = np.concatenate([plane[:, :out], first[:, None], rest], 1), np.inf
    told[:out] = 0.0
    return plane, told


def rim_moves(circle: Circle) -> np.ndarray:
    """How `around` of a circle is moved by its six numbers, (n, 3, 6)."""
    angle = around(circle)
    radial = circle.spokes(angle)
    shifted = np.broadcast_to(np.eye(3), (len(angle), 3, 3))
    tilted = [circle.radius * np.cross(axis, radial) for axis in circle.axes]
    return np.concatenate([shifted, np.stack([*tilted, radial], -1)], -1)


def rim(circle: Circle, numbers: np.ndarray) -> np.ndarray:
    """Where `around` of a circle is with errors of its six numbers, (n, 3)."""
    one, two = circle.axes
    axis = circle.axis + numbers[3] * np.cross(one, circle.axis) + numbers[4] * np.cross(two, circle.axis)
    axis = axis / np.linalg.norm(axis)
    radial = circle.spokes(around(circle))
    level = radial - (radial @ axis)[:, None] * axis
    level = level / np.linalg.norm(level, axis=1, keepdims=True)
    return circle.centre + numbers[:3] + (circle.radius + numbers[5]) * level
