"""The lens' distortion: from where a pinhole camera would see a point to where it is recorded, and back.

Ideal image coordinates are a pinhole camera's, in which straight edges are straight; lines, corners and lengths are
measured in them. Recorded coordinates are those of the pixels. Both are px with (0, 0) the centre of the first pixel.
"""

from __future__ import annotations

import numpy as np

from scenes import Camera
from scenes.cameras.lens_model import LensModel

_STEPS = 30
_SETTLED = 1e-12  # focal lengths


def image_centre(camera: Camera) -> np.ndarray:
    """Image of the point that the camera looks at (x, y), px."""
    return np.array([camera.width - 1, camera.height - 1]) / 2


def recorded(ideal: np.ndarray, camera: Camera) -> np.ndarray:
    """Where ideal image points (..., 2) are recorded, px; NaN where the lens records nothing."""
    if not camera.lens.bends:
        return ideal
    centre = image_centre(camera)
    return centre + camera.focal_px * camera.lens.bent((ideal - centre) / camera.focal_px)


def undistorted(seen: np.ndarray, camera: Camera) -> np.ndarray:
    """Ideal coordinates of recorded image points (..., 2), px, by Newton's method; NaN where nothing is recorded."""
    if not camera.lens.bends:
        return seen
    centre = image_centre(camera)
    return centre + camera.focal_px * unbent((np.asarray(seen, float) - centre) / camera.focal_px, camera.lens)


def unbent(wanted: np.ndarray, lens: LensModel) -> np.ndarray:
    """Where a pinhole sees what a lens records at places (..., 2), both in focal lengths, by Newton's method."""
    found = wanted.copy()
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            step = _solved(lens.slope(found), lens.bent(found) - wanted)
            found = found - step
            if not np.nanmax(np.abs(step), initial=0.0) > _SETTLED:
                break
        missed = ~(np.abs(lens.bent(found) - wanted).max(-1) <= 1e-9)
    return np.where(missed[..., None], np.nan, found)


def lens_jacobian(ideal: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivative of the recorded by the ideal coordinates at ideal points (..., 2), shape (..., 2, 2)."""
    if not camera.lens.bends:
        return np.broadcast_to(np.eye(2), (*np.shape(ideal), 2))
    return camera.lens.slope((ideal - image_centre(camera)) / camera.focal_px)


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of (..., 2, 2) systems; infinite or NaN where they are singular."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    x, y = right[..., 0], right[..., 1]
    return np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]
