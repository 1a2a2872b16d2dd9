"""Images in files: 8 and 16 bit PNG, TIFF and JPEG, float TIFF, and NumPy's .npy."""

from __future__ import annotations

from pathlib import Path
from zlib import crc32

import cv2
import numpy as np

from scenes import InvalidInput
from scenes.files.image import read

__all__ = ["read", "write"]

_SUFFIXES = (".png", ".tif", ".tiff", ".npy")


def write(path: Path, image: np.ndarray) -> None:
    """Write grey levels: exactly as float to .npy and float32 to .tif, rounded to 8 bits (16 above 255) to .png.

    A PNG is marked as linear in the light (gAMA 1).

    Raises
    ------
    InvalidInput
        If the suffix is unknown or the file cannot be written.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise InvalidInput(f"--output must end in {', '.join(_SUFFIXES)}, got {str(path)!r}")
    try:
        if path.suffix.lower() == ".npy":
            np.save(path, image)
            return
        if path.suffix.lower() == ".png":
            depth = np.uint8 if image.max() <= 255 else np.uint16
            image = np.clip(np.rint(image), 0, np.iinfo(depth).max).astype(depth)
        else:
            image = image.astype(np.float32)
        data = cv2.imencode(path.suffix, image)[1].tobytes()
        path.write_bytes(_linear(data) if path.suffix.lower() == ".png" else data)
    except OSError as error:
        raise InvalidInput(f"--output must be a writable file, got {path} ({error.strerror})") from None


def _linear(png: bytes) -> bytes:
    """A PNG with a mark that its numbers are linear in the light, behind its header of 33 bytes."""
    mark = b"gAMA" + (100_000).to_bytes(4, "big")
    return png[:33] + (4).to_bytes(4, "big") + mark + crc32(mark).to_bytes(4, "big") + png[33:]
