"""A user's own photograph: light linear grey levels of one channel, and how they came about."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from scenes.cameras import mosaic, tone
from scenes.errors import InvalidInput
from scenes.files import image as image_file

CHANNELS = ("r", "g", "b", "luminance")
_LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear light, red, green, blue (IEC 61966-2-1)
_SEEN = 1_000_000  # pixels that tell a channel's contrast and noise


@dataclass(frozen=True, eq=False)
class Photograph:
    """Levels of light.

    Attributes
    ----------
    levels : ndarray, shape (height, width)
        Grey levels, linear in the light, 0 to ``full``.
    full : float or None
        The scale's end, grey levels; None where the file holds real numbers.
    compressed : bool
        Whether the file is one that was compressed with a loss.
    tone, channel : str
        What was done with its tone curve, and which channel it is, in words.
    tone_known : bool
        Whether the levels are said to be linear in the light. False where a file of whole numbers says nothing of its
        tone curve, and neither does its user.
    """

    levels: np.ndarray
    full: float | None = None
    compressed: bool = False
    tone: str = "tone curve: none"
    channel: str = "grey"
    tone_known: bool = True


def read(
    path: Path,
    gamma: str | None = None,
    channel: str | None = None,
    bayer: str | None = None,
    size: image_file.Size | None = None,
) -> Photograph:
    """Read a photograph: turned as its EXIF data say, its tone curve undone, one channel of it.

    Parameters
    ----------
    gamma : str, optional
        "none", "srgb", or the exponent that turns the file's numbers into light. As the file says where not given:
        its colour profile, EXIF data, PNG's sRGB and gAMA marks; sRGB for any JPEG; else nothing is undone,
        and ``tone_known`` is False.
    channel : {"r", "g", "b", "luminance"}, optional
        That with the largest contrast over noise where not given.
    bayer : {"RGGB", "BGGR", "GRBG", "GBRG"}, optional
        The file is a sensor's raw mosaic, whose first pixels these are.
    size : Size, optional
        That it must have; looked at before it is decoded.

    Raises
    ------
    InvalidInput
        If the file is no image or not of that size, or an option is none of these or does not go with it.
    """
    if channel is not None and channel not in CHANNELS:
        raise InvalidInput(f"--channel must be one of {', '.join(CHANNELS)}, got {channel!r}")
    image, told = image_file.decoded(path, size)
    curve, by = (tone.asked(gamma), "as asked") if gamma is not None else (told.tone, told.told_by)
    full = _full_scale(image, curve)
    if full is None and not curve.plain and gamma is None:
        curve, by = tone.NONE, ""  # real numbers are light
    light = _linear(image, curve, full)
    said = f"tone curve: {curve.name}" + (f" ({by})" if by else "")
    if bayer is not None:
        if light.ndim == 3 and light.shape[2] > 1:
            raise InvalidInput(f"--bayer must go with a file of one channel, got {path} with {light.shape[2]}")
        levels, which = mosaic.balanced(light.reshape(light.shape[:2]), bayer)
    else:
        levels, which = _one_channel(path, light, channel)
    known = bool(by) or full is None or bayer is not None
    return Photograph(levels.astype(float), full, told.compressed, said, which, known)


def _full_scale(image: np.ndarray, curve: tone.Tone) -> float | None:
    """The end of a file's scale: of its format, or of the bits that its pixels need; None for real numbers."""
    if image.dtype.kind == "f":
        return None
    return float(2 ** mosaic.bits(image) - 1) if curve.plain else float(np.iinfo(image.dtype).max)


def _linear(image: np.ndarray, curve: tone.Tone, full: float | None) -> np.ndarray:
    """The image's numbers as light on the same scale."""
    if curve.plain:
        return image
    scale = full if full is not None else max(float(image.max()), 1e-12)
    if full is not None and image.dtype.kind == "u":
        table = scale * curve.light(np.arange(np.iinfo(image.dtype).max + 1, dtype=float) / scale)
        return table.astype(np.float32)[image]
    return (scale * curve.light(image.astype(np.float32) / scale)).astype(np.float32)


def _one_channel(path: Path, light: np.ndarray, channel: str | None) -> tuple[np.ndarray, str]:
    """A channel's levels and what is said of it."""
    if light.ndim == 2 or light.shape[2] == 1:
        if channel is not None:
            raise InvalidInput(f"--channel must be left out for a grey image, got {channel!r} with {path}")
        return light.reshape(light.shape[:2]), "grey"
    if light.shape[2] not in (3, 4):
        raise InvalidInput(f"{path} must be an image of one or three channels, got shape {light.shape}")
    if channel is not None:
        return _channel(light, channel), channel
    if (light[..., 0] == light[..., 1]).all() and (light[..., 1] == light[..., 2]).all():
        return light[..., 1], "grey"
    some = _sample(light)
    clear = {name: _contrast_to_noise(_channel(some, name)) for name in CHANNELS}
    best = max(clear, key=clear.get)
    return _channel(light, best), f"{best} (of {', '.join(CHANNELS)} the one with the most contrast over noise)"


def _channel(light: np.ndarray, name: str) -> np.ndarray:
    if name != "luminance":
        return light[..., 2 - CHANNELS.index(name)]
    return sum(np.float32(w) * light[..., 2 - k] for k, w in enumerate(_LUMINANCE))


def _sample(light: np.ndarray) -> np.ndarray:
    """About `_SEEN` pixels of an image (height, width, channels): bands of 64 rows, one under the other."""
    apart = 64 * max(light.shape[0] * light.shape[1] // _SEEN, 1)
    return np.concatenate([light[k : k + 64] for k in range(0, len(light), apart)])


def _contrast_to_noise(levels: np.ndarray) -> float:
    """Spread of the smoothed levels over the middle size of what second differences leave."""
    image = levels.astype(np.float32)
    mask = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
    noise = float(np.sqrt(np.mean(np.clip(np.abs(cv2.filter2D(image, -1, mask)), 0, None) ** 2 * _still(image, mask))))
    return float(np.ptp(np.percentile(cv2.GaussianBlur(image, (0, 0), 2), [2, 98]))) / max(noise, 1e-6)


def _still(image: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """1 where second differences are not those of edges, else 0."""
    size = np.abs(cv2.filter2D(image, -1, mask))
    return size < 4 * np.median(size) + 1e-6
