"""A camera with a telecentric lens, as its data sheet says it."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from scenes.cameras.diffraction import airy_um
from scenes.cameras.kinds import CAMERAS
from scenes.cameras.pinhole import Camera, is_positive
from scenes.errors import given as told
from scenes.ranges import NotNegative, Positive
from scenes.units import Unit, in_unit

_MOST_DEG = 45.0  # of a chief ray: more is no telecentric lens
Angle = Annotated[float, Field(ge=-_MOST_DEG, le=_MOST_DEG)]


@CAMERAS.add("telecentric")
class Telecentric(Camera):
    """A camera with an object-side telecentric lens: what is moved along the axis keeps its size in the image.

    The chief rays run along the axis, but for ``telecentricity_deg``: then they meet at the finite distance of an
    entrance pupil far behind the lens (or, below 0, behind the part), and the magnification changes with the depth by
    its tangent over the radius of the field. ``focal_px`` follows: the magnification over the pixel pitch, times
    ``distance``; it is no focal length. ``distance`` is the lens' working distance, at which it is focused.
    """

    kind: Literal["telecentric"]  # ty: ignore[incompatible-attribute-override]
    """telecentric: all chief rays run along the axis."""
    focal_px: Annotated[float, Field(ge=1e-3, le=1e12)]
    """Magnification over the pixel pitch, times ``distance``: follows from the magnification [px]."""
    magnification: Positive
    """Size of the image over that of the part, at the working distance [ratio]."""
    telecentricity_deg: Angle = 0.0
    """Angle of the chief ray to the axis at the image's corner, positive where nearer parts look larger; a data sheet's
    limit, of unknown sign, is `{ value = 0, half_width = 0.1 }` [degrees]."""
    numerical_aperture: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """On the part's side, sine of the half angle of the cone of light: blurs what is out of focus [ratio]."""
    wavelength_nm: Positive | None = None
    """With it the blur is that of diffraction alone, and ``blur_px`` follows [nm]."""
    image_side_deg: Angle = 0.0
    """Angle of the chief ray behind the lens at the image's corner: 0 of a bi-telecentric lens, whose magnification
    does not depend on the sensor's place [degrees]."""
    flange_mm: Annotated[float, Field(ge=-100, le=100)] = 0.0
    """By how much the sensor stands farther from the lens than it should; matters with ``image_side_deg`` alone
    [mm]."""

    follows: ClassVar[dict[str, tuple[str, ...]]] = {"magnification": ("focal_px",), "wavelength_nm": ("blur_px",)}
    sheet: ClassVar[tuple[str, ...]] = (
        "magnification", "pixel_pitch_um", "numerical_aperture", "wavelength_nm", "image_side_deg", "flange_mm",
    )  # fmt: skip

    @model_validator(mode="after")
    def _along_the_axis(self) -> Telecentric:
        if self.natural_vignetting:
            raise ValueError(
                "camera.natural_vignetting must be left out of a telecentric camera, whose rays run along the axis, got"
                " true"
            )
        return self

    @model_validator(mode="after")
    def _one_aperture(self) -> Telecentric:
        if self.lens.aperture_radius:
            raise ValueError(
                "camera.lens.aperture_radius must be left out of a telecentric camera, whose numerical_aperture says"
                f" it, got {self.lens.aperture_radius:g}"
            )
        return self

    @classmethod
    def derived(cls, camera: dict[str, Any], unit: Unit, pitch_um: float | None) -> dict[str, tuple[float, str]]:
        """``focal_px`` of magnification and pitch, and the blur by diffraction where a wavelength is said."""
        magnification, distance = camera.get("magnification"), camera.get("distance")
        for key, value in (("magnification", magnification), ("distance", distance)):
            if not is_positive(value):
                raise ValueError(f"camera.{key} must be a number greater than 0, got {told(value)}")
        if camera.get("focal_length_mm") is not None:
            raise ValueError("camera.focal_length_mm must be left out with magnification, got it")
        if pitch_um is None:
            raise ValueError("camera.pixel_pitch_um must be given with magnification, got nothing")
        scale = magnification * _stretched(camera, pitch_um) * 1000 / pitch_um  # px / mm
        found = {"focal_px": (scale * in_unit(distance, unit, "mm"), "magnification")}
        wavelength, aperture = camera.get("wavelength_nm"), camera.get("numerical_aperture")
        if is_positive(wavelength):
            if not is_positive(aperture):
                raise ValueError("camera.numerical_aperture must be given with wavelength_nm, got nothing")
            blur = airy_um(wavelength, magnification / (2 * aperture)) / pitch_um
            found["blur_px"] = (blur, "wavelength_nm")
        return found

    @property
    def perspective(self) -> float:
        """Share of perspective: 0 where the chief rays are parallel; a pinhole's where the angle is that of its field.

        The chief ray to the image's corner, R px from the middle, is inclined by s R / ``focal_px``.
        """
        if not self.telecentricity_deg:
            return 0.0
        return self.focal_px * math.tan(math.radians(self.telecentricity_deg)) / self.corner_px

    @property
    def corner_px(self) -> float:
        """Distance of the image's corner from its middle, px."""
        return math.hypot(self.width, self.height) / 2

    @property
    def aperture_radius(self) -> float:
        """Radius of the cone of light at the working distance: the numerical aperture's [length]."""
        return self.distance * self.numerical_aperture / math.sqrt(1 - self.numerical_aperture**2)

    def stopped_down(self) -> Self:
        """The same with an aperture of no size."""
        return self.model_copy(update={"numerical_aperture": 0.0})

    def moved_to(self, distance: float) -> Self:
        """The same camera elsewhere on its axis: the field where it now looks is as large as the lens makes it."""
        moved = self.divisor(self.distance) + self.perspective * (distance - self.distance)
        return self.tried(distance=distance, focal_px=self.focal_px * distance / moved)

    def enlarged(self, factor: float) -> Self:
        """The same camera with a magnification by so much larger; unchecked."""
        return self.tried(focal_px=factor * self.focal_px, magnification=factor * self.magnification)

    def depth_of_field(self, circle_px: NotNegative) -> float:
        """Length along the axis within which no circle of confusion is wider than a diameter, scene units."""
        aside = circle_px * self.distance / self.focal_px  # on the part
        return math.inf if self.aperture_radius == 0 else aside * self.distance / self.aperture_radius


def _stretched(camera: dict[str, Any], pitch_um: float) -> float:
    """By what the magnification differs for the sensor's place."""
    angle, off = camera.get("image_side_deg") or 0.0, camera.get("flange_mm") or 0.0
    sides = camera.get("width"), camera.get("height")
    if not (off and angle and all(map(is_positive, sides))):
        return 1.0
    return 1 + off * math.tan(math.radians(angle)) / (math.hypot(*sides) / 2 * pitch_um / 1000)
