"""The camera: a pinhole, and what every other kind of camera has."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from scenes.cameras.binning import Binning
from scenes.cameras.blur_field import BlurField
from scenes.cameras.kinds import CAMERAS
from scenes.cameras.lens import Lens
from scenes.cameras.lens_model import AnyLens
from scenes.cameras.over_field import outward
from scenes.model import Model
from scenes.ranges import Coordinate, Curve, Fraction, Length, Level, NotNegative, Positive, rising
from scenes.units import Unit, in_unit

_FASTEST, _SAME_SHEAR = 0.5, 1e-9  # px a row
Illumination = Annotated[tuple[tuple[Fraction, Annotated[float, Field(gt=0, le=1.5)]], ...], Field(max_length=64)]
MOST_PIXELS = 40_000_000  # 320 MB as float64


@CAMERAS.add("pinhole")
class Camera(Model):
    """A pinhole camera on a sphere around ``look_at``, which it looks at, z axis up.

    Instead of ``width`` and ``height``, ``distance`` and ``focal_px`` a scene may say ``sensor_size_mm``,
    ``working_distance_mm``, and ``focal_length_mm`` with ``pixel_pitch_um`` (`scenes.cameras.data_sheet.completed`).

    What lies beside the axis by b at the depth z is seen at ``focal_px`` b / ((1 - s) ``distance`` + s z) px from the
    image's middle, s the share of perspective (`perspective`): 1 of a pinhole.
    """

    kind: Literal["pinhole"] = "pinhole"
    """pinhole: all rays go through one point."""
    width: Annotated[int, Field(ge=1, le=16384)]
    """Width of the image [px]."""
    height: Annotated[int, Field(ge=1, le=16384)]
    """Height of the image [px]."""
    focal_px: Annotated[float, Field(ge=1e-3, le=1e12)]
    """Focal length: distance of the image from the lens over the pixel pitch [px]."""
    distance: Length
    """From ``look_at`` [length]."""
    blur_px: Annotated[float, Field(ge=0, le=100)] = 0.6
    """Standard deviation of the lens' Gaussian blur; where ``blur_field`` is given, that in the image's middle [px]."""
    blur_field: BlurField | None = None
    """How the blur varies over the image; even where not given."""
    relative_illumination: Illumination = ()
    """Light that the lens passes over that in the image's middle: rows [image height, ratio], 0 the image's middle and
    1 its corner; even where not given [ratio]."""
    natural_vignetting: bool = False
    """Whether light falls by the fourth power of the cosine of the angle from the axis, besides."""
    exposure: Level = 200.0
    """What the light adds to darkness on a white diffuse surface at ``look_at`` that faces it [grey levels]."""
    look_at: tuple[Coordinate, Coordinate, Coordinate] = (0.0, 0.0, 0.0)
    """The point that it looks at, centre of the spheres of poses; the origin as in the paper [length]."""
    roll_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    """By which it is turned about its axis, from its image's right towards down; what is mounted at it turns too
    [degrees]."""
    lens: AnyLens = Lens()
    """What makes the lens more than a pinhole."""
    analyser_deg: float | None = None
    """Direction that an ideal polariser before the lens lets through, from the image's x to its y [degrees]."""
    transmission: Curve = ()
    """Of the lens by wavelength, C of eq. 1: rows [nm, relative value]; constant where not given."""
    responsivity: Curve = ()
    """Of the sensor by wavelength, S of eq. 1: rows [nm, relative value]; constant where not given."""
    line_time_us: NotNegative = 0.0
    """From reading one row to reading the next, from the top down; 0 of a global shutter [us]."""
    motion: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    """With which the part moves along the image's right and down while its rows are read, at ``distance`` [length /
    s]."""
    pixel_pitch_um: Positive | None = None
    """From one pixel to the next, as on the data sheet [um]."""
    focal_length_mm: Positive | None = None
    """The lens' focal length, as engraved; it is focused at ``distance`` [mm]."""
    sensor_size_mm: tuple[Positive, Positive] | None = None
    """Width and height of the sensor; says ``width`` and ``height`` with the pitch [mm]."""
    working_distance_mm: Positive | None = None
    """The same as ``distance`` [mm]."""
    binning: Binning | None = None
    """Squares of pixels taken together: ``width``, ``height``, ``pixel_pitch_um`` and the noise are then said of the
    sensor's pixels, what else is in px or grey levels of the picture. A scene that is read has those of the squares."""

    @model_validator(mode="after")
    def _not_too_large(self) -> Camera:
        if self.width * self.height > MOST_PIXELS:
            raise ValueError(
                f"camera.width x height must be at most {MOST_PIXELS} pixels, got {self.width * self.height}"
            )
        return self

    @model_validator(mode="after")
    def _binned_by_its_scene(self) -> Camera:
        if self.binning is not None:
            raise ValueError(f"camera.binning must stand in a scene, whose noise it changes, got {self.binning.kind}")
        return self

    @model_validator(mode="after")
    def _sheared_as_it_moves(self) -> Camera:
        sheared = shear(self.line_time_us, self.motion, self.focal_px / self.distance)
        told = getattr(self.lens, "shear", None)
        if any(sheared) and told is None:
            raise ValueError(
                f"camera.line_time_us must be 0 with a lens of kind {self.lens.kind}, got {self.line_time_us}"
            )
        if any(sheared) and max(abs(a - b) for a, b in zip(sheared, told, strict=True)) > _SAME_SHEAR:
            raise ValueError(
                f"camera.lens.shear must be {sheared[0]:.9g}, {sheared[1]:.9g}, as line_time_us and motion say, "
                f"got {told}"
            )
        return self

    @property
    def field_of_view(self) -> tuple[float, float]:
        """Width and height of what it sees at its distance, in the scene's unit."""
        return tuple(self.distance / self.focal_px * pixels for pixels in (self.width, self.height))

    follows: ClassVar[dict[str, tuple[str, ...]]] = {"focal_length_mm": ("focal_px",)}
    """Keys that follow from a data sheet's key where that is said."""
    sheet: ClassVar[tuple[str, ...]] = ("focal_length_mm", "pixel_pitch_um")
    """The data sheet's numbers that others follow from, beside lengths of the scene."""

    @classmethod
    def derived(cls, camera: dict[str, Any], unit: Unit, pitch_um: float | None) -> dict[str, tuple[float, str]]:
        """What follows from a camera's table, as data sheets say it: values by their keys, and from which key.

        Raises
        ------
        ValueError
            If it does not fit together, or is not enough.
        """
        focal, distance = camera.get("focal_length_mm"), camera.get("distance")
        if not (is_positive(focal) and is_positive(distance)):
            return {}
        if pitch_um is None:
            raise ValueError("camera.pixel_pitch_um must be given with focal_length_mm, got nothing")
        away = in_unit(distance, unit, "mm")
        if not focal < away:
            raise ValueError(f"camera.focal_length_mm must be less than the distance, {away:g} mm, got {focal:g}")
        return {"focal_px": (focal * away / (away - focal) / pitch_um * 1000, "focal_length_mm")}

    @property
    def most_blur_px(self) -> float:
        """The largest standard deviation of the lens' blur within the image, in focus, px."""
        return self.blur_px if self.blur_field is None else self.blur_px * self.blur_field.most

    @property
    def is_dimmed(self) -> bool:
        """Whether it passes less light aside of the image's middle, or more."""
        return bool(self.relative_illumination) or self.natural_vignetting

    @property
    def perspective(self) -> float:
        """Share of perspective: 1 where all rays go through one point, 0 where they are parallel."""
        return 1.0

    @property
    def aperture_radius(self) -> float:
        """Radius of the cone of light that a point in focus sends through the lens, at ``distance`` [length]."""
        return self.lens.aperture_radius

    def stopped_down(self) -> Self:
        """The same with an aperture of no size."""
        return self.model_copy(update={"lens": self.lens.model_copy(update={"aperture_radius": 0.0})})

    def divisor(self, depth: Any) -> Any:
        """What ``focal_px`` is divided by for the px of a unit length at a depth along the axis, scene units."""
        share = self.perspective
        return (1 - share) * self.distance + share * depth

    def moved_to(self, distance: float) -> Self:
        """The same camera elsewhere on its axis, its lens set as before; unchecked."""
        return self.tried(distance=distance)

    def enlarged(self, factor: float) -> Self:
        """The same camera with a focal length by so much longer; unchecked."""
        changes, focal, pitch = {"focal_px": factor * self.focal_px}, self.focal_length_mm, self.pixel_pitch_um
        if focal is not None and pitch is not None:  # 1 / focal length = 1 / distance + 1 / image distance
            image = self.focal_px * pitch / 1000
            changes["focal_length_mm"] = 1 / (1 / focal - 1 / image + 1 / (factor * image))
        return self.tried(**changes)

    @field_validator("relative_illumination")
    @classmethod
    def _outward(cls, rows: Any) -> Any:
        return outward("camera.relative_illumination", rows)

    @field_validator("transmission", "responsivity")
    @classmethod
    def _in_order(cls, rows: tuple, info: ValidationInfo) -> tuple:
        return rising(f"camera.{info.field_name}", rows)


def shear(line_time_us: float, motion: tuple[float, float], px_per_length: float) -> tuple[float, float]:
    """By how many px a part that moves is recorded farther right and down a row, as a rolling shutter reads it.

    With u its velocity in the image, px a second, and T the line's time, a place y rows below the middle is read
    y_r T later, y_r = y + u_y T y_r: it is recorded u T y_r farther, of y: u T / (1 - u_y T).

    Raises
    ------
    ValueError
        If it moves down by half a row or more while one is read, or as fast up.

    Examples
    --------
    >>> [round(value, 6) for value in shear(10.0, (20.0, 0.0), 50.0)]
    [0.01, 0.0]
    """
    right, down = (1e-6 * line_time_us * px_per_length * speed for speed in motion)
    if not max(abs(right), abs(down)) < _FASTEST:
        raise ValueError(
            f"camera.motion must be less than half a row in line_time_us, got {max(abs(right), abs(down)):.3g}"
        )
    return right / (1 - down), down / (1 - down)


def is_positive(value: Any) -> bool:
    """Whether a key says a positive, finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and value > 0
