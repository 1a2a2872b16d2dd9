"""Profiles across the sides of a polygon in a photograph: where the sides are, and how blurred."""

from __future__ import annotations

import cv2
import numpy as np

from measure.features.corners import corners_through
from measure.features.layout import polygon_layout
from measure.features.optics import Optics

_REACH = 6.0  # px across a side
_ORDINARY = 0.7  # px: a usual lens blur


def refined(image: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Corners (4, 2) of lines through the steepest places across each side: to some tenths of a pixel.

    As they were where a line is not found within 6 px.
    """
    sides = []
    for places, normal, offsets, profiles in _across(image, corners):
        rise = np.diff(profiles, axis=1)
        steep = np.clip(rise * np.sign(rise.sum()), 0, None) ** 2
        middle = (steep @ (offsets[1:] + offsets[:-1]) / 2) / np.maximum(steep.sum(1), 1e-12)
        sides.append(places + middle[:, None] * normal)
    found, _ = corners_through(sides)
    return found if np.abs(found - corners).max() < 2 * _REACH else corners


def edge_sigma(image: np.ndarray, corners: np.ndarray) -> float:
    """Lens blur (standard deviation, px) from the width of the quadrilateral's sides, the pixel's box taken off.

    The derivative of each side's mean profile, cut at 6 px, has the blur's variance; the median of the sides counts.
    """
    widths = []
    for _, _, offsets, profiles in _across(image, corners):
        rise = np.diff(profiles.mean(0))
        middles = (offsets[1:] + offsets[:-1]) / 2
        centre = (middles * np.abs(rise)).sum() / max(np.abs(rise).sum(), 1e-12)
        weight = np.where(np.abs(middles - centre) < 4, rise, 0)
        if abs(weight.sum()) > 1e-9:
            mean = (weight * middles).sum() / weight.sum()
            widths.append((weight * (middles - mean) ** 2).sum() / weight.sum() - 1 / 12 - 0.5**2 / 12)
    return float(np.sqrt(np.clip(np.median(widths), 0.09, 16.0))) if widths else _ORDINARY


def _across(image: np.ndarray, corners: np.ndarray):
    """For each side 80 places on it (80, 2), its normal, offsets along it (T,), px, and grey levels there (80, T)."""
    layout = polygon_layout(corners, Optics(image.shape, _ORDINARY))
    offsets, levels = np.arange(-_REACH, _REACH + 0.01, 0.5), image.astype(np.float32)
    for (start, stop), normal in zip(layout.ends, layout.normals, strict=True):
        places = start + np.linspace(0.2, 0.8, 80)[:, None] * (stop - start)
        where = (places[:, None] + offsets[:, None] * normal).astype(np.float32)
        yield places, normal, offsets, cv2.remap(levels, where, None, cv2.INTER_CUBIC)
