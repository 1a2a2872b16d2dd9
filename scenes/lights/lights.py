"""Lights: what they look like and where they are mounted."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from scenes.model import Model
from scenes.pose import Pose, PoseField
from scenes.ranges import Coordinate, Curve, Length, NotNegative, Positive, rising

Mount = Literal["free", "camera", "fixed"]


class Luminaire(Model):
    """What every kind of light has.

    It stands on a sphere around the reference point (`Camera.look_at`) and faces it. Its own axes are those of a sensor
    at its place: right, down, and towards the reference point.
    """

    distance: Length
    """From ``look_at`` [length]."""
    intensity: NotNegative = 1.0
    """Irradiance that it gives on its axis at ``distance``, over that of ``camera.exposure``."""
    mount: Mount = "free"
    """free: on its sphere, where a setting or the plan says; camera: it moves with the sensor; fixed: at ``pose``."""
    pose: PoseField | None = None
    """Polar angle and azimuth of a fixed light [degrees]."""
    offset: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    """Of a light at the camera: to the right and down, from the sensor's axis [length]."""
    polarisation_deg: float | None = None
    """Seen along the beam, from away from the pole (0) to growing azimuth (90); left out: none [degrees]."""
    spectrum: Curve = ()
    """Q of eq. 1: rows [nm, relative value]; constant where not given."""

    @field_validator("spectrum")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("light.spectrum", rows)

    @model_validator(mode="after")
    def _mounted(self) -> Luminaire:
        if (self.mount == "fixed") != (self.pose is not None):
            got = "none" if self.pose is None else f"{self.pose} with mount {self.mount!r}"
            raise ValueError(f"pose must be given for mount 'fixed' and for no other, got {got}")
        if self.mount != "camera" and any(self.offset):
            raise ValueError(f"offset must be left out but for mount 'camera', got {list(self.offset)}")
        return self

    @property
    def half_size(self) -> float:
        """Half of its largest extent; 0 for a point [length]."""
        return 0.0


class Light(Luminaire):
    """A point, or a sphere that shines alike from everywhere."""

    kind: Literal["point"] = "point"
    """point"""
    radius: Annotated[float, Field(ge=0)] = 0.0
    """0 for a point [length]."""

    @model_validator(mode="after")
    def _clear(self) -> Light:
        if self.radius >= self.distance / 2:
            raise ValueError(f"light.radius must be less than half of light.distance, got {self.radius:g}")
        return self

    @property
    def half_size(self) -> float:
        """Its radius [length]."""
        return self.radius


class Disc(Luminaire):
    """A flat disc, of equal radiance everywhere and in all directions before it."""

    kind: Literal["disc"]
    """disc"""
    radius: Positive
    """Its radius [length]."""

    @property
    def half_size(self) -> float:
        """Its radius [length]."""
        return self.radius


class Bar(Luminaire):
    """A flat rectangle, of equal radiance everywhere and in all directions before it."""

    kind: Literal["bar"]
    """bar"""
    length: Positive
    """Along its own axis to the right [length]."""
    width: Positive
    """Down [length]."""
    turn_deg: float = 0.0
    """By which it is turned about its axis, from right towards down [degrees]."""

    @property
    def half_size(self) -> float:
        """Half of its diagonal [length]."""
        return float((self.length**2 + self.width**2) ** 0.5 / 2)


class Ring(Luminaire):
    """A ring around its axis, flat or tilted inwards as part of a cone, of equal radiance everywhere."""

    kind: Literal["ring"]
    """ring"""
    inner_radius: NotNegative
    """Of its hole [length]."""
    outer_radius: Positive
    """Of its rim [length]."""
    tilt_deg: Annotated[float, Field(ge=0, lt=90)] = 0.0
    """Between its surface and the plane across its axis: it shines inwards, and its outer rim is nearer [degrees]."""

    @model_validator(mode="after")
    def _not_empty(self) -> Ring:
        if self.inner_radius >= self.outer_radius:
            got = f"{self.inner_radius:g} and {self.outer_radius:g}"
            raise ValueError(f"inner_radius must be less than outer_radius, got {got}")
        return self

    @property
    def half_size(self) -> float:
        """Its outer radius [length]."""
        return self.outer_radius


class Dome(Luminaire):
    """Part of a sphere of radius ``distance`` around the reference point, shining inwards, open at its top."""

    kind: Literal["dome"]
    """dome"""
    half_angle_deg: Annotated[float, Field(gt=0, le=90)] = 90.0
    """From its axis to its rim [degrees]."""
    opening_deg: Annotated[float, Field(ge=0, lt=90)] = 0.0
    """From its axis to the rim of the hole at its top, through which the camera looks [degrees]."""

    @model_validator(mode="after")
    def _not_empty(self) -> Dome:
        if self.opening_deg >= self.half_angle_deg:
            got = f"{self.opening_deg:g} and {self.half_angle_deg:g}"
            raise ValueError(f"opening_deg must be less than half_angle_deg, got {got}")
        return self

    @property
    def half_size(self) -> float:
        """Its radius [length]."""
        return self.distance


class Backlight(Luminaire):
    """A flat square behind the object, which the sensor sees: of equal radiance within a cone about its axis.

    ``intensity`` is its own brightness: over that of a white surface that ``camera.exposure`` stands for.
    """

    kind: Literal["backlight"]
    """backlight"""
    mount: Mount = "fixed"
    """fixed: at ``pose``; camera: it stays opposite the sensor; free: on its sphere."""
    pose: PoseField | None = None
    """Where a fixed one stands; (180, 0), below the object, where not given [degrees]."""
    half_side: Positive
    """How far it reaches each way [length]."""
    cone_deg: Annotated[float, Field(ge=0.1, le=90)] = 90.0
    """Half angle of the cone about its axis in which it shines: 90 is diffuse, a few degrees telecentric [degrees]."""

    @model_validator(mode="before")
    @classmethod
    def _below(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("mount", "fixed") == "fixed" and data.get("pose") is None:
            return {**data, "pose": Pose(180.0, 0.0)}
        return data

    @property
    def half_size(self) -> float:
        """Half of its diagonal [length]."""
        return float(2**0.5 * self.half_side)


def as_point(light: Luminaire) -> Light:
    """A point in its middle that gives the same irradiance at the reference point."""
    return Light(**{name: getattr(light, name) for name in Luminaire.model_fields})


def _kind(value: Any) -> str:
    return value.get("kind", "point") if isinstance(value, dict) else getattr(value, "kind", "point")


AnyLight = Annotated[
    Annotated[Light, Tag("point")]
    | Annotated[Disc, Tag("disc")]
    | Annotated[Bar, Tag("bar")]
    | Annotated[Ring, Tag("ring")]
    | Annotated[Dome, Tag("dome")]
    | Annotated[Backlight, Tag("backlight")],
    Discriminator(_kind),
]
