"""The contour of a torus, in closed form.

In the meridian plane at the angle theta the tube is a circle, and the projection of e - s M, (e, s) the eye and M the
circle's middle, is (p, q). The normal (cos psi, sin psi) is across the line of sight where p cos psi + q sin psi = s r:
one angle psi each side of the eye's, if the projection is outside the circle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.contours.statuses import INSIDE, OK, TANGENT
from scenes.parts.surfaces import Torus, axes_beside
from scenes.viewpoint import Viewpoint

_NEAR = 1e-12  # of the tube
_WHOLE = 1e-9  # rad: arcs less wide are none


@dataclass(frozen=True, eq=False)
class Meridians:
    """Meridian angles middle + half cos(2 pi u), psi on the side of sin(2 pi u), or all on one ``side``."""

    torus: Torus
    eye: Viewpoint
    middle: float
    half: float
    side: float
    closed: bool = True

    def points(self, u: np.ndarray) -> np.ndarray:
        """Points (n, 3)."""
        turn = 2 * np.pi * np.asarray(u)
        angle = self.middle + (turn if self.side else self.half * np.cos(turn))
        side = self.side if self.side else np.where(np.sin(turn) >= 0, 1.0, -1.0)
        torus, away = self.torus, self.eye.towards(self.torus.centre)
        one, two = _axes(torus, away)
        radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
        out, up = radial @ away - self.eye.share * torus.radius, float(away @ torus.axis)
        share = np.clip(self.eye.share * torus.tube / np.hypot(out, up), -1.0, 1.0)
        over = np.arctan2(up, out) + side * np.arccos(share)
        wide = torus.radius + torus.tube * np.cos(over)
        return torus.centre + wide[:, None] * radial + (torus.tube * np.sin(over))[:, None] * torus.axis


def torus_branches(torus: Torus, eye: Viewpoint) -> tuple[str, tuple[Meridians, ...]]:
    """Status and branches from an eye."""
    if eye.share:
        over = float(torus.values(eye.at / eye.share)) * (-1 if torus.hollow else 1) / torus.tube
        if over <= _NEAR:
            return (INSIDE if over < -_NEAR else TANGENT), ()
    away, share = eye.towards(torus.centre), abs(eye.share)
    up = float(away @ torus.axis)
    far = float(np.linalg.norm(away - up * torus.axis))
    if abs(up) >= share * torus.tube:
        return OK, tuple(Meridians(torus, eye, 0.0, np.pi, side) for side in (-1.0, 1.0))
    half = np.sqrt((share * torus.tube - up) * (share * torus.tube + up))
    least, most = ((eye.share * torus.radius + s * half) / far if far > 0 else np.inf for s in (-1, 1))
    near, beyond = (float(np.arccos(min(c, 1.0))) for c in (most, least))  # no contour between these angles
    if beyond - near <= _WHOLE:
        return OK, tuple(Meridians(torus, eye, 0.0, np.pi, side) for side in (-1.0, 1.0))
    arcs = [(0.0, near), (np.pi, np.pi - beyond)]
    return OK, tuple(Meridians(torus, eye, middle, width, 0.0) for middle, width in arcs if width > _WHOLE)


def _axes(torus: Torus, away: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors across the axis: the first towards the eye, from which the meridians' angles count."""
    beside = away - (away @ torus.axis) * torus.axis
    size = np.linalg.norm(beside)
    one = beside / size if size > _NEAR * torus.radius else axes_beside(torus.axis)[0]
    return one, np.cross(torus.axis, one)
