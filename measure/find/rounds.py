"""An ellipse from a closed outline: brought to where the image is steepest, and what speaks for it."""

from __future__ import annotations

import cv2
import numpy as np

from measure.features.conic import along_axes, nearly_away
from measure.find.candidate import CIRCLE, ELLIPSE, Candidate, ellipse_outline
from measure.find.coarse import Coarse
from measure.find.support import contrast, sign_of, steepest, texture

_LEAST_AXIS = 5.0  # px, the shorter semi-axis
_LEAST_RATIO = 0.1  # of the axes
_DEVIATION = 1.0, 0.05  # px, and part of the shorter semi-axis: how far an outline may be from the ellipse
_RESIDUAL = 0.6, 0.02  # the same of the steepest places, root mean square
_SUPPORT = 0.7
_ROUND = 0.02, 1.0  # difference of the axes over the longer, and px, up to which it may be a circle


def ellipse(outline: np.ndarray) -> np.ndarray | None:
    """x, y, a, b and angle of the ellipse that fits an outline (n, 2), (5,); None if there is none."""
    (x, y), (width, height), angle = cv2.fitEllipseDirect(outline)
    a, b, turn = (width / 2, height / 2, angle) if width >= height else (height / 2, width / 2, angle + 90)
    found = np.array([x, y, a, b, turn % 180])
    return found if np.isfinite(found).all() and b >= max(_LEAST_AXIS, _LEAST_RATIO * a) else None


def deviation(outline: np.ndarray, parameters: np.ndarray) -> tuple[float, float]:
    """Root mean square and 95 % quantile of an outline's distances from an ellipse, to first order, px."""
    some = outline[:: max(len(outline) // 200, 1)].astype(float)
    away = np.abs(nearly_away(some, parameters))
    return float(np.sqrt(np.mean(away**2))), float(np.sort(away)[int(0.95 * (len(away) - 1))])


def near(parameters: np.ndarray, away: float) -> bool:
    """Whether a deviation's quantile is one of an ellipse."""
    return away <= max(_DEVIATION[0], _DEVIATION[1] * parameters[3])


def rounded(coarse: Coarse, parameters: np.ndarray) -> Candidate | None:
    """The circle or ellipse near x, y, a, b, angle, coarse px; None where a person would see none."""
    for reach in (4.0, 2.0):
        reach = min(reach, parameters[3] / 2)
        places, normals = _outline(parameters)
        seen = steepest(coarse, places, normals, sign_of(coarse, places, normals), reach)
        if seen.counts.sum() < max(8, _SUPPORT * len(places)):
            return None
        parameters = ellipse((places + seen.offsets[:, None] * normals)[seen.counts].astype(np.float32))
        if parameters is None or not _inside(parameters, coarse.size):
            return None
    places, normals = _outline(parameters)
    sign = sign_of(coarse, places, normals)
    seen = steepest(coarse, places, normals, sign, min(2.0, parameters[3] / 3))
    if seen.support < _SUPPORT or seen.straightness > max(_RESIDUAL[0], _RESIDUAL[1] * parameters[3]):
        return None
    if texture(coarse, places, normals, np.pi * parameters[2] * parameters[3]):
        return None
    step = contrast(coarse, places, normals)
    length = np.linalg.norm(np.roll(places, -1, 0) - places, axis=1).sum()
    a, b = parameters[2:4]
    kind = CIRCLE if a - b < max(_ROUND[0] * a, _ROUND[1]) else ELLIPSE
    fine = np.concatenate([coarse.fine(parameters[:2]), parameters[2:4] * coarse.factor, parameters[4:]])
    score = float(abs(step) * seen.support * np.sqrt(length))
    return Candidate(kind, ellipse_outline(fine), seen.support, step, score, fine)


def _outline(parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (m, 2) about evenly spaced along an ellipse, and outward unit normals (m, 2)."""
    fine = ellipse_outline(parameters, 721)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0, append=fine[:1]), axis=1))])
    count = int(np.clip(length[-1] / 1.5, 24, 240))
    closed = np.concatenate([fine, fine[:1]])
    places = np.stack([np.interp(length[-1] * np.arange(count) / count, length, closed[:, i]) for i in (0, 1)], 1)
    u, v = along_axes(places, parameters)
    angle, (a, b) = np.radians(parameters[4]), parameters[2:4]
    nu, nv = u / a**2, v / b**2
    normals = np.stack([np.cos(angle) * nu - np.sin(angle) * nv, np.sin(angle) * nu + np.cos(angle) * nv], 1)
    return places, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _inside(parameters: np.ndarray, size: np.ndarray) -> bool:
    points = ellipse_outline(parameters)
    return bool((points > 1).all() and (points < size - 2).all())
