"""Cylinder and cone as one: radius r(z) = r + k z at the height z over a point of the axis, k the tangent of the angle.

Nothing of it needs the apex, so a slight taper is as well told as none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scenes.parts.surfaces.roots import quadratic_roots
from scenes.parts.surfaces.surface import axes_beside, outwards

_PARALLEL = 1e-14  # squared sine of the angle between a line and a generator below which they are parallel


class Ruled(NamedTuple):
    """Point of the axis, unit axis, radius there, slope k, ends (z0, z1), and whether the material is outside."""

    point: np.ndarray
    axis: np.ndarray
    radius: float
    slope: float
    ends: tuple[float, float]
    hollow: bool

    @property
    def cosine(self) -> float:
        """Cosine of the half angle."""
        return 1 / np.hypot(1.0, self.slope)

    def split(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Height over the point (...), distance from the axis (...), and unit vector from there (..., 3)."""
        away = points - self.point
        height = away @ self.axis
        beside = away - height[..., None] * self.axis
        far = np.linalg.norm(beside, axis=-1)
        with np.errstate(invalid="ignore"):
            radial = np.where(far[..., None] > 0, beside / far[..., None], axes_beside(self.axis)[0])
        return height, far, radial

    def values(self, points: np.ndarray) -> np.ndarray:
        height, far, _ = self.split(points)
        return outwards(self.hollow) * self.cosine * (far - (self.radius + self.slope * height))

    def normals(self, points: np.ndarray) -> np.ndarray:
        return outwards(self.hollow) * self.cosine * (self.split(points)[2] - self.slope * self.axis)

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        _, far, radial = self.split(points)
        around = np.cross(self.axis, radial)
        bend = outwards(self.hollow) * self.cosine / far
        return bend[..., None, None] * around[..., :, None] * around[..., None, :]

    def third(self, points: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """Along a tangent with parts x around and s along the generator the curvature falls as the radius grows."""
        _, far, radial = self.split(points)
        around = (tangents * np.cross(self.axis, radial)).sum(-1)
        upwards = tangents @ self.axis
        return outwards(self.hollow) * 3 * self.cosine * around**2 * self.slope * upwards / far**2

    def shifts(self, points: np.ndarray, taper: bool) -> np.ndarray:
        """For the point (3), two tilts of the axis, the radius, and with ``taper`` the half angle."""
        normals = self.normals(points)
        height, _, _ = self.split(points)
        away, sign = points - self.point, outwards(self.hollow)
        tilts = [turned(away, self.axis, beside, normals) for beside in axes_beside(self.axis)]
        columns = [*np.moveaxis(normals, -1, 0), *tilts, np.full(height.shape, sign * self.cosine)]
        if taper:
            columns.append(sign * height / self.cosine)
        return np.stack(columns, -1)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        origins, directions = np.broadcast_arrays(np.asarray(origins, float), np.asarray(directions, float))
        away = origins - self.point
        up = directions @ self.axis
        flat = directions - up[..., None] * self.axis
        across = (flat**2).sum(-1)
        with np.errstate(all="ignore"):  # from where the line is nearest to the axis, so that nothing cancels
            start = np.where(across > _PARALLEL * (directions**2).sum(-1), -(away * flat).sum(-1) / across, 0.0)
        near = away + start[..., None] * directions
        height = near @ self.axis
        beside = near - height[..., None] * self.axis
        wide = self.radius + self.slope * height
        far = np.linalg.norm(beside, axis=-1)
        second = across - (self.slope * up) ** 2
        parallel = np.abs(second) <= _PARALLEL * (directions**2).sum(-1)
        found = quadratic_roots(
            np.where(parallel, 0.0, second),
            (beside * flat).sum(-1) - self.slope * up * wide,
            (far - wide) * (far + wide),
        )
        found = found + start[..., None]
        with np.errstate(invalid="ignore"):
            at = away[..., None, :] + np.where(np.isfinite(found), found, 0.0)[..., None] * directions[..., None, :]
        keep = self.radius + self.slope * (at @ self.axis) >= 0  # not of the cone beyond its apex
        return np.sort(np.where(keep, found, np.inf), axis=-1)

    def within(self, points: np.ndarray) -> np.ndarray:
        height = (points - self.point) @ self.axis
        return (height >= self.ends[0]) & (height <= self.ends[1])

    def area_points(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Points (..., 3) that cover the surface evenly by area as u, v cover the unit square."""
        low, high = self.ends
        start = self.radius + self.slope * low
        along = (high - low) * np.asarray(v, float)
        if self.slope:
            end = self.radius + self.slope * high
            wide = np.sqrt(start**2 + np.asarray(v) * (end - start) * (end + start))
            along = (wide - start) / self.slope
        one, two = axes_beside(self.axis)
        angle = 2 * np.pi * np.asarray(u, float)[..., None]
        radial = np.cos(angle) * one + np.sin(angle) * two
        height = low + along
        return self.point + height[..., None] * self.axis + (self.radius + self.slope * height)[..., None] * radial


def turned(away: np.ndarray, axis: np.ndarray, beside: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Shift along normals where the axis turns towards a unit vector ``beside`` it: that of a rotation."""
    return (((away @ axis)[..., None] * beside - (away @ beside)[..., None] * axis) * normals).sum(-1)
