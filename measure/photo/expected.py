"""Where a photograph's quadrilateral is expected and what it should look like: what estimators start from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from measure.features.found import Shape
from measure.features.layout import Layout, polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from measure.goodness import WORST
from measure.photo.blur import SideBlur, side_blur
from measure.photo.noise_curve import NoiseCurve
from measure.photo.profiles import edge_sigma
from measure.photo.recording import Recording
from measure.photo.uneven import MOST, orders, shaded
from scenes import status


@dataclass(frozen=True)
class Expected:
    """A quadrilateral's layout in a photograph.

    Attributes
    ----------
    layout : Layout
    blur : SideBlur
        Of each side; the layout's own where all are alike.
    orders : tuple of int
        Of the levels' unevenness beside it and on it.
    """

    layout: Layout
    blur: SideBlur
    orders: tuple[int, int]

    def at(self, corners: np.ndarray, optics: Optics | None = None) -> Layout:
        """The same with corners (4, 2) elsewhere, px."""
        plain = polygon_layout(corners, optics or self.layout.optics)
        return shaded(replace(plain, defocus=self.layout.defocus), *self.orders)

    @property
    def bent(self) -> Expected:
        """The same with levels that may bend on both sides: what patches do not tell moves sides by their sigma."""
        return replace(self, layout=shaded(self.layout, MOST, MOST), orders=(MOST, MOST))

    @property
    def uneven(self) -> bool:
        """Whether levels beside the sides bend: what moves all but the likeliest arrangement."""
        return max(self.orders) == MOST


def expected(image: np.ndarray, corners: np.ndarray, seen: Recording) -> Expected:
    """From corners (4, 2) known to some tenths of a pixel, px."""
    optics = optics_of(image, corners, edge_sigma(image, corners), seen.curve)
    sides = side_blur(image, polygon_layout(corners, optics), seen.curve)
    blur = optics.blur_px
    if np.isfinite(sides.common):
        blur = float(np.nanmin(sides.sigma)) if sides.differs else sides.common
        optics = optics_of(image, corners, blur, seen.curve)
    layout = polygon_layout(corners, optics)
    if sides.differs:  # a defocus of radius r adds r^2 / 4 to the blur's variance
        radius = 2 * np.sqrt(np.maximum(np.nan_to_num(sides.sigma, nan=blur) ** 2 - blur**2, 0.0))
        layout = replace(layout, defocus=np.tile(radius[:, None], 2))
    found = orders(seen.patches, layout, seen.curve)
    return Expected(shaded(layout, *found), sides, found)


def optics_of(image: np.ndarray, corners: np.ndarray, blur: float, curve: NoiseCurve) -> Optics:
    """Optics of a photograph with so much blur, px; the noise's variance is that of the mean level around."""
    low, high = np.floor(corners.min(0) - 16).astype(int), np.ceil(corners.max(0) + 17).astype(int)
    part = image[max(low[1], 0) : high[1], max(low[0], 0) : high[0]]
    mean = float(part.mean()) if part.size else float(image.mean())
    return Optics(
        image.shape, blur, float(curve.variance(mean)), max(1.0, blur), 3 + 2 * max(1.0, blur), curve.noise,
        dark_level=curve.dark_level,
    )  # fmt: skip


def likeliest(image: np.ndarray, near: Expected) -> tuple[Shape, Expected]:
    """The likeliest arrangement, with levels that bend on both sides where without them it does not fit."""
    shape = find_shape(image[None], near.layout, "arrangement")
    if status.MISFIT not in shape.status or near.uneven:
        return shape, near
    other = find_shape(image[None], near.bent.layout, "arrangement")
    return (other, near.bent) if other.p_value[0] >= WORST else (shape, near)
