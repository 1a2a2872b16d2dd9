"""What makes a lens more than a pinhole."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from scenes.model import Model
from scenes.ranges import NotNegative, Positive

COEFFICIENTS = 5  # k1, k2, p1, p2, k3


def _row(value: Any) -> Any:
    """k1 alone stands for a row of one; missing coefficients are 0."""
    row = (value,) if isinstance(value, int | float) and not isinstance(value, bool) else value
    return (*row, *[0.0] * (COEFFICIENTS - len(row))) if isinstance(row, list | tuple) else row


Coefficient = Annotated[float, Field(ge=-10, le=10)]
Distortion = Annotated[
    tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient],
    BeforeValidator(_row, json_schema_input_type=float | list[float]),
]


class Lens(Model):
    """What makes the lens more than a pinhole.

    A point that a pinhole camera sees at (x, y) focal lengths from the image's centre is recorded at (x, y) (1 + k1 r^2
    + k2 r^4 + k3 r^6), and tangentially displaced by (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y).

    Examples
    --------
    >>> Lens(distortion=-0.2).coefficients
    (-0.2, 0.0, 0.0, 0.0, 0.0)
    """

    aperture_radius: NotNegative = 0.0
    """Of a thin lens; 0 for a pinhole [length]."""
    focus: Positive | None = None
    """Distance at which it is focused; that of ``look_at`` when not given [length]."""
    distortion: Distortion = (0.0,) * COEFFICIENTS
    """OpenCV's k1, k2, p1, p2, k3, or k1 alone."""

    @property
    def coefficients(self) -> tuple[float, ...]:
        """The five coefficients, also of a copy that was given k1 alone."""
        return tuple(float(value) for value in _row(self.distortion))

    @property
    def bends(self) -> bool:
        """Whether straight edges are recorded bent."""
        return any(self.coefficients)
