"""Cylinder and cone as one: radius r(z) = r + k z at the height z over a point of the axis, k the tangent of the angle.

Nothing of it needs the apex, so a slight taper is as well told as none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from scenes.parts.surfaces.roots import quadratic_roots
from scenes.parts.surfaces.surface import axes_beside, outwards

_PARALLEL = 1e-14  # squared sine of the angle between a line and a generator below which they are parallel


@dataclass(frozen=True, eq=False)
class Ruled:
    """What `scenes.parts.surfaces.Cylinder` and `Cone` have, and tell by the same formulas (see `Surface`).

    Attributes
    ----------
    point : ndarray, shape (3,)
        On the axis.
    axis : ndarray, shape (3,)
        Unit vector.
    radius : float
        At the point.
    ends : tuple of float
        Between which heights z0..z1 over the point, along the axis; infinite where not given.
    hollow : bool
        Whether the material is outside.
    """

    point: np.ndarray
    axis: np.ndarray
    radius: float
    ends: tuple[float, float] = (-math.inf, math.inf)
    hollow: bool = False

    parameters: ClassVar[tuple[str, ...]]

    @property
    def slope(self) -> float:
        """Growth of the radius along the axis."""
        return 0.0

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
        """Signed distance of points (..., 3) near the wall, (...)."""
        height, far, _ = self.split(points)
        return outwards(self.hollow) * self.cosine * (far - (self.radius + self.slope * height))

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material, (..., 3)."""
        return outwards(self.hollow) * self.cosine * (self.split(points)[2] - self.slope * self.axis)

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the normal by the place, (..., 3, 3)."""
        _, far, radial = self.split(points)
        around = np.cross(self.axis, radial)
        bend = outwards(self.hollow) * self.cosine / far
        return bend[..., None, None] * around[..., :, None] * around[..., None, :]

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of each parameter, the half angle in rad, (..., p)."""
        normals = self.normals(points)
        height, _, _ = self.split(points)
        away, sign = points - self.point, outwards(self.hollow)
        tilts = [turned(away, self.axis, beside, normals) for beside in axes_beside(self.axis)]
        columns = [*np.moveaxis(normals, -1, 0), *tilts, np.full(height.shape, sign * self.cosine)]
        if "half_angle" in self.parameters:
            columns.append(sign * height / self.cosine)
        return np.stack(columns, -1)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet this sheet, (..., 2)."""
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
        """Whether points lie between its ends, (...)."""
        height = (points - self.point) @ self.axis
        return (height >= self.ends[0]) & (height <= self.ends[1])


def turned(away: np.ndarray, axis: np.ndarray, beside: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Shift along normals where the axis turns towards a unit vector ``beside`` it: that of a rotation."""
    return (((away @ axis)[..., None] * beside - (away @ beside)[..., None] * axis) * normals).sum(-1)
