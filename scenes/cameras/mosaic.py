"""A sensor's raw colour mosaic, measured as it is: interpolated pixels would not be independent."""

from __future__ import annotations

import cv2
import numpy as np

from scenes.errors import InvalidInput

PATTERNS = {"RGGB": "RG", "BGGR": "BG", "GRBG": "GR", "GBRG": "GB"}
_CODES = {  # OpenCV names patterns by the second row's second and third pixel
    "RGGB": cv2.COLOR_BayerBG2GRAY, "BGGR": cv2.COLOR_BayerRG2GRAY,
    "GRBG": cv2.COLOR_BayerGB2GRAY, "GBRG": cv2.COLOR_BayerGR2GRAY,
}  # fmt: skip
_UNEVEN = 0.02  # of a channel's share of the light: beyond it the picture has colours
_BLOCK = 8  # px of one colour: means of such squares tell the shares


def bits(image: np.ndarray) -> int:
    """Bits of an integer image's scale: 8, 10, 12, 14 or 16, those that its brightest pixel needs."""
    if image.dtype == np.uint8:
        return 8
    return next((b for b in (8, 10, 12, 14, 16) if int(image.max()) < 2**b), 16)


def balanced(levels: np.ndarray, pattern: str) -> tuple[np.ndarray, str]:
    """A raw mosaic (height, width) with its colours' sensitivities made equal, and what is said of it.

    Where things are grey under one light each pixel then shows it as all others do, and is its own measurement. Where
    colours differ from place to place the mosaic is interpolated by OpenCV, which correlates its noise.

    Raises
    ------
    InvalidInput
        If the pattern is none.
    """
    pattern = pattern.upper()
    if pattern not in PATTERNS:
        raise InvalidInput(f"--bayer must be one of {', '.join(PATTERNS)}, got {pattern!r}")
    planes = {place: _blocks(levels[place[0] :: 2, place[1] :: 2]) for place in np.ndindex(2, 2)}
    mean, spread = sum(blocks.mean(-1) for blocks in planes.values()) / 4, planes[0, 0].std(-1)
    even = (spread <= 2 * np.median(spread)) & (mean > 0.05 * mean.max())  # no edges
    shares = {place: blocks.mean(-1)[even] / mean[even] for place, blocks in planes.items()}
    middle = {place: float(np.median(share)) for place, share in shares.items()}
    if max(float(np.percentile(np.abs(share / middle[p] - 1), 90)) for p, share in shares.items()) > _UNEVEN:
        whole = levels if levels.dtype in (np.uint8, np.uint16) else np.clip(np.rint(levels), 0, 65535)
        return cv2.cvtColor(np.ascontiguousarray(whole.astype(np.uint16)), _CODES[pattern]), "interpolated mosaic"
    found = levels.astype(np.float32)
    for place, share in middle.items():
        found[place[0] :: 2, place[1] :: 2] /= share
    return found, "the mosaic itself, its colours balanced"


def _blocks(plane: np.ndarray) -> np.ndarray:
    """One colour's pixels in squares, (n, pixels of each)."""
    height, width = (size // _BLOCK * _BLOCK for size in plane.shape)
    if not height or not width:
        raise InvalidInput(f"--bayer must go with an image of at least {2 * _BLOCK} px, got {plane.shape}")
    blocks = plane[:height, :width].astype(np.float32).reshape(height // _BLOCK, _BLOCK, -1, _BLOCK)
    return blocks.swapaxes(1, 2).reshape(-1, _BLOCK**2)
