"""A lens with radial and tangential distortion, before a sensor that may read its rows one after another."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field

from scenes.cameras.lens_model import LENSES, LensModel

COEFFICIENTS = 5  # k1, k2, p1, p2, k3


def _row(value: Any) -> Any:
    """k1 alone stands for a row of one; missing coefficients are 0."""
    row = (value,) if isinstance(value, int | float) and not isinstance(value, bool) else value
    return (*row, *[0.0] * (COEFFICIENTS - len(row))) if isinstance(row, list | tuple) else row


Coefficient = Annotated[float, Field(ge=-10, le=10)]
Shear = Annotated[float, Field(ge=-0.5, le=1.0)]
Distortion = Annotated[
    tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient],
    BeforeValidator(_row, json_schema_input_type=float | list[float]),
]


@LENSES.add("brown_conrady")
class Lens(LensModel):
    """Radial and tangential distortion (Brown and Conrady's, in OpenCV's form).

    A point that a pinhole camera sees at (x, y) focal lengths from the image's centre is recorded at (x, y) (1 + k1 r^2
    + k2 r^4 + k3 r^6), and tangentially displaced by (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y).

    Examples
    --------
    >>> Lens(distortion=-0.2).coefficients
    (-0.2, 0.0, 0.0, 0.0, 0.0)
    """

    kind: Literal["brown_conrady"] = "brown_conrady"
    """Polynomials in the distance from the axis."""
    distortion: Distortion = (0.0,) * COEFFICIENTS
    """OpenCV's k1, k2, p1, p2, k3, or k1 alone."""

    shear: tuple[Shear, Shear] = (0.0, 0.0)
    """By which a place is recorded farther right, and farther down, for each row below the image's middle: what a
    rolling shutter makes of a part that moves. Follows from ``camera.line_time_us`` and ``camera.motion``
    [px a row]."""

    @property
    def coefficients(self) -> tuple[float, ...]:
        """The five coefficients, also of a copy that was given k1 alone."""
        return tuple(float(value) for value in _row(self.distortion))

    @property
    def bends(self) -> bool:
        """Whether straight edges are recorded bent."""
        return any(self.coefficients) or any(self.shear)

    def straight(self) -> Self:
        """The same without distortion."""
        return self.tried(distortion=(0.0,) * COEFFICIENTS, shear=(0.0, 0.0))

    def bent(self, points: np.ndarray) -> np.ndarray:
        """OpenCV's model at points (..., 2) in focal lengths; NaN beyond the radius at which it folds the image."""
        k1, k2, p1, p2, k3 = self.coefficients
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        moved = np.stack(
            [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
            -1,
        )
        right, down = self.shear
        if right or down:
            moved = moved + moved[..., 1:] * [right, down]
        return np.where((r2 < _fold(k1, k2, k3))[..., None], moved, np.nan)

    def slope(self, points: np.ndarray) -> np.ndarray:
        """Its derivative, (..., 2, 2)."""
        k1, k2, p1, p2, k3 = self.coefficients
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        grows = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))  # of the radial factor with r^2 / 2
        mixed = grows * x * y + 2 * p1 * x + 2 * p2 * y
        xx = radial + grows * x * x + 2 * p1 * y + 6 * p2 * x
        yy = radial + grows * y * y + 6 * p1 * y + 2 * p2 * x
        right, down = self.shear
        rows = (
            np.stack([xx + right * mixed, mixed + right * yy], -1),
            np.stack([(1 + down) * mixed, (1 + down) * yy], -1),
        )
        return np.stack(rows, -2)


_UNITS = tuple(Lens(distortion=tuple(row)) for row in np.eye(COEFFICIENTS).tolist())


def by_coefficients(points: np.ndarray) -> np.ndarray:
    """Derivative (..., 2, 5) of where `Lens` records points (..., 2), in focal lengths, by its coefficients, in which
    it is linear."""
    return np.stack([lens.bent(points) - points for lens in _UNITS], -1)


@lru_cache(maxsize=16)
def _fold(k1: float, k2: float, k3: float) -> float:
    """Squared radius at which r (1 + k1 r^2 + k2 r^4 + k3 r^6) stops growing; infinite where it never does."""
    roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
    real = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
    return float(real.min(initial=np.inf))
