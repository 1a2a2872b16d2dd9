"""A measuring station as it truly stands, where its operator believes the scene."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imaging.bundles.unknowns import place_of
from imaging.geometry.lens import image_centre, recorded
from imaging.geometry.projection import project_ideal
from imaging.pictures import Pictures
from imaging.pose_scatter import LEAST_SINE
from scenes import Scene
from scenes.carriers import Carrier


@dataclass(frozen=True, eq=False)
class Station:
    """What one picture is taken of and with.

    Attributes
    ----------
    scene : Scene
        With the true numbers.
    sensor : ndarray, shape (2,)
        True pose, degrees.
    lights : tuple of ndarray, shape (2,)
    roll_deg : float
        By which the sensor is turned about its axis, from its right towards down.
    stretch : tuple of float
        Focal lengths along x and y over ``camera.focal_px``.
    principal_px : tuple of float
        Where the axis meets the sensor, from the image's middle.
    shift : tuple of float
        Of the part along x, y and z, the scene's unit.
    tilt_deg : tuple of float
        Rotation vector of the part about ``pivot``, degrees.
    board_shift, board_tilt_deg : tuple of float
        The same of a board relative to the part.
    pivot : tuple of float
    """

    scene: Scene
    sensor: np.ndarray
    lights: tuple[np.ndarray, ...]
    roll_deg: float = 0.0
    stretch: tuple[float, float] = (1.0, 1.0)
    principal_px: tuple[float, float] = (0.0, 0.0)
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    board_shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    board_tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def nominal(cls, pictures: Pictures) -> Station:
        """As the scene says, of one picture."""
        return cls(pictures.scene, pictures.sensors, pictures.lights, pivot=pictures.scene.camera.look_at)

    @property
    def pictures(self) -> Pictures:
        """What the image model takes: brightness as the true lights and surfaces make it, the part in its place."""
        return Pictures(self.scene, self.sensor, self.lights, closely=True)

    def sensor_moved(self, step_deg: float, which: int) -> Station:
        """With the sensor moved along the meridian (0) or the circle of latitude (1)."""
        return replace(self, sensor=_moved(self.sensor, step_deg, which))

    def light_moved(self, light: int, step_deg: float, which: int) -> Station:
        """The same of a light."""
        moved = _moved(self.lights[light], step_deg, which)
        return replace(self, lights=(*self.lights[:light], moved, *self.lights[light + 1 :]))

    def carried(self, carrier: Carrier, which: int, step: float) -> Station:
        """With the sensor moved by a step of one error of what carries it: the part moves the other way."""
        move = -step * carrier.moves(place_of(self.pictures))[:, which]
        shift, tilt = np.array(self.shift) + move[:3], np.array(self.tilt_deg) + np.degrees(move[3:])
        return replace(self, shift=tuple(shift), tilt_deg=tuple(tilt))

    def changed(self, name: str, which: int, step: float) -> Station:
        """With one number of an attribute that is a tuple changed by a step."""
        values = list(getattr(self, name))
        values[which] += step
        return replace(self, **{name: tuple(values)})

    def part_at(self, points: np.ndarray) -> np.ndarray:
        """Where points (..., 3) of the part truly are."""
        return self._at(points, self.shift, self.tilt_deg)

    def board_at(self, points: np.ndarray) -> np.ndarray:
        """Where points (..., 3) of a board would be, were the part in its place."""
        return self._at(points, self.board_shift, self.board_tilt_deg)

    def _at(self, points: np.ndarray, shift: tuple[float, ...], tilt_deg: tuple[float, ...]) -> np.ndarray:
        at, vector = points, np.radians(tilt_deg)
        angle = float(np.linalg.norm(vector))
        if angle > 0:
            from scipy.spatial.transform import Rotation

            pivot = np.array(self.pivot)
            at = Rotation.from_rotvec(vector).apply((at - pivot).reshape(-1, 3)).reshape(at.shape) + pivot
        return at + np.array(shift)

    def record(self, points: np.ndarray) -> np.ndarray:
        """Where the camera records points (n, 3) of the part, px, shape (n, 2)."""
        return records([self], points)[0]


def records(stations: Sequence[Station], points: np.ndarray) -> np.ndarray:
    """Where the cameras of S stations record points (n, 3) of the part, px, shape (S, n, 2).

    Stations of one scene, which differ in where things stand, are evaluated together.
    """
    found = np.empty((len(stations), len(points), 2))
    numbers: dict[int, list[int]] = defaultdict(list)
    for k, each in enumerate(stations):
        numbers[id(each.scene)].append(k)
    for some in numbers.values():
        found[some] = _recorded([stations[k] for k in some], points)
    return found


def _recorded(stations: Sequence[Station], points: np.ndarray) -> np.ndarray:
    """The same where the scene is one."""
    camera = stations[0].scene.camera
    centre, roll = image_centre(camera), np.radians([each.roll_deg for each in stations])
    cos, sin = np.cos(roll), np.sin(roll)
    turn = np.stack([np.stack([cos, -sin], -1), np.stack([sin, cos], -1)], -2)
    there, sensors = np.stack([each.part_at(points) for each in stations]), np.stack([each.sensor for each in stations])
    ideal = (project_ideal(there, sensors, camera) - centre) @ turn + centre
    stretch, middle = (np.array([getattr(each, name) for each in stations]) for name in ("stretch", "principal_px"))
    return centre + middle[:, None] + (recorded(ideal, camera) - centre) * stretch[:, None]


def _moved(pose: np.ndarray, step_deg: float, which: int) -> np.ndarray:
    sine = max(abs(float(np.sin(np.radians(pose[0])))), LEAST_SINE)
    return pose + (np.array([step_deg, 0.0]) if which == 0 else np.array([0.0, step_deg / sine]))
