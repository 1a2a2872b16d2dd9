"""Binning: pixels of a sensor taken together, and the sensor that this makes of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from scenes.catalogue.entry import Said
from scenes.model import Model

if TYPE_CHECKING:
    from scenes.catalogue.sensor import ListedSensor

_MOST_BITS = 16


class Binning(Model):
    """A mode of binning ``factor`` x ``factor`` pixels, as a data sheet states it.

    Charge is added before it is read: one read's noise, one pixel's saturation. Digital sums and means are of pixels
    that were read and rounded one by one: noise of all of them, saturation of all of them. Light's own noise and fixed
    patterns add up as independent numbers do.
    """

    factor: Annotated[int, Field(ge=2, le=8)] = 2
    """Pixels along each side."""
    kind: Literal["charge", "sum", "mean"]
    """charge: before reading; sum, mean: of digital numbers."""
    frame_rate_hz: Said = None
    """Pictures a second in this mode; the sensor's own where not given [Hz]."""

    def of(self, sensor: ListedSensor) -> ListedSensor:
        """The sensor as this mode makes it, unchecked: its name, size, pitch, noise and bits."""
        count, columns, rows = self.factor**2, *sensor.resolution
        changed = {
            "name": f"{sensor.name}, {self.factor} x {self.factor} {self.kind}", "binning": (), "emva1288": None,
            "resolution": (columns // self.factor, rows // self.factor),
            "pixel_pitch_um": self.factor * sensor.pixel_pitch_um,
            "frame_rate_hz": self.frame_rate_hz or sensor.frame_rate_hz,
            "prnu_percent": None if sensor.prnu_percent is None else sensor.prnu_percent / self.factor,
            "dsnu_e": None if sensor.dsnu_e is None else sensor.dsnu_e * self.factor,
            "absolute_sensitivity_threshold_e": None, "dynamic_range_db": None, "snr_max_db": None,
        }  # fmt: skip
        return sensor.tried(**changed, **(self._digital(sensor, count) if self.kind != "charge" else {}))

    def _digital(self, sensor: ListedSensor, count: int) -> dict[str, float | int | None]:
        """Noise, saturation, bits and gain of ``count`` numbers added, the rounding of each included."""
        gain = sensor.system_gain_e or 2**sensor.bits / sensor.saturation_capacity_e
        bits, rounded = sensor.bits, count
        if self.kind == "sum":
            bits, rounded = (
                min(sensor.bits + math.ceil(math.log2(count)), _MOST_BITS),
                count - 1,
            )  # the last one is bits'
        dark = math.sqrt(count * sensor.temporal_dark_noise_e**2 + rounded / 12 / gain**2)
        stated = sensor.system_gain_e and (
            sensor.system_gain_e / count if self.kind == "mean" else sensor.system_gain_e
        )
        return {
            "saturation_capacity_e": count * sensor.saturation_capacity_e, "temporal_dark_noise_e": dark, "bits": bits,
            "system_gain_e": stated,
        }  # fmt: skip
