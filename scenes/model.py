"""What is to be measured, with what: the typed description that every other package reads.

Lengths in space are cm, lengths in the image px, brightness is in grey levels.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from scenes import mesh
from scenes.errors import InvalidInput
from scenes.optics import Floor, Jitter, Lens, Noise, Obstacle
from scenes.pose import Pose, PoseField
from scenes.ranges import Darkness, Fraction, Length, Level, Positive
from scenes.solid import Solid, block


class Model(BaseModel):
    """Frozen, without unknown keys, without NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Block(Model):
    """A rectangular block with a corner at the origin and its sides along the axes; ``size`` in cm."""

    kind: Literal["block"] = "block"
    size: tuple[Length, Length, Length]

    @cached_property
    def solid(self) -> Solid:
        """Vertices, faces and edges, named as in the paper's Fig. 6."""
        return block(self.size)


class Mesh(Model):
    """A polyhedron from a mesh file (STL, PLY or OBJ, lengths in cm).

    ``file`` is relative to the scene's file. Vertices, edges and circles get the names that `scenes.mesh.solid` gives;
    ``names`` may give vertices (by their position, cm) other ones.
    """

    kind: Literal["mesh"]
    file: Path
    names: dict[str, tuple[float, float, float]] = {}

    def __hash__(self) -> int:
        return hash((self.file, tuple(sorted(self.names.items()))))

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @cached_property
    def solid(self) -> Solid:
        """Vertices, faces, edges and circles of the mesh."""
        return mesh.renamed(mesh.read(self.file), self.names)


def _tag_of_object(value: Any) -> str:
    return value.get("kind", "block") if isinstance(value, dict) else getattr(value, "kind", "block")


Object = Annotated[Annotated[Block, Tag("block")] | Annotated[Mesh, Tag("mesh")], Discriminator(_tag_of_object)]


def _rising(key: str, rows: tuple) -> tuple:
    """The rows of a table, once their wavelengths are known to rise."""
    if any(a[0] >= b[0] for a, b in pairwise(rows)):
        raise ValueError(f"{key} must be rows of rising wavelength, got {[row[0] for row in rows]}")
    return rows


Curve = tuple[tuple[Positive, Annotated[float, Field(ge=0)]], ...]


class Material(Model):
    """Reflectance of the surface: the paper's Torrance-Sparrow model (its section 2).

    ``specular_fraction`` is s, ``diffuse_reflectance`` R_d, ``refractive_index`` n, ``extinction`` k
    and ``roughness`` the Beckmann m. With n = 1 and k = 0 the Fresnel term vanishes and the surface is
    purely diffuse, reflecting (1 - s) R_d. ``index_table`` gives n and k by wavelength, rows
    [wavelength in nm, n, k] with rising wavelengths, and then replaces ``refractive_index`` and ``extinction``.
    """

    specular_fraction: Fraction = 0.0
    diffuse_reflectance: Fraction = 1.0
    refractive_index: Annotated[float, Field(gt=0, le=1e6)] = 1.0  # its square and its square's square must be numbers
    extinction: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    roughness: Annotated[float, Field(ge=1e-6, le=1e6)] = 0.2
    index_table: tuple[tuple[Positive, Positive, Annotated[float, Field(ge=0, le=1e6)]], ...] = ()

    @field_validator("index_table")
    @classmethod
    def _rising(cls, rows: tuple) -> tuple:
        return _rising("material.index_table", rows)

    @property
    def is_diffuse(self) -> bool:
        """Whether the specular term is exactly zero."""
        indices = [row[1:] for row in self.index_table] or [(self.refractive_index, self.extinction)]
        return self.specular_fraction == 0 or all(index == (1, 0) for index in indices)


class Camera(Model):
    """A pinhole camera on a sphere around the origin, looking at the origin, the object's z axis up.

    ``focal_px`` is the focal length in pixels, ``blur_px`` the standard deviation of the lens' Gaussian
    blur, ``exposure`` the grey level of a white diffuse surface at the origin that faces the light, and
    ``black_level`` the grey level of darkness, which keeps noise from being clipped. ``analyser_deg`` is the
    direction that an ideal linear polariser in front of the lens lets through, from the image's x towards its y.
    ``transmission`` (of the lens) and ``responsivity`` (of the sensor) are C and S of eq. 1 by wavelength, rows
    [nm, relative value], constant where not given.
    """

    width: Annotated[int, Field(ge=1, le=16384)]
    height: Annotated[int, Field(ge=1, le=16384)]
    focal_px: Annotated[float, Field(ge=1e-3, le=1e12)]
    distance: Length
    blur_px: Annotated[float, Field(ge=0, le=100)] = 0.6
    exposure: Level = 200.0
    black_level: Darkness = 0.0
    lens: Lens = Lens()
    analyser_deg: float | None = None
    transmission: Curve = ()
    responsivity: Curve = ()

    @field_validator("transmission", "responsivity")
    @classmethod
    def _rising(cls, rows: tuple, info: ValidationInfo) -> tuple:
        return _rising(f"camera.{info.field_name}", rows)


class Light(Model):
    """A light on a sphere around the origin; ``distance`` in cm.

    ``radius`` (cm) is 0 for a point. ``polarisation_deg`` is the direction in which the light swings, seen along the
    beam: from the direction away from the pole (0) towards that of growing azimuth (90); None for unpolarised light.
    ``spectrum`` is Q of eq. 1, rows [nm, relative value].
    """

    distance: Length
    radius: Annotated[float, Field(ge=0)] = 0.0
    polarisation_deg: float | None = None
    spectrum: Curve = ()

    @field_validator("spectrum")
    @classmethod
    def _rising(cls, rows: tuple) -> tuple:
        return _rising("light.spectrum", rows)


class Corner(Model):
    """A vertex of the object and the two edges whose images are intersected to find it."""

    vertex: str
    edges: tuple[str, str]


class Centre(Model):
    """The centre of a circular edge, found by fitting the ellipse that is its image."""

    circle: str

    @property
    def edges(self) -> tuple[str, ...]:
        """The circle's own name, for it is the one edge that is needed."""
        return (self.circle,)


def _tag_of_feature(value: Any) -> str:
    return "centre" if isinstance(value, Centre) or (isinstance(value, dict) and "circle" in value) else "corner"


Feature = Annotated[Annotated[Corner, Tag("corner")] | Annotated[Centre, Tag("centre")], Discriminator(_tag_of_feature)]


class Task(Model):
    """What to measure: the distance in the image between two features, or the angle between two edges.

    A distance needs ``start`` and ``end``, an angle ``lines``, the names of its two edges.
    """

    kind: Literal["distance", "angle"] = "distance"
    start: Feature | None = None
    end: Feature | None = None
    lines: tuple[str, str] | None = None

    @model_validator(mode="after")
    def _complete(self) -> Task:
        wanted = ("start", "end") if self.kind == "distance" else ("lines",)
        for key in ("start", "end", "lines"):
            value = getattr(self, key)
            if (value is None) == (key in wanted):
                got = "nothing" if value is None else repr(value)
                raise ValueError(f"task.{key} must be {'given' if key in wanted else 'left out'}, got {got}")
        return self

    @property
    def corners(self) -> tuple[Corner | Centre, ...]:
        """The two features of a distance; none for an angle."""
        return () if self.start is None or self.end is None else (self.start, self.end)

    @property
    def edges(self) -> tuple[str, ...]:
        """The required edges: those of the start feature, then those of the end feature; or the two lines."""
        return self.lines or sum((feature.edges for feature in self.corners), ())


class Locator(Model):
    """How edge points are found.

    ``scale_px`` is the standard deviation of the smoothing Gaussian, ``window_px`` how far to each side
    of the expected edge is searched, ``thresholds`` the gradient thresholds (grey levels a pixel) of the
    classic edge detector; the paper used 12 and 10.
    """

    scale_px: Annotated[float, Field(ge=0.8, le=10)] = 1.0
    window_px: Annotated[float, Field(ge=1, le=50)] = 3.0
    thresholds: tuple[Positive, ...] = (12.0, 10.0)


class Setting(Model):
    """One pair of sensor and light, with what the paper printed for it (variances, px^2)."""

    sensor: PoseField
    light: PoseField
    paper_ice: Positive | None = None
    paper_real: tuple[Positive, Positive] | None = None


class Scene(Model):
    """Everything that a prediction, a render or a measurement has to know.

    Raises
    ------
    pydantic.ValidationError
        If a value is missing, unknown or out of range, if the task names a vertex or an edge that the
        object lacks, or if a sensor or a light would stand in or on the object. `scenes.load` turns it
        into `scenes.InvalidInput`.
    """

    name: str
    title: str = ""
    object: Object
    material: Material
    camera: Camera
    light: Light
    noise: Noise
    task: Task
    locator: Locator = Locator()
    settings: tuple[Setting, ...] = ()
    same_scale: tuple[str, ...] = ()
    floor: Floor | None = None
    obstacles: tuple[Obstacle, ...] = ()
    jitter: Jitter = Jitter()

    @property
    def solid(self) -> Solid:
        """Vertices, faces and edges of the object."""
        return self.object.solid

    def position(self, role: Literal["sensor", "light"], pose: Pose) -> np.ndarray:
        """Where the sensor or the light stands, cm, shape (3,)."""
        polar, azimuth = np.radians([pose.polar_deg, pose.azimuth_deg])
        direction = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
        return (self.camera if role == "sensor" else self.light).distance * np.array(direction)

    def check_pose(self, role: Literal["sensor", "light"], pose: Any, key: str | None = None) -> Pose:
        """The pose, once it is known to stand outside the object.

        Raises
        ------
        InvalidInput
            If the pose is no pose, or lies in or on the object.
        """
        try:
            pose = Pose.of(pose)
        except InvalidInput as error:
            raise InvalidInput(f"{key or role}: {error}") from None
        if self.solid.height_above(self.position(role, pose)) <= 1e-6 * np.ptp(self.solid.vertices):
            radius = (self.camera if role == "sensor" else self.light).distance
            raise InvalidInput(f"{key or role} must be outside the object, got {pose} at {radius:g} cm")
        if self.floor is not None and self.position(role, pose)[2] <= self.floor.height:
            raise InvalidInput(f"{key or role} must be above the floor, got {pose}")
        return pose

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        self._check_task()
        self._check_surroundings()
        for i, setting in enumerate(self.settings):
            for role in ("sensor", "light"):
                self.check_pose(role, getattr(setting, role), f"settings[{i}].{role}")
        return self

    def _check_task(self) -> None:
        for end, feature in zip(("start", "end"), self.task.corners, strict=False):
            check = self._check_corner if isinstance(feature, Corner) else self._check_centre
            check(f"task.{end}", feature)
        if self.task.kind == "angle":
            known = [edge.name for edge in self.solid.edges]
            for name in self.task.lines:
                if name not in known:
                    raise ValueError(f"task.lines must be edges ({', '.join(known)}), got {name!r}")
            if self.task.lines[0] == self.task.lines[1]:
                raise ValueError(f"task.lines must be two different edges, got {list(self.task.lines)}")
        elif self.task.start == self.task.end or (
            getattr(self.task.start, "vertex", 0) == getattr(self.task.end, "vertex", 1)
        ):
            key = "vertex" if isinstance(self.task.end, Corner) else "circle"
            raise ValueError(
                f"task.end.{key} must be another {key} than task.start.{key}, got {getattr(self.task.end, key)!r}"
            )

    def _check_centre(self, key: str, centre: Centre) -> None:
        known = [circle.name for circle in self.solid.circles]
        if centre.circle not in known:
            raise ValueError(f"{key}.circle must be one of {', '.join(known) or '(none here)'}, got {centre.circle!r}")

    def _check_surroundings(self) -> None:
        """Floor below the object, light and sensor above it and outside obstacles, one level of darkness."""
        low = float(self.solid.vertices[:, 2].min())
        if self.floor is not None and self.floor.height > low:
            raise ValueError(
                f"floor.height must be at most {low:g}, the object's lowest point, got {self.floor.height:g}"
            )
        if self.noise.needs_darkness and self.noise.dark_level != self.camera.black_level:
            raise ValueError(
                f"noise.dark_level must be camera.black_level ({self.camera.black_level:g}) where noise depends on the "
                f"light, got {self.noise.dark_level:g}"
            )
        if self.light.radius >= self.light.distance / 2:
            raise ValueError(f"light.radius must be less than half of light.distance, got {self.light.radius:g}")

    def _check_corner(self, key: str, corner: Corner) -> None:
        if corner.vertex not in self.solid.vertex_names:
            raise ValueError(f"{key}.vertex must be one of {', '.join(self.solid.vertex_names)}, got {corner.vertex!r}")
        there = [edge.name for edge in self.solid.edges_at(corner.vertex)]
        for name in corner.edges:
            if name not in there:
                raise ValueError(f"{key}.edges must be edges at {corner.vertex} ({', '.join(there)}), got {name!r}")
        if corner.edges[0] == corner.edges[1]:
            raise ValueError(f"{key}.edges must be two different edges, got {list(corner.edges)}")
