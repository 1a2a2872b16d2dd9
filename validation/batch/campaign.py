"""What a batch works through: scenes, poses and swept parameters, as numbered settings made one at a time."""

from __future__ import annotations

import bisect
import contextlib
import itertools
import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

import scenes
from scenes import InvalidInput, Picture, Pose, Scene, Setting
from scenes.errors import describe
from scenes.files.door import read_toml
from scenes.load import find, from_document
from scenes.model import FileName, Model, Title

MOST_SETTINGS = 4_000_000
MOST_SCENES = 1_000
MOST_VALUES = 1_000  # of an axis or a swept key
_LARGEST = 1e15  # of a range's numbers
_MOST_KEYS = 8  # swept at a time


def _values(axis: Any) -> Any:
    """A list of values, or ``{from, to, count}`` or ``{from, to, step}`` written out (``to`` included)."""
    if not isinstance(axis, dict):
        return axis
    try:
        start, stop = float(axis["from"]), float(axis["to"])
        (how,) = axis.keys() - {"from", "to"}
        size = float(axis[how])
        if how not in ("count", "step") or len(axis) != 3 or not max(map(abs, (start, stop, size))) <= _LARGEST:
            raise ValueError
        count = int(size) if how == "count" else math.floor((stop - start) / size + 1e-9) + 1
        if count < 1 or (how == "count" and count != size):
            raise ValueError
    except (KeyError, TypeError, ValueError, OverflowError, ZeroDivisionError):
        raise ValueError(f"a range must be {{from, to, count}} or {{from, to, step}}, got {axis}") from None
    if count > MOST_VALUES:
        raise ValueError(f"a range must be of at most {MOST_VALUES} values, got {float(count):.3g}")
    return np.linspace(start, stop if how == "count" else start + (count - 1) * size, count).tolist()


_Angle = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST)]
_Axis = Field(min_length=1, max_length=MOST_VALUES)
Polar = Annotated[tuple[Annotated[float, Field(ge=0, le=180)], ...], BeforeValidator(_values), _Axis]
Azimuth = Annotated[tuple[_Angle, ...], BeforeValidator(_values), _Axis]


class Grid(Model):
    """Every sensor with every light; angles in degrees."""

    sensor_polar: Polar
    sensor_azimuth: Azimuth
    light_polar: Polar
    light_azimuth: Azimuth

    @property
    def axes(self) -> tuple[tuple[float, ...], ...]:
        return self.sensor_polar, self.sensor_azimuth, self.light_polar, self.light_azimuth


@dataclass(frozen=True)
class Case:
    """One setting of a campaign: its number, which its random numbers depend on, and a scene without a pose list."""

    index: int
    scene: Scene
    setting: Setting
    parameters: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def picture(self) -> Picture:
        """The setting as planner, renderer and measurement take it."""
        return Picture.of(self.scene, self.setting.sensor, self.setting.light)


class Campaign(Model):
    """Scenes x swept parameters x poses.

    Attributes
    ----------
    scenes : tuple of Scene
    grid : Grid, optional
        Poses for all scenes, instead of each scene's own list.
    sweep : dict
        Values by key of the scene ("noise.sigma"); all combinations are worked through.

    Raises
    ------
    pydantic.ValidationError
        If there is no scene or no setting, more than `MOST_SETTINGS` of them, or a swept value makes a scene invalid.
        `load` turns it into `InvalidInput`.
    """

    name: FileName
    title: Title = ""
    scenes: Annotated[tuple[Scene, ...], Field(min_length=1, max_length=MOST_SCENES)]
    grid: Grid | None = None
    sweep: dict[str, Annotated[tuple[Any, ...], BeforeValidator(_values), _Axis]] = Field({})
    _latest: tuple[tuple[int, int], Scene] | None = PrivateAttr(None)

    @classmethod
    def of(cls, scene: Scene | Campaign) -> Campaign:
        """The campaign that is one scene with its own settings."""
        return scene if isinstance(scene, Campaign) else cls(name=scene.name, title=scene.title, scenes=(scene,))

    def measured_by(self, estimators: tuple[str, ...]) -> Campaign:
        """The same, measured by these estimators (`Locator.estimators`)."""
        scenes = tuple(
            scene.with_(locator=scene.locator.model_copy(update={"estimators": estimators})) for scene in self.scenes
        )
        return self.model_copy(update={"scenes": scenes})

    def __len__(self) -> int:
        return self._ends[-1]

    def case(self, index: int) -> Case:
        """The setting of a number.

        Raises
        ------
        InvalidInput
            If its pose lies in or on the object, or the combination of swept values makes no valid scene.
        """
        which, combination, place = self._place(index)
        scene = self._scene(which, combination)
        setting = self._setting(which, place)
        scene.check_pose("sensor", setting.sensor)
        scene.check_lights(setting.lights)
        return Case(index, scene, setting, self._parameters(combination))

    def at(self, index: int) -> tuple[Setting, dict[str, Any]]:
        """Poses and swept values of a number, without the scene, and unchecked: cheap."""
        which, combination, place = self._place(index)
        return self._setting(which, place), self._parameters(combination)

    def _place(self, index: int) -> tuple[int, int, int]:
        """Scene, combination of swept values and pose, each by its number."""
        which = bisect.bisect_right(self._ends, index)
        return which, *divmod(index - (self._ends[which - 1] if which else 0), self._poses[which])

    def samples(self, count: int = 32) -> tuple[Scene, ...]:
        """Each scene as it is without the sweep, with up to so many of its poses as its settings."""
        found = []
        for which, scene in enumerate(self.scenes):
            places = np.unique(np.linspace(0, self._poses[which] - 1, count).astype(int)) if self._poses[which] else ()
            settings = [self._setting(which, int(place)) for place in places]
            with contextlib.suppress(ValidationError, InvalidInput):  # a pose in the object
                found.append(Scene.model_validate(scene.model_dump() | {"settings": settings}))
        return tuple(found)

    @cached_property
    def _poses(self) -> list[int]:
        """Number of poses of each scene."""
        if self.grid:
            return [math.prod(map(len, self.grid.axes))] * len(self.scenes)
        return [len(scene.settings) for scene in self.scenes]

    @cached_property
    def _ends(self) -> list[int]:
        """Number of settings up to and with each scene."""
        combinations = math.prod(map(len, self.sweep.values()))
        return list(itertools.accumulate(combinations * poses for poses in self._poses))

    def _parameters(self, combination: int) -> dict[str, Any]:
        if not self.sweep:
            return {}
        places = np.unravel_index(combination, [len(values) for values in self.sweep.values()])
        return {key: values[i] for (key, values), i in zip(self.sweep.items(), places, strict=True)}

    def _setting(self, which: int, place: int) -> Setting:
        if self.grid:
            places = np.unravel_index(place, [len(axis) for axis in self.grid.axes])
            angles = [axis[i] for axis, i in zip(self.grid.axes, places, strict=True)]
            return Setting(sensor=Pose(*angles[:2]), light=Pose(*angles[2:]))
        setting = self.scenes[which].settings[place]
        if self.sweep:  # the paper printed its numbers for the scene as it was
            return Setting(sensor=setting.sensor, light=setting.light)
        return setting

    def _scene(self, which: int, combination: int) -> Scene:
        """The last one is kept: settings are asked for in order."""
        if self._latest is None or self._latest[0] != (which, combination):
            scene = changed(self.scenes[which], self._parameters(combination))
            self._latest = (which, combination), scene
        return self._latest[1]

    @model_validator(mode="after")
    def _consistent(self) -> Campaign:
        if not self._ends[-1]:
            raise ValueError(
                f"settings must be a list of at least one sensor and light, or a grid given, got {self.name}"
            )
        if len(self.sweep) > _MOST_KEYS:
            raise ValueError(f"sweep must be of at most {_MOST_KEYS} keys, got {len(self.sweep)}")
        if self._ends[-1] > MOST_SETTINGS:
            raise ValueError(f"settings must be at most {MOST_SETTINGS} in all, got {self._ends[-1]:.3g}")
        for scene, (key, values) in itertools.product(self.scenes, self.sweep.items()):
            for value in values:
                changed(scene, {key: value})
        return self


def changed(scene: Scene, parameters: dict[str, Any]) -> Scene:
    """The scene without its pose list and with other values, by key ("noise.sigma")."""
    document = scene.model_dump(mode="json", exclude={"settings"})
    for key, value in parameters.items():
        *tables, last = key.split(".")
        table = document
        for name in tables:
            table = table.get(name) if isinstance(table, dict) else None
        if not isinstance(table, dict) or last not in table:
            raise InvalidInput(f"sweep.{key} must be a key of the scene, got none in {scene.name}")
        table[last] = value
    try:
        return Scene.model_validate(document)
    except ValidationError as error:
        raise InvalidInput(f"sweep of {scene.name}: {describe(error)}") from None


def load(source: str | Path) -> Campaign:
    """Read a campaign, or a scene as a campaign of its own settings.

    A campaign is a TOML file with a list ``scenes`` (bundled names, or paths beside the file), and perhaps the tables
    ``grid`` and ``sweep``.

    Raises
    ------
    InvalidInput
        One line that names the file and the key.
    """
    path = find(source)
    document = read_toml(path)
    if "scenes" in document:
        return _campaign(path, document)
    try:
        return Campaign.of(from_document(path, document))
    except ValidationError as error:
        raise InvalidInput(f"{source}: {describe(error)}") from None


def _campaign(path: Path, document: dict[str, Any]) -> Campaign:
    names = document["scenes"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InvalidInput(f"{path}: scenes must be a list of names or files, got {names!r}")
    if len(names) > MOST_SCENES:
        raise InvalidInput(f"{path}: scenes must be at most {MOST_SCENES}, got {len(names)}")
    document["scenes"] = [scenes.load(name if name in scenes.names() else path.parent / name) for name in names]
    if "sweep" in document:
        document["sweep"] = _flat(document["sweep"])
    try:
        return Campaign.model_validate({"name": path.stem, **document})
    except ValidationError as error:
        raise InvalidInput(f"{path}: {describe(error)}") from None
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None


def _flat(table: Any, prefix: str = "") -> Any:
    """Nested tables as keys with dots, down to lists and ranges."""
    if not isinstance(table, dict) or "from" in table:
        return {prefix: table} if prefix else table
    return {k: v for name, item in table.items() for k, v in _flat(item, f"{prefix}.{name}".lstrip(".")).items()}
