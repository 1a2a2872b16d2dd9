"""What the lens and the pixel do: blur, distortion, depth of field."""

from __future__ import annotations

import numpy as np

from planner.features.projected_edges import straight
from planner.imaging.projection import depth, edge_points, project
from planner.models.locator import edge_blur
from render.optics import distorted
from render.phenomena.base import EVERYTHING, Effect, Influence, Poses, changed, largest
from render.phenomena.edges import lever, sides
from scenes import Scene


class LensBlur(Effect):
    """The lens' Gaussian blur and the pixel's own box."""

    name = "lens_blur"
    switch = "a Gaussian filter of the supersampled image, then averaging; costs nothing beside the rays"

    def absent(self, scene: Scene, poses: Poses) -> str | None:
        return None

    def influence(self, scene: Scene, poses: Poses) -> Influence:
        """A point's variance is as (s^2 + s_e^2)^3."""
        own, blur = scene.locator.scale_px**2, edge_blur(scene.camera.blur_px) ** 2
        found = sides(scene, poses)
        moved = np.abs(found.shift(blur)).max(-1)
        return largest((lever(scene, poses) * moved).sum(-1), np.array([((own + blur) / own) ** 3 - 1]))


class LensDistortion(Effect):
    """Radial distortion k1."""

    name = "lens_distortion"
    cost = 1.1
    switch = "the blurred supersampled image is resampled"

    def absent(self, scene: Scene, poses: Poses) -> str | None:
        return "k1 is 0" if scene.camera.lens.distortion == 0 else None

    def influence(self, scene: Scene, poses: Poses) -> Influence:
        """How far the required edges' points move, and how much the image is stretched there."""
        points = edge_points(scene.solid, straight(scene), np.linspace(0, 1, 33))
        moved = []
        for sensor in poses.sensors:
            image = project(points.reshape(-1, 3), sensor, scene.camera)
            moved.append(np.linalg.norm(distorted(image, scene.camera) - image, axis=1).reshape(points.shape[:2]))
        bias = np.array(moved).max(-1)
        stretch = 3 * abs(scene.camera.lens.distortion) * self._radius2(scene, poses)
        return largest((lever(scene, poses) * bias).sum(-1), 6 * stretch)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "camera", lens=scene.camera.lens.model_copy(update={"distortion": 0.0}))

    @staticmethod
    def _radius2(scene: Scene, poses: Poses) -> np.ndarray:
        centre = np.array([scene.camera.width - 1, scene.camera.height - 1]) / 2
        corners = [project(scene.solid.vertices, sensor, scene.camera) - centre for sensor in poses.sensors]
        return (np.array(corners) ** 2).sum(-1).max(-1) / scene.camera.focal_px**2


class DepthOfField(Effect):
    """A thin lens blurs what is out of focus."""

    name = "depth_of_field"
    cost = 9.0
    random = True
    switch = "a thin lens instead of a pinhole; random, so edge pixels cannot be singled out"

    def absent(self, scene: Scene, poses: Poses) -> str | None:
        return "the aperture is a pinhole" if scene.camera.lens.aperture_radius == 0 else None

    def influence(self, scene: Scene, poses: Poses) -> Influence:
        """A disc of radius r adds r^2 / 4 to the blur; it is an even blur only as far as r is small beside it.

        The edge moves by shading, and by up to r^2 / 4 of a pixel where the blur changes along it.
        """
        camera, lens = scene.camera, scene.camera.lens
        ends = edge_points(scene.solid, straight(scene), np.linspace(0, 1, 9)).reshape(-1, 3)
        z = depth(ends, poses.sensors, camera)
        if (z <= 0).any():
            return EVERYTHING
        radius = lens.aperture_radius * camera.focal_px * np.abs(1 / z - 1 / (lens.focus or camera.distance))
        added = (radius.max(-1)) ** 2 / 4
        own = scene.locator.scale_px**2 + edge_blur(camera.blur_px) ** 2
        moved = np.abs(sides(scene, poses).shift(1.0)).max(-1) * added[:, None]
        bias = (lever(scene, poses) * (moved + 0.02 * added[:, None])).sum(-1)
        return largest(bias, (1 + added / own) ** 3 - 1)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "camera", lens=scene.camera.lens.model_copy(update={"aperture_radius": 0.0}))
