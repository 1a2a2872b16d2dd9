"""What every kind of lens is: what makes it more than a pinhole."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from scenes.model import Model
from scenes.ranges import NotNegative, Positive
from scenes.registry import OneOf, Registry


class LensModel(Model):
    """What every kind of lens has: where it records what a pinhole camera would see.

    A new kind is a class in one file, made known by ``@LENSES.add(name)``: its fields, `bends`, `bent`, `slope` and
    `straight`.
    """

    kind: str
    """Its kind's name."""
    aperture_radius: NotNegative = 0.0
    """Of a thin lens; 0 for a pinhole [length]."""
    focus: Positive | None = None
    """Distance at which it is focused; that of ``look_at`` when not given [length]."""

    @property
    def bends(self) -> bool:
        """Whether straight edges are recorded bent."""
        raise NotImplementedError

    def bent(self, points: np.ndarray) -> np.ndarray:
        """Where points (..., 2) of a pinhole's image are recorded, from its middle; both in focal lengths.

        NaN where nothing is.
        """
        raise NotImplementedError

    def slope(self, points: np.ndarray) -> np.ndarray:
        """Derivative of `bent` by the points, shape (..., 2, 2)."""
        raise NotImplementedError

    def straight(self) -> LensModel:
        """A lens that moves no point, focused as this one."""
        raise NotImplementedError


LENSES: Registry[type[LensModel]] = Registry("camera.lens.kind")
AnyLens = Annotated[LensModel, OneOf(LENSES, "brown_conrady")]
