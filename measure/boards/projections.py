"""How differently two calibrations of one camera see the same rays, and how differently they should.

Where a camera's axes are is a part of its calibration. So the rays of one are turned by the rotation that makes the
images most alike, and what that rotation takes is not counted in what is told, either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from measure.boards.parameters import CameraModel

_GRID, _MARGIN = (24, 16), 0.05  # places over the image; of its sides, that are left out
_STEPS, _SETTLED, _EXACT = 100, 1e-12, 1e-6


class Calibrated(Protocol):
    """A camera's model, its numbers and their covariance, the image's (height, width)."""

    @property
    def model(self) -> CameraModel: ...
    @property
    def values(self) -> np.ndarray: ...
    @property
    def covariance(self) -> np.ndarray: ...
    @property
    def image_shape(self) -> tuple[int, int]: ...


@dataclass(frozen=True, eq=False)
class Difference:
    """Of images of rays from infinity.

    Attributes
    ----------
    places : ndarray, shape (n, 2)
        Where the first camera sees them, px: a grid over the image, less what one of the cameras shows nowhere.
    away : ndarray, shape (n, 2)
        Where the second sees them less that, px, after the best rotation.
    covariance : ndarray, shape (2 n, 2 n)
        Of ``away``, place by place, by both covariances, as of independent calibrations, px^2.
    wanted : int
        Places of the whole grid.
    """

    places: np.ndarray
    away: np.ndarray
    covariance: np.ndarray
    wanted: int

    @property
    def rms_px(self) -> float:
        """Root mean square of the distances over the places."""
        return float(np.sqrt((self.away**2).sum(1).mean()))

    @property
    def told_px(self) -> float:
        """The same as it should be."""
        return float(np.sqrt(2 * np.diag(self.covariance).mean()))


def projection_difference(first: Calibrated, second: Calibrated, margin: float = _MARGIN) -> Difference:
    """Compare two cameras, as `measure.calibrate_camera` gives them, over the image but ``margin`` of its sides."""
    places = grid_over(first.image_shape, margin)
    rays = rays_of(first, places)
    seen = np.isfinite(rays).all(1)
    rays = rays[seen]
    turn = _best_turn(rays, places[seen], second)
    there = rays @ turn.T
    image, by_second, by_points = second.model.seen(second.values, there)
    both = np.isfinite(image).all(1)
    by_first = first.model.seen(first.values, rays[both])[1]
    rows = np.concatenate([_spread(by_first, first.covariance), _spread(by_second[both], second.covariance)], 1)
    taken = np.linalg.qr(_by_turn(there[both], by_points[both]))[0]
    rows = rows - taken @ (taken.T @ rows)
    return Difference(places[seen][both], image[both] - places[seen][both], rows @ rows.T, len(places))


def grid_over(image_shape: tuple[int, int], margin: float) -> np.ndarray:
    """Places (n, 2), px, over an image of (height, width) but a part of its sides."""
    height, width = image_shape
    x, y = (
        np.linspace(margin * (n - 1), (1 - margin) * (n - 1), k) for n, k in zip((width, height), _GRID, strict=True)
    )
    return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


def rays_of(camera: Calibrated, places: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) of the rays that are seen at places (n, 2), px; NaN where there is none."""
    focal = camera.values[0]
    found = (places - (np.array(camera.image_shape[::-1]) - 1) / 2) / focal
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            image, _, by = camera.model.seen(camera.values, np.column_stack([found, np.ones(len(found))]))
            step = np.einsum("nij,nj->ni", np.linalg.pinv(np.nan_to_num(by[..., :2])), image - places)
            found = found - step * np.minimum(1.0, 2.0 / np.maximum(np.abs(step).max(1, keepdims=True), 1e-300))
            if not np.nanmax(np.abs(step)) > _SETTLED:
                break
        rays = np.column_stack([found, np.ones(len(found))])
        missed = ~(np.abs(camera.model.seen(camera.values, rays)[0] - places).max(1) < _EXACT)
    return np.where(missed[:, None], np.nan, rays / np.linalg.norm(rays, axis=1, keepdims=True))


def _best_turn(rays: np.ndarray, places: np.ndarray, camera: Calibrated) -> np.ndarray:
    """Rotation after which the camera sees rays nearest to places, by Gauss and Newton's method."""
    turn = np.eye(3)
    for _ in range(_STEPS):
        there = rays @ turn.T
        image, _, by_points = camera.model.seen(camera.values, there)
        good = np.isfinite(image).all(1)
        rows = _by_turn(there[good], by_points[good])
        step = np.linalg.lstsq(rows, (places - image)[good].ravel())[0]
        turn = cv2.Rodrigues(step)[0] @ turn
        if np.abs(step).max() < _SETTLED:
            break
    return turn


def _by_turn(rays: np.ndarray, by_points: np.ndarray) -> np.ndarray:
    """Derivatives (2 n, 3) of images by a small rotation of their rays."""
    x, y, z = rays.T
    zero = np.zeros_like(x)
    moved = np.stack([np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], 1)
    return (by_points @ moved).reshape(-1, 3)


def _spread(by_values: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Derivatives times a root of the covariance, (2 n, k)."""
    sizes, axes = np.linalg.eigh((covariance + covariance.T) / 2)
    return by_values.reshape(2 * len(by_values), -1 if len(covariance) else 0) @ (
        axes * np.sqrt(np.maximum(sizes, 0.0))
    )
