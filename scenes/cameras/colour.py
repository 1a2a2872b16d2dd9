"""Colour filters on a sensor's pixels, and how a picture is made of what they let through."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.model import Model
from scenes.ranges import Positive

COLOURS = "RGB"
SITES = {"R": 0.25, "G": 0.5, "B": 0.25}  # part of the pixels
_NAMES = {"red": "R", "green": "G", "blue": "B"}
_LUMA = {"R": 0.299, "G": 0.587, "B": 0.114}  # ITU-R BT.601, which OpenCV's conversion to grey takes
_TENT = np.outer([1, 2, 1], [1, 2, 1]) / 4.0
_BESIDE = {"R": _TENT, "G": np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]]) / 4.0, "B": _TENT}
_SPREAD = {"R": 0.5, "G": 0.25, "B": 0.5}  # variances of these along an axis, px^2: means over the places of a pattern
_COARSE = 1.5  # px: of every second pixel of a row; there 10 % of the variance is left of what goes with the place
_ORDER = 5 / 2  # power with which a smoothing scale counts in the variance of a long edge, noise alone

Response = Annotated[float, Field(ge=0, le=1e3)]


class Colour(Model):
    """A mosaic of colour filters, and how a picture of grey levels is made of it.

    The colours' sensitivities are made equal (white balance): what is dark level + q (level - dark level) in a pixel of
    response q is divided by q again. Without demosaicing that is the picture: each pixel is its own measurement, those
    of weak colours are noisier. Bilinear demosaicing then takes the mean of the nearest pixels of a colour, as OpenCV's
    ``cvtColor`` does: a linear filter of the raw noise, whose covariance is known. It blurs by `blur_px` itself.

    Examples
    --------
    >>> raw = Colour(pattern="RGGB", response=(0.5, 1.0, 0.5))
    >>> raw.noise_factor(2), raw.noise_factor(1), raw.blur_px
    (2.5, 1.5, 0.0)
    >>> round(Colour(pattern="RGGB", demosaicing="bilinear").blur_px, 3)
    0.594
    """

    pattern: Literal["RGGB", "BGGR", "GRBG", "GBRG"]
    """Colours of the first two pixels of the first two rows."""
    response: tuple[Response, Response, Response] = (1.0, 1.0, 1.0)
    """Of red, green and blue pixels to the light as it comes from what is measured, relative to the strongest colour
    that is read; for lamp, surface and filters together, which are not modelled by wavelength."""
    demosaicing: Literal["none", "bilinear"] = "none"
    """none: the raw mosaic, balanced; bilinear: the nearest pixels' mean. Others have no known law of noise."""
    reads: Literal["grey", "red", "green", "blue"] = "grey"
    """What the picture shows: all colours, by the weights 0.299, 0.587, 0.114 where demosaicing mixes them, or one."""
    scale_px: Positive = 1.0
    """Of the locator that noise is told for: follows from ``locator.scale_px`` [px]."""

    @model_validator(mode="after")
    def _read(self) -> Colour:
        if self.reads != "grey" and self.demosaicing == "none":
            raise ValueError(f"demosaicing must be bilinear where only {self.reads} is read, got 'none'")
        read = [self.response[COLOURS.index(colour)] for colour in self.weights]
        if min(read) < 1e-3:
            raise ValueError(f"response must be at least 0.001 of the colours that are read, got {min(read):g}")
        if max(read) != 1:
            raise ValueError(f"response must be 1 of the strongest colour that is read, got {max(read):g}")
        return self

    @property
    def interpolates(self) -> bool:
        """Whether pixels of the picture share raw pixels, so that their noise is correlated."""
        return self.demosaicing != "none"

    @property
    def weights(self) -> dict[str, float]:
        """By which colours make the picture; without demosaicing each pixel counts for itself."""
        if self.reads == "grey":
            return dict(_LUMA) if self.interpolates else dict(SITES)
        return {_NAMES[self.reads]: 1.0}

    @property
    def blur_px(self) -> float:
        """Standard deviation of what demosaicing blurs by, px; a part of ``camera.blur_px``."""
        if not self.interpolates:
            return 0.0
        return math.sqrt(sum(weight * _SPREAD[colour] for colour, weight in self.weights.items()))

    @property
    def least_scale_px(self) -> float:
        """Smoothing scale, px, below which an edge's slope depends on its place in the mosaic.

        Noise that is told alike for all places does not know of it.
        """
        return _COARSE if self.reads in ("red", "blue") else 0.0

    def noise_factor(self, power: int) -> float:
        """Variance of white noise in the picture that moves a long edge as the mosaic's does, over the raw noise's.

        Raw noise that goes with the power p of the balanced signal's share has variance 1 / q^p of its own in a pixel
        of response q: 2 for noise in darkness, 1 for shot noise, 0 for what is a part of the signal. A locator that
        smooths by ``scale_px``, s, and takes a line through its points answers to white noise by s^-5; interpolated of
        a part f of the pixels with weight w, to which the filter's variance m adds, by w^2 / f (s^2 + m)^(-5/2).
        """
        response = dict(zip(COLOURS, self.response, strict=True))
        if not self.interpolates:
            return sum(part / response[colour] ** power for colour, part in SITES.items())
        return sum(
            weight**2 / SITES[colour] / response[colour] ** power * (1 + _SPREAD[colour] / self.scale_px**2) ** -_ORDER
            for colour, weight in self.weights.items()
        )

    @property
    def shares(self) -> np.ndarray:
        """Response of the pixels by row and column modulo 2, (2, 2)."""
        return _shares(self)

    @property
    def kernels(self) -> np.ndarray:
        """Weights of raw pixels, balance included, by row and column modulo 2 and place beside it, (2, 2, 3, 3)."""
        return _kernels(self)


@lru_cache(maxsize=64)
def _shares(colour: Colour) -> np.ndarray:
    each = [colour.response[COLOURS.index(letter)] for letter in colour.pattern]
    return _kept(np.array(each).reshape(2, 2))


@lru_cache(maxsize=64)
def _kernels(colour: Colour) -> np.ndarray:
    found = np.zeros((2, 2, 3, 3))
    if not colour.interpolates:
        found[:, :, 1, 1] = 1 / colour.shares
        return _kept(found)
    sites = np.array(list(colour.pattern)).reshape(2, 2)
    for row, column in np.ndindex(2, 2):
        around = sites[np.ix_((row + np.arange(-1, 2)) % 2, (column + np.arange(-1, 2)) % 2)]
        for letter, weight in colour.weights.items():
            near = _BESIDE[letter] * (around == letter)
            found[row, column] += weight / colour.response[COLOURS.index(letter)] * near / near.sum()
    return _kept(found)


def _kept(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
