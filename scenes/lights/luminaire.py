"""What every kind of light is: where it is mounted, the points that stand for it, and what the renderer makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import field_validator, model_validator

from scenes.model import Model
from scenes.pose import PoseField
from scenes.ranges import Coordinate, Curve, Length, NotNegative, rising

Mount = Literal["free", "camera", "fixed"]
ERROR = 1e-5  # of the irradiance, of a light that nothing hides a part of
GLANCE, SMOOTH, FULL, _MOST = 2, 4, 10, 24  # nodes each way: at least for many pictures, without a kink, and for one
BLACK = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.0}}


@dataclass(frozen=True, eq=False)
class Nodes:
    """K points that shine for a light, in its own axes.

    Attributes
    ----------
    places : ndarray, shape (K, 3)
        In the scene's unit.
    normals : ndarray, shape (K, 3), or None
        Of the surface that they stand for, whose nodes send as the cosine to it; None where they send alike into all
        directions.
    powers : ndarray, shape (K,)
        Irradiance across a node's beam times squared distance, on its normal, over the camera's exposure.
    area : float
        Of the surface that they stand for; 0 for points and spheres.
    """

    places: np.ndarray
    normals: np.ndarray | None
    powers: np.ndarray
    area: float = 0.0


@dataclass(frozen=True, eq=False)
class Surface:
    """Quadrature nodes on a Lambertian surface: places (K, 3), unit normals (K, 3) and areas (K,)."""

    places: np.ndarray
    normals: np.ndarray
    areas: np.ndarray


class Luminaire(Model):
    """What every kind of light has.

    It stands on a sphere around the reference point (`Camera.look_at`) and faces it. Its own axes are those of a sensor
    at its place: right, down, and towards the reference point; its middle is their origin.

    A new kind is a class in one file, made known by ``@LIGHTS.add(name)``: its fields, `half_size`, and either
    `surface` and `shape`, of a surface of equal radiance, or `nodes` and `described`.
    """

    kind: str
    """Its kind's name."""
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

    faces_sensor: ClassVar[bool] = False
    """Whether the sensor sees the light itself, behind the object."""

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

    @property
    def is_point(self) -> bool:
        """Whether it is taken for a point."""
        return False

    def profile(self, cosine: np.ndarray) -> np.ndarray:
        """What a node sends at an angle to its normal over what it sends along it, from the angle's cosine."""
        return np.maximum(cosine, 0.0)

    @property
    def cone(self) -> float:
        """Half angle of the cone about its axis in which it shines [rad]."""
        return np.pi / 2

    def seen_at(self, right: np.ndarray, down: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """What the sensor sees of one that faces it, over its brightness: arrays of one shape.

        Parameters
        ----------
        right, down : ndarray
            Where rays meet its plane, along its own axes, the scene's unit.
        cosine : ndarray
            Between the rays, back from it, and its axis.
        """
        raise NotImplementedError

    @property
    def target(self) -> np.ndarray:
        """The reference point in the light's axes, (3,)."""
        return np.array([-self.offset[0], -self.offset[1], self.distance])

    def nodes(self, reach: float, fewest: int = FULL) -> Nodes:
        """Points that shine for it at places up to ``reach`` from the reference point.

        Parameters
        ----------
        reach : float
            In the scene's unit.
        fewest : int
            Nodes each way: at least `FULL`, `SMOOTH` where nothing hides a part of the light, or just `GLANCE`.
        """
        made = self.surface(self.count(reach, fewest))
        towards = np.array([0.0, 0.0, self.distance]) - made.places
        square = (towards**2).sum(1)
        facing = np.maximum(np.einsum("ki,ki->k", towards, made.normals), 0.0) * towards[:, 2] / square**2
        powers = self.intensity * made.areas / (made.areas @ facing)
        return Nodes(made.places, made.normals, powers, float(made.areas.sum()))

    def surface(self, count: int) -> Surface:
        """Gauss nodes of its surface of equal radiance, ``count`` each way."""
        raise NotImplementedError

    def shape(self) -> dict[str, Any]:
        """The surface for the renderer, in the light's axes.

        One of Mitsuba's shapes with ``to_world``, an ndarray (4, 4), or ``{"type": "triangles", "triangles": ndarray
        (T, 3, 3)}``, their outside towards the object.
        """
        raise NotImplementedError

    def described(self, axes: np.ndarray, exposure: float, reach: float) -> list[dict[str, Any]]:
        """Mitsuba's dictionaries of it: emitters, or shapes that shine.

        Parameters
        ----------
        axes : ndarray, shape (4, 4)
            From its own axes to the scene's.
        exposure : float
            Radiance times pi of a white Lambertian surface under a light of intensity 1.
        reach : float
            As of `nodes`.
        """
        made = self.nodes(reach)
        return [shining(self.shape(), axes, exposure * made.powers.sum() / made.area)]

    def count(self, reach: float, fewest: int) -> int:
        """Gauss nodes each way for an error of `ERROR` at the nearest place that is asked about."""
        nearest = max(self.distance - reach, 0.05 * self.distance)
        return fewest if fewest == GLANCE else max(self._needed(nearest), fewest)

    def _needed(self, distance: float) -> int:
        return needed(self.half_size / (distance + np.hypot(distance, self.half_size)))


def needed(ratio: float) -> int:
    """Gauss nodes each way where the error falls with this ratio's square a node."""
    return int(min(np.ceil(np.log(ERROR) / (2 * np.log(ratio))), _MOST))


def shining(shape: dict[str, Any], axes: np.ndarray, radiance: float) -> dict[str, Any]:
    """A black shape of a radiance, in the scene's axes."""
    emitter = {"type": "area", "radiance": {"type": "spectrum", "value": float(radiance)}}
    placed = dict(shape)
    if "triangles" in shape:
        placed["triangles"] = shape["triangles"] @ axes[:3, :3].T + axes[:3, 3]
    else:
        placed["to_world"] = axes @ shape.get("to_world", np.eye(4))
    return {**placed, "bsdf": BLACK, "emitter": emitter}


@lru_cache(maxsize=64)
def gauss(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss nodes and weights of [0, 1], and unit vectors (2 count, 3) evenly around the axis."""
    x, weight = np.polynomial.legendre.leggauss(count)
    angle = (np.arange(2 * count) + 0.5) * np.pi / count
    found = (x + 1) / 2, weight / 2, np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], -1)
    for each in found:
        each.setflags(write=False)
    return found


def annulus(inner: float, outer: float, tilt: float, count: int) -> Surface:
    """Nodes of a flat ring, or of part of a cone whose rim stands nearer by ``tilt`` [rad]."""
    share, weight, around = gauss(count)
    radius = np.sqrt(inner**2 + share * (outer**2 - inner**2))  # equal weights are equal areas
    height = (radius - (inner + outer) / 2) * np.tan(tilt)
    places = radius[:, None, None] * around + height[:, None, None] * np.array([0.0, 0.0, 1.0])
    normals = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) - np.sin(tilt) * around
    areas = weight * np.pi * (outer**2 - inner**2) / np.cos(tilt) / len(around)
    return Surface(places.reshape(-1, 3), np.tile(normals, (count, 1)), np.repeat(areas, len(around)))


def rectangle(sides: tuple[float, float], turn: float, count: int) -> Surface:
    """Nodes of a flat rectangle, turned about its axis by ``turn`` [rad]."""
    x, weight = np.polynomial.legendre.leggauss(count)
    along, across = (part.ravel() for part in np.meshgrid(x * sides[0] / 2, x * sides[1] / 2, indexing="ij"))
    places = np.stack([along * np.cos(turn) - across * np.sin(turn), along * np.sin(turn) + across * np.cos(turn)], -1)
    areas = np.outer(weight, weight).ravel() * sides[0] * sides[1] / 4
    places = np.concatenate([places, np.zeros((len(places), 1))], 1)
    return Surface(places, np.tile([0.0, 0.0, 1.0], (len(places), 1)), areas)


def square(half_sides: tuple[float, float], turn: float = 0.0) -> dict[str, Any]:
    """Mitsuba's square of half side 1 as a rectangle, turned about its axis by ``turn`` [rad]."""
    to_world = np.diag([*half_sides, 1.0, 1.0])
    rotation = np.eye(4)
    rotation[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    return {"type": "rectangle", "to_world": rotation @ to_world}


def turned(radii: np.ndarray, heights: np.ndarray) -> dict[str, Any]:
    """The surface that a line of radii and heights makes turning about the axis, as flat pieces of the same area."""
    step = 2 * np.pi / _AROUND
    angle = np.arange(_AROUND + 1) * step
    circle = np.stack([np.cos(angle), np.sin(angle)], -1) * np.sqrt(step / np.sin(step))
    ring = np.broadcast_to(heights[:, None, None], (len(radii), angle.size, 1))
    places = np.concatenate([radii[:, None, None] * circle, ring], -1)
    a, b, c, d = places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]
    pieces = [np.stack(corners, -2).reshape(-1, 3, 3) for corners in ([a, b, c], [a, c, d])]
    return {"type": "triangles", "triangles": np.concatenate(pieces)}


_AROUND = 128  # pieces of a surface that is turned about its axis
