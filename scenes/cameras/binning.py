"""Binning: pixels of a sensor taken together, and the camera and noise that this makes of them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from scenes.cameras.noise import Noise
from scenes.errors import given
from scenes.model import Model

_MOST_BITS = 16
_SHRUNK = ("width", "height")
_SPREADS = ("sd", "half_width")


class Binning(Model):
    """Squares of ``factor`` x ``factor`` pixels taken together.

    Charge is added before it is read: one read's noise, one pixel's end of the scale. Digital sums and means are of
    pixels that were read and rounded one by one: noise and light of all of them. Light's own noise and fixed patterns
    add up as independent numbers do.

    Examples
    --------
    >>> raw = Noise(sigma=3.0, gain=0.2, bits=12)
    >>> for kind in ("charge", "sum", "mean"):
    ...     one = Binning(kind=kind).noise(raw)
    ...     print(kind, round(one.sigma, 3), one.gain, one.bits)
    charge 3.0 0.2 12
    sum 6.021 0.2 14
    mean 1.507 0.05 12
    """

    factor: Annotated[int, Field(ge=2, le=8)] = 2
    """Pixels along each side."""
    kind: Literal["charge", "sum", "mean"]
    """charge: before reading; sum, mean: of digital numbers."""

    def noise(self, raw: Noise) -> Noise:
        """Of a picture of such squares, by the noise of a pixel; its level of darkness is the picture's own.

        With n = factor^2 pixels of variance s^2 in darkness, a sum has n s^2 and the rounding of all pixels but one,
        which is that of its own digits; a mean the n-th part of it in each grey level, and one rounding more. What a
        row shares, factor pixels of the square share, and factor rows are independent.

        Raises
        ------
        ValueError
            If sums have more than 16 bits.
        """
        count = self.factor**2
        digital, over = self.kind != "charge", count if self.kind == "mean" else 1
        rounded = 0 if raw.bits is None or not digital else count if self.kind == "mean" else count - 1
        shared = self.factor**1.5 / over if digital else 1.0
        return raw.tried(
            sigma=math.sqrt((count if digital else 1) * raw.sigma**2 + rounded / 12) / over,
            gain=raw.gain / over, bits=self._bits(raw.bits), prnu=raw.prnu / self.factor,
            dsnu=raw.dsnu * self.factor / over,
            row_sigma=raw.row_sigma * shared, column_sigma=raw.column_sigma * shared,
        )  # fmt: skip

    @property
    def most_bits(self) -> int:
        """Digits of a pixel with which those of a square are 16 at most."""
        return _MOST_BITS - (math.ceil(2 * math.log2(self.factor)) if self.kind == "sum" else 0)

    def _bits(self, bits: int | None) -> int | None:
        if bits is not None and bits > self.most_bits:
            raise ValueError(
                f"bits must be at most {self.most_bits} for sums of {self.factor} x {self.factor} pixels, got {bits}"
            )
        return None if bits is None else bits + _MOST_BITS - self.most_bits

    def camera(self, table: dict[str, Any]) -> dict[str, Any]:
        """A camera's table, width, height and pixel pitch those of the squares; columns that fill none are cut off."""
        whole = {key: table[key] // self.factor for key in _SHRUNK if isinstance(table.get(key), int)}
        return {**table, **whole, "pixel_pitch_um": self.factor * table["pixel_pitch_um"]}


def binned(data: dict[str, Any]) -> dict[str, Any]:
    """A scene's document as its ``camera.binning`` makes it, which is not in it any longer; values of the wrong kind
    are left to the model's own checks.

    Raises
    ------
    ValueError
        If it does not go with what else the document says.
    """
    camera, noise = data.get("camera"), data.get("noise")
    if not isinstance(camera, dict) or camera.get("binning") is None:
        return data
    told = camera["binning"]
    try:
        mode = told if isinstance(told, Binning) else Binning.model_validate(told)
    except ValidationError:
        return data
    camera = {key: value for key, value in camera.items() if key != "binning"}
    try:
        raw = noise if isinstance(noise, Noise) else Noise.model_validate(noise)
    except ValidationError:
        return {**data, "camera": camera}
    _check(camera, raw, mode)
    try:
        found = mode.noise(raw)
    except ValueError as error:
        raise ValueError(f"noise.{error}") from None
    before = _numbers(camera, raw)
    camera = mode.camera(camera)
    uncertain = _scaled(data.get("uncertain", ()), before, _numbers(camera, found))
    table = {key: getattr(found, key) for key in found.model_fields_set}
    return {**data, "camera": camera, "noise": table, "uncertain": uncertain}


def _check(camera: dict[str, Any], raw: Noise, mode: Binning) -> None:
    pitch = camera.get("pixel_pitch_um")
    if isinstance(pitch, bool) or not isinstance(pitch, int | float):
        raise ValueError(f"camera.pixel_pitch_um must be a pixel's with camera.binning, got {given(pitch)}")
    if camera.get("focal_px") is not None:
        raise ValueError(
            "camera.focal_px must follow from focal_length_mm or magnification with camera.binning,"
            f" got {given(camera['focal_px'])}"
        )
    if raw.colour is not None:
        raise ValueError(f"camera.binning must be left out with noise.colour, got {mode.kind}")
    if raw.excess:
        raise ValueError(f"camera.binning must be left out with noise.excess, got {mode.kind}")
    if camera.get("line_time_us"):
        raise ValueError(f"camera.line_time_us must be 0 with camera.binning, got {given(camera['line_time_us'])}")
    white = camera.get("exposure", 0)
    if mode.kind == "sum" and raw.bits is not None and isinstance(white, int | float):
        most = mode.factor**2 * (2**raw.bits - 1) - raw.dark_level
        if white > most:
            raise ValueError(f"camera.exposure must be at most {most:g}, where pixels end their scale, got {white:g}")


def _numbers(camera: dict[str, Any], noise: Noise) -> dict[str, float]:
    """What binning changes, by the keys of a scene."""
    names = ("sigma", "gain", "prnu", "dsnu", "row_sigma", "column_sigma")
    return {"camera.pixel_pitch_um": camera["pixel_pitch_um"]} | {f"noise.{key}": getattr(noise, key) for key in names}


def _scaled(uncertain: Any, before: dict[str, float], after: dict[str, float]) -> Any:
    """How well numbers are known, as a part of themselves."""
    if not isinstance(uncertain, list | tuple):
        return uncertain
    return [_as_part(each, before, after) for each in uncertain]


def _as_part(each: Any, before: dict[str, float], after: dict[str, float]) -> Any:
    table = {key: getattr(each, key) for key in each.model_fields_set} if isinstance(each, BaseModel) else each
    key = table.get("key") if isinstance(table, dict) else None
    if not isinstance(key, str) or not before.get(key):
        return each
    ratio = after[key] / before[key]
    return {name: value * ratio if name in _SPREADS and isinstance(value, float | int) else value
            for name, value in table.items()}  # fmt: skip
