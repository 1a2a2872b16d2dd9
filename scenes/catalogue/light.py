"""A light of a catalogue: its shape, its colour, and how bright it is, in whichever unit a data sheet says that."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, TypeAdapter

from scenes.catalogue.entry import Contradiction, Entry, Said
from scenes.catalogue.photometry import WHITE_NM, efficacy
from scenes.lights import AnyLight, Luminaire
from scenes.units import Unit, in_unit

Kind = Literal["ring", "bar", "dome", "flat dome", "backlight", "spot"]
Pair = tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]]
_AGREE = 0.3  # part by which two statements of its brightness may differ: typical values, measured differently
_LIGHT = TypeAdapter(AnyLight)
_STATED = ("radiance", "luminance", "irradiance", "illuminance", "radiant_power", "luminous_flux")


class ListedLight(Entry):
    """A light. One statement of its brightness is enough; without any, exposure times are not known."""

    kind: Kind | None = None
    """ring, bar, dome, flat dome (a lit plate with a hole for the lens), backlight or spot."""
    outer_diameter_mm: Said = None
    """Of what shines, of round ones [mm]."""
    inner_diameter_mm: Said = None
    """Of the hole in the middle [mm]."""
    size_mm: Pair | None = None
    """Width and height of what shines, of rectangular ones [mm]."""
    working_distance_mm: Pair | None = None
    """Least and greatest distance from the part that it is made for [mm]."""
    wavelength_nm: Said = None
    """Of its peak; left out: white [nm]."""
    radiance: Said = None
    """[W / (m^2 sr)]."""
    luminance: Said = None
    """[cd / m^2]."""
    irradiance: Said = None
    """On its axis at ``at_distance_mm`` [W / m^2]."""
    illuminance: Said = None
    """The same in [lx]."""
    at_distance_mm: Said = None
    """Where that was measured; 0: on its surface [mm]."""
    radiant_power: Said = None
    """Of its LEDs; counts as sent alike from all of its surface, nothing lost [W]."""
    luminous_flux: Said = None
    """The same in [lm]."""

    table: ClassVar[str] = "lights"
    positive: ClassVar[tuple[str, ...]] = ("outer_diameter_mm", "wavelength_nm", *_STATED)

    @property
    def missing(self) -> tuple[str, ...]:
        """Keys without which it cannot be used."""
        if self.kind is None:
            return ("kind",)
        if self.kind == "ring":
            sized = self.outer_diameter_mm and self.inner_diameter_mm
            return () if sized else ("outer_diameter_mm and inner_diameter_mm",)
        return () if self.outer_diameter_mm or self.size_mm else ("size_mm",)

    @property
    def photon_nm(self) -> float:
        """A wavelength that stands for its photons [nm]."""
        return self.wavelength_nm or WHITE_NM

    @property
    def area_mm2(self) -> float:
        """Of what shines; of a dome, of its opening [mm^2]."""
        hole = math.pi * (self.inner_diameter_mm or 0.0) ** 2 / 4
        if self.size_mm:
            return self.size_mm[0] * self.size_mm[1] - hole
        return math.pi * self.outer_diameter_mm**2 / 4 - hole

    @property
    def reach_mm(self) -> tuple[float, float]:
        """Distances from the part that it is made for [mm]."""
        return self.working_distance_mm or (0.0, math.inf)

    def at(self, distance_mm: float, unit: Unit = "mm", behind: tuple[float, float] = (180.0, 0.0)) -> Luminaire:
        """It in a scene, at a distance from its reference point; its intensity is 1.

        Rings, domes and flat domes are mounted at the camera, bars and spots are free, a backlight stands ``behind``. A
        flat dome is a ring of the same area, a rectangular spot a disc of the same area, a backlight the square of its
        shorter side.

        Raises
        ------
        pydantic.ValidationError
            If it cannot stand there.
        """

        def length(mm: float) -> float:
            return in_unit(mm, "mm", unit)

        common: dict[str, Any] = {"distance": length(distance_mm)}
        radius = length(math.sqrt((self.area_mm2 + math.pi * (self.inner_diameter_mm or 0.0) ** 2 / 4) / math.pi))
        hole = length((self.inner_diameter_mm or 0.0) / 2)
        if self.kind in ("ring", "flat dome"):
            table = {"kind": "ring", "mount": "camera", "inner_radius": hole, "outer_radius": radius}
        elif self.kind == "dome":
            opening = math.degrees(math.asin(min(hole / common["distance"], 0.99)))
            table = {"kind": "dome", "mount": "camera", "opening_deg": opening}
        elif self.kind == "backlight":
            half = length(min(self.size_mm or (self.outer_diameter_mm * math.sqrt(0.5),) * 2) / 2)
            table = {"kind": "backlight", "pose": behind, "half_side": half}
        elif self.kind == "bar":
            sides = sorted(map(length, self.size_mm or (2 * radius, 2 * radius)))
            table = {"kind": "bar", "length": sides[1], "width": sides[0]}
        else:
            table = {"kind": "disc", "radius": radius}
        return _LIGHT.validate_python(common | table)

    def irradiance_at(self, distance_mm: float) -> float | None:
        """Of a white surface on its axis; of a backlight pi times its radiance [W / m^2]; None where not known."""
        stated = self._radiance()
        if stated is not None:
            return stated * self._seen(distance_mm)
        if self.irradiance or self.illuminance:
            there = self.irradiance or self.illuminance / efficacy(self.wavelength_nm)
            if not self.at_distance_mm:
                return None
            return there * self._seen(distance_mm) / self._seen(self.at_distance_mm)
        return None

    def _radiance(self) -> float | None:
        """What a diffuse surface of its statements has, [W / (m^2 sr)]."""
        per_watt = efficacy(self.wavelength_nm)
        if self.radiance or self.luminance:
            return self.radiance or self.luminance / per_watt
        if (self.irradiance or self.illuminance) and self.at_distance_mm == 0:
            return (self.irradiance or self.illuminance / per_watt) / math.pi
        if self.radiant_power or self.luminous_flux:
            return (self.radiant_power or self.luminous_flux / per_watt) / (math.pi * self.area_mm2 * 1e-6)
        return None

    def _seen(self, distance_mm: float) -> float:
        """Irradiance at a distance over radiance: the projected solid angle that it fills [sr]."""
        if self.kind in ("backlight", "dome"):
            return math.pi  # the sensor, or the part, sees it all around
        light = self.at(distance_mm)
        made = light.surface(light.count(0.0, 10))
        towards = light.target - made.places
        cosines = np.maximum(np.einsum("ki,ki->k", towards, made.normals), 0.0) * towards[:, 2]
        return float(made.areas @ (cosines / (towards**2).sum(1) ** 2))

    def checked(self) -> Iterator[Contradiction]:
        """Sizes, distances, and brightness that is stated twice."""
        hole, outer = self.inner_diameter_mm, self.outer_diameter_mm or (min(self.size_mm) if self.size_mm else None)
        if None not in (hole, outer) and hole >= outer:
            text = f"inner_diameter_mm must be less than {outer:g}, the size of what shines, got {hole:g}"
            yield self.against(("inner_diameter_mm", "outer_diameter_mm", "size_mm"), text)
        if self.size_mm is not None and 0 in self.size_mm:
            yield self.against(("size_mm",), f"size_mm must be left out where not known, got {list(self.size_mm)}")
        if self.working_distance_mm is not None and self.working_distance_mm[0] > self.working_distance_mm[1]:
            given = list(self.working_distance_mm)
            yield self.against(("working_distance_mm",), f"working_distance_mm must rise, got {given}")
        if (self.irradiance or self.illuminance) and self.at_distance_mm is None:
            keys = ("irradiance", "illuminance", "at_distance_mm")
            yield self.against(keys, "at_distance_mm must be given with irradiance or illuminance, got nothing")
        yield from self._twice()

    def _twice(self) -> Iterator[Contradiction]:
        for watts, lumens in (("radiance", "luminance"), ("irradiance", "illuminance"),
                              ("radiant_power", "luminous_flux")):  # fmt: skip
            one, other = getattr(self, watts), getattr(self, lumens)
            if None not in (one, other):
                made = one * efficacy(self.wavelength_nm)
                colour = f"{self.wavelength_nm:g} nm" if self.wavelength_nm else "white light"
                yield from self.differs(lumens, made, (watts, colour), _AGREE * made)
