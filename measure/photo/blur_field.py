"""How a lens' blur varies over its field, from the straight sides of what a photograph shows all over it.

Each side tells the blur across it, with a standard error (`measure.photo.blur`); a table over the image height
(`scenes.cameras.blur_field`) is fitted to them by weighted least squares, averaged along each side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import chdtrc

from measure.estimators.strip_pixels import LEAST_BLUR
from measure.features.layout import polygon_layout
from measure.photo.blur import side_blur
from measure.photo.expected import optics_of
from measure.photo.noise_curve import noise_curve
from scenes import InvalidInput
from scenes.cameras.blur_field import BlurField
from scenes.photograph import Photograph

_ROWS = (0.6, 1.0), (0.45, 0.75, 1.0)  # of the largest image height that sides tell: of few sides, and of many
_MANY = 24
_FEWEST = 6  # sides
_MIDDLE = 0.5  # of the largest height, within which a side must lie
_ALONG = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2, np.polynomial.legendre.leggauss(4)[1] / 2
_LEAST, _MOST, _WIDEST = 0.2, 15.0, 100.0  # of the ratios; px
_SMALL = 1e-6


@dataclass(frozen=True, eq=False)
class BlurredSides:
    """Blur across n straight sides.

    Attributes
    ----------
    ends : ndarray, shape (n, 2, 2)
        px.
    sigma, error : ndarray, shape (n,)
        Standard deviation of the lens' Gaussian, px, and of its error.
    """

    ends: np.ndarray
    sigma: np.ndarray
    error: np.ndarray

    def height2(self, shape: tuple[int, int]) -> np.ndarray:
        """Squared image heights (n, 4) of places along them, in an image (height, width)."""
        size = np.array(shape[::-1])
        places = self.ends[:, :1] + _ALONG[0][:, None] * (self.ends[:, 1:] - self.ends[:, :1])
        return (((places - (size - 1) / 2) * 2) ** 2).sum(-1) / (size**2).sum()


@dataclass(frozen=True, eq=False)
class FittedField:
    """Blur over the field.

    Attributes
    ----------
    blur_px : float
        In the image's middle, px.
    field : BlurField
        A table.
    covariance : ndarray, shape (1 + rows, 1 + rows)
        Of ``blur_px`` and the table's ratios; grown by chi-square over its degrees of freedom where that is above 1.
    p_value : float
        Of so large a chi-square by noise alone.
    sides : BlurredSides
    residual : ndarray, shape (n,)
        Of each side, in its standard errors.
    """

    blur_px: float
    field: BlurField
    covariance: np.ndarray
    p_value: float
    sides: BlurredSides
    residual: np.ndarray

    @property
    def sd(self) -> np.ndarray:
        """Standard uncertainties of ``blur_px``, px, and of the table's ratios."""
        return np.sqrt(np.diag(self.covariance))

    def lines(self) -> list[str]:
        """The scene's keys, with standard uncertainties."""
        (blur, *rows), times = self.sd, self.field.table
        told = (f"[{height:.4f}, {_uncertain(value, sd)}]" for (height, value), sd in zip(times, rows, strict=True))
        return [
            "[camera]",
            f"blur_px = {_uncertain(self.blur_px, blur)}",
            "",
            "[camera.blur_field] # rows [image height, blur over that in the middle]",
            f"table = [{', '.join(told)}]",
        ]


def _uncertain(value: float, sd: float) -> str:
    return f"{{ value = {value:.5f}, sd = {sd:.5f} }}"


def blurred_sides(photo: Photograph, polygons: Sequence[np.ndarray], blur_px: float = 1.0) -> BlurredSides:
    """Of all sides of convex polygons, corners (k, 2) each, px, in order around them, to a tenth of a pixel.

    ``blur_px`` is about what is expected. Sides that tell nothing are left out.
    """
    curve, found = noise_curve(photo.levels, photo.full), []
    for corners in polygons:
        optics = optics_of(photo.levels, np.asarray(corners, float), blur_px, curve)
        told = side_blur(photo.levels, polygon_layout(corners, optics), curve)
        ends = pairwise([*corners, corners[0]])
        found += [each for each in zip(ends, told.sigma, told.error, strict=True) if np.isfinite(each[1])]
    ends, sigma, error = zip(*found, strict=True) if found else ((), (), ())
    return BlurredSides(np.reshape(np.array(ends, float), (-1, 2, 2)), np.array(sigma, float), np.array(error, float))


def fitted_field(sides: BlurredSides, shape: tuple[int, int]) -> FittedField:
    """The likeliest blur over the field of an image (height, width).

    Raises
    ------
    InvalidInput
        If the sides are too few, or do not lie from the image's middle outwards.
    """
    from scipy.optimize import least_squares  # slow to load, and rarely needed

    height2 = sides.height2(shape)
    heights = np.sqrt(height2 @ _ALONG[1]) if len(height2) else np.zeros(0)
    if heights.size < _FEWEST:
        raise InvalidInput(f"image must show at least {_FEWEST} sides that tell their blur, got {heights.size}")
    if heights.min() > _MIDDLE * heights.max():
        raise InvalidInput(
            "image must show sides from its middle outwards, got some at"
            f" {heights.min():.2f} to {heights.max():.2f} of its half diagonal"
        )
    farthest = float(np.sqrt(height2.max()))
    rows = tuple(round(part * farthest, 4) for part in _ROWS[heights.size >= _MANY])

    def field(values: np.ndarray) -> BlurField:
        return BlurField(table=tuple(zip(rows, values[1:].tolist(), strict=True)))

    def away(values: np.ndarray) -> np.ndarray:
        return (values[0] * (field(values).times(height2) @ _ALONG[1]) - sides.sigma) / sides.error

    one = np.ones(len(rows))
    start = np.array([float(np.average(sides.sigma, weights=sides.error**-2)), *one])
    low, high = np.array([LEAST_BLUR / 3, *_LEAST * one]), np.array([_WIDEST, *_MOST * one])
    best = least_squares(away, np.clip(start, low + _SMALL, high), bounds=(low, high), xtol=1e-12, ftol=1e-12)
    squares, freedom = float(2 * best.cost), heights.size - best.x.size
    covariance = np.linalg.inv(best.jac.T @ best.jac) * max(squares / freedom, 1.0)
    return FittedField(
        float(best.x[0]), field(best.x), covariance, float(chdtrc(freedom, squares)), sides, best.fun
    )  # fmt: skip
