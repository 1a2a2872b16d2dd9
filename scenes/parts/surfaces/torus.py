"""The torus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from scenes.parts.surfaces.roots import real_roots
from scenes.parts.surfaces.ruled import turned
from scenes.parts.surfaces.surface import axes_beside, checked, length, outwards, point, unit


@dataclass(frozen=True, eq=False)
class Torus:
    """A tube of ``tube`` radius around a circle of ``radius``: a fillet or an O-ring.

    Attributes
    ----------
    centre : ndarray, shape (3,)
    axis : ndarray, shape (3,)
        Unit vector.
    radius : float
        Of the circle in the tube's middle.
    tube : float
        Of the tube; not more than the circle's.
    hollow : bool
        Whether the material is outside of the tube.

    Raises
    ------
    InvalidInput
        If a number is not finite, not positive, or the tube is wider than its circle.
    """

    centre: np.ndarray
    axis: np.ndarray
    radius: float
    tube: float
    hollow: bool = False

    kind: ClassVar[str] = "torus"
    parameters: ClassVar[tuple[str, ...]] = ("x", "y", "z", "tilt1", "tilt2", "radius", "tube")

    def __post_init__(self) -> None:
        checked(
            self,
            centre=point("torus.centre", self.centre),
            axis=unit("torus.axis", self.axis),
            radius=length("torus.radius", self.radius),
            tube=length("torus.tube", self.tube),
        )
        length("torus.radius - torus.tube", self.radius - self.tube)

    def split(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vector from the axis (..., 3), and distance from the tube's middle outwards and along the axis (...)."""
        away = points - self.centre
        height = away @ self.axis
        beside = away - height[..., None] * self.axis
        far = np.linalg.norm(beside, axis=-1)
        with np.errstate(invalid="ignore"):
            radial = np.where(far[..., None] > 0, beside / far[..., None], axes_beside(self.axis)[0])
        return radial, far - self.radius, height

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3)."""
        _, out, up = self.split(points)
        return outwards(self.hollow) * (np.hypot(out, up) - self.tube)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material, (..., 3)."""
        radial, out, up = self.split(points)
        found = out[..., None] * radial + up[..., None] * self.axis
        return outwards(self.hollow) * found / np.hypot(out, up)[..., None]

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the normal by the place, (..., 3, 3): 1 / tube around it, and what the circle's bend adds."""
        radial, out, up = self.split(points)
        size, around = np.hypot(out, up), np.cross(self.axis, radial)
        over = (out[..., None] * self.axis - up[..., None] * radial) / size[..., None]
        bend = (out / size / (self.radius + out))[..., None, None]
        found = over[..., :, None] * over[..., None, :] / self.tube + bend * around[..., :, None] * around[..., None, :]
        return outwards(self.hollow) * found

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of each parameter, (..., 7)."""
        normals, away = self.normals(points), points - self.centre
        radial, _, _ = self.split(points)
        tilts = [turned(away, self.axis, beside, normals) for beside in axes_beside(self.axis)]
        wider, thicker = (normals * radial).sum(-1), np.full(away.shape[:-1], outwards(self.hollow))
        return np.stack([*np.moveaxis(normals, -1, 0), *tilts, wider, thicker], -1)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet it, (..., 4): roots of a quartic, counted from where they are nearest to the centre."""
        origins, directions = np.broadcast_arrays(np.asarray(origins, float), np.asarray(directions, float))
        size = np.linalg.norm(directions, axis=-1)
        along, away = directions / size[..., None], origins - self.centre
        start = -(away * along).sum(-1)
        near = (away + start[..., None] * along) / self.radius  # all in radii
        tube, up, height = self.tube / self.radius, along @ self.axis, near @ self.axis
        beside, flat = near - height[..., None] * self.axis, along - up[..., None] * self.axis
        rest = (near**2).sum(-1) + (1 - tube) * (1 + tube)  # (t^2 + rest)^2 = 4 (square of the distance from the axis)
        zero = np.zeros_like(rest)
        quartic = [zero + 1, zero, 2 * rest - 4 * (flat**2).sum(-1), -8 * (flat * beside).sum(-1)]
        quartic.append(rest**2 - 4 * (beside**2).sum(-1))
        found = real_roots(np.stack(quartic, -1))
        return (found * self.radius + start[..., None]) / size[..., None]

    def within(self, points: np.ndarray) -> np.ndarray:
        """True: it has no ends."""
        return np.ones(np.shape(points)[:-1], bool)
