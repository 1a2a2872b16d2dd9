"""A lens of a user's own: an equidistant fisheye, which records a ray at a radius as its angle from the axis."""

from typing import Literal

import numpy as np

from scenes import Lens
from scenes.cameras import LENSES, LensModel


@LENSES.add("fisheye")
class Fisheye(LensModel):
    """r = f theta in place of a pinhole's r = f tan(theta)."""

    kind: Literal["fisheye"]
    """fisheye"""

    @property
    def bends(self) -> bool:
        return True

    def bent(self, points: np.ndarray) -> np.ndarray:
        return points * _factor(np.linalg.norm(points, axis=-1))[..., None]

    def slope(self, points: np.ndarray) -> np.ndarray:
        """Around the axis by the factor itself, away from it by the angle's own derivative."""
        radius = np.linalg.norm(points, axis=-1)
        away = points / np.maximum(radius, 1e-300)[..., None]
        factor, grows = _factor(radius), 1 / (1 + radius**2)
        radial = away[..., :, None] * away[..., None, :]
        return factor[..., None, None] * np.eye(2) + (grows - factor)[..., None, None] * radial

    def straight(self) -> Lens:
        return Lens(aperture_radius=self.aperture_radius, focus=self.focus)


def _factor(radius: np.ndarray) -> np.ndarray:
    """Angle over its tangent."""
    safe = np.maximum(radius, 1e-8)
    return np.where(radius > 1e-8, np.arctan(safe) / safe, 1.0)
