"""Cones and cylinders through the corners of facets: a chord of their border is no straight line of the surface.

Where a plane cuts a cone, a file may have one chord for the whole curve, which nothing but the surface tells from a
straight edge. Corners of facets lie on the surface as exactly as a file holds places, middles of chords do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes.parts.chains import Chains
from scenes.parts.surfaces import axes_beside

_SIDES = 4  # of a facet, at most: those of more are planes that a surface continues
_CORNERS = 10  # that tell a surface: its six numbers and more
_STEPS, _STEP = 20, 0.3  # of Gauss-Newton's method, at most; of the surface's size, each at most
_EXACT = 1e-9  # of the surface's size: a step that changes nothing that single precision shows
_TOLD = 1e-4  # smallest over largest singular value of what tells the six numbers
_ON = 0.5  # of what single precision leaves of two places: how far corners may lie off a surface that is told


@dataclass(frozen=True, eq=False)
class Axial:
    """A cone, or a cylinder: its radius changes by ``slope`` along the axis (3,) from ``radius`` at ``point`` (3,)."""

    point: np.ndarray
    axis: np.ndarray
    radius: float
    slope: float

    def off(self, points: np.ndarray) -> np.ndarray:
        """How far outside of it points (n, 3) lie, (n,)."""
        away = points - self.point
        along = away @ self.axis
        around = np.linalg.norm(away - along[:, None] * self.axis, axis=-1)
        return (around - self.radius - self.slope * along) / np.hypot(1, self.slope)

    @classmethod
    def through(cls, points: np.ndarray, normals: np.ndarray) -> Axial | None:
        """The nearest one to points (n, 3), by least squares; ``normals`` (m, 3) of its facets say about which way its
        axis runs. None where the points do not tell it.

        Examples
        --------
        >>> turn, along = np.meshgrid(np.linspace(0, 2, 6), [0.0, 1, 3])
        >>> around = (2 + 0.5 * along) * np.stack([np.cos(turn), np.sin(turn)])
        >>> points = np.stack([*around, along], -1).reshape(-1, 3)
        >>> normals = np.stack([np.cos(turn), np.sin(turn), 0 * turn - 0.5], -1).reshape(-1, 3)
        >>> found = Axial.through(points, normals)
        >>> round(abs(float(found.slope)), 9), bool(np.abs(found.off(points)).max() < 1e-12)
        (0.5, True)
        """
        if len(points) < _CORNERS:
            return None
        middle = points.mean(0)
        size = float(np.abs(points - middle).max())
        found = cls._near((points - middle) / size, normals)
        for _ in range(_STEPS):
            if found is None:
                return None
            found, step, told = found._better((points - middle) / size)
            if step <= _EXACT:
                break
        if step > _EXACT or told < _TOLD:
            return None
        return cls(middle + size * found.point, found.axis, size * found.radius, found.slope)

    @classmethod
    def _near(cls, points: np.ndarray, normals: np.ndarray) -> Axial | None:
        """To begin with: the axis as square to all differences of the normals as can be, the rest linear."""
        axis = np.linalg.svd(normals - normals.mean(0), full_matrices=len(normals) < 3)[2][2]
        beside = np.stack(axes_beside(axis))
        flat, along = points @ beside.T, points @ axis
        design = np.column_stack([2 * flat, along, along**2, np.ones(len(along))])
        x, y, change, _, squared = np.linalg.lstsq(design, (flat**2).sum(1))[0]
        if squared + x**2 + y**2 <= 0:
            return None
        radius = float(np.sqrt(squared + x**2 + y**2))
        return cls(np.array([x, y]) @ beside, axis, radius, float(change / (2 * radius)))

    def _better(self, points: np.ndarray) -> tuple[Axial | None, float, float]:
        """A step nearer, how large it is, and how well its six numbers are told."""
        beside = np.stack(axes_beside(self.axis))
        away = points - self.point
        along = away @ self.axis
        across = away - along[:, None] * self.axis
        around, width = np.linalg.norm(across, axis=1), np.hypot(1, self.slope)
        if not around.min() > 0:
            return None, np.inf, 0.0
        off, out = (around - self.radius - self.slope * along) / width, across @ beside.T / around[:, None]
        tilts = -along[:, None] * out - self.slope * (across @ beside.T)
        slopes = np.column_stack([-out, tilts, -np.ones(len(along)), -along - off * self.slope / width]) / width
        left, told, right = np.linalg.svd(slopes, full_matrices=False)
        step = right.T @ (-(left.T @ off) / np.maximum(told, _TOLD**2 * told[0]))
        step /= max(1.0, np.abs(step).max() / _STEP)
        axis = self.axis + step[2:4] @ beside
        point, axis = self.point + step[:2] @ beside, axis / np.linalg.norm(axis)
        found = Axial(point, axis, self.radius + step[4], self.slope + step[5])
        return found, float(np.abs(step).max()), float(told[-1] / told[0])


def chords(
    vertices: np.ndarray, shape: Chains, normals: np.ndarray, region: np.ndarray, smooth: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """Which of the asked chains are chords of the border of a cone or cylinder; bool, shape (C,).

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
    shape : Chains
    normals : ndarray, shape (F, 3)
    region : ndarray of int, shape (F,)
        Number of the curved surface that each face is a facet of, -1 for others.
    smooth, asked : ndarray of bool, shape (C,)
        Chains inside of curved surfaces, and those that may be straight edges.
    """
    small = np.bincount(shape.faces.ravel(), minlength=len(region)) <= _SIDES
    of = _beside_facets(shape, region, smooth)
    own = of[shape.faces]
    likely = asked & ((own >= 0) & small[shape.faces]).any(1)
    found = np.zeros(len(asked), bool)
    for number in np.setdiff1d(own[likely], [-1]):
        inside = (region[shape.faces] == number).any(1)
        corners = vertices[np.unique(shape.ends[inside])]
        surface = Axial.through(corners, normals[region == number])
        near = _ON * shape.unsure
        if surface is None or np.abs(surface.off(corners)).max() > near:
            continue
        rows = np.flatnonzero(likely & ((own == number) & small[shape.faces]).any(1))
        ends = vertices[shape.ends[rows]]
        on = np.abs(surface.off(ends.reshape(-1, 3))).reshape(-1, 2).max(1) <= near
        found[rows] |= on & (np.abs(surface.off(ends.mean(1))) > shape.unsure)
    return found


def _beside_facets(shape: Chains, region: np.ndarray, smooth: np.ndarray) -> np.ndarray:
    """The same numbers, and those of the surfaces that other faces continue smoothly."""
    found = region.copy()
    for side in (0, 1):
        here, other = shape.faces[smooth, side], shape.faces[smooth, 1 - side]
        rows = (region[here] < 0) & (region[other] >= 0)
        found[here[rows]] = region[other[rows]]
    return found
