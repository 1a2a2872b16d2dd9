"""What is to be measured, with what: the typed description that every other package reads.

Lengths in space are cm, lengths in the image px, brightness is in grey levels.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from scenes.errors import InvalidInput
from scenes.optics import Band, Floor, Jitter, Lens, Noise, Obstacle
from scenes.pose import Pose, PoseField
from scenes.solid import Solid, block

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class Model(BaseModel):
    """Frozen, without unknown keys, without NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Block(Model):
    """A rectangular block with a corner at the origin and its sides along the axes; ``size`` in cm."""

    kind: Literal["block"] = "block"
    size: tuple[Positive, Positive, Positive]

    @cached_property
    def solid(self) -> Solid:
        """Vertices, faces and edges, named as in the paper's Fig. 6."""
        return block(self.size)


class Material(Model):
    """Reflectance of the surface: the paper's Torrance-Sparrow model (its section 2).

    ``specular_fraction`` is s, ``diffuse_reflectance`` R_d, ``refractive_index`` n, ``extinction`` k
    and ``roughness`` the Beckmann m. With n = 1 and k = 0 the Fresnel term vanishes and the surface is
    purely diffuse, reflecting (1 - s) R_d. ``dispersion_um2`` is Cauchy's B: n at a wavelength w (um) is
    ``refractive_index`` + B (1 / w^2 - 1 / 0.5893^2).
    """

    specular_fraction: Fraction = 0.0
    diffuse_reflectance: Fraction = 1.0
    refractive_index: Positive = 1.0
    extinction: NotNegative = 0.0
    roughness: Positive = 0.2
    dispersion_um2: NotNegative = 0.0

    @property
    def is_diffuse(self) -> bool:
        """Whether the specular term is exactly zero."""
        return self.specular_fraction == 0 or (self.refractive_index == 1 and self.extinction == 0)


class Camera(Model):
    """A pinhole camera on a sphere around the origin, looking at the origin, the object's z axis up.

    ``focal_px`` is the focal length in pixels, ``blur_px`` the standard deviation of the lens' Gaussian
    blur, ``exposure`` the grey level of a white diffuse surface at the origin that faces the light, and
    ``black_level`` the grey level of darkness, which keeps noise from being clipped. ``analyser_deg`` is the
    direction that an ideal linear polariser in front of the lens lets through, from the image's x towards its y.
    """

    width: Annotated[int, Field(ge=1, le=16384)]
    height: Annotated[int, Field(ge=1, le=16384)]
    focal_px: Positive
    distance: Positive
    blur_px: NotNegative = 0.6
    exposure: Positive = 200.0
    black_level: NotNegative = 0.0
    lens: Lens = Lens()
    analyser_deg: float | None = None


class Light(Model):
    """A light on a sphere around the origin; ``distance`` in cm.

    ``radius`` (cm) is 0 for a point. ``polarisation_deg`` is the direction in which the light swings, seen along the
    beam: from the direction away from the pole (0) towards that of growing azimuth (90); None for unpolarised light.
    ``bands`` are the wavelengths it consists of.
    """

    distance: Positive
    radius: NotNegative = 0.0
    polarisation_deg: float | None = None
    bands: tuple[Band, ...] = ()


class Corner(Model):
    """A vertex of the object and the two edges whose images are intersected to find it."""

    vertex: str
    edges: tuple[str, str]


class Task(Model):
    """What to measure: the distance in the image between two corners."""

    kind: Literal["distance"] = "distance"
    start: Corner
    end: Corner

    @property
    def corners(self) -> tuple[Corner, Corner]:
        return self.start, self.end

    @property
    def edges(self) -> tuple[str, ...]:
        """The required edges: the two of the start corner, then the two of the end corner."""
        return self.start.edges + self.end.edges


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
    object: Block
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
        self._check_surroundings()
        for end in ("start", "end"):
            self._check_corner(f"task.{end}", getattr(self.task, end))
        if self.task.start.vertex == self.task.end.vertex:
            raise ValueError(
                f"task.end.vertex must be another vertex than task.start.vertex, got {self.task.end.vertex!r}"
            )
        for i, setting in enumerate(self.settings):
            for role in ("sensor", "light"):
                self.check_pose(role, getattr(setting, role), f"settings[{i}].{role}")
        return self

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
