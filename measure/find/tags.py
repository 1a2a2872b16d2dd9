"""AprilTag and ArUco tags among the quadrilaterals of a photograph, read by OpenCV."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np

from measure.find.candidate import QUADRILATERAL, TAG, Candidate

FAMILIES = {
    "APRILTAG_36h11": 6, "APRILTAG_25h9": 5, "APRILTAG_16h5": 4, "4X4_1000": 4, "5X5_1000": 5, "6X6_1000": 6,
    "7X7_1000": 7, "ARUCO_ORIGINAL": 5,
}  # fmt: skip
"""Cells along a side inside the black border, which is one cell wide."""
_AROUND = 0.3  # of a tag's size: margin of what OpenCV sees
_ENOUGH = 160  # px along the longer side of what OpenCV sees
_LEAST = 12.0  # px along a side
_PATTERN = 0.4  # difference of bright and dark cells over that of inside and outside; a plain square has none
_AWAY = 2.0, 0.08  # px, and part of the size: how far OpenCV's corners may be from ours


@lru_cache(maxsize=1)
def _detector() -> cv2.aruco.ArucoDetector:
    settings = cv2.aruco.DetectorParameters()
    settings.errorCorrectionRate = 0.0  # in so many dictionaries something is always near
    settings.minMarkerPerimeterRate = 0.5
    settings.maxErroneousBitsInBorderRate = 0.1
    names = [cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}")) for name in FAMILIES]
    return cv2.aruco.ArucoDetector(names, settings)


def tag(image: np.ndarray, found: Candidate) -> Candidate:
    """A quadrilateral, or the tag that it is: corners then in the tag's own order, number and family known."""
    if found.kind != QUADRILATERAL or found.contrast > 0 or min(found.sizes) < _LEAST:
        return found
    size = max(found.sizes)
    low = np.maximum(np.floor(found.outline.min(0) - _AROUND * size), 0).astype(int)
    high = np.minimum(np.ceil(found.outline.max(0) + _AROUND * size).astype(int) + 1, image.shape[::-1])
    part = np.asarray(image[low[1] : high[1], low[0] : high[0]], np.float32)
    scale = min(1.0, _ENOUGH / max(part.shape))
    small = part if scale == 1 else cv2.resize(part, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    dark, bright = np.percentile(small, [1, 99])
    if not _patterned(small, (found.outline - low + 0.5) * scale - 0.5, float(bright - dark)):
        return found
    grey = np.clip((small - dark) * (255 / max(float(bright - dark), 1e-300)), 0, 255).astype(np.uint8)
    corners, numbers, _, families = _detector().detectMarkersMultiDict(grey)
    for places, number, family in zip(corners, _flat(numbers), _flat(families), strict=True):
        fine = (places.reshape(4, 2) + 0.5) / scale - 0.5 + low
        order = [int(np.linalg.norm(found.outline - corner, axis=1).argmin()) for corner in fine]
        away = np.linalg.norm(found.outline[order] - fine, axis=1).max()
        if sorted(order) == [0, 1, 2, 3] and away < max(_AWAY[0], _AWAY[1] * size):
            name = list(FAMILIES)[family]
            return replace(found, kind=TAG, outline=found.outline[order], identifier=number, family=name)
    return found


def _patterned(part: np.ndarray, corners: np.ndarray, range_: float) -> bool:
    """Whether the inside of a quadrilateral (4, 2) has cells, within the black border."""
    middle = corners.mean(0)
    inside = np.zeros(part.shape, np.uint8)
    cv2.fillConvexPoly(inside, np.rint(middle + 0.6 * (corners - middle)).astype(int), 1)
    dark, bright = np.percentile(part[inside > 0], [5, 95])
    return bool(bright - dark > _PATTERN * range_)


def _flat(values: np.ndarray | None) -> list[int]:
    return [] if values is None else [int(value) for value in np.ravel(values)]
