"""Images in files: 8 and 16 bit PNG, TIFF and JPEG, float TIFF, and NumPy's .npy."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from scenes import InvalidInput

_SUFFIXES = (".png", ".tif", ".tiff", ".npy")


def write(path: Path, image: np.ndarray) -> None:
    """Write grey levels: exactly as float to .npy and float32 to .tif, rounded to 8 bits (16 above 255) to .png.

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
        path.write_bytes(cv2.imencode(path.suffix, image)[1].tobytes())
    except OSError as error:
        raise InvalidInput(f"--output must be a writable file, got {path} ({error.strerror})") from None


def read(path: Path) -> np.ndarray:
    """Grey levels of an image file, float64, shape (height, width); colour becomes grey.

    Raises
    ------
    InvalidInput
        If the file cannot be read as an image.
    """
    try:
        data = path.read_bytes()
        if path.suffix.lower() == ".npy":
            image = np.load(path, allow_pickle=False)
        else:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except (OSError, ValueError, EOFError, cv2.error) as error:
        reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
        raise InvalidInput(f"{path} must be a readable image, got: {reason}") from None
    if image is None or image.ndim not in (2, 3) or image.dtype.kind not in "uif":
        raise InvalidInput(f"{path} must be a readable image, got something else")
    if image.ndim == 3:
        image = (
            cv2.cvtColor(np.ascontiguousarray(image[:, :, :3]), cv2.COLOR_BGR2GRAY)
            if image.shape[2] >= 3
            else image[:, :, 0]
        )
    return image.astype(float)
