"""The plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.surface import axes_beside, checked, point, unit


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane.

    Attributes
    ----------
    point : ndarray, shape (3,)
        On it.
    normal : ndarray, shape (3,)
        Unit vector away from the material.
    """

    point: np.ndarray
    normal: np.ndarray

    kind: ClassVar[str] = "plane"
    parameters: ClassVar[tuple[str, ...]] = ("height", "tilt1", "tilt2")
    hollow: ClassVar[bool] = False

    def __post_init__(self) -> None:
        checked(self, point=point("plane.point", self.point), normal=unit("plane.normal", self.normal))

    @cached_property
    def quadric(self) -> Quadric:
        """As a degenerate equation of second degree."""
        return Quadric.about(self.point, np.zeros((3, 3)), self.normal, 0.0)

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3)."""
        return (points - self.point) @ self.normal

    def normals(self, points: np.ndarray) -> np.ndarray:
        """The same unit normal everywhere, (..., 3)."""
        return np.broadcast_to(self.normal, np.shape(points)).copy()

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Zero: the normal does not turn."""
        return np.zeros((*np.shape(points), 3))

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of height (along it) and both tilts, (..., 3)."""
        away = points - self.point
        tilts = [-(away @ beside) for beside in axes_beside(self.normal)]
        return np.stack([np.ones(away.shape[:-1]), *tilts], -1)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet it, (..., 1)."""
        fall, over = np.broadcast_arrays(np.asarray(directions) @ self.normal, self.values(np.asarray(origins, float)))
        with np.errstate(all="ignore"):
            found = -over / fall
        return np.where(np.isfinite(found) & (fall != 0), found, np.inf)[..., None]

    def within(self, points: np.ndarray) -> np.ndarray:
        """True: it has no ends."""
        return np.ones(np.shape(points)[:-1], bool)
