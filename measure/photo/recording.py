"""What a photograph tells of how it was recorded: noise against level, its correlation, compression."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from measure import status
from measure.photo.compression import is_compressed
from measure.photo.correlation import Correlation, correlation
from measure.photo.noise_curve import NoiseCurve, limits_of, noise_curve, rounding
from measure.photo.patches import Patches, smooth_patches
from scenes.photograph import Photograph


@dataclass(frozen=True)
class Recording:
    """Noise of a photograph.

    Attributes
    ----------
    curve : NoiseCurve
        Variance of a pixel at each level.
    correlation : Correlation
        Of neighbouring pixels, over that variance.
    compressed : bool
        Whether there are traces of JPEG.
    patches : Patches
        The smooth patches that told.
    """

    curve: NoiseCurve
    correlation: Correlation
    compressed: bool
    patches: Patches

    @property
    def status(self) -> str:
        """The most serious thing to be said of any measurement in it, correlation left out."""
        return status.worst(
            status.COMPRESSED if self.compressed else status.OK, status.MISFIT if self.curve.falls else status.OK
        )


def recording(photo: Photograph) -> Recording:
    """How a photograph was recorded, from itself."""
    image = photo.levels
    curve, (step, _) = noise_curve(image, photo.full), rounding(image)
    patches = smooth_patches(image, limits_of(image, photo.full), step)
    found = correlation(patches, curve)
    if not found.white:
        whole = found.kernel[found.kernel.shape[0] // 2, found.kernel.shape[1] // 2]
        total = max(float(whole), 1e-3)
        added = (total - 1) * curve.step**2 / 12  # the rounding's part stays as it is
        curve = replace(curve, dark=max(total * curve.dark + added, 0.0), gain=total * curve.gain)
        found = replace(found, kernel=found.kernel / total)
    return Recording(curve, found, photo.compressed or is_compressed(image, step), patches)


def noise_at(curve: NoiseCurve, levels: np.ndarray) -> float:
    """Standard deviation of the noise at the mean of some grey levels."""
    return float(np.sqrt(curve.variance(np.mean(levels))))
