"""The contour of a surface: the points at which lines of sight touch it.

There the normal N is across the line of sight: N . (e - s X) = 0, (e, s) the eye (`scenes.viewpoint`), a place or at
infinity. On a quadric these points lie in the eye's polar plane; on a cone or a cylinder they are two lines, on a
sphere a circle, on a torus one or two points a meridian.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from typing import Protocol

import numpy as np

from imaging.contours.quadrics import quadric_branches
from imaging.contours.statuses import DEGENERATE, INSIDE, OK, TANGENT
from imaging.contours.tori import torus_branches
from scenes.parts.surfaces import Quadric, Sphere, Surface, Torus, axes_beside
from scenes.parts.surfaces.ruled import Ruled
from scenes.viewpoint import Viewpoint

_NEAR = 1e-12  # of the radius: an eye no farther from a surface stands on it
_LONGEST = 1e3  # distances of the eye: where a line without an end is cut


class Branch(Protocol):
    """A piece of a contour by a parameter from 0 to 1; ``closed`` where its ends are one."""

    closed: bool

    def points(self, u: np.ndarray) -> np.ndarray:
        """Points (n, 3) at parameters (n,)."""


@dataclass(frozen=True)
class Contour:
    """Pieces of the contour, seen or not; none unless the status is ``ok``."""

    status: str
    branches: tuple[Branch, ...] = ()


@dataclass(frozen=True, eq=False)
class Segment:
    """A straight piece, from one end to the other."""

    start: np.ndarray
    stop: np.ndarray
    closed: bool = False

    def points(self, u: np.ndarray) -> np.ndarray:
        """Points (n, 3)."""
        return self.start + np.asarray(u)[:, None] * (self.stop - self.start)


@dataclass(frozen=True, eq=False)
class Round:
    """A circle, from its two half axes."""

    centre: np.ndarray
    one: np.ndarray
    two: np.ndarray
    closed: bool = True

    def points(self, u: np.ndarray) -> np.ndarray:
        """Points (n, 3)."""
        angle = 2 * np.pi * np.asarray(u)[:, None]
        return self.centre + np.cos(angle) * self.one + np.sin(angle) * self.two


def contour(surface: Surface, eye: Viewpoint | np.ndarray) -> Contour:
    """The contour of a surface from an eye, or a place (3,).

    Trimmed at the surface's ends; whether other surfaces hide it is not asked.
    """
    return _contour(surface, Viewpoint.of(eye))


@singledispatch
def _contour(surface: Surface, eye: Viewpoint) -> Contour:
    return Contour(DEGENERATE)


@_contour.register
def _(surface: Sphere, eye: Viewpoint) -> Contour:
    """Where N . (e - s c) = s r, c the centre, r the radius."""
    away, near = eye.towards(surface.centre), eye.share * surface.radius
    far = float(np.linalg.norm(away))
    over = (far - abs(near)) / surface.radius
    if over <= _NEAR:
        return Contour(INSIDE if over < -_NEAR else TANGENT)
    axis, share = away / far, near / far
    wide = surface.radius * np.sqrt((far - near) * (far + near)) / far
    one, two = axes_beside(axis)
    return Contour(OK, (Round(surface.centre + surface.radius * share * axis, wide * one, wide * two),))


@_contour.register
def _(wall: Ruled, eye: Viewpoint) -> Contour:
    """Two generators, at the angles phi from the eye's radial with cos(phi) = r(z_e) / rho.

    r(z_e) is the radius at the eye's height, rho the eye's distance from the axis; of an eye at infinity the slope
    times its direction's part along the axis, over that across.
    """
    height, far, radial = (np.asarray(v) for v in wall.split(wall.point + eye.towards(wall.point)))
    wide = eye.share * wall.radius + wall.slope * float(height)
    over = (float(far) - abs(wide)) / wall.radius
    if over <= _NEAR:
        return Contour(TANGENT if over >= -_NEAR and far > 0 else INSIDE)
    cosine, sine = wide / far, np.sqrt((far - wide) * (far + wide)) / far
    beside = np.cross(wall.axis, radial)
    long = _LONGEST * (np.linalg.norm(eye.towards(wall.point)) + wall.radius)
    low, high = np.clip(wall.ends, -long, long)
    branches = []
    for side in (-1.0, 1.0):
        toward = cosine * radial + side * sine * beside
        ends = [wall.point + z * wall.axis + (wall.radius + wall.slope * z) * toward for z in (low, high)]
        branches.append(Segment(*ends))
    return Contour(OK, tuple(branches))


@_contour.register
def _(surface: Torus, eye: Viewpoint) -> Contour:
    return Contour(*torus_branches(surface, eye))


@_contour.register
def _(surface: Quadric, eye: Viewpoint) -> Contour:
    return Contour(*quadric_branches(surface, eye))
