"""Kernels of the Gaussian and its derivatives, sampled at pixels around places. NumPy alone: a recipe has this file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from imaging.features.locator import edge_blur
from measure.estimators.crossings import STEP

_TRUNCATE = 4  # standard deviations at which the Gaussian ends


def places_across(places: np.ndarray, normals: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets (T,) within the window, px, and the places (m T, 2) at them from ``places`` with their normals."""
    half = int(np.ceil(window / STEP))
    offsets = STEP * np.arange(-half, half + 1)
    across = (places[:, None] + offsets[:, None] * normals[:, None]).reshape(-1, 2)
    return offsets, across, np.repeat(normals, offsets.size, 0)


def gaussian_windows(
    places: np.ndarray, scale: float, weigh: Callable[..., np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Windows that smooth an image at places (M, 2), px, by a sampled Gaussian whose sum is exactly 1.

    ``weigh(gauss, dx, dy)``, arrays (M, k, k), makes other kernels of the Gaussian and the pixels' distances, px.

    Returns
    -------
    values : ndarray, shape (M, k, k)
        Row by row.
    first : ndarray of int, shape (M, 2)
        Column and row of each window's first pixel.
    """
    radius = int(np.ceil(_TRUNCATE * scale))
    nearest = np.rint(places).astype(np.int32)
    grid = np.arange(-radius, radius + 1, dtype=np.int32)
    dx = (nearest - places)[:, 0, None, None] + grid
    dy = (nearest - places)[:, 1, None, None] + grid[:, None]
    gauss = np.exp(-(dx**2) / (2 * scale**2)) / (2 * np.pi * scale**2) * np.exp(-(dy**2) / (2 * scale**2))
    values = gauss / gauss.sum((1, 2), keepdims=True) if weigh is None else weigh(gauss, dx, dy)
    return values, nearest - radius


def second_derivatives(places: np.ndarray, normals: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Windows that take the Gaussian second derivative of an image at places (M, 2) along unit normals (M, 2), px.

    The sampled kernel is corrected to sum to exactly zero, so that a constant image gives 0.
    """

    def derive(gauss: np.ndarray, dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
        across = dx * normals[:, 0, None, None] + dy * normals[:, 1, None, None]
        across *= across
        mean = np.einsum("nij,nij->n", gauss, across) / gauss.sum((1, 2))
        across -= mean[:, None, None]
        across *= gauss
        return across / scale**4

    return gaussian_windows(places, scale, derive)


def slope_to_contrast(scale: float, blur: np.ndarray | float) -> np.ndarray:
    """Contrast of a straight edge of a lens' blur (...), px, at which its second derivative has slope 1."""
    return np.sqrt(2 * np.pi) * np.hypot(scale, edge_blur(blur)) ** 3
