"""How a photograph changes across an expected outline: where it is steepest, and on what part of the outline."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from measure.find.coarse import Coarse

_STEP = 0.5  # px between the places of a profile
_AVERAGED = 3  # neighbours along the outline
_NOISE, _USUAL = 4.0, 0.25  # standard deviations of the gradient, and part of its median along the side
_AROUND = np.arange(4.0, 8.0)  # px outside an outline, where others may be
_OTHERS = 0.5  # slope of those over the outline's
_SMALL = 24.0  # px, root of the area: up to it a shape among others like it is texture
_MOST_AROUND = 0.2  # part of the surroundings with edges of others
_AWAY = 3.0  # px inside and outside where levels are compared


@dataclass(frozen=True, eq=False)
class Steepest:
    """For places along an outline: how far out the image is steepest (m,), px, how steep it is there (m,), and whether
    that counts as an edge (m,), bool."""

    offsets: np.ndarray
    slopes: np.ndarray
    counts: np.ndarray

    @property
    def support(self) -> float:
        """Part of the places with an edge."""
        return float(self.counts.mean())

    @property
    def longest_gap(self) -> int:
        """Most neighbouring places without an edge."""
        padded = np.concatenate([[True], self.counts, [True]])
        return int(np.diff(np.flatnonzero(padded)).max()) - 1

    @property
    def straightness(self) -> float:
        """Root mean square of the offsets that count, px."""
        return float(np.sqrt(np.mean(self.offsets[self.counts] ** 2))) if self.counts.any() else np.inf


def steepest(
    coarse: Coarse, places: np.ndarray, normals: np.ndarray, sign: int | np.ndarray, reach: float, piece=None
) -> Steepest:
    """The steepest change of one sign along outward normals (m, 2) through places (m, 2), within ``reach`` px.

    The sign is 1 or -1, for all places or for each (m,). What is usual is told along each ``piece`` (m,) by itself
    where pieces are given.
    """
    offsets = np.arange(-reach, reach + _STEP / 2, _STEP)
    rises = cv2.blur(coarse.across(places, normals, offsets), (1, _AVERAGED), borderType=cv2.BORDER_REFLECT)
    profiles = rises * np.broadcast_to(sign, len(places))[:, None]
    best = profiles.argmax(1)
    slopes = profiles[np.arange(len(places)), best]
    if piece is None:
        usual = np.median(slopes)
    else:
        usual = np.array([np.median(slopes[piece == p]) for p in range(int(piece.max()) + 1)])[piece]
    return Steepest(offsets[best], slopes, slopes > np.maximum(_NOISE * coarse.gradient_noise, _USUAL * usual))


def sign_of(coarse: Coarse, places: np.ndarray, normals: np.ndarray) -> int:
    """1 where most of the image grows outwards, else -1."""
    return 1 if coarse.across(places, normals, np.array([-1.0, 0, 1])).sum() >= 0 else -1


def contrast(coarse: Coarse, places: np.ndarray, normals: np.ndarray) -> float:
    """Median difference of levels inside and outside over the noise."""
    steps = coarse.levels(places - _AWAY * normals) - coarse.levels(places + _AWAY * normals)
    return float(np.median(steps)) / max(coarse.noise, 1e-300)


def texture(coarse: Coarse, places: np.ndarray, normals: np.ndarray, area: float) -> bool:
    """Whether a small shape is one of many: leaves, pebbles, letters."""
    if area > _SMALL**2:
        return False
    usual = np.median(np.abs(coarse.across(places, normals, np.zeros(1))))
    return bool((np.hypot(*coarse.slopes(places, normals, _AROUND)) > _OTHERS * usual).mean() > _MOST_AROUND)
