"""A camera of a catalogue: its sensor by EMVA 1288, its mount and its timing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from scenes.cameras.colour import Colour
from scenes.catalogue.binning import ListedBinning
from scenes.catalogue.entry import Contradiction, Entry, Said
from scenes.model import Name, Title

Count = Annotated[int, Field(ge=0, le=100_000)]
Shutter = Literal["global", "rolling", "global reset"]
Pattern = Literal["RGGB", "BGGR", "GRBG", "GBRG"]
Ratio = Annotated[float, Field(gt=0, le=1)]
_ROUNDED_DB = 1.0  # data sheets round to whole decibels
_ROUNDED_MM, _SIZE = 0.05, 0.01  # of a sensor's side, and a part of it: rows that no picture shows
_NOISE = 0.10  # part by which the sensitivity threshold may differ from dark noise and half an electron


class ListedSensor(Entry):
    """A camera: sensor, electronics, mount. Figures of EMVA 1288 are its mean values."""

    chip: Name | None = None
    """The sensor in it."""
    resolution: tuple[Count, Count] | None = None
    """Columns and rows [px]."""
    pixel_pitch_um: Said = None
    """From one pixel to the next [um]."""
    sensor_size_mm: tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]] | None = None
    """Width and height of the sensor [mm]."""
    diagonal_mm: Said = None
    """Its diagonal [mm]."""
    shutter: Shutter | None = None
    """global, rolling, or global reset."""
    colour: bool | Pattern = False
    """Whether a mosaic of colour filters lies on it, or the colours of its first two pixels of two rows: RGGB, ..."""
    quantum_efficiency_rgb: tuple[Ratio, Ratio, Ratio] | None = None
    """Of its red, green and blue pixels, each at its own wavelength; makes a colour sensor one to plan with [ratio]."""
    bits: Annotated[int, Field(ge=0, le=24)] | None = None
    """Bit depth of its converter."""
    saturation_capacity_e: Said = None
    """Electrons at saturation [e-]."""
    temporal_dark_noise_e: Said = None
    """Standard deviation of the temporal noise in darkness [e-]."""
    absolute_sensitivity_threshold_e: Said = None
    """Signal of a signal-to-noise ratio of 1 [e-]."""
    dynamic_range_db: Said = None
    """Saturation capacity over the absolute sensitivity threshold [dB]."""
    snr_max_db: Said = None
    """Signal-to-noise ratio at saturation [dB]."""
    quantum_efficiency: Said = None
    """Electrons a photon [ratio]."""
    quantum_efficiency_nm: Said = None
    """At which wavelength that was measured [nm]."""
    system_gain_e: Said = None
    """Grey levels an electron, K; follows from saturation and bits where not given [1/e-]."""
    prnu_percent: Said = None
    """Standard deviation of the fixed pattern at half saturation, a part of the signal [%]."""
    dsnu_e: Said = None
    """Standard deviation of the fixed pattern in darkness [e-]."""
    mount: tuple[Name, ...] = ()
    """Lens mounts that it is sold with: C, CS, S, F, ..."""
    frame_rate_hz: Said = None
    """Pictures a second at full resolution [Hz]."""
    exposure_min_us: Said = None
    """Shortest exposure [us]."""
    exposure_max_us: Said = None
    """Longest exposure [us]."""
    binning: tuple[ListedBinning, ...] = ()
    """Modes that take pixels together; each is a sensor of its own for a search."""
    emva1288: Title | None = None
    """Result file of EMVA 1288's reference software (XML), relative to the catalogue: fills in what is not given."""

    table: ClassVar[str] = "sensors"
    positive: ClassVar[tuple[str, ...]] = (
        "pixel_pitch_um", "diagonal_mm", "bits", "saturation_capacity_e", "temporal_dark_noise_e",
        "absolute_sensitivity_threshold_e", "dynamic_range_db", "snr_max_db", "quantum_efficiency",
        "quantum_efficiency_nm", "system_gain_e", "frame_rate_hz", "exposure_max_us",
    )  # fmt: skip
    needed: ClassVar[tuple[str, ...]] = (
        "resolution", "pixel_pitch_um", "bits", "saturation_capacity_e", "temporal_dark_noise_e",
        "quantum_efficiency", "mount",
    )  # fmt: skip

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height by pitch and resolution [mm]."""
        columns, rows = self.resolution
        return columns * self.pixel_pitch_um / 1000, rows * self.pixel_pitch_um / 1000

    @property
    def diagonal(self) -> float:
        """Of that [mm]."""
        return math.hypot(*self.size_mm)

    @property
    def filters(self) -> Colour | None:
        """Its colour filters where grey things are measured in its raw mosaic under white light; None without."""
        if not isinstance(self.colour, str) or self.quantum_efficiency_rgb is None:
            return None
        most = max(self.quantum_efficiency_rgb)
        red, green, blue = (each / most for each in self.quantum_efficiency_rgb)
        return Colour(pattern=self.colour, response=(red, green, blue))

    @property
    def best_efficiency(self) -> float:
        """Quantum efficiency of its strongest pixels [ratio]."""
        return self.quantum_efficiency if self.filters is None else max(self.quantum_efficiency_rgb)

    @property
    def modes(self) -> tuple[ListedSensor, ...]:
        """Itself, and what each mode of binning makes of it."""
        return (self, *(each.of(self) for each in self.binning))

    def takes(self, mount: str) -> bool:
        """Whether a lens of a mount fits; one for C fits a CS camera by a ring of 5 mm, not the other way."""
        return mount in self.mount or (mount == "C" and "CS" in self.mount)

    def checked(self) -> Iterator[Contradiction]:
        """Size, noise and time."""
        if self.resolution is not None and 0 in self.resolution:
            yield self.against(("resolution",), f"resolution must be left out where not known, got {self.resolution}")
            return
        yield from self._sizes()
        yield from self._emva()
        if None not in (self.exposure_min_us, self.exposure_max_us) and self.exposure_min_us >= self.exposure_max_us:
            both = f"{self.exposure_min_us:g} and {self.exposure_max_us:g}"
            keys = ("exposure_min_us", "exposure_max_us")
            yield self.against(keys, f"exposure_min_us must be less than exposure_max_us, got {both}")
        if self.binning and self.colour:
            yield self.against(
                ("binning", "colour"), "binning must be of a monochrome sensor, got one with colour filters"
            )
        if self.quantum_efficiency_rgb is not None and not isinstance(self.colour, str):
            text = f"colour must be a pattern (RGGB, ...) with quantum_efficiency_rgb, got {self.colour}"
            yield self.against(("quantum_efficiency_rgb", "colour"), text)
        if (self.quantum_efficiency or 0) > 1:
            text = f"quantum_efficiency must be a ratio of at most 1, got {self.quantum_efficiency:g}"
            yield self.against(("quantum_efficiency",), text)

    def _sizes(self) -> Iterator[Contradiction]:
        if self.resolution is None or self.pixel_pitch_um is None:
            return
        for side, made, given in zip(("width", "height"), self.size_mm, self.sensor_size_mm or (), strict=False):
            if abs(given - made) > _ROUNDED_MM + _SIZE * made:
                text = (
                    f"sensor_size_mm must have a {side} of {made:.4g} by resolution and pixel_pitch_um, got {given:g}"
                )
                yield self.against(("sensor_size_mm", "resolution", "pixel_pitch_um"), text)
        wide = _ROUNDED_MM + _SIZE * self.diagonal
        yield from self.differs("diagonal_mm", self.diagonal, ("resolution", "pixel_pitch_um"), wide)

    def _emva(self) -> Iterator[Contradiction]:
        full, dark, least = (
            self.saturation_capacity_e,
            self.temporal_dark_noise_e,
            self.absolute_sensitivity_threshold_e,
        )
        if full is None:
            return
        if least is not None:
            value = 20 * math.log10(full / least)
            others = ("saturation_capacity_e", "absolute_sensitivity_threshold_e")
            yield from self.differs("dynamic_range_db", value, others, _ROUNDED_DB)
        elif dark is not None and self.dynamic_range_db is not None:
            yield from self._range_of(full, dark)
        if dark is not None and least is not None:
            wide = 0.3 + _NOISE * dark
            yield from self.differs(
                "absolute_sensitivity_threshold_e", dark + 0.5, ("temporal_dark_noise_e", "half an electron"), wide
            )
        yield from self.differs("snr_max_db", 10 * math.log10(full), ("saturation_capacity_e",), _ROUNDED_DB)
        if self.system_gain_e is not None and self.bits and self.system_gain_e * full > 1.02 * 2**self.bits:
            text = f"system_gain_e must keep {full:g} e- within {self.bits} bits, got {self.system_gain_e:g}"
            yield self.against(("system_gain_e", "saturation_capacity_e", "bits"), text)

    def _range_of(self, full: float, dark: float) -> Iterator[Contradiction]:
        """Makers divide by the threshold, which is half an electron above dark noise, or by dark noise."""
        low, high = 20 * math.log10(full / (dark + 0.5)), 20 * math.log10(full / dark)
        if not low - _ROUNDED_DB <= self.dynamic_range_db <= high + _ROUNDED_DB:
            keys = ("dynamic_range_db", "saturation_capacity_e", "temporal_dark_noise_e")
            text = (
                f"dynamic_range_db must be {low:.1f} to {high:.1f} by saturation_capacity_e {full:g} and"
                f" temporal_dark_noise_e {dark:g}, got {self.dynamic_range_db:g}"
            )
            yield self.against(keys, text)
