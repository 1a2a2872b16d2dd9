"""One exposure: a scene, where its sensor stands, and where its lights stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scenes.errors import InvalidInput
from scenes.lights import Luminaire
from scenes.pose import Pose, several
from scenes.results import html_of, poses
from scenes.scene import Scene


@dataclass(frozen=True)
class Picture:
    """A scene seen by its sensor under its lights, checked once: what planner, renderer and measurement take.

    Attributes
    ----------
    scene : Scene
    sensor : Pose
    lights : tuple of Pose
        One for each of the scene's lights, also of those that are not free; none where it is not known where they
        stand.

    Examples
    --------
    >>> import scenes
    >>> Picture.of(scenes.load("task1"), (30, 135), (15, 315)).lights
    (Pose(polar_deg=15.0, azimuth_deg=315.0),)
    """

    scene: Scene
    sensor: Pose
    lights: tuple[Pose, ...] = ()

    @classmethod
    def of(cls, scene: Scene | Picture, sensor: Any = None, lights: Any = None) -> Picture:
        """A checked picture, from a picture or from a scene and poses.

        Parameters
        ----------
        scene : Scene or Picture
            A picture is returned as it is.
        sensor : Pose or pair of float
            Polar angle and azimuth, degrees.
        lights : Pose, pair of float, or one for each free light, optional
            None where it is not known where the lights stand; where none is free it is always known.

        Raises
        ------
        InvalidInput
            If a pose is no pose or lies in or on the object, or there are not as many as the scene has lights.
        """
        if isinstance(scene, Picture):
            return scene
        if not isinstance(scene, Scene):
            raise InvalidInput(f"scene must be a Scene or a Picture, got {type(scene).__name__}")
        sensor = scene.check_pose("sensor", sensor)
        if lights is None and scene.free:
            return cls(scene, sensor)
        free = scene.check_lights(several(() if lights is None else lights))
        return cls(scene, sensor, _complete(scene, sensor, free))

    @property
    def light(self) -> Pose | None:
        """The first light's pose; None where it is not known."""
        return self.lights[0] if self.lights else None

    @property
    def free_lights(self) -> tuple[Pose, ...]:
        """Poses of the free lights, as `of` takes them; none where it is not known where they stand."""
        return tuple(self.lights[i] for i in self.scene.free) if self.lights else ()

    @property
    def row(self) -> dict[str, Any]:
        """The scene's name and the poses of sensor and free lights, degrees, as columns of a table.

        >>> import scenes
        >>> Picture.of(scenes.load("task1"), (30, 135)).row["light_polar"] is None
        True
        """
        free = self.free_lights or ((None, None),) * len(self.scene.free)
        return {"scene": self.scene.name, **poses(self.sensor, free)}

    def _repr_html_(self) -> str:
        return html_of(self, f"{self.scene.title or self.scene.name}, sensor {self.sensor}", [self.row])

    def unlit(self) -> Picture:
        """The same picture, its lights not known."""
        return Picture(self.scene, self.sensor)

    def with_scene(self, scene: Scene) -> Picture:
        """The same poses in another scene."""
        return Picture(scene, self.sensor, self.lights)

    def __hash__(self) -> int:
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        """Without the hash: of a text it is another number in every process."""
        return {key: value for key, value in self.__dict__.items() if key != "_hash"}

    @cached_property
    def _hash(self) -> int:
        return hash((self.scene, self.sensor, self.lights))


def _complete(scene: Scene, sensor: Pose, free: tuple[Pose, ...]) -> tuple[Pose, ...]:
    """Poses of all lights from those of the free ones."""
    given, at = iter(free), np.array(list(sensor))
    return tuple(next(given) if light.mount == "free" else Pose(*mounted(light, at).tolist()) for light in scene.lights)


def mounted(light: Luminaire, sensors: np.ndarray) -> np.ndarray:
    """Poses (..., 2) of a light that is not free, from the sensors' (..., 2), degrees.

    At its own pose, at the sensor's, or opposite the sensor.
    """
    if light.mount == "fixed":
        return np.array(list(light.pose))
    if light.faces_sensor:
        return np.stack([180.0 - sensors[..., 0], (sensors[..., 1] + 180.0) % 360.0], -1)
    return sensors
