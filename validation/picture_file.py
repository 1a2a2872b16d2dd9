"""Images in files: 8 and 16 bit PNG, TIFF and JPEG, float TIFF, and NumPy's .npy."""

from __future__ import annotations

import io
import math
import warnings
from pathlib import Path
from tokenize import TokenError

import cv2
import numpy as np
from PIL import Image

from scenes import InvalidInput

_MOST_PIXELS = 40_000_000  # 320 MB as float64
_TIFF = (b"II*\0", b"MM\0*")
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
        if path.suffix.lower() == ".npy":
            image = np.load(path, mmap_mode="r", allow_pickle=False)  # a map: what is told of the size is not believed
            _check_size(path, image.shape)
        else:
            data = path.read_bytes()
            _check_size(path, _told_size(data))
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except InvalidInput:
        raise
    except (OSError, ValueError, EOFError, SyntaxError, TokenError, MemoryError, OverflowError, cv2.error) as error:
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


def _told_size(data: bytes) -> tuple[int, ...]:
    """Size of an image by its header alone; () for a kind of TIFF that only the decoder knows.

    Where the header is broken nothing is decoded: the decoder would believe it, and take gigabytes.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data)) as header:
                return header.size
    except Image.DecompressionBombError:
        return (_MOST_PIXELS + 1,)
    except Exception:  # every format raises its own
        if data[:4] in _TIFF:
            return ()
        raise ValueError("no header of an image") from None


def _check_size(path: Path, shape: tuple[int, ...]) -> None:
    if math.prod(shape) > _MOST_PIXELS:
        raise InvalidInput(f"{path} must be an image of at most {_MOST_PIXELS} pixels, got more")
