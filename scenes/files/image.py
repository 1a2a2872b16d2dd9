"""Images from files: 8 and 16 bit PNG, TIFF and JPEG, float TIFF, and NumPy's .npy."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tokenize import TokenError
from typing import NamedTuple

import cv2
import numpy as np

from scenes.cameras.pinhole import MOST_PIXELS as _MOST_PIXELS
from scenes.cameras.pinhole import Camera
from scenes.errors import InvalidInput
from scenes.files.door import Unreadable, opened, read_bytes
from scenes.files.header import Header, header, turned

_MOST_BYTES = 8 * _MOST_PIXELS + 10_000  # the largest image as float64, with a header


class WrongSize(InvalidInput):
    """An image that has not the size of what it is to go with."""


class Size(NamedTuple):
    """Of an image, px, and what has it."""

    height: int
    width: int
    of: str = "the camera"

    @classmethod
    def of_camera(cls, camera: Camera) -> Size:
        return cls(camera.height, camera.width)


def read(path: Path, size: Size | None = None) -> np.ndarray:
    """Grey levels of an image file as they are written, float64, shape (height, width); colour becomes grey.

    Turned as the file says that it is to be seen.

    Raises
    ------
    InvalidInput
        If the file cannot be read as an image, or has not the given size.
    """
    image, _ = decoded(path, size)
    if image.ndim == 3:
        image = _grey(path, image)
    with np.errstate(invalid="ignore"):  # signalling NaNs
        return image.astype(float)


def decoded(path: Path, size: Size | None = None) -> tuple[np.ndarray, Header]:
    """The numbers in an image file, (height, width) or (height, width, channels), and what else it says.

    Channels are blue, green, red, as OpenCV has them. Where its header tells of another size nothing is decoded.

    Raises
    ------
    InvalidInput
        If the file cannot be read as an image; `WrongSize` if it has not the given size.
    """
    try:
        image, told = (_array(path, size), Header(())) if path.suffix.lower() == ".npy" else _decoded(path, size)
    except Unreadable as error:
        raise InvalidInput(f"{path} must be a readable image, got: {error.reason}") from None
    except InvalidInput:
        raise
    except (OSError, ValueError, EOFError, SyntaxError, TokenError, MemoryError, OverflowError, cv2.error) as error:
        reason = getattr(error, "strerror", None) or (str(error).splitlines() or [type(error).__name__])[0]
        raise InvalidInput(f"{path} must be a readable image, got: {reason}") from None
    if image is None or image.ndim not in (2, 3) or image.dtype.kind not in "uif" or not image.size:
        raise InvalidInput(f"{path} must be a readable image, got something else")
    image = turned(image, told.orientation)
    if size is not None and image.shape[:2] != size[:2]:
        raise _wrong(path, size, image.shape)
    return image, told


def _array(path: Path, size: Size | None) -> np.ndarray:
    """What a .npy file holds; its header is not believed before the file is as large as it says."""
    with opened(path, _MOST_BYTES) as (file, length):
        version = np.lib.format.read_magic(file)
        reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, by_columns, kind = reader(file, max_header_size=10_000)
        _check_size(path, shape, size)
        if kind.hasobject or math.prod(shape) * kind.itemsize > length:
            raise ValueError("objects, or fewer bytes than its header tells")
        flat = np.frombuffer(file.read(math.prod(shape) * kind.itemsize), kind)
        return flat.reshape(shape, order="F" if by_columns else "C")


def _decoded(path: Path, size: Size | None) -> tuple[np.ndarray | None, Header]:
    data = read_bytes(path, _MOST_BYTES)
    told = header(data)
    _check_size(path, told.size[::-1], size)
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


def _check_size(path: Path, shape: tuple[int, ...], size: Size | None) -> None:
    """What a header says, before any pixel is looked at; it may still be turned."""
    if math.prod(shape) > _MOST_PIXELS:
        raise InvalidInput(f"{path} must be an image of at most {_MOST_PIXELS} pixels, got more")
    if size is not None and len(shape) > 1 and sorted(shape[:2]) != sorted(size[:2]):
        raise _wrong(path, size, shape)


def _wrong(path: Path, size: Size, shape: tuple[int, ...]) -> WrongSize:
    return WrongSize(f"{path} must be {size.width} x {size.height} px as {size.of}, got {shape[1]} x {shape[0]}")
