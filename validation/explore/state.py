"""What one visitor looks at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from scenes import InvalidInput, Picture, Pose, Scene, Setting

SENSOR = -1  # number of the thing that is moved; free lights count from 0
SHOWN = ("sigma", "ratio", "worst")
MOST_VIEWS = 4  # that are kept beside the one that is moved
_FIRST = Pose(35.0, 300.0), Pose(30.0, 225.0)  # where a scene has no settings


@dataclass(frozen=True)
class State:
    """Poses, and what is asked of them.

    Attributes
    ----------
    sensor : Pose
    lights : tuple of Pose
        Of the lights that are free.
    measurand : int
        Number of the quantity that is looked at.
    shown : {"sigma", "ratio", "worst"}
        What colours the sphere: sigma in the object, 2 sigma over half of the tolerance zone, or the largest such ratio
        of all measurands that have a tolerance.
    moving : int
        What is moved, and for which the sphere is coloured: `SENSOR`, or the number of a free light.
    views : tuple of Setting
        Pictures that are taken, too: all values are combined with theirs.
    """

    sensor: Pose
    lights: tuple[Pose, ...]
    measurand: int = 0
    shown: str = "sigma"
    moving: int = SENSOR
    views: tuple[Setting, ...] = ()

    @classmethod
    def first(cls, scene: Scene) -> State:
        """That of the scene's first setting."""
        moving = 0 if scene.free else SENSOR
        shown = "worst" if any(quantity.tolerance for quantity in scene.quantities) else "sigma"
        if scene.settings:
            return cls(scene.settings[0].sensor, scene.settings[0].lights, shown=shown, moving=moving)
        lights = tuple(replace(_FIRST[1], azimuth_deg=_FIRST[1].azimuth_deg + 40.0 * i) for i in range(len(scene.free)))
        return cls(_FIRST[0], lights, shown=shown, moving=moving)

    @classmethod
    def of_message(cls, scene: Scene, told: Any) -> State:
        """That which a page tells of.

        Raises
        ------
        InvalidInput
            If it is no state of this scene. A pose that lies in the object is one; `picture` refuses it.
        """
        if not isinstance(told, dict):
            raise InvalidInput(f"state must be an object, got {told!r}")
        views = told.get("views", [])
        if not isinstance(views, list) or len(views) > MOST_VIEWS:
            raise InvalidInput(f"views must be a list of at most {MOST_VIEWS}, got {str(views)[:80]}")
        return cls(
            *_poses(scene, told),
            _number("measurand", told.get("measurand"), 0, len(scene.quantities) - 1),
            _choice("shown", told.get("shown"), SHOWN),
            _number("moving", told.get("moving"), SENSOR, len(scene.free) - 1),
            tuple(_setting(*_poses(scene, each)) for each in views),
        )

    def to_message(self) -> dict[str, Any]:
        """What `of_message` understands."""
        return {
            "sensor": list(self.sensor),
            "lights": [list(pose) for pose in self.lights],
            "measurand": self.measurand,
            "shown": self.shown,
            "moving": self.moving,
            "views": [
                {"sensor": list(each.sensor), "lights": [list(pose) for pose in each.lights]} for each in self.views
            ],
        }

    @property
    def setting(self) -> Setting:
        """Its poses as a scene has them."""
        return _setting(self.sensor, self.lights)

    def pictures(self, scene: Scene) -> list[Picture]:
        """Those of `views`, then its own; raises InvalidInput where a pose is refused."""
        return [Picture.of(scene, each.sensor, each.lights) for each in (*self.views, self.setting)]

    def picture(self, scene: Scene) -> Picture:
        """What the sensor takes there; raises InvalidInput where a pose is refused."""
        return Picture.of(scene, self.sensor, self.lights)

    def tolerable(self, scene: Scene) -> State:
        """Without a ratio where the measurand has no tolerance, without the worst where none has one."""
        zones = [quantity.tolerance for quantity in scene.quantities]
        known = {"sigma": True, "ratio": zones[self.measurand] is not None, "worst": any(zones)}
        return self if known[self.shown] else replace(self, shown="sigma")


def _poses(scene: Scene, told: Any) -> tuple[Pose, tuple[Pose, ...]]:
    """Sensor and free lights of a message's part."""
    if not isinstance(told, dict):
        raise InvalidInput(f"view must be an object, got {str(told)[:80]}")
    lights = told.get("lights")
    if not isinstance(lights, list) or len(lights) != len(scene.free):
        raise InvalidInput(f"lights must be {len(scene.free)} pose(s), got {str(lights)[:80]}")
    return Pose.of(told.get("sensor")), tuple(map(Pose.of, lights))


def _setting(sensor: Pose, lights: tuple[Pose, ...]) -> Setting:
    return Setting(sensor=sensor, light=lights[0] if len(lights) == 1 else lights)


def _number(name: str, value: Any, least: int, most: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise InvalidInput(f"{name} must be a whole number from {least} to {most}, got {value!r}")
    return value


def _choice(name: str, value: Any, known: tuple[str, ...]) -> str:
    if value not in known:
        raise InvalidInput(f"{name} must be one of {', '.join(known)}, got {value!r}")
    return value
