"""What an image file says of itself beside its pixels: size, orientation, tone curve, compression."""

from __future__ import annotations

import io
import warnings
from typing import NamedTuple

import numpy as np
from PIL import Image

from scenes.cameras import tone
from scenes.cameras.pinhole import MOST_PIXELS
from scenes.cameras.tone import Tone

_TIFF = (b"II*\0", b"MM\0*")
_ORIENTATION, _EXIF, _COLOUR_SPACE, _SRGB = 0x0112, 0x8769, 0xA001, 1


class Header(NamedTuple):
    """Of one file.

    Attributes
    ----------
    size : tuple of int
        (width, height) as stored; () for a kind of TIFF that only the decoder knows.
    orientation : int
        EXIF's number, 1 to 8, that is still to be applied to the decoded pixels.
    tone : Tone
    told_by : str
        What tells the tone curve: "its EXIF data", "its colour profile", ...; "" where nothing does.
    compressed : bool
        Whether what is in it was compressed with a loss.
    """

    size: tuple[int, ...]
    orientation: int = 1
    tone: Tone = tone.NONE
    told_by: str = ""
    compressed: bool = False


def header(data: bytes) -> Header:
    """The header of an encoded image.

    Where it is broken nothing is to be decoded: the decoder would believe it, and take gigabytes.

    Raises
    ------
    ValueError
        If there is none.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data)) as image:
                return _told(image, data)
    except Image.DecompressionBombError:
        return Header((MOST_PIXELS + 1,))
    except Exception:  # every format raises its own
        if data[:4] in _TIFF:
            return Header(())
        raise ValueError("no header of an image") from None


def _told(image: Image.Image, data: bytes) -> Header:
    size, lossy = image.size, image.format == "JPEG" and _loses(image)
    try:
        exif = _exif(image, data)
        turn = exif.get(_ORIENTATION, 1) if image.format != "TIFF" else 1  # the decoder turns TIFF by itself
        curve, by = _tone(image, exif)
    except Exception:  # a broken note beside good pixels
        return Header(size, compressed=lossy)
    return Header(size, turn if turn in range(1, 9) else 1, curve, by, lossy)


def _exif(image: Image.Image, data: bytes) -> Image.Exif:
    """Its EXIF data. A PNG may have them behind its pixels, so that these are decoded first: only where it has any."""
    return image.getexif() if image.format != "PNG" or b"exif" in data.lower() else Image.Exif()


def _loses(image: Image.Image) -> bool:
    """Whether a JPEG's coefficients were rounded to more than 1."""
    tables = getattr(image, "quantization", None) or {}
    return any(max(table) > 1 for table in tables.values()) or not tables


def _tone(image: Image.Image, exif: Image.Exif) -> tuple[Tone, str]:
    profile = image.info.get("icc_profile")
    found = tone.of_profile(profile) if profile else None
    if found is not None:
        return found, "its colour profile"
    if exif.get_ifd(_EXIF).get(_COLOUR_SPACE) == _SRGB:
        return tone.SRGB, "its EXIF data"
    if "srgb" in image.info:
        return tone.SRGB, "its sRGB mark"
    if image.info.get("gamma"):
        power = 1 / float(image.info["gamma"])
        return (tone.NONE if abs(power - 1) < 0.01 else Tone(f"gamma {power:.3g}", power)), "its gAMA mark"
    if image.format == "JPEG":
        return tone.SRGB, "being a JPEG"
    return tone.NONE, ""


def turned(image: np.ndarray, orientation: int) -> np.ndarray:
    """An image (height, width, ...) as EXIF's orientation 1 to 8 says that it is to be seen."""
    if orientation >= 5:
        image = np.swapaxes(image, 0, 1)
    flips = {2: (1,), 3: (0, 1), 4: (0,), 6: (1,), 7: (0, 1), 8: (0,)}.get(orientation, ())
    return np.ascontiguousarray(np.flip(image, flips)) if orientation > 1 else image
