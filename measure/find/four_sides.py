"""A quadrilateral from a closed outline: its corners brought to where the image is steepest, and what speaks for it."""

from __future__ import annotations

import cv2
import numpy as np

from measure.features.corners import corners_through
from measure.find.candidate import QUADRILATERAL, Candidate
from measure.find.coarse import Coarse
from measure.find.support import contrast, sign_of, steepest, texture

_TOLERANCES = (0.01, 0.02, 0.03, 0.05)  # of the length, when an outline is made a polygon
_LEAST_SIDE = 8.0  # px
_ANGLES = np.cos(np.radians([25.0, 155.0]))  # of a corner: smallest and largest
_DEVIATION = 1.5, 0.02  # px, and part of a side: how far an outline may be from the sides
_STRAIGHT = 0.8, 0.006  # the same of the steepest places, root mean square
_SUPPORT = 0.8  # part of each side with an edge
_GAP = 3.0, 0.03  # px, and part of a side, without one
_BALANCE = 0.1  # weakest side's slope over the strongest side's
_BEYOND = np.arange(2.0, 10.0)  # px beyond a corner: where a side goes on, it does so without a gap
_SEEN = 0.5  # slope there over the side's


def polygon(outline: np.ndarray) -> np.ndarray | None:
    """Four corners (4, 2) of an outline (n, 2); None if it has not four."""
    hull = cv2.convexHull(outline)
    length = cv2.arcLength(hull, True)
    for tolerance in _TOLERANCES:
        corners = cv2.approxPolyDP(hull, tolerance * length, True)[:, 0].astype(float)
        if len(corners) <= 4:
            return corners if len(corners) == 4 and shaped(corners) else None
    return None


def deviation(outline: np.ndarray, corners: np.ndarray) -> tuple[float, float]:
    """Root mean square and 95 % quantile of the distances of an outline's points (n, 2) from the nearest side, px."""
    some = outline[:: max(len(outline) // 200, 1)].astype(float)
    along = np.roll(corners, -1, 0) - corners
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    away = np.abs(some @ normals.T - (corners * normals).sum(1)).min(1)
    return float(np.sqrt(np.mean(away**2))), float(np.sort(away)[int(0.95 * (len(away) - 1))])


def near(corners: np.ndarray, away: float) -> bool:
    """Whether a deviation's quantile is one of a quadrilateral."""
    return away <= max(_DEVIATION[0], _DEVIATION[1] * np.sqrt(cv2.contourArea(corners.astype(np.float32))))


def shaped(corners: np.ndarray) -> bool:
    """Whether sides are long enough and angles neither sharp nor flat."""
    along = np.roll(corners, -1, 0) - corners
    length = np.linalg.norm(along, axis=1)
    if not (length >= _LEAST_SIDE).all() or not cv2.isContourConvex(corners.astype(np.float32)):
        return False
    cosine = -(along * np.roll(along, 1, 0)).sum(1) / (length * np.roll(length, 1))
    return bool((cosine < _ANGLES[0]).all() and (cosine > _ANGLES[1]).all())


def four_sides(coarse: Coarse, corners: np.ndarray) -> Candidate | None:
    """The quadrilateral near corners (4, 2), coarse px; None where a person would see none.

    All four sides are straight, each with an edge of one sign nearly everywhere and ends where they meet the next side.
    """
    for reach in (4.0, 2.0):
        corners = _moved(coarse, corners, reach)
        if corners is None:
            return None
    places, normals, piece, lengths = _sides(corners, 1.0 / 40)
    signs = _signs(coarse, places, normals, piece)
    seen = steepest(coarse, places, normals, signs[piece], 1.5, piece)
    supports, contrasts, slopes = np.empty(4), np.empty(4), np.empty(4)
    for side in range(4):
        of = piece == side
        one = type(seen)(seen.offsets[of], seen.slopes[of], seen.counts[of])
        supports[side], slopes[side] = one.support, np.median(one.slopes)
        spacing = lengths[side] / of.sum()
        if one.support < _SUPPORT or one.longest_gap * spacing > max(_GAP[0], _GAP[1] * lengths[side]):
            return None
        if one.straightness > max(_STRAIGHT[0], _STRAIGHT[1] * lengths[side]):
            return None
        contrasts[side] = contrast(coarse, places[of], normals[of])
    if slopes.min() < _BALANCE * slopes.max() or _goes_on(coarse, corners, signs, slopes):
        return None
    if texture(coarse, places, normals, cv2.contourArea(corners.astype(np.float32))):
        return None
    weakest = contrasts[np.argmin(np.abs(contrasts))]
    score = abs(weakest) * supports.min() * np.sqrt(lengths.sum())
    corners = np.roll(corners, -int(np.argmin(corners.sum(1))), axis=0)
    return Candidate(QUADRILATERAL, coarse.fine(corners), float(supports.min()), float(weakest), float(score))


def _sides(corners: np.ndarray, left_out: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places along the sides (m, 2), outward normals (m, 2), which side (m,), and the sides' lengths (4,)."""
    along = np.roll(corners, -1, 0) - corners
    lengths = np.linalg.norm(along, axis=1)
    turning = _turning(corners)
    outward = turning * np.stack([along[:, 1], -along[:, 0]], 1) / lengths[:, None]
    counts = np.clip(lengths.astype(int), 8, 120)
    fractions = [np.linspace(max(left_out, 1.5 / n), 1 - max(left_out, 1.5 / n), k)
                 for n, k in zip(lengths, counts, strict=True)]  # fmt: skip
    places = [corners[i] + f[:, None] * along[i] for i, f in enumerate(fractions)]
    piece = np.repeat(np.arange(4), counts)
    return np.concatenate(places), outward[piece], piece, lengths


def _turning(corners: np.ndarray) -> float:
    """1 or -1: which way round the corners go."""
    return float(np.copysign(1.0, cv2.contourArea(corners.astype(np.float32), True)))


def _moved(coarse: Coarse, corners: np.ndarray, reach: float) -> np.ndarray | None:
    """Corners of lines through the steepest places within ``reach`` px of the sides."""
    places, normals, piece, _ = _sides(corners, 0.1)
    seen = steepest(coarse, places, normals, _signs(coarse, places, normals, piece)[piece], reach, piece)
    points = places + seen.offsets[:, None] * normals
    used = [points[(piece == side) & seen.counts] for side in range(4)]
    if min(map(len, used)) < 4:
        return None
    found, sines = corners_through(used)
    near_enough = sines.min() > 0.1 and np.abs(found - corners).max() < 4 * reach + 4
    inside = near_enough and (found > 1).all() and (found < coarse.size - 2).all()
    return found if inside and shaped(found) else None


def _signs(coarse: Coarse, places: np.ndarray, normals: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """Which way the image changes at each side: a block's face may be brighter than one neighbour and darker than
    another."""
    return np.array([sign_of(coarse, places[piece == side], normals[piece == side]) for side in range(4)])


def _goes_on(coarse: Coarse, corners: np.ndarray, signs: np.ndarray, slopes: np.ndarray) -> bool:
    """Whether a side goes straight on beyond a corner: then it ends elsewhere, and the corner is none of the shape."""
    along = np.roll(corners, -1, 0) - corners
    lengths = np.linalg.norm(along, axis=1)
    turning = _turning(corners)
    for side, length in enumerate(lengths):
        direction = along[side] / length
        outward = turning * np.array([direction[1], -direction[0]])
        for corner, toward in ((corners[side], -direction), (corners[(side + 1) % 4], direction)):
            places = corner + _BEYOND[:, None] * toward
            inside = ((places > 1) & (places < coarse.size - 2)).all(1)
            if inside.sum() < 3:
                continue
            seen = steepest(coarse, places[inside], np.tile(outward, (int(inside.sum()), 1)), signs[side], 1.5)
            if (seen.slopes < max(_SEEN * slopes[side], 4 * coarse.gradient_noise)).sum() < 2:
                return True
    return False
