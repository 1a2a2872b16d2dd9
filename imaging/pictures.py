"""Many pictures of one scene at once: arrays of poses that broadcast against each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from imaging.geometry.projection import light_position, sensor_position, viewpoint
from imaging.light.emitters import Emitter, emitters
from scenes import InvalidInput, Noise, Picture, Scene, mounted
from scenes.arrays import poses
from scenes.lights import FULL, GLANCE
from scenes.viewpoint import Viewpoint

T = TypeVar("T")
_OF_LIGHT = ("sensor_at", "viewpoint", "lights_at", "emitters", "edges", "measurands", "sides")  # whatever the noise


@dataclass(frozen=True, eq=False)
class Pictures:
    """Pictures of a scene from arrays of poses; what is computed of them is computed once.

    Attributes
    ----------
    scene : Scene
    sensors : ndarray, shape (..., 2)
        Polar angle and azimuth, degrees.
    lights : tuple of ndarray, shape (..., 2)
        For each of the scene's lights, also of those that are not free; broadcast against the sensors.
    closely : bool
        Whether this is one picture to be looked at closely: with the light that surfaces send to each other, and along
        circles (`imaging.features.rim_look`). Many pictures are glanced at, which takes a thousandth of the time.
    roughly : bool
        Whether a close look takes the light between faces from few rays and their patches: a part of the time, for a
        setting that is one of many.
    """

    scene: Scene
    sensors: np.ndarray
    lights: tuple[np.ndarray, ...] = ()
    closely: bool = False
    roughly: bool = False
    _known: dict[Any, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, scene: Scene | Picture, sensors: Any = None, lights: Any = None) -> Pictures:
        """From a picture, or a scene, sensors (..., 2) and poses of its free light (..., 2) or a tuple of them."""
        if isinstance(scene, Picture):
            return _of_picture(scene)
        if not isinstance(scene, Scene):
            raise InvalidInput(f"scene must be a Scene or a Picture, got {type(scene).__name__}")
        sensors = poses(sensors, "sensors")
        if lights is None and scene.free:
            return cls(scene, sensors)
        each = lights if isinstance(lights, tuple) and len(scene.free) != 1 else () if lights is None else (lights,)
        if len(each) != len(scene.free):
            raise InvalidInput(f"lights must be {len(scene.free)} arrays, one for each free light, got {len(each)}")
        free = iter([poses(some, "lights") for some in each])
        parts = tuple(next(free) if light.mount == "free" else mounted(light, sensors) for light in scene.lights)
        return cls(scene, sensors, parts, all(part.ndim == 1 for part in (sensors, *parts)))

    def with_scene(self, scene: Scene) -> Pictures:
        """The same poses in another scene."""
        return Pictures(scene, self.sensors, self.lights, self.closely, self.roughly)

    def with_noise(self, noise: Noise) -> Pictures:
        """The same pictures by a sensor of another noise; what geometry and light alone decide is kept."""
        named = {key: key if isinstance(key, str) else key[0] for key in self._known}
        kept = {key: self._known[key] for key, name in named.items() if name in _OF_LIGHT}
        return replace(self, scene=self.scene.model_copy(update={"noise": noise}), _known=kept)

    def at(self, sensors: np.ndarray, lights: tuple[np.ndarray, ...]) -> Pictures:
        """The same scene from other poses, looked at as closely."""
        return Pictures(self.scene, sensors, lights, self.closely, self.roughly)

    @property
    def glanced(self) -> Pictures:
        """The same, looked at as the search does with many."""
        return self.once("glanced", lambda: replace(self, closely=False, _known={}))

    @property
    def sensor_at(self) -> np.ndarray:
        """Where the sensors stand, scene units, shape (..., 3)."""
        return self.once("sensor_at", lambda: sensor_position(self.scene.camera, self.sensors))

    @property
    def viewpoint(self) -> Viewpoint:
        """From where the sensors look."""
        return self.once("viewpoint", lambda: viewpoint(self.scene.camera, self.sensors))

    @property
    def lights_at(self) -> tuple[np.ndarray, ...]:
        """Where each light's middle is, scene units, shape (..., 3)."""
        return self.once("lights_at", self._lights_at)

    @property
    def emitters(self) -> tuple[Emitter, ...]:
        """The points that shine: of each light one, or as many as its size calls for."""
        return self.once("emitters", lambda: emitters(self.scene, self.lights, FULL if self.closely else GLANCE))

    def _lights_at(self) -> tuple[np.ndarray, ...]:
        lit = zip(self.scene.lights, self.lights, strict=True)
        return tuple(light_position(self.scene.camera, light, poses) for light, poses in lit)

    def once(self, key: Any, make: Callable[[], T]) -> T:
        """What ``make`` gives, made at the first call with this key."""
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]


@lru_cache(maxsize=64)
def _of_picture(picture: Picture) -> Pictures:
    """One object for equal pictures, so that what one asks of it is there for all who ask."""
    lights = tuple(np.array(list(pose)) for pose in picture.lights)
    return Pictures(picture.scene, np.array(list(picture.sensor)), lights, bool(lights))
