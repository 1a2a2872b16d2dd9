"""The camera."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator, model_validator

from scenes.lens import Lens
from scenes.model import Model
from scenes.ranges import Coordinate, Curve, Length, Level, Positive, rising

MOST_PIXELS = 40_000_000  # 320 MB as float64


class Camera(Model):
    """A pinhole camera on a sphere around ``look_at`` (the origin as in the paper), which it looks at, z axis up.

    Instead of ``width`` and ``height``, ``distance`` and ``focal_px`` a scene may say ``sensor_size_mm``,
    ``working_distance_mm``, and ``focal_length_mm`` with ``pixel_pitch_um`` (`scenes.data_sheet.completed`).

    ``focal_px`` is the focal length in pixels, ``blur_px`` the standard deviation of the lens' Gaussian
    blur and ``exposure`` the grey level above darkness that the light gives a white diffuse surface at the reference
    point ``look_at`` that faces it. ``analyser_deg`` is the direction that an ideal linear polariser in front of the
    lens lets through, from the image's x towards its y.
    ``transmission`` (of the lens) and ``responsivity`` (of the sensor) are C and S of eq. 1 by wavelength, rows
    [nm, relative value], constant where not given.
    """

    width: Annotated[int, Field(ge=1, le=16384)]
    height: Annotated[int, Field(ge=1, le=16384)]
    focal_px: Annotated[float, Field(ge=1e-3, le=1e12)]
    distance: Length
    blur_px: Annotated[float, Field(ge=0, le=100)] = 0.6
    exposure: Level = 200.0
    look_at: tuple[Coordinate, Coordinate, Coordinate] = (0.0, 0.0, 0.0)
    lens: Lens = Lens()
    analyser_deg: float | None = None
    transmission: Curve = ()
    responsivity: Curve = ()
    pixel_pitch_um: Positive | None = None
    focal_length_mm: Positive | None = None
    sensor_size_mm: tuple[Positive, Positive] | None = None
    working_distance_mm: Positive | None = None

    @model_validator(mode="after")
    def _not_too_large(self) -> Camera:
        if self.width * self.height > MOST_PIXELS:
            raise ValueError(
                f"camera.width x height must be at most {MOST_PIXELS} pixels, got {self.width * self.height}"
            )
        return self

    @property
    def field_of_view(self) -> tuple[float, float]:
        """Width and height of what it sees at its distance, in the scene's unit."""
        return tuple(self.distance / self.focal_px * pixels for pixels in (self.width, self.height))

    @field_validator("transmission", "responsivity")
    @classmethod
    def _in_order(cls, rows: tuple, info: ValidationInfo) -> tuple:
        return rising(f"camera.{info.field_name}", rows)
