"""Arrays from outside, checked once: real finite numbers, not something that NumPy makes numbers of."""

from __future__ import annotations

import math
import warnings
from numbers import Real
from typing import Any

import numpy as np

from scenes.errors import InvalidInput, given

BRIGHTEST = 1e15  # grey levels; beyond, squares of them and single precision overflow
_TINY = 1e-15  # grey levels, the least that a scene may say: of less all is 0


def numbers(values: Any, name: str) -> np.ndarray:
    """An array_like of real numbers as float64.

    Raises
    ------
    InvalidInput
        If it holds anything else: text, complex numbers, dates, objects, masked or missing values.
    """
    if isinstance(values, np.ma.MaskedArray):
        raise InvalidInput(f"{name} must be an array without a mask, got a masked array")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # ragged lists
            array = np.asarray(values)
            if array.dtype.kind not in "biuf":
                raise InvalidInput(f"{name} must be of real numbers, got {_kind(array, values)}")
            return array.astype(float, copy=False)
    except (ValueError, TypeError, OverflowError, RecursionError, Warning) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name} must be of real numbers, got something else") from None


def number(value: Any, name: str) -> float:
    """One finite real number.

    Raises
    ------
    InvalidInput
        If it is anything else.

    Examples
    --------
    >>> number(np.float32(2), "p")
    2.0
    """
    try:
        found = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise InvalidInput(f"{name} must be a finite number, got {given(value)}")
    return found


def _kind(array: np.ndarray, values: Any) -> str:
    if values is None:
        return "nothing"
    kinds = {"c": "complex numbers", "U": "text", "S": "bytes", "M": "dates", "m": "times", "V": "records"}
    return kinds.get(array.dtype.kind, "objects")


def finite(values: Any, name: str) -> np.ndarray:
    """The same, if all of them are finite."""
    array = numbers(values, name)
    if not np.isfinite(array).all():
        raise InvalidInput(f"{name} must be of finite numbers, got NaN or infinity")
    return array


def grey_levels(values: Any, name: str = "image") -> np.ndarray:
    """An image or a stack of them, shape (..., height, width), grey levels, as float64.

    Raises
    ------
    InvalidInput
        If it is no such array of finite real numbers, is empty, or holds a level beyond 1e15.
    """
    images = numbers(values, name)
    if images.ndim < 2 or images.size == 0:
        raise InvalidInput(f"{name} must be of shape (..., height, width), got shape {images.shape}")
    low, high = float(images.min()), float(images.max())
    if not np.isfinite([low, high]).all():
        raise InvalidInput(f"{name} must be of finite numbers, got NaN or infinity")
    if max(-low, high) > BRIGHTEST:
        raise InvalidInput(f"{name} must be of grey levels up to {BRIGHTEST:g}, got {max(-low, high):.3g}")
    return images if max(-low, high) >= _TINY else np.zeros_like(images)


def picture(values: Any, name: str = "image") -> np.ndarray:
    """One image, shape (height, width); otherwise as `grey_levels`."""
    image = grey_levels(values, name)
    if image.ndim != 2:
        raise InvalidInput(f"{name} must be of shape (height, width), got shape {image.shape}")
    return image


def poses(values: Any, name: str) -> np.ndarray:
    """Poses (polar, azimuth), degrees, shape (..., 2).

    Raises
    ------
    InvalidInput
        If they are no such array of finite numbers, or a polar angle lies outside 0 to 180.
    """
    array = finite(values, name)
    if array.ndim < 1 or array.shape[-1] != 2:
        raise InvalidInput(f"{name} must be pairs (polar, azimuth), got shape {array.shape}")
    if array.size and not (array[..., 0].min() >= 0 and array[..., 0].max() <= 180):
        raise InvalidInput(f"{name} must have polar angles between 0 and 180, got others")
    return array
