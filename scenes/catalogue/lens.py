"""A lens of a catalogue: entocentric (a pinhole's perspective) or telecentric, as its data sheet says it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from scenes.cameras.diffraction import airy_um
from scenes.catalogue.entry import Contradiction, Entry, Said
from scenes.catalogue.photometry import WHITE_NM
from scenes.model import Name

Kind = Literal["entocentric", "telecentric", "bi-telecentric"]
Mtf = tuple[tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0, lt=1)]], ...]
FORMATS = {
    '1/4"': 4.0, '1/3"': 6.0, '1/2.9"': 6.3, '1/2.5"': 7.2, '1/2.3"': 7.9, '1/2"': 8.0, '1/1.8"': 8.9, '1/1.7"': 9.2,
    '2/3"': 11.0, '1/1.2"': 13.4, '1/1.1"': 14.0, '1"': 16.0, '1.1"': 17.6, '1.2"': 19.3, '4/3"': 22.5, '35 mm': 43.3,
}  # fmt: skip
"""Diagonal of the sensors of a format [mm]."""
_VISIBLE_NM = (400.0, 700.0)
_RAYLEIGH, _LINES = 0.61, 0.5  # resolution over wavelength / NA: of two points (Rayleigh), of lines (Abbe)
_ROUGH = 0.1  # part by which a computed resolution may differ
_FIELD, _NA = 0.03, 0.05  # rounding of fields, and of apertures beside half of the last digit that is given


class ListedLens(Entry):
    """A lens. Working distances are from its front, apertures are working ones of telecentric lenses."""

    kind: Kind | None = None
    """entocentric: fixed focal length; telecentric on the part's side; or bi-telecentric."""
    mount: Name | None = None
    """C, CS, S (M12), F, ..."""
    focal_length_mm: Said = None
    """Of an entocentric one [mm]."""
    magnification: Said = None
    """Of a telecentric one [ratio]."""
    working_distance_mm: Said = None
    """Of a telecentric one, at which it is in focus [mm]."""
    minimum_object_distance_mm: Said = None
    """Of an entocentric one, the nearest at which it can be focused [mm]."""
    maximum_object_distance_mm: Said = None
    """Of an entocentric one, the farthest; infinity where not given [mm]."""
    f_number: Said = None
    """Least f-number: of an entocentric lens for infinity, of a telecentric one the working f-number."""
    f_number_max: Said = None
    """Greatest f-number of an iris; left out: the aperture is fixed."""
    numerical_aperture: Said = None
    """On the part's side; follows from the working f-number where not given [ratio]."""
    image_circle_mm: Said = None
    """Diameter of the image that it makes [mm]."""
    format: Name | None = None
    """Largest sensor format that it is made for, as 2/3"; its diagonal stands for the image circle."""
    field_diameter_mm: Said = None
    """Diameter of the field of a telecentric lens [mm]."""
    for_diagonals_mm: tuple[Annotated[float, Field(gt=0)], ...] = ()
    """Diagonals of sensors that it is said to be for [mm]."""
    depth_of_field_mm: Said = None
    """Whole depth in focus, as stated [mm]."""
    resolution_um: Said = None
    """Smallest detail on the part that it resolves [um]."""
    distortion_percent: Said = None
    """Largest distortion in the image [%]."""
    telecentricity_deg: Said = None
    """Largest angle of a chief ray to the axis [degrees]."""
    transmission: Annotated[float, Field(ge=0, le=1)] | None = None
    """Of its glass; 1 where not given [ratio]."""
    mtf: Mtf = ()
    """Contrast of lines in the image: rows [line pairs / mm, ratio], on the axis or the mean over the field."""

    table: ClassVar[str] = "lenses"
    positive: ClassVar[tuple[str, ...]] = (
        "focal_length_mm", "magnification", "working_distance_mm", "minimum_object_distance_mm",
        "maximum_object_distance_mm", "f_number", "f_number_max", "numerical_aperture", "image_circle_mm",
        "field_diameter_mm", "depth_of_field_mm", "resolution_um", "transmission",
    )  # fmt: skip

    @property
    def is_telecentric(self) -> bool:
        """On the part's side."""
        return self.kind in ("telecentric", "bi-telecentric")

    @property
    def missing(self) -> tuple[str, ...]:
        """Keys without which it cannot be used."""
        of_kind = ("magnification", "working_distance_mm") if self.is_telecentric else ("focal_length_mm",)
        keys = ["kind", "mount", *of_kind]
        found = [key for key in keys if not getattr(self, key)]
        if not self.f_number and not (self.is_telecentric and self.numerical_aperture):
            found.append("f_number")
        return tuple(found) + (() if self.circle_mm else ("image_circle_mm",))

    @property
    def circle_mm(self) -> float | None:
        """Diameter of its image: as stated, or that of the format that it is made for [mm]."""
        return self.image_circle_mm or (FORMATS.get(self.format) if self.format else None)

    @property
    def stops(self) -> tuple[float, ...]:
        """F-numbers that can be set: the least, and whole stops from 1 on up to the greatest."""
        least = self.f_number or self.magnification / (2 * self.numerical_aperture)
        most = self.f_number_max or least
        whole = (2 ** (n / 2) for n in range(13))
        return (least, *(stop for stop in whole if least * 1.01 < stop <= most * 1.01))

    def aberrations_um(self, wavelength_nm: float, f_number: float) -> float | None:
        """Standard deviation of a Gaussian blur in the image that the MTF tells of beside diffraction [um].

        exp(-2 pi^2 sigma^2 f^2) at the frequency f whose contrast is lowest above 0.1; None without an MTF.
        """
        rows = [(f, contrast) for f, contrast in self.mtf if contrast > 0.1] or list(self.mtf)
        if not rows:
            return None
        frequency, contrast = min(rows, key=lambda row: row[1])
        total = math.sqrt(-math.log(contrast) / 2) / (math.pi * frequency) * 1000
        return math.sqrt(max(total**2 - (airy_um(wavelength_nm, f_number)) ** 2, 0.0))

    def checked(self) -> Iterator[Contradiction]:
        """Kind, apertures, field, circle."""
        yield from self._kind()
        if None not in (self.f_number, self.f_number_max) and self.f_number > self.f_number_max:
            text = f"f_number must be at most f_number_max {self.f_number_max:g}, got {self.f_number:g}"
            yield self.against(("f_number", "f_number_max"), text)
        yield from self._circle()
        if self.is_telecentric:
            yield from self._aperture()
            yield from self._field()
        if self.numerical_aperture:
            yield from self._waves(self.numerical_aperture)

    def _kind(self) -> Iterator[Contradiction]:
        if self.is_telecentric and self.focal_length_mm is not None:
            text = f"focal_length_mm must be left out of a {self.kind} lens, got {self.focal_length_mm:g}"
            yield self.against(("kind", "focal_length_mm"), text)
        if self.kind == "entocentric" and self.telecentricity_deg is not None:
            text = f"telecentricity_deg must be left out of an entocentric lens, got {self.telecentricity_deg:g}"
            yield self.against(("kind", "telecentricity_deg"), text)
        if self.format is not None and self.format not in FORMATS:
            yield self.against(("format",), f"format must be one of {', '.join(FORMATS)}, got {self.format}")

    def _circle(self) -> Iterator[Contradiction]:
        if self.image_circle_mm is None:
            return
        wanted = [(f"format {self.format}", FORMATS[self.format])] if self.format in FORMATS else []
        wanted += [(f"a sensor of for_diagonals_mm {each:g}", each) for each in self.for_diagonals_mm]
        for what, diagonal in wanted:
            if self.image_circle_mm < (1 - _FIELD) * diagonal:
                text = f"image_circle_mm must be at least {diagonal:g} for {what}, got {self.image_circle_mm:g}"
                yield self.against(("image_circle_mm", "format", "for_diagonals_mm"), text)

    def _aperture(self) -> Iterator[Contradiction]:
        if None in (self.f_number, self.magnification):
            return
        made = self.magnification / (2 * self.f_number)
        wide = (
            _NA * made
            + _last_digit(self.numerical_aperture)
            + made * _last_digit(self.magnification) / self.magnification
        )
        yield from self.differs("numerical_aperture", made, ("magnification", "f_number"), wide)

    def _field(self) -> Iterator[Contradiction]:
        if None in (self.field_diameter_mm, self.magnification) or self.circle_mm is None:
            return
        image = self.magnification * self.field_diameter_mm
        wide = _FIELD + _last_digit(self.magnification) / self.magnification
        low, high = (1 - wide) * self.circle_mm, (1 + wide) * self.circle_mm
        named = "image_circle_mm" if self.image_circle_mm else f"format {self.format}"
        if image < low or (self.image_circle_mm and image > high):
            text = (
                f"magnification x field_diameter_mm must be {'' if self.image_circle_mm else 'at least '}"
                f"{self.circle_mm:g} mm by {named}, got {image:.3g}"
            )
            yield self.against(("magnification", "field_diameter_mm", "image_circle_mm"), text)

    def _waves(self, aperture: float) -> Iterator[Contradiction]:
        """What no lens of that aperture can be: finer than light, or sharp over less than its waves make it."""
        least, most = (w / 1000 / (aperture + s * _last_digit(aperture))
                       for w, s in zip(_VISIBLE_NM, (1, -1), strict=True))  # fmt: skip
        low, high = (1 - _ROUGH) * _LINES * least, (1 + _ROUGH) * _RAYLEIGH * most
        if self.resolution_um is not None and not low <= self.resolution_um <= high:
            text = (
                f"resolution_um must be {low:.3g} to {high:.3g} by numerical_aperture {aperture:g} and visible light,"
                f" got {self.resolution_um:g}"
            )
            yield self.against(("resolution_um", "numerical_aperture"), text)
        waves = WHITE_NM * 1e-6 / (2 * (aperture + _last_digit(aperture)) ** 2)
        if self.depth_of_field_mm is not None and self.depth_of_field_mm < waves:
            text = (
                f"depth_of_field_mm must be at least {waves:.3g} by wave optics at numerical_aperture {aperture:g},"
                f" got {self.depth_of_field_mm:g}"
            )
            yield self.against(("depth_of_field_mm", "numerical_aperture"), text)


def _last_digit(value: float | None) -> float:
    """Half of the last decimal that a number is given with."""
    text = f"{value:.12g}" if value else ""
    return 0.5 * 10.0 ** -len(text.partition(".")[2]) if "." in text and "e" not in text else 0.0
