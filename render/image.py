"""The noise-free image of a scene from one sensor pose under one light pose, by Mitsuba."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.view import direction, frame, project
from render import variant as variants
from render.optics import blur_and_bin
from render.precision import check_precision
from scenes import InvalidInput, Pose, Scene


@dataclass(frozen=True)
class Quality:
    """What the clean image's accuracy costs: rays a pixel are ``supersample`` squared times ``samples``.

    ``supersample`` is how many fine pixels divide a pixel each way; ``samples`` (a square number) how many rays each
    of them gets. On Task1, 4 x 4 x 16 leave the fitted lines within about 0.001 px.
    """

    supersample: int = 4
    samples: int = 16
    seed: int = 0

    def __post_init__(self) -> None:
        if self.supersample < 1:
            raise InvalidInput(f"supersample must be at least 1, got {self.supersample}")
        if self.samples < 1 or math.isqrt(self.samples) ** 2 != self.samples:
            raise InvalidInput(f"samples must be a square number, got {self.samples}")


def image(
    scene: Scene, sensor: Any, light: Any, quality: Quality = Quality(), variant: str | None = None
) -> np.ndarray:
    """Noise-free image.

    Parameters
    ----------
    scene : Scene
    sensor, light : Pose or pair of float
        Polar angle and azimuth, degrees.
    quality : Quality
        Rays a pixel.
    variant : str, optional
        Mitsuba variant; `render.variant.choose()` when not given.

    Returns
    -------
    ndarray of float64, shape (height, width)
        Grey levels, darkness at the black level. Only the part that the object covers is rendered; the rest is dark.
        The same seed gives the same image, bit by bit, for the same variant.

    Raises
    ------
    InvalidInput
        If a pose stands in or on the object, the material is not purely diffuse, or the focal length is too long.
    """
    sensor, light = scene.check_pose("sensor", sensor), scene.check_pose("light", light)
    if not scene.material.is_diffuse:
        raise InvalidInput(
            "material must be diffuse (specular_fraction 0, or refractive_index 1 and extinction 0) to be rendered, "
            "got a specular one"
        )
    picture = np.zeros((scene.camera.height, scene.camera.width))
    rows, columns = window(scene, sensor)
    if picture[rows, columns].size:
        check_precision(scene.camera)
        mitsuba = variants.use(variant or variants.choose())
        description = _description(mitsuba, scene, sensor, light, quality, rows, columns)
        fine = np.array(mitsuba.render(mitsuba.load_dict(description), seed=quality.seed), dtype=float)[:, :, 0]
        picture[rows, columns] = blur_and_bin(fine, scene.camera.blur_px, quality.supersample)
    return picture + scene.camera.black_level


def window(scene: Scene, sensor: Pose) -> tuple[slice, slice]:
    """Rows and columns of the image that the object, blurred, can reach."""
    camera = scene.camera
    corners = project(scene.solid.vertices, np.array(list(sensor)), camera)
    if np.isnan(corners).any():
        return slice(0, camera.height), slice(0, camera.width)
    margin = 2 + 6 * camera.blur_px
    low, high = np.floor(corners.min(0) - margin), np.ceil(corners.max(0) + margin + 1)
    (left, top), (right, bottom) = (
        np.clip(edge, 0, [camera.width, camera.height]).astype(int).tolist() for edge in (low, high)
    )
    return slice(top, bottom), slice(left, right)


def _description(
    mitsuba, scene: Scene, sensor: Pose, light: Pose, quality: Quality, rows: slice, columns: slice
) -> dict:
    """Mitsuba's description of the scene. No floor: a black one adds nothing but time."""
    axes = frame(np.array(list(sensor)))
    camera, position = scene.camera, scene.position("sensor", sensor)
    transform = mitsuba.ScalarTransform4f
    half = np.array(scene.object.size) / 2
    k = quality.supersample
    return {
        "type": "scene",
        "integrator": {"type": "direct", "hide_emitters": True},
        "sensor": {
            "type": "perspective",
            "fov_axis": "x",
            "fov": 2 * math.degrees(math.atan(camera.width / 2 / camera.focal_px)),
            "near_clip": 1e-3 * camera.distance,
            "far_clip": 1e3 * camera.distance,
            # the origin itself: a target one step ahead of a far sensor has lost its direction in single precision
            "to_world": transform().look_at(origin=position.tolist(), target=[0.0, 0.0, 0.0], up=(-axes.down).tolist()),
            "film": {
                "type": "hdrfilm",
                "width": camera.width * k,
                "height": camera.height * k,
                "crop_offset_x": columns.start * k,
                "crop_offset_y": rows.start * k,
                "crop_width": (columns.stop - columns.start) * k,
                "crop_height": (rows.stop - rows.start) * k,
                "rfilter": {"type": "box"},
                "pixel_format": "luminance",
                "component_format": "float32",
            },
            "sampler": {"type": "stratified", "sample_count": quality.samples},
        },
        "object": {
            "type": "cube",  # a built-in cube has exact flat shading
            "to_world": transform().scale(half.tolist()).translate([1, 1, 1]),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": _albedo(scene)}},
        },
        "light": {
            "type": "point",
            "position": (scene.light.distance * direction(np.array(list(light)))).tolist(),
            # a Lambertian surface sends albedo / pi of its irradiance, intensity / distance^2 at the origin
            "intensity": {"type": "spectrum", "value": math.pi * camera.exposure * scene.light.distance**2},
        },
    }


def _albedo(scene: Scene) -> float:
    return (1 - scene.material.specular_fraction) * scene.material.diffuse_reflectance
