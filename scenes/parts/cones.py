"""Cones and cylinders through the corners of facets: a chord of their border is no straight line of the surface.

Where a plane cuts a cone, a file may have one chord for the whole curve, which nothing but the surface tells from a
straight edge. Corners of facets lie on the surface as exactly as a file holds places, middles of chords do not.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from scenes.parts.chains import SINGLE, Chains
from scenes.parts.surfaces import axes_beside

_SIDES = 4  # of a facet, at most: those of more are planes that a surface continues
_CORNERS = 8  # that tell a surface: two more than its six numbers, which no other surface's lie on by chance
_STEPS, _STEP = 20, 0.3  # of Gauss-Newton's method, at most; of the surface's size, each at most
_EXACT = 1e-9  # of the surface's size: a step that changes nothing that single precision shows
_TOLD = 1e-8  # of the largest singular value of what tells the six numbers: less tells nothing
_ON = 0.5  # of what single precision leaves of two places: how far corners may lie off a surface that is told


@dataclass(frozen=True, eq=False)
class Axial:
    """A cone, as flat as it likes, or a cylinder.

    Of places on it cos a times the way from the axis, less sin a times that along it, is ``apart``.

    Attributes
    ----------
    point, axis : ndarray, shape (3,)
    angle : float
        a, half the cone's, 0 of a cylinder, rad.
    apart : float
        Of a cylinder, the radius.
    """

    point: np.ndarray
    axis: np.ndarray
    angle: float
    apart: float

    def off(self, points: np.ndarray) -> np.ndarray:
        """How far outside of it points (n, 3) lie, (n,)."""
        away = points - self.point
        along = away @ self.axis
        around = np.linalg.norm(away - along[:, None] * self.axis, axis=-1)
        return np.cos(self.angle) * around - np.sin(self.angle) * along - self.apart

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
        >>> round(abs(float(np.tan(found.angle))), 9), bool(np.abs(found.off(points)).max() < 1e-12)
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
            found, step = found._better((points - middle) / size)
            if step <= _EXACT:
                break
        if step > _EXACT:
            return None
        return cls(middle + size * found.point, found.axis, found.angle, size * found.apart)

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
        angle = float(np.arctan(change / (2 * radius)))
        return cls(np.array([x, y]) @ beside, axis, angle, radius * np.cos(angle))

    def _better(self, points: np.ndarray) -> tuple[Axial | None, float]:
        """A step nearer, and how large it is."""
        off, slopes, beside = self._slopes(points)
        if not np.isfinite(slopes).all():
            return None, np.inf
        left, told, right = np.linalg.svd(slopes, full_matrices=False)
        step = right.T @ (-(left.T @ off) / np.maximum(told, _TOLD * told[0]))
        step /= max(1.0, np.abs(step).max() / _STEP)
        axis = self.axis + step[2:4] @ beside
        point, axis = self.point + step[:2] @ beside, axis / np.linalg.norm(axis)
        return Axial(point, axis, self.angle + step[4], self.apart + step[5]), float(np.abs(step).max())

    def _slopes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How far off points (n, 3) are, that by the six numbers, (n, 6), and the ways square to the axis, (2, 3)."""
        beside = np.stack(axes_beside(self.axis))
        away = points - self.point
        along = away @ self.axis
        across = away - along[:, None] * self.axis
        around, cosine, sine = np.linalg.norm(across, axis=1), np.cos(self.angle), np.sin(self.angle)
        off, out = cosine * around - sine * along - self.apart, across @ beside.T / around[:, None]
        tilts = -cosine * along[:, None] * out - sine * (across @ beside.T)
        turns = -sine * around - cosine * along
        return off, np.column_stack([-cosine * out, tilts, turns, -np.ones(len(along))]), beside

    def leverage(self, places: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """By how much it is off at places (n, 3), at most, if each of the corners (m, 3) that tell it is by one; (n,).

        They may tell some of its numbers ill: what counts is what that moves there.
        """
        middle = corners.mean(0)
        size = float(np.abs(corners - middle).max())
        unit = Axial((self.point - middle) / size, self.axis, self.angle, self.apart / size)
        by, of = (unit._slopes((each - middle) / size)[1] for each in (places, corners))
        return np.abs(by @ np.linalg.pinv(of, rcond=_TOLD)).sum(1)


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
    across = _across(shape, smooth & (region[shape.faces] >= 0).any(1) & ((region >= 0) | small)[shape.faces].all(1))
    found = np.zeros(len(asked), bool)
    single = SINGLE * float(np.abs(vertices).max())

    def told_by(faces: np.ndarray, ends: np.ndarray) -> np.ndarray | None:
        """Which lines (n, 2, 3) are chords of the surface of some faces; None where they are of none."""
        corners = vertices[np.unique(shape.ends[np.isin(shape.faces, faces).any(1)])]
        return _beside(corners, normals[faces], ends, single)

    for number in np.setdiff1d(own[likely], [-1]):
        rows = np.flatnonzero(likely & ((own == number) & small[shape.faces]).any(1))
        ends = vertices[shape.ends[rows]]
        told = told_by(np.flatnonzero(region == number), ends)
        if told is not None:
            found[rows] |= told
            continue
        for row, side in zip(*np.nonzero((own[rows] == number) & small[shape.faces[rows]]), strict=True):
            told = told_by(np.array(_nearest(across, int(shape.faces[rows[row], side]))), ends[row : row + 1])
            found[rows[row]] |= told is not None and bool(told[0])
    return found


def _beside(corners: np.ndarray, normals: np.ndarray, ends: np.ndarray, single: float) -> np.ndarray | None:
    """Which lines (n, 2, 3) are chords of a surface through corners (m, 3); None where there is no such surface."""
    surface = Axial.through(corners, normals)
    if surface is None or np.abs(surface.off(corners)).max() > single:
        return None
    on = np.abs(surface.off(ends.reshape(-1, 3))).reshape(-1, 2).max(1) <= single
    middle = ends.mean(1)
    unsure = 2 * single + single * surface.leverage(middle, corners)
    return on & (np.abs(surface.off(middle)) > unsure)


def _across(shape: Chains, inside: np.ndarray) -> dict[int, list[tuple[float, int]]]:
    """Of each face the bends to those that it continues in, and which these are."""
    found: dict[int, list[tuple[float, int]]] = defaultdict(list)
    for row in np.flatnonzero(inside).tolist():
        one, two = shape.faces[row].tolist()
        found[one].append((float(shape.bend[row]), two))
        found[two].append((float(shape.bend[row]), one))
    return found


def _nearest(across: dict[int, list[tuple[float, int]]], first: int) -> list[int]:
    """A face and those that continue it with the least bends, enough to tell a surface by their corners."""
    found, open_ = [], [(0.0, first)]
    while open_ and len(found) < _CORNERS:
        _, face = heappop(open_)
        if face not in found:
            found.append(face)
            for each in across[face]:
                heappush(open_, each)
    return found


def _beside_facets(shape: Chains, region: np.ndarray, smooth: np.ndarray) -> np.ndarray:
    """The same numbers, and those of the surfaces that other faces continue smoothly."""
    found = region.copy()
    for side in (0, 1):
        here, other = shape.faces[smooth, side], shape.faces[smooth, 1 - side]
        rows = (region[here] < 0) & (region[other] >= 0)
        found[here[rows]] = region[other[rows]]
    return found
