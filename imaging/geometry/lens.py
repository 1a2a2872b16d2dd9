"""The lens' distortion: from where a pinhole camera would see a point to where it is recorded, and back.

Ideal image coordinates are a pinhole camera's, in which straight edges are straight; lines, corners and lengths are
measured in them. Recorded coordinates are those of the pixels. Both are px with (0, 0) the centre of the first pixel.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from scenes import Camera

_STEPS = 30
_SETTLED = 1e-12  # focal lengths


def image_centre(camera: Camera) -> np.ndarray:
    """Image of the point that the camera looks at (x, y), px."""
    return np.array([camera.width - 1, camera.height - 1]) / 2


def recorded(ideal: np.ndarray, camera: Camera) -> np.ndarray:
    """Where ideal image points (..., 2) are recorded, px; NaN beyond the radius at which the lens folds the image."""
    if not camera.lens.bends:
        return ideal
    centre = image_centre(camera)
    return centre + camera.focal_px * _bent((ideal - centre) / camera.focal_px, camera.lens.coefficients)


def undistorted(seen: np.ndarray, camera: Camera) -> np.ndarray:
    """Ideal coordinates of recorded image points (..., 2), px, by Newton's method; NaN where nothing is recorded."""
    if not camera.lens.bends:
        return seen
    centre, coefficients = image_centre(camera), camera.lens.coefficients
    wanted = (np.asarray(seen, float) - centre) / camera.focal_px
    found = wanted.copy()
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            step = _solved(_slope(found, coefficients), _bent(found, coefficients) - wanted)
            found = found - step
            if not np.nanmax(np.abs(step), initial=0.0) > _SETTLED:
                break
        missed = np.abs(_bent(found, coefficients) - wanted).max(-1) > 1e-9
    return centre + camera.focal_px * np.where(missed[..., None], np.nan, found)


def lens_jacobian(ideal: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivative of the recorded by the ideal coordinates at ideal points (..., 2), shape (..., 2, 2)."""
    if not camera.lens.bends:
        return np.broadcast_to(np.eye(2), (*np.shape(ideal), 2))
    return _slope((ideal - image_centre(camera)) / camera.focal_px, camera.lens.coefficients)


def _bent(points: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    """OpenCV's model at points (..., 2) in focal lengths."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = points[..., 0], points[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    moved = np.stack(
        [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y], -1
    )
    return np.where((r2 < _fold(k1, k2, k3))[..., None], moved, np.nan)


def _slope(points: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    """Its derivative, (..., 2, 2)."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = points[..., 0], points[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    grows = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))  # of the radial factor with r^2 / 2
    mixed = grows * x * y + 2 * p1 * x + 2 * p2 * y
    xx = radial + grows * x * x + 2 * p1 * y + 6 * p2 * x
    yy = radial + grows * y * y + 6 * p1 * y + 2 * p2 * x
    return np.stack([np.stack([xx, mixed], -1), np.stack([mixed, yy], -1)], -2)


def signed_confusion(camera: Camera, depth: np.ndarray) -> np.ndarray:
    """Radius of the circle of confusion of a thin lens at depths (scene units), px; negative beyond the focus."""
    lens = camera.lens
    return lens.aperture_radius * camera.focal_px * (1 / depth - 1 / (lens.focus or camera.distance))


def confusion(camera: Camera, depth: np.ndarray) -> np.ndarray:
    """The same without sign."""
    return np.abs(signed_confusion(camera, depth))


def blur_at(camera: Camera, depth: np.ndarray) -> np.ndarray | float:
    """Standard deviation of the blur at depths (scene units), px: the Gaussian's and a quarter of the disc's r^2."""
    if camera.lens.aperture_radius == 0:
        return camera.blur_px
    return np.sqrt(camera.blur_px**2 + confusion(camera, depth) ** 2 / 4)


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of (..., 2, 2) systems; infinite or NaN where they are singular."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    x, y = right[..., 0], right[..., 1]
    return np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]


@lru_cache(maxsize=16)
def _fold(k1: float, k2: float, k3: float) -> float:
    """Squared radius at which r (1 + k1 r^2 + k2 r^4 + k3 r^6) stops growing; infinite where it never does."""
    roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
    real = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
    return float(real.min(initial=np.inf))
