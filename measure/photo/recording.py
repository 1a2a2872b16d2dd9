"""What a photograph tells of how it was recorded: noise against level, its correlation, compression."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from threading import Lock

import numpy as np

from imaging.geometry.segments import distance_to_segment
from measure.photo.compression import is_compressed
from measure.photo.correlation import Correlation, correlation
from measure.photo.noise_curve import NoiseCurve, curve_of, scale_of
from measure.photo.patches import SIDE, Patches, smooth_patches
from scenes import status
from scenes.photograph import Photograph

_BLURRED = 3.0  # px beside an edge
_ONE_AT_A_TIME = Lock()


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


def recording(photo: Photograph, corners: np.ndarray | None = None) -> Recording:
    """How a photograph was recorded, from itself; patches across the sides of a polygon (k, 2), px, do not count.

    Edges that hardly stand out of the noise pass for smooth, and look like noise that is not white.
    """
    patches, curve, compressed = _whole(photo)
    if corners is not None:
        patches = _beside(patches, corners)
    found = correlation(patches, curve)
    if not found.white:
        whole = found.kernel[found.kernel.shape[0] // 2, found.kernel.shape[1] // 2]
        total = max(float(whole), 1e-3)
        added = (total - 1) * curve.step**2 / 12  # the rounding's part stays as it is
        curve = replace(curve, dark=max(total * curve.dark + added, 0.0), gain=total * curve.gain)
        found = replace(found, kernel=found.kernel / total)
    return Recording(curve, found, compressed, patches)


def _whole(photo: Photograph) -> tuple[Patches, NoiseCurve, bool]:
    """Smooth patches, noise against level, and whether it was compressed; once for all shapes and their threads."""
    with _ONE_AT_A_TIME:
        return _told(photo)


@lru_cache(maxsize=1)
def _told(photo: Photograph) -> tuple[Patches, NoiseCurve, bool]:
    scale = scale_of(photo.levels, photo.full)
    patches = smooth_patches(photo.levels, scale.limits, scale.step)
    compressed = photo.compressed or is_compressed(photo.levels, scale.step)
    return patches, curve_of(patches, scale, photo.levels), compressed


def _beside(patches: Patches, corners: np.ndarray) -> Patches:
    """The patches that no side of a polygon touches."""
    middle = patches.corner[:, ::-1] + (SIDE - 1) / 2
    sides = zip(corners, np.roll(corners, -1, 0), strict=True)
    clear = np.all([distance_to_segment(middle, *side) > SIDE / np.sqrt(2) + _BLURRED for side in sides], axis=0)
    kept = {name: getattr(patches, name)[clear] for name in ("corner", "pixels", "level", "variance")}
    return replace(patches, **kept)
