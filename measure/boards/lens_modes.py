"""What a calibration leaves open of a camera as independent errors, of a splined lens those that move the image most
first."""

from __future__ import annotations

import numpy as np

from measure.boards.projections import Calibrated, grid_over, rays_of
from measure.boards.splined import SplinedModel
from scenes.cameras.lens_modes import LensMode
from scenes.errors import InvalidInput

_LEAST = 1e-4  # px: an error that moves no place of the image by more is left out


def lens_modes(camera: Calibrated) -> tuple[LensMode, ...]:
    """Of a calibrated camera with a splined lens, as a scene's ``uncertainty.lens_modes`` takes them.

    Raises
    ------
    InvalidInput
        If its lens is not splined.
    """
    if not isinstance(camera.model, SplinedModel):
        raise InvalidInput("model must be splined for modes of its lens, got one of coefficients")
    return tuple(_mode(camera.model, error) for error in errors_of(camera).T)


def errors_of(camera: Calibrated) -> np.ndarray:
    """Independent errors of a camera's values, shape (k, m), each as large as its standard uncertainty.

    Together they have its covariance. Of a splined lens principal components of how the image of fixed rays moves, over
    a grid of the image, those that move it at all.
    """
    root = _root(camera.covariance)
    if not isinstance(camera.model, SplinedModel):
        return root
    rays = rays_of(camera, grid_over(camera.image_shape, 0.0))
    is_recorded = np.isfinite(camera.model.lens(camera.values).bent(rays[:, :2] / rays[:, 2:])).all(1)
    by_values = camera.model.seen(camera.values, rays[is_recorded])[1]
    axes = np.linalg.svd(by_values.reshape(-1, len(root)) @ root, full_matrices=False)[2]
    errors = root @ axes.T
    far = np.linalg.norm(by_values @ errors, axis=1).max(0)
    return errors[:, far > _LEAST]


def _mode(model: SplinedModel, error: np.ndarray) -> LensMode:
    right, down = (model.free @ error[1:]).reshape(2, *model.control[::-1]).tolist()
    return LensMode(focal_px=float(error[0]), right=tuple(map(tuple, right)), down=tuple(map(tuple, down)))


def _root(covariance: np.ndarray) -> np.ndarray:
    """A root (k, k) of a covariance whose numbers have sizes of their own."""
    size = np.sqrt(np.diag(covariance))
    values, axes = np.linalg.eigh(covariance / np.outer(size, size))
    return size[:, None] * axes * np.sqrt(np.maximum(values, 0.0))
