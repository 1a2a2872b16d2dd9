"""Everything that a prediction, a render or a measurement has to know, in one checked description.

Lengths in space are in the scene's unit (cm as in the paper, if it says none), lengths in the image px,
brightness is in grey levels.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, PlainSerializer, Tag, model_validator

from scenes.cameras import CAMERAS, LENSES, AnyCamera
from scenes.cameras.noise import Noise
from scenes.changes import changed
from scenes.consistency import check_consistent
from scenes.errors import InvalidInput
from scenes.influences import INFLUENCES
from scenes.lights import LIGHTS, AnyLight
from scenes.lights.filters import Filter, Lamp
from scenes.materials.kinds import MATERIALS, AnyMaterial
from scenes.materials.on_faces import AnyFaceMaterial
from scenes.materials.surfaces import Surfaces, surfaces
from scenes.materials.textures import Texture
from scenes.measurands.features import Basic, Wall
from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.material import material_of
from scenes.measurands.measurands import Locator, Measurand, Quantity, Task, quantities_of
from scenes.measurands.zone import Zone
from scenes.model import FileName, Model, Title, rebuild
from scenes.parts.ball import Ball
from scenes.parts.block import Block
from scenes.parts.mesh_file import Mesh
from scenes.parts.part_file import PartFile, with_walls
from scenes.parts.solid import Solid, assembled
from scenes.parts.step_file import Step
from scenes.parts.turned import Turned
from scenes.placement import Placement, datums_of
from scenes.pose import Pose, PoseField, pairs, several
from scenes.ranges import Positive
from scenes.results import html_of
from scenes.spellings import in_full
from scenes.surroundings import Floor, Jitter, Obstacle
from scenes.uncertain import UncertainNumber
from scenes.uncertainty import Uncertainty
from scenes.units import Unit


def _tag_of_object(value: Any) -> str:
    return value.get("kind", "block") if isinstance(value, dict) else getattr(value, "kind", "block")


Object = Annotated[
    Annotated[Block, Tag("block")]
    | Annotated[Mesh, Tag("mesh")]
    | Annotated[Step, Tag("step")]
    | Annotated[Ball, Tag("ball")]
    | Annotated[Turned, Tag("turned")],
    Discriminator(_tag_of_object),
]


@lru_cache(maxsize=64)
def _bodies(measured: Solid, obstacles: tuple[Obstacle, ...]) -> Solid:
    return assembled(measured, *(obstacle.solid for obstacle in obstacles))


def _poses(value: Any) -> Pose | tuple[Pose, ...]:
    """One pose, or one for each of several lights."""
    found = tuple(Pose.of(each) for each in several(value))
    return found[0] if len(found) == 1 else found


LightPoses = Annotated[
    Pose | tuple[Pose, ...],
    BeforeValidator(_poses, json_schema_input_type=tuple[float, float] | list[tuple[float, float]]),
    PlainSerializer(pairs),
]


class Setting(Model):
    """One pair of sensor and light, with what the paper printed for it."""

    sensor: PoseField
    """Polar angle (0 to 180) and azimuth [degrees]."""
    light: LightPoses = ()
    """The same of the light that is free, or a list of such pairs, one for each light that is [degrees]."""
    paper_ice: Positive | None = None
    """The paper's predicted variance [px^2]."""
    paper_real: tuple[Positive, Positive] | None = None
    """The paper's measured variances, for both thresholds [px^2]."""

    @property
    def lights(self) -> tuple[Pose, ...]:
        """Poses of the lights that are free."""
        return several(self.light)


class Scene(Model):
    """Everything that a prediction, a render or a measurement has to know.

    Raises
    ------
    pydantic.ValidationError
        If a value is missing, unknown or out of range, if the task names a vertex or an edge that the
        object lacks, or if a sensor or a light would stand in or on the object. `scenes.load` turns it
        into `scenes.InvalidInput`.
    """

    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True, serialize_by_alias=True)

    name: FileName
    """The file's name where not given."""
    units: Unit = "cm"
    """Unit of all lengths in space."""
    title: Title = ""
    """What it is about, for tables."""
    object: Object
    """What is measured."""
    material: AnyMaterial
    """Of the object and the obstacles, where ``materials`` say nothing else."""
    materials: tuple[AnyFaceMaterial, ...] = ()
    """Of some faces of the object."""
    textures: tuple[Texture, ...] = ()
    """What is printed on faces, or how unevenly they reflect."""
    camera: AnyCamera
    """The camera."""
    light: AnyLight | None = None
    """The light, where there is one."""
    several_lights: tuple[AnyLight, ...] = Field((), alias="lights")
    """All lights, where there are several; each of a kind of its own."""
    noise: Noise
    """The sensor's noise."""
    task: Task | None = None
    """What is measured, in short: one distance or angle."""
    measurands: tuple[Measurand, ...] = ()
    """What is measured: all requirements of a drawing."""
    locator: Locator = Locator()
    """How edge points are found."""
    settings: tuple[Setting, ...] = ()
    """Poses to predict, render and measure."""
    same_scale: tuple[str, ...] = ()
    """Scenes whose settings share the paper's free scale with this one's."""
    floor: Floor | None = None
    """What the object stands on; left out: darkness."""
    obstacles: tuple[Obstacle, ...] = ()
    """What stands beside it."""
    jitter: Jitter = Jitter()
    """How exactly poses are set."""
    lamps: tuple[Lamp, ...] = ()
    """Lamps that a plan may choose instead of the light's own (`ice plan --vary band`)."""
    filters: tuple[Filter, ...] = ()
    """Filters that a plan may put before the lens."""
    uncertain: tuple[UncertainNumber, ...] = ()
    """Numbers with an uncertainty; also written in their places, as `{ value = 25, sd = 0.05 }`."""
    uncertainty: Uncertainty = Uncertainty()
    """The same of what is no number of a scene."""
    placement: Placement = Placement()
    """How it is known where the part lies."""

    def _repr_html_(self) -> str:
        rows = [
            {"measurand": each.name, "kind": each.kind, "of": each.told_of,
             "unit": self.unit_of(each), "plus": each.tolerance and each.tolerance.plus,
             "minus": each.tolerance and each.tolerance.minus}
            for each in quantities_of(self.task, self.measurands)
        ]  # fmt: skip
        return html_of(self, self.title or self.name, rows)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """All numbers to be measured: that of ``task``, or those of ``measurands``; InvalidInput without either."""
        if self.task is None and not self.measurands:
            raise InvalidInput(f"task or measurands must be given to plan, predict or measure, got none in {self.name}")
        return quantities_of(self.task, self.measurands)

    @property
    def features(self) -> tuple[Basic, ...]:
        """Those that are found for all quantities, in their order, then the placement's datums; none of a scene that
        asks for nothing."""
        asked = sum((quantity.basic for quantity in quantities_of(self.task, self.measurands)), ())
        return asked + datums_of(self) if asked else ()

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the edges and circles that its numbers need, each once: a task's as it names them."""
        if self.task is not None:
            return self.task.edges
        return tuple(dict.fromkeys(name for feature in self.features for name in feature.edges))

    @property
    def zones(self) -> tuple[Zone, ...]:
        """Of the geometric tolerances among the measurands."""
        found = ((i, each, each.zone) for i, each in enumerate(self.measurands))
        return tuple(self._grown(f"measurands[{i}]", each, zone) for i, each, zone in found if zone is not None)

    def _grown(self, key: str, each: Measurand, zone: Zone) -> Zone:
        """A zone with what it grows with, where it does."""
        if each.maximum_material is None:
            return zone
        quantities = quantities_of(self.task, self.measurands)
        return replace(zone, material=material_of(self.solid, key, each, quantities))

    def unit_of(self, quantity: Quantity) -> str:
        """Of a number in the object: the scene's unit of length, or degrees."""
        return "degrees" if quantity.is_angle else self.units

    @property
    def solid(self) -> Solid:
        """Vertices, faces and edges of the object; of a part from a file the curved surfaces that are measured."""
        solid, names = self.object.solid_in(self.units), self.measured_walls
        return with_walls(solid, self.object.curved_in(self.units), names) if names else solid

    @property
    def all_walls(self) -> Solid:
        """The same with every curved surface that may be measured."""
        solid = self.object.solid_in(self.units)
        if not isinstance(self.object, PartFile):
            return solid
        walls = self.object.curved_in(self.units)
        return with_walls(solid, walls) if walls else solid

    @property
    def measured_walls(self) -> tuple[str, ...]:
        """The curved surfaces of a part from a file that the measurands are about."""
        if not isinstance(self.object, PartFile):
            return ()
        return tuple(f.surface for each in self.measurands for f in each.features if isinstance(f, Wall))

    @property
    def bodies(self) -> Solid:
        """The object and the obstacles as one solid: all that hides and shades. The object's faces come first."""
        return _bodies(self.solid, self.obstacles)

    @property
    def bright_floor(self) -> Floor | None:
        """The floor, where it sends light back."""
        return None if self.floor is None or self.floor.reflectance == 0 else self.floor

    @property
    def surfaces(self) -> Surfaces:
        """What each face of `bodies` is made of."""
        return surfaces(self.material, self.materials, self.solid, len(self.bodies.faces))

    @property
    def lights(self) -> tuple[AnyLight, ...]:
        """All lights."""
        return self.several_lights or (() if self.light is None else (self.light,))

    def with_(self, **changes: Any) -> Scene:
        """The scene with some of its keys said anew, checked as a file is.

        A table changes the keys that it has; a list, or a part of another ``kind``, takes the place of the one before.
        Numbers that carry an uncertainty keep it; ``{"value": 25, "sd": 0.05}`` says another. What follows from a
        camera's data sheet follows anew. Paths of files are relative to where the program runs.

        Parameters
        ----------
        **changes
            Keys of the scene, or longer ones as error messages name them: ``**{"lights[1].distance": 30}``.

        Raises
        ------
        InvalidInput
            As of `scenes.load`.

        Examples
        --------
        >>> import scenes
        >>> task1 = scenes.load("task1")
        >>> noisy = task1.with_(noise={"sigma": 2.0}, camera={"blur_px": 1.5})
        >>> noisy.noise.sigma, noisy.camera.blur_px, noisy.camera.width, task1.camera.blur_px
        (2.0, 1.5, 256, 0.6)
        >>> task1.with_(**{"settings[3].light": (20, 300)}).settings[3].light
        Pose(polar_deg=20.0, azimuth_deg=300.0)
        >>> task1.with_(noise={"sigma": -1})
        Traceback (most recent call last):
        scenes.errors.InvalidInput: noise.sigma must be at least 0, got -1
        """
        return changed(self, changes)

    def lit_by(self, *lights: AnyLight) -> Scene:
        """The scene with other lights, all else as it is."""
        one = lights[0] if len(lights) == 1 else None
        return self.model_copy(update={"light": one, "several_lights": () if one else lights})

    @property
    def free(self) -> tuple[int, ...]:
        """Which of the lights are free: those that a setting gives poses for."""
        return tuple(i for i, light in enumerate(self.lights) if light.mount == "free")

    def position(self, role: Literal["sensor", "light"], pose: Pose, which: int = 0) -> np.ndarray:
        """Where the sensor or a light stands, shape (3,): on a sphere around the reference point."""
        polar, azimuth = np.radians([pose.polar_deg, pose.azimuth_deg])
        direction = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
        return np.array(self.camera.look_at) + self._distance(role, which) * np.array(direction)

    def _distance(self, role: Literal["sensor", "light"], which: int) -> float:
        return (self.camera if role == "sensor" else self.lights[which]).distance

    def check_pose(self, role: Literal["sensor", "light"], pose: Any, key: str | None = None, which: int = 0) -> Pose:
        """The pose, once it is known to stand outside the object; ``which`` of the lights.

        Raises
        ------
        InvalidInput
            If the pose is no pose, or lies in or on the object.
        """
        try:
            pose = Pose.of(pose)
        except InvalidInput as error:
            raise InvalidInput(f"{key or role}: {error}") from None
        at = self.position(role, pose, which)
        if self.solid.height_above(at) <= 1e-6 * self.solid.extent:
            radius = self._distance(role, which)
            raise InvalidInput(f"{key or role} must be outside the object, got {pose} at {radius:g} {self.units}")
        if self.floor is not None and at[2] <= self.floor.height:
            raise InvalidInput(f"{key or role} must be above the floor, got {pose}")
        return pose

    @model_validator(mode="before")
    @classmethod
    def _in_full(cls, data: Any) -> Any:
        return in_full(data) if isinstance(data, dict) else data

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        check_consistent(self)
        return self

    def check_lights(self, poses: tuple[Any, ...], key: str = "light") -> tuple[Pose, ...]:
        """Poses of all free lights, once they are known to stand outside the object.

        Raises
        ------
        InvalidInput
            If there are not as many as free lights, or one of them is no pose or lies in or on the object.
        """
        if len(poses) != len(self.free):
            raise InvalidInput(f"{key} must be {len(self.free)} pose(s), one for each free light, got {len(poses)}")
        keys = [f"{key}[{i}]" if len(poses) > 1 else key for i in range(len(poses))]
        return tuple(self.check_pose("light", *each) for each in zip(poses, keys, self.free, strict=True))


CAMERAS.followed_by(rebuild)
INFLUENCES.followed_by(rebuild)
LENSES.followed_by(rebuild)
LIGHTS.followed_by(rebuild)
MATERIALS.followed_by(rebuild)
MEASURANDS.followed_by(rebuild)
