"""A mode of binning of a camera that can be bought, and the sensor that it makes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scenes.cameras.binning import Binning
from scenes.cameras.noise import Noise
from scenes.catalogue.entry import Said

if TYPE_CHECKING:
    from scenes.catalogue.sensor import ListedSensor


class ListedBinning(Binning):
    """A mode of binning as a data sheet states it: what it makes of pixels is `scenes.cameras.binning`'s."""

    frame_rate_hz: Said = None
    """Pictures a second in this mode; the sensor's own where not given [Hz]."""

    def of(self, sensor: ListedSensor) -> ListedSensor:
        """The sensor as this mode makes it, unchecked: its name, size, pitch, noise and bits."""
        gain = sensor.system_gain_e or 2**sensor.bits / sensor.saturation_capacity_e
        dark, bits = gain * sensor.temporal_dark_noise_e, min(sensor.bits, self.most_bits)
        noise = self.noise(Noise(sigma=dark, gain=gain, bits=bits, dsnu=gain * (sensor.dsnu_e or 0.0)))
        columns, rows = sensor.resolution
        return sensor.tried(
            name=f"{sensor.name}, {self.factor} x {self.factor} {self.kind}", binning=(), emva1288=None,
            resolution=(columns // self.factor, rows // self.factor),
            pixel_pitch_um=self.factor * sensor.pixel_pitch_um, bits=noise.bits,
            saturation_capacity_e=sensor.saturation_capacity_e * (1 if self.kind == "charge" else self.factor**2),
            temporal_dark_noise_e=noise.sigma / noise.gain,
            system_gain_e=sensor.system_gain_e and noise.gain,
            prnu_percent=None if sensor.prnu_percent is None else sensor.prnu_percent / self.factor,
            dsnu_e=None if sensor.dsnu_e is None else noise.dsnu / noise.gain,
            frame_rate_hz=self.frame_rate_hz or sensor.frame_rate_hz,
            absolute_sensitivity_threshold_e=None, dynamic_range_db=None, snr_max_db=None,
        )  # fmt: skip
