"""Places spread evenly over faces, and directions from them, without random numbers.

A low-discrepancy sequence fills the unit square; its points are folded into triangles, or stand for directions as
dense as Lambert's cosine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes import Solid

_PLASTIC = 1.324717957244746  # x^3 = x + 1, whose powers fill a square evenly (Roberts 2018, "R2")
_OTHER = 1.1673039782614187  # x^5 = x + 1, the same of four axes, whose powers no sum of the others' is (R4)
_THINNED = 16  # so many even places stand for one where places are denser: as many times denser they are at most


@dataclass(frozen=True, eq=False)
class Places:
    """Places (m, 3) on faces (m,) of a solid, with their normals (m, 3)."""

    points: np.ndarray
    normals: np.ndarray
    faces: np.ndarray

    @classmethod
    def spread(cls, solid: Solid, faces: np.ndarray, count: int, after: int = 0) -> Places:
        """So many, evenly over the area of some faces; none is among the first ``after``."""
        here = np.isin(solid.triangle_faces, faces)
        triangles, of_face = solid.triangles[here], solid.triangle_faces[here]
        until = np.cumsum(areas_of(triangles))
        which = np.searchsorted(until, (np.arange(count) + 0.5) / count * until[-1])
        a, b = in_unit_square(after + count)[after:].T
        a, b = np.where(a + b > 1, 1 - a, a)[:, None], np.where(a + b > 1, 1 - b, b)[:, None]
        first, second, third = triangles[which].swapaxes(0, 1)
        points = first + a * (second - first) + b * (third - first)
        return cls(points, solid.normals[of_face[which]], of_face[which])

    def beside(self, solid: Solid, faces: np.ndarray, count: int, about: np.ndarray, near: np.ndarray) -> Places:
        """These and about so many more, as dense as 1 / (d^2 + s^2) at a distance d from the nearest of points
        ``about`` (k, 3), of which ``near`` (k,) are s."""
        from scipy.spatial import KDTree  # slow to load, and rarely needed

        many = Places.spread(solid, faces, _THINNED * count, after=len(self.points))
        away, which = KDTree(about).query(many.points)
        until = np.cumsum(1 / (away**2 + near[which] ** 2))
        some = np.unique(np.searchsorted(until, (np.arange(count) + 0.5) / count * until[-1]))
        return self.joined(Places(many.points[some], many.normals[some], many.faces[some]))

    def joined(self, more: Places) -> Places:
        """These, then more."""
        both = zip((self.points, self.normals, self.faces), (more.points, more.normals, more.faces), strict=True)
        return Places(*map(np.concatenate, both))


def in_unit_square(count: int) -> np.ndarray:
    """So many points that fill the unit square evenly, (n, 2)."""
    return np.arange(1, count + 1)[:, None] / _PLASTIC ** np.arange(1, 3) % 1.0


def shifts(count: int) -> np.ndarray:
    """So many shifts of the unit square, (n, 2), by which sets of its points are others wherever they are asked for."""
    return shift_of(np.arange(1, count + 1)[:, None])


def shift_of(number: int | np.ndarray) -> np.ndarray:
    """Shifts by their numbers, from 1, one more axis of 2.

    Of a sequence of its own: shifted by one of its own points, `in_unit_square` of n points is n - 1 of the same again.
    """
    return number / _OTHER ** np.arange(1, 3) % 1.0


def ways_about(normals: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Unit vectors about normals (n, 3), as dense as the cosine to them, of points (n, k, 2) of the unit square."""
    beside = np.eye(3)[np.abs(normals).argmin(-1)]
    one = np.cross(normals, beside)
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    turn, out = 2 * np.pi * square[..., 0], np.sqrt(square[..., 1])
    along = np.stack([out * np.cos(turn), out * np.sin(turn), np.sqrt(1 - square[..., 1])], -1)
    return along @ np.stack([one, np.cross(normals, one), normals], -2)


def middles_of(solid: Solid) -> np.ndarray:
    """Of faces, (F, 3)."""
    areas, found = areas_of(solid.triangles), np.zeros((len(solid.faces), 3))
    np.add.at(found, solid.triangle_faces, areas[:, None] * solid.triangles.mean(1))
    return found / np.bincount(solid.triangle_faces, areas, len(solid.faces))[:, None]


def areas_of(triangles: np.ndarray) -> np.ndarray:
    """Of triangles (t, 3, 3), (t,)."""
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=-1) / 2
