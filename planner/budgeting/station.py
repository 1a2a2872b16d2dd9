"""A measuring station as it truly stands, where its operator believes the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from imaging.geometry.lens import image_centre, recorded
from imaging.geometry.projection import project_ideal
from imaging.pictures import Pictures
from imaging.pose_scatter import LEAST_SINE
from scenes import Scene


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

    def ideal(self, points: np.ndarray) -> np.ndarray:
        """Where a pinhole at the true pose sees points (n, 3) of the part, px, shape (n, 2)."""
        camera = self.scene.camera
        centre = image_centre(camera)
        cos, sin = np.cos(np.radians(self.roll_deg)), np.sin(np.radians(self.roll_deg))
        return (project_ideal(self.part_at(points), self.sensor, camera) - centre) @ np.array(
            [[cos, -sin], [sin, cos]]
        ) + centre

    def record(self, points: np.ndarray) -> np.ndarray:
        """Where the camera records points (n, 3) of the part, px, shape (n, 2)."""
        camera = self.scene.camera
        centre = image_centre(camera)
        seen = recorded(self.ideal(points), camera) - centre
        return centre + np.array(self.principal_px) + seen * np.array(self.stretch)


def _moved(pose: np.ndarray, step_deg: float, which: int) -> np.ndarray:
    sine = max(abs(float(np.sin(np.radians(pose[0])))), LEAST_SINE)
    return pose + (np.array([step_deg, 0.0]) if which == 0 else np.array([0.0, step_deg / sine]))
