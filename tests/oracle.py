"""Images made without the renderer: convex polygons, exactly blurred and exactly averaged over square pixels."""

import numpy as np
from scipy.special import ndtr

from planner.imaging.projection import direction, facing, frame, project
from planner.imaging.irradiance import bands
from planner.imaging.reflectance import reflected
from validation.hard.polygon import _scan_lines, _spans, polygon_image

__all__ = ["block_image", "polygon_image", "shaded_image"]

_FEW, _FEW_WEIGHTS = np.polynomial.legendre.leggauss(4)


def shaded_image(faces, shape, blur):
    """Grey levels (height, width) of plane convex faces with shading of their own, under a Gaussian blur.

    Parameters
    ----------
    faces : list of (corners, shade)
        Corners (k, 2) in px, and a function of x and y (arrays, px) that gives the level there. Faces do not overlap.
    shape : tuple of int
    blur : float

    Gauss-Legendre quadrature of both integrals on panels of at most half a pixel that end at the face's outline, so
    that the integrand is smooth: about 1e-6 of the contrast.
    """
    picture = np.zeros(shape)
    for corners, shade in faces:
        corners = np.asarray(corners, float)
        lines, weights = _scan_lines(np.unique(corners[:, 1]))
        left, right = _spans(corners, lines)
        panels = max(int(np.ceil(2 * np.max(right - left))), 1)
        t = (np.arange(panels)[:, None] + (1 + _FEW) / 2).ravel() / panels
        x = left[:, None] + (right - left)[:, None] * t
        value = shade(x, lines[:, None]) * (right - left)[:, None] * np.tile(_FEW_WEIGHTS / 2, panels) / panels
        rows = np.zeros((lines.size, shape[1]))
        reach, nearest, line = int(np.ceil(7 * blur)) + 1, np.rint(x).astype(int), np.arange(lines.size)[:, None]
        for step in range(-reach, reach + 1):
            pixel = nearest + step
            part = value * (ndtr((pixel + 0.5 - x) / blur) - ndtr((pixel - 0.5 - x) / blur))
            inside = (pixel >= 0) & (pixel < shape[1])
            np.add.at(rows, (np.broadcast_to(line, x.shape)[inside], pixel[inside]), part[inside])
        away = lines - np.arange(shape[0])[:, None]
        picture += (ndtr((away + 0.5) / blur) - ndtr((away - 0.5) / blur)) * weights @ rows
    return picture


def block_image(scene, sensor, light):
    """Exact image of the scene's convex solid before darkness; shading by `planner.reflectance`."""
    camera, solid, pose = scene.camera, scene.solid, np.array(sensor, float)
    axes, eye = frame(pose), camera.distance * direction(pose)
    lamp = scene.light.distance * direction(np.array(light, float))
    image = project(solid.vertices, pose, camera)

    def shading(normal, offset):
        def shade(x, y):
            u, v = ((p - (n - 1) / 2) / camera.focal_px for p, n in ((x, camera.width), (y, camera.height)))
            ray = axes.forward + u[..., None] * axes.right + (v + 0 * u)[..., None] * axes.down
            point = eye + ray * ((offset - eye @ normal) / (ray @ normal))[..., None]
            to_light, to_sensor = lamp - point, eye - point
            distance = np.linalg.norm(to_light, axis=-1, keepdims=True)
            to_sensor /= np.linalg.norm(to_sensor, axis=-1, keepdims=True)
            level = reflected(scene.material, bands(scene, scene.light), np.broadcast_to(normal, point.shape), to_light / distance, to_sensor)
            return camera.exposure * level * (scene.light.distance / distance[..., 0]) ** 2

        return shade

    faces = [
        (image[list(face)], shading(normal, offset))
        for face, normal, offset, seen in zip(
            solid.faces, solid.normals, solid.offsets, facing(solid, eye), strict=True
        )
        if seen
    ]
    return scene.noise.dark_level + shaded_image(faces, (camera.height, camera.width), camera.blur_px)
