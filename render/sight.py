"""Lines of sight of a telecentric camera: as sensors of Mitsuba with parallel ones, and as arrays of rays.

Mitsuba's orthographic sensor shows all of an image whose lines of sight are parallel. Where they are not quite, or
where a cone of light goes through the lens, a small tile of the image is shown by such a sensor, its axis along the
line of sight through the tile's middle and a place on the aperture: between that and the tile's side the lines of sight
turn by the share of perspective times half the tile, which `Sight.widest` bounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from imaging.geometry.projection import Frame, camera_frame, depth
from scenes import Camera, Picture

_BEFORE = 0.01  # of the bodies' extent: how far before the nearest of them rays begin
_OFF_PX, _ROUGH_PX = 1e-3, 0.05  # by how much a tile may displace what lies at its side, nearest or farthest
_GOLDEN = math.pi * (3 - math.sqrt(5))


@dataclass(frozen=True, eq=False)
class Sight:
    """Lines of sight through an image in fine pixels.

    Attributes
    ----------
    camera : Camera
    axes : Frame
        Of one pose, each (3,).
    near, far : float
        Depths between which all bodies are, scene units; rays begin at the first.
    divided : int
        Fine pixels that divide a pixel, each way.
    opening : float
        Tangent of the half angle of the cone of light; 0 where the aperture is not simulated.
    """

    camera: Camera
    axes: Frame
    near: float
    far: float
    divided: int
    opening: float

    @classmethod
    def of(cls, picture: Picture, active: frozenset[str], divided: int) -> Sight | None:
        """None of a pinhole camera, which Mitsuba has."""
        camera, pose = picture.scene.camera, np.array(list(picture.sensor))
        if camera.perspective == 1:
            return None
        bodies = picture.scene.bodies
        away = depth(bodies.vertices, pose, camera)
        opening = camera.aperture_radius / camera.distance if "depth_of_field" in active else 0.0
        near = float(away.min()) - _BEFORE * bodies.extent
        return cls(camera, camera_frame(camera, pose), near, float(away.max()), divided, opening)

    @property
    def is_parallel(self) -> bool:
        """Whether one sensor shows the whole image."""
        return self.camera.perspective == 0 and self.opening == 0

    def widest(self, sides: tuple[int, ...], *, roughly: bool = False) -> int:
        """The largest of some rising sides of a tile, fine pixels, in which nothing is displaced too far; or the least.

        What is to one side of a tile's middle is displaced as far as what is to the other, the other way: edges that
        cross several tiles keep their place. ``roughly`` is for what shows where edges are.
        """
        turned = abs(self.camera.perspective) * (self.far - self.near) / self.camera.divisor(self._middle)
        good = [side for side in sides if side / (2 * self.divided) * turned / 2 <= (_ROUGH_PX if roughly else _OFF_PX)]
        return good[-1] if good else sides[0]

    def pupils(self, count: int) -> np.ndarray:
        """Places on the aperture, of unit radius, that stand for all of it, (n, 2): evenly along a spiral."""
        if self.opening == 0:
            return np.zeros((1, 2))
        number = np.arange(count)
        radius, turn = np.sqrt((number + 0.5) / count), number * _GOLDEN
        return np.stack([radius * np.cos(turn), radius * np.sin(turn)], -1)

    def to_world(self, corner: tuple[int, int], size: tuple[int, int], pupil: np.ndarray) -> np.ndarray:
        """Transform (4, 4) of Mitsuba's orthographic sensor for a tile from a corner (x, y), of a size, fine pixels.

        Its own axes are left, up and forward, its half width is 1.
        """
        frame = self.camera.width, self.camera.height
        at = [(c + s / 2) / self.divided - whole / 2 for c, s, whole in zip(corner, size, frame, strict=True)]
        half = size[0] / (2 * self.divided) * self._length(self._middle)
        origin, way = self._line(np.array(at), pupil)
        found = np.eye(4)
        found[:3] = np.stack([-half * self.axes.right, -half * self.axes.down, way, origin], -1)
        return found

    def described(self, corner: tuple[int, int], size: tuple[int, int]) -> dict[str, Any]:
        """Numbers of that sensor for what needs one for the whole image, by the aperture's middle."""
        reach = self.far - self.near + self.camera.distance
        return {
            "to_world": self.to_world(corner, size, np.zeros(2)),
            "near_clip": 1e-6 * reach,
            "far_clip": 1e3 * reach,
        }

    def rays(self, mi: Any, place: Any, crop: tuple[slice, slice], pair: Any) -> Any:
        """Rays through places (0 to 1) of a crop, and places on the aperture of random numbers, as Mitsuba's arrays."""
        import drjit as dr

        rows, columns = crop
        x, y = (
            (part.start + at * (part.stop - part.start)) / self.divided - whole / 2
            for part, at, whole in (
                (columns, place.x, self.camera.width), (rows, place.y, self.camera.height),
            )
        )  # fmt: skip
        pupil = mi.warp.square_to_uniform_disk_concentric(pair)
        origin, way = self._line((x, y), (pupil.x, pupil.y))
        return mi.Ray3f(mi.Point3f(*origin), dr.normalize(mi.Vector3f(*way)))

    @cached_property
    def _middle(self) -> float:
        return (self.near + self.far) / 2

    def _length(self, away: float) -> float:
        """Length that a px shows at a depth, scene units."""
        return self.camera.divisor(away) / self.camera.focal_px

    def _line(self, at: Any, pupil: Any) -> tuple[Any, Any]:
        """Where a line of sight begins and its way, of unit length along the axis, (3,) each: numbers or arrays.

        Through an image point (x, y), px from the middle, and a place on the aperture of unit radius.
        """
        camera, share = self.camera, self.camera.perspective
        focus = camera.lens.focus or camera.distance
        lean = self.opening * camera.distance / camera.divisor(focus)
        origin, way = [], []
        for c, *axes in zip(camera.look_at, *self.axes, strict=True):
            right, down, forward = map(float, axes)
            beside = at[0] * right + at[1] * down
            turned = share / camera.focal_px * beside + lean * (pupil[0] * right + pupil[1] * down) + forward
            in_focus = self._length(focus) * beside + (c + (focus - camera.distance) * forward)
            origin.append(in_focus + (self.near - focus) * turned)
            way.append(turned)
        if isinstance(at, np.ndarray):
            return np.array(origin), np.array(way)
        return origin, way
