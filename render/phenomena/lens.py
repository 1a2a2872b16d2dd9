"""What the lens and the pixel do: blur, distortion, depth of field."""

from __future__ import annotations

import numpy as np

from imaging.features.locator import edge_blur
from imaging.features.projected_edges import circles
from imaging.geometry.blur import confusion
from imaging.geometry.lens import lens_jacobian, recorded
from imaging.geometry.projection import depth, edge_points, project, project_ideal
from imaging.light.illumination import illumination
from imaging.pictures import Pictures
from render.phenomena.base import EVERYTHING, Effect, Influence, changed, largest
from render.phenomena.edges import lever, required, sides
from scenes import Scene


class LensBlur(Effect):
    """The lens' Gaussian blur and the pixel's own box."""

    name = "lens_blur"
    switch = "a Gaussian filter of the supersampled image, then averaging; costs nothing beside the rays"

    def influence(self, pictures: Pictures) -> Influence:
        """A point's variance is as (s^2 + s_e^2)^3."""
        scene = pictures.scene
        own, blur = scene.locator.scale_px**2, edge_blur(scene.camera.most_blur_px) ** 2
        found = sides(pictures)
        moved = np.abs(found.shift(blur)).max(-1)
        return largest((lever(pictures) * moved).sum(-1), np.array([((own + blur) / own) ** 3 - 1]))


class RelativeIllumination(Effect):
    """The lens passes less light beside the image's middle."""

    name = "relative_illumination"
    switch = "a factor on the supersampled image before it is blurred; costs nothing beside the rays"

    def absent(self, pictures: Pictures) -> str | None:
        return None if pictures.scene.camera.is_dimmed else "the lens passes light evenly"

    def influence(self, pictures: Pictures) -> Influence:
        """Contrast changes by the factor, the variance at most by its square; edges move as by shading of its slope."""
        scene = pictures.scene
        points = edge_points(scene.solid, required(scene), np.linspace(0, 1, 9)).reshape(-1, 3)
        at = project(points, pictures.sensors, scene.camera)
        x, y = at[..., 0], at[..., 1]
        factor = illumination(scene.camera, x, y)
        steps = [illumination(scene.camera, x + dx, y + dy) - factor for dx, dy in np.eye(2)]
        slope = np.hypot(*steps).max(-1) / factor.min(-1)
        width2 = scene.locator.scale_px**2 + edge_blur(scene.camera.most_blur_px) ** 2
        bias = lever(pictures).sum(-1) * width2 * slope
        return largest(bias, np.maximum(factor.min(-1) ** -2.0, factor.max(-1) ** 2) - 1)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "camera", relative_illumination=(), natural_vignetting=False)


class LensDistortion(Effect):
    """Radial and tangential distortion, five coefficients."""

    name = "lens_distortion"
    cost = 1.1
    switch = "the supersampled image is resampled before it is blurred"

    def absent(self, pictures: Pictures) -> str | None:
        return None if pictures.scene.camera.lens.bends else "all coefficients are 0"

    def influence(self, pictures: Pictures) -> Influence:
        """How far the required edges' points move, and how much the image is stretched there."""
        scene = pictures.scene
        points = edge_points(scene.solid, required(scene), np.linspace(0, 1, 33))
        image = project_ideal(points.reshape(-1, 3), pictures.sensors, scene.camera)
        moved = np.linalg.norm(recorded(image, scene.camera) - image, axis=-1)
        bias = moved.reshape(len(moved), *points.shape[:2]).max(-1)
        stretch = np.linalg.norm(lens_jacobian(image, scene.camera) - np.eye(2), axis=(-2, -1)).max(-1)
        return largest((lever(pictures) * bias).sum(-1), 6 * stretch)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "camera", lens=scene.camera.lens.straight())


class DepthOfField(Effect):
    """A thin lens blurs what is out of focus."""

    name = "depth_of_field"
    cost = 9.0
    random = True
    switch = "a thin lens instead of a pinhole; random, so edge pixels cannot be singled out"

    def absent(self, pictures: Pictures) -> str | None:
        return "the aperture is a pinhole" if pictures.scene.camera.aperture_radius == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        """A disc of radius r adds r^2 / 4 to the blur; it is an even blur only as far as r is small beside it.

        The edge moves by shading, and by up to r^2 / 4 of a pixel where the blur changes along it. Of circles and
        curved surfaces it is not told, for their walls take part of the cone of light.
        """
        scene = pictures.scene
        camera = scene.camera
        if circles(scene):
            return EVERYTHING
        ends = edge_points(scene.solid, required(scene), np.linspace(0, 1, 9)).reshape(-1, 3)
        z = depth(ends, pictures.sensors, camera)
        if (z <= 0).any():
            return EVERYTHING
        radius = confusion(camera, z)
        added = (radius.max(-1)) ** 2 / 4
        own = scene.locator.scale_px**2 + edge_blur(camera.blur_px) ** 2
        moved = np.abs(sides(pictures).shift(1.0)).max(-1) * added[:, None]
        bias = (lever(pictures) * (moved + 0.02 * added[:, None])).sum(-1)
        return largest(bias, (1 + added / own) ** 3 - 1)

    def without(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"camera": scene.camera.stopped_down()})
