"""A lens whose displacements are bicubic splines: what no polynomial in the distance from the axis describes."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.cameras.lens import Lens
from scenes.cameras.lens_model import LENSES, LensModel

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline

DEGREE = 3
Plane = Literal["normalised", "stereographic"]
_Place = Annotated[float, Field(ge=-100, le=100)]
_Shift = Annotated[float, Field(ge=-100, le=100)]
Rows = tuple[tuple[_Shift, ...], ...]


@LENSES.add("splined")
class Splined(LensModel):
    """Displacements over a plane, each component a bicubic B-spline of evenly spaced control points.

    A point that a pinhole camera sees at x focal lengths from the image's centre lies at w = x of the normalised plane,
    or at w = 2 x / (1 + sqrt(1 + |x|^2)) of the stereographic one, and is recorded at w + d(w). Beyond ``extent``
    nothing is known of the lens, and nothing is recorded.

    Examples
    --------
    >>> flat = ((0.0,) * 4,) * 4
    >>> lens = Splined(kind="splined", plane="stereographic", extent=(-1, -1, 1, 1), right=flat, down=flat)
    >>> lens.bent(np.array([[0.75, 0.0], [9.0, 0.0]])).round(6).tolist()
    [[0.666667, 0.0], [nan, nan]]
    """

    kind: Literal["splined"]
    """Displacements that are splines."""
    plane: Plane = "normalised"
    """Over which plane: that of a pinhole's image, or, for wide lenses, its stereographic projection."""
    extent: tuple[_Place, _Place, _Place, _Place]
    """Least x and y and largest x and y of the plane, where the lens is known, focal lengths."""
    right: Rows
    """Control points of the displacement to the right, row by row from the least y, 4 or more a row and column; the
    outermost lie one interval beyond the extent. Focal lengths."""
    down: Rows
    """The same of the displacement downwards."""

    @model_validator(mode="after")
    def _is_a_grid(self) -> Splined:
        sizes = {len(row) for row in (*self.right, *self.down)}
        if len(sizes) != 1 or len(self.right) != len(self.down) or min(*sizes, len(self.right)) <= DEGREE:
            raise ValueError("right and down must be equally many rows of equally many numbers, 4 at least, got others")
        if not (self.extent[0] < self.extent[2] and self.extent[1] < self.extent[3]):
            raise ValueError(f"extent must be least x and y, largest x and y, got {list(self.extent)}")
        return self

    @property
    def bends(self) -> bool:
        """Also where all displacements are 0: the stereographic plane is no pinhole's."""
        return True

    def straight(self) -> Lens:
        """A lens that moves no point, focused as this one."""
        return Lens(aperture_radius=self.aperture_radius, focus=self.focus)

    def bent(self, points: np.ndarray) -> np.ndarray:
        """Where points (..., 2) are recorded, focal lengths; NaN beyond the extent."""
        place = on_plane(points, self.plane)
        return place + self._moved(place)

    def slope(self, points: np.ndarray) -> np.ndarray:
        """Its derivative, (..., 2, 2)."""
        place = on_plane(points, self.plane)
        by_place = np.eye(2) + np.stack([self._moved(place, nu=(1, 0)), self._moved(place, nu=(0, 1))], -1)
        return by_place @ plane_slope(points, self.plane)

    def _moved(self, place: np.ndarray, nu: tuple[int, int] = (0, 0)) -> np.ndarray:
        return _splines(self.extent, self.right, self.down)(place, nu=nu)


@lru_cache(maxsize=16)
def _splines(extent: tuple[float, ...], right: Rows, down: Rows) -> NdBSpline:
    """Both displacements over the plane; NaN beyond the extent."""
    from scipy.interpolate import NdBSpline  # slow to load, and rarely needed

    control = np.stack([np.array(right).T, np.array(down).T], -1)
    return NdBSpline(knots(extent, control.shape[:2]), control, DEGREE, extrapolate=False)


def knots(extent: tuple[float, ...], control: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Knots along x and y of splines whose control points (columns, rows) span an extent, evenly spaced.

    Examples
    --------
    >>> knots((0, 0, 1, 2), (4, 5))[1].tolist()
    [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    """
    found = []
    for low, high, count in zip(extent[:2], extent[2:], control, strict=True):
        width = (high - low) / (count - DEGREE)
        found.append(low + width * np.arange(-DEGREE, count + 1.0))
    return found[0], found[1]


def on_plane(points: np.ndarray, plane: Plane) -> np.ndarray:
    """Where points (..., 2) of a pinhole's image lie on a plane; both in focal lengths."""
    return points if plane == "normalised" else points * (2 / (1 + _length(points)))[..., None]


def plane_slope(points: np.ndarray, plane: Plane) -> np.ndarray:
    """Derivative of `on_plane`, (..., 2, 2)."""
    if plane == "normalised":
        return np.broadcast_to(np.eye(2), (*points.shape, 2))
    length = _length(points)[..., None, None]
    across = points[..., :, None] * points[..., None, :]
    return 2 / (1 + length) * (np.eye(2) - across / (length * (1 + length)))


def off_plane(places: np.ndarray, plane: Plane) -> np.ndarray:
    """The inverse of `on_plane`; NaN where a place is no pinhole's.

    Examples
    --------
    >>> off_plane(on_plane(np.array([[0.75, -3.0]]), "stereographic"), "stereographic").round(9).tolist()
    [[0.75, -3.0]]
    """
    if plane == "normalised":
        return places
    factor = 1 - (places**2).sum(-1, keepdims=True) / 4
    return places / np.where(factor > 0, factor, np.nan)


def _length(points: np.ndarray) -> np.ndarray:
    """Of the rays through points (..., 2) of the normalised plane."""
    return np.sqrt(1 + (points**2).sum(-1))
