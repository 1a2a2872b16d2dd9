"""Blur that varies over the image, by the image height: as a table, as a polynomial, or as data sheets say it."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from scenes.cameras.over_field import Piece, at_height, between, outward
from scenes.materials.vectors import NUMPY, Ops
from scenes.model import Model
from scenes.ranges import Fraction, Positive

_LEAST, _MOST = 0.1, 20.0  # times the blur in the middle
_ROWS = 32  # of a table that stands for a field
_LOOKED = np.linspace(0, 1, 1001)  # squared image heights
Contrast = Annotated[float, Field(ge=0.01, le=0.999)]


class BlurField(Model):
    """The lens' blur by the image height: 0 in the image's middle, 1 at its corner; the same in all directions.

    One of three: ``table``, ``polynomial``, or ``mtf`` with ``lp_per_mm``. The first two say by what ``blur_px``, the
    blur in the middle, is multiplied; the third says ``blur_px`` too. Between rows a monotone cubic in the squared
    height (`scipy.interpolate.PchipInterpolator`); beyond the last row as in it.

    Examples
    --------
    >>> field = BlurField(polynomial=(0.5, 0.25))
    >>> float(field.times(0.0)), float(field.times(0.25)), float(field.times(1.0))
    (1.0, 1.140625, 1.75)
    """

    table: Annotated[tuple[tuple[Fraction, Positive], ...], Field(max_length=64)] = ()
    """Rows [image height, blur over that in the middle]; in the middle it is 1 [ratio]."""
    polynomial: Annotated[tuple[Annotated[float, Field(ge=-20, le=20)], ...], Field(max_length=4)] = ()
    """a, b, ... of the blur over that in the middle, 1 + a h^2 + b h^4 + ..., h the image height [ratio]."""
    mtf: Annotated[tuple[tuple[Fraction, Contrast], ...], Field(max_length=64)] = ()
    """Rows [image height, contrast that the lens transfers at ``lp_per_mm``], the first at 0; without the pixels'
    own [ratio]."""
    lp_per_mm: Positive | None = None
    """Line pairs a mm on the sensor at which ``mtf`` is stated [1 / mm]."""

    @model_validator(mode="after")
    def _whole(self) -> BlurField:
        ways = [name for name in ("table", "polynomial", "mtf") if getattr(self, name)]
        if len(ways) != 1:
            raise ValueError(
                f"camera.blur_field must have one of table, polynomial and mtf, got {' and '.join(ways) or 'none'}"
            )
        if bool(self.mtf) != (self.lp_per_mm is not None):
            raise ValueError("camera.blur_field.lp_per_mm must be given with mtf, and with it alone, got one of both")
        if self.mtf and self.mtf[0][0] != 0:
            raise ValueError(f"camera.blur_field.mtf must begin in the middle, at 0, got {self.mtf[0][0]:g}")
        outward(f"camera.blur_field.{ways[0]}", self._rows if not self.polynomial else ())
        times = self.times(_LOOKED)
        if not (times.min() >= _LEAST and times.max() <= _MOST):
            raise ValueError(
                f"camera.blur_field must be between {_LEAST:g} and {_MOST:g} times blur_px everywhere, got"
                f" {times.min():.3g} to {times.max():.3g}"
            )
        return self

    def times(self, height2: Any, ops: Ops = NUMPY) -> Any:
        """The blur over that in the middle at squared image heights; written with ``ops``, as a material's formulas."""
        if self.polynomial:
            return at_height((Piece(0.0, 1.0, self.polynomial),), height2, ops)
        return at_height(between(self._rows), height2, ops)

    @property
    def most(self) -> float:
        """The largest `times` within the image."""
        return float(self.times(_LOOKED).max())

    @property
    def least(self) -> float:
        """The smallest."""
        return float(self.times(_LOOKED).min())

    def smoothed(self, blur_px: float, added_px: float) -> BlurField:
        """The field of images that are blurred by ``added_px`` on top, the blur in the middle ``blur_px`` before.

        >>> field = BlurField(polynomial=(2.0,)).smoothed(3.0, 4.0)
        >>> round(5.0 * float(field.times(1.0)), 6) == round(math.hypot(9.0, 4.0), 6)
        True
        """
        if added_px == 0:
            return self
        heights = np.linspace(0, 1, _ROWS + 1)[1:]
        blur = np.hypot(blur_px * self.times(heights**2), added_px) / math.hypot(blur_px, added_px)
        return BlurField(table=tuple(zip(heights.tolist(), blur.tolist(), strict=True)))

    def middle_um(self) -> float | None:
        """Standard deviation of the blur in the middle that ``mtf`` says, um on the sensor; None without it."""
        return gaussian_um(self.mtf[0][1], self.lp_per_mm) if self.mtf and self.lp_per_mm else None

    def without_middle(self) -> dict[str, Any]:
        """The table of a scene's file that says the same but for the blur in the middle; of one row of ``mtf`` none.

        >>> BlurField(mtf=((0.0, 0.5), (1.0, 0.25)), lp_per_mm=60).without_middle()
        {'table': [[0.0, 1.0], [1.0, 1.4142135623730951]]}
        """
        if self.mtf:
            return {"table": [list(row) for row in self._rows]}
        return self.model_dump(mode="json", exclude_defaults=True)

    @property
    def _rows(self) -> tuple[tuple[float, float], ...]:
        """Rows [image height, blur over that in the middle]."""
        if self.mtf:
            middle = math.log(self.mtf[0][1])
            return tuple((height, math.sqrt(math.log(contrast) / middle)) for height, contrast in self.mtf)
        return self.table


def gaussian_um(contrast: float, lp_per_mm: float) -> float:
    """Standard deviation of the Gaussian that transfers so much contrast at a frequency, um.

    exp(-2 pi^2 s^2 f^2) is its modulation transfer.

    >>> round(gaussian_um(0.4, 60), 3)
    3.591
    """
    return 1000 * math.sqrt(-math.log(contrast) / 2) / (math.pi * lp_per_mm)
