"""A light behind the object, which the sensor sees."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.lights.kinds import LIGHTS
from scenes.lights.luminaire import FULL, SMOOTH, Luminaire, Mount, Nodes, Surface, rectangle, square
from scenes.pose import Pose, PoseField
from scenes.ranges import Positive

_FAR = 1e4  # distances, to where a node of a telecentric light stands


@LIGHTS.add("backlight")
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

    faces_sensor: ClassVar[bool] = True

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

    @property
    def cone(self) -> float:
        """Half angle of its cone [rad]."""
        return float(np.radians(self.cone_deg))

    def seen_at(self, right: np.ndarray, down: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """1 on its square, from within its cone."""
        aside = np.maximum(np.abs(right), np.abs(down))
        return (aside <= self.half_side) & (cosine > max(np.cos(self.cone), 0.0))

    @property
    def is_telecentric(self) -> bool:
        """Whether it shines within a cone."""
        return self.cone_deg < 90

    def nodes(self, reach: float, fewest: int = FULL) -> Nodes:
        """Its surface's nodes, or directions within its cone as points far behind it, of equal radiance."""
        if not self.is_telecentric:
            made = self.surface(self.count(reach, fewest))  # its radiance: that of a white surface, exposure / pi
            powers = self.intensity * made.areas / np.pi
            return Nodes(made.places, made.normals, powers, float(made.areas.sum()))
        count = min(fewest, SMOOTH)
        x, weight = np.polynomial.legendre.leggauss(count)
        widest = np.sin(np.radians(self.cone_deg)) ** 2
        angle = (np.arange(2 * count) + 0.5) * np.pi / count
        sine = np.sqrt((x + 1) / 2 * widest)[:, None]
        away = np.stack(np.broadcast_arrays(sine * np.cos(angle), sine * np.sin(angle), -np.sqrt(1 - sine**2)), -1)
        away, far = away.reshape(-1, 3), _FAR * self.distance
        # irradiance across the axis: radiance times the integral of the cosine, pi sin^2 of the half angle
        share = np.repeat(weight / 2 / angle.size, angle.size) * widest
        return Nodes(far * away, None, self.intensity * share * far**2 / -away[:, 2])

    def surface(self, count: int) -> Surface:
        """Nodes on it."""
        return rectangle((2 * self.half_side,) * 2, 0.0, count)

    def shape(self) -> dict[str, Any]:
        """A square."""
        return square((self.half_side, self.half_side))

    def described(self, axes: np.ndarray, exposure: float, reach: float) -> list[dict[str, Any]]:
        """A square, or the directions of its cone."""
        if not self.is_telecentric:
            return super().described(axes, exposure, reach)
        made, found = self.nodes(reach), []
        for place, power in zip(made.places, made.powers, strict=True):
            away = axes[:3, :3] @ (self.target - place)
            value = {"type": "spectrum", "value": exposure * float(power) / float(away @ away)}
            found.append({"type": "directional", "direction": away.tolist(), "irradiance": value})
        return found
