"""Images from files: 8 and 16 bit PNG, TIFF and JPEG, float TIFF, and NumPy's .npy."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tokenize import TokenError

import cv2
import numpy as np

from scenes.camera import MOST_PIXELS as _MOST_PIXELS
from scenes.errors import InvalidInput
from scenes.files import Unreadable, opened, read_bytes
from scenes.image_header import Header, header, turned

_MOST_BYTES = 8 * _MOST_PIXELS + 10_000  # the largest image as float64, with a header


def read(path: Path) -> np.ndarray:
    """Grey levels of an image file as they are written, float64, shape (height, width); colour becomes grey.

    Turned as the file says that it is to be seen.

    Raises
    ------
    InvalidInput
        If the file cannot be read as an image.
    """
    image, _ = decoded(path)
    if image.ndim == 3:
        image = _grey(path, image)
    with np.errstate(invalid="ignore"):  # signalling NaNs
        return image.astype(float)


def decoded(path: Path) -> tuple[np.ndarray, Header]:
    """The numbers in an image file, (height, width) or (height, width, channels), and what else it says.

    Channels are blue, green, red, as OpenCV has them.

    Raises
    ------
    InvalidInput
        If the file cannot be read as an image.
    """
    try:
        image, told = (_array(path), Header(())) if path.suffix.lower() == ".npy" else _decoded(path)
    except Unreadable as error:
        raise InvalidInput(f"{path} must be a readable image, got: {error.reason}") from None
    except InvalidInput:
        raise
    except (OSError, ValueError, EOFError, SyntaxError, TokenError, MemoryError, OverflowError, cv2.error) as error:
        reason = getattr(error, "strerror", None) or (str(error).splitlines() or [type(error).__name__])[0]
        raise InvalidInput(f"{path} must be a readable image, got: {reason}") from None
    if image is None or image.ndim not in (2, 3) or image.dtype.kind not in "uif" or not image.size:
        raise InvalidInput(f"{path} must be a readable image, got something else")
    return turned(image, told.orientation), told


def _array(path: Path) -> np.ndarray:
    """What a .npy file holds; its header is not believed before the file is as large as it says."""
    with opened(path, _MOST_BYTES) as (file, size):
        version = np.lib.format.read_magic(file)
        reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, by_columns, kind = reader(file, max_header_size=10_000)
        _check_size(path, shape)
        if kind.hasobject or math.prod(shape) * kind.itemsize > size:
            raise ValueError("objects, or fewer bytes than its header tells")
        flat = np.frombuffer(file.read(math.prod(shape) * kind.itemsize), kind)
        return flat.reshape(shape, order="F" if by_columns else "C")


def _decoded(path: Path) -> tuple[np.ndarray | None, Header]:
    data = read_bytes(path, _MOST_BYTES)
    told = header(data)
    _check_size(path, told.size)
    with _silent():
        return (cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None), told


def _grey(path: Path, image: np.ndarray) -> np.ndarray:
    """Grey levels of (height, width, channels): OpenCV's order for files that it reads, of three or four channels."""
    if image.shape[2] == 1:
        return image[:, :, 0]
    if image.shape[2] not in (3, 4) or image.dtype not in (np.uint8, np.uint16, np.float32, np.float64):
        raise InvalidInput(f"{path} must be an image of one or three channels, got shape {image.shape} {image.dtype}")
    kind = np.float32 if image.dtype == np.float64 else image.dtype
    return cv2.cvtColor(np.ascontiguousarray(image[:, :, :3], kind), cv2.COLOR_BGR2GRAY)


@contextmanager
def _silent() -> Iterator[None]:
    """The decoders' own lines about broken files, written by C code, are not shown: ours is the one line."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _check_size(path: Path, shape: tuple[int, ...]) -> None:
    if math.prod(shape) > _MOST_PIXELS:
        raise InvalidInput(f"{path} must be an image of at most {_MOST_PIXELS} pixels, got more")
