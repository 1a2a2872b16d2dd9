"""Three convex parts on a table whose place is found in the picture: scenes, places at random, images of the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from imaging.blurred.whole import image
from imaging.models.bound import information, response
from imaging.pictures import Pictures
from imaging.placed import placed
from scenes import Picture, Scene
from scenes.placement import root

MOST = np.array([5.0, 5.0, 2.0, 3.0, 3.0, 3.0])  # mm, degrees
SENSOR, LIGHT = (28.0, 300.0), (22.0, 60.0)


def _box(x: float, y: float, z: float) -> list[tuple[float, float, float]]:
    return [(i, j, z) for i in (-x, x) for j in (-y, y)]


CORNERS = {
    "block": [*_box(25, 15, 0), *_box(25, 15, 12)],
    "wedge": [*_box(24, 16, 0), (-24, -16, 14), (24, -16, 14), (-24, 6, 14), (24, 6, 14)],
    "roof": [*_box(22, 18, 0), *_box(22, 18, 8), (-22, 4, 16), (22, 4, 16)],
}
ASKED: dict[str, list[tuple[str, str, tuple[str, str]]]] = {
    "block": [
        ("length", "width", ("e4", "e11")),
        ("breadth", "width", ("e5", "e8")),
        ("square", "angle", ("e4", "e5")),
    ],
    "wedge": [("length", "width", ("e4", "e11")), ("breadth", "width", ("e5", "e7"))],
    "roof": [("length", "width", ("e4", "e13")), ("slope", "width", ("e5", "e7"))],
}
DATUMS = {
    "block": ("e4", "e5", "e8", "e11", "e9", "e10"),
    "wedge": ("e4", "e5", "e7", "e11", "e9", "e10", "e12"),
    "roof": ("e4", "e5", "e7", "e13", "e11"),
}
"""What the camera sees of them with contrast, or most of it."""
EVERY = {
    "block": ("e4", "e5", "e8", "e11", "e9", "e10", "e12"),
    "wedge": ("e4", "e5", "e6", "e7", "e8", "e9", "e10", "e11", "e12"),
    "roof": ("e4", "e5", "e6", "e7", "e10", "e13", "e14", "e11", "e12", "e15"),
}
"""All of it."""


def scene(
    folder: Path, name: str, datums: tuple[str, ...] | None = None, datum_sd: float = 0.0, **changes: Any
) -> Scene:
    """One of the parts, from all its datums or some; its place is known to `MOST`."""
    hull = ConvexHull(np.array(CORNERS[name], float))
    mesh = trimesh.Trimesh(hull.points, hull.simplices)
    mesh.fix_normals()
    mesh.export(folder / f"{name}.stl")
    limits = [{"half_width": float(each)} for each in MOST]
    made = Scene.model_validate({
        "name": name, "units": "mm", "object": {"kind": "mesh", "units": "mm", "file": str(folder / f"{name}.stl")},
        "material": {"diffuse_reflectance": 0.9},
        "camera": {"width": 320, "height": 272, "focal_px": 1200.0, "distance": 300.0, "look_at": [0, 0, 6],
                   "blur_px": 0.7, "exposure": 190.0},
        "light": {"distance": 300.0}, "noise": {"dark_level": 16.0, "sigma": 1.6, "bits": 8},
        "uncertainty": {"part_shift": limits[:3], "part_tilt_deg": limits[3:]},
        "placement": {"from": "datums", "datums": list(datums or DATUMS[name]), "datum_sd": datum_sd},
        "measurands": [{"name": asked, "kind": kind, "features": [{"edge": edge} for edge in edges], "tolerance": 0.05}
                       for asked, kind, edges in ASKED[name]],
    })  # fmt: skip
    return made.with_(**changes) if changes else made


def drawn(rng: np.random.Generator, most: np.ndarray = MOST) -> np.ndarray:
    """A place of the part at random, evenly over what is plausible, (6,)."""
    return rng.uniform(-1, 1, 6) * most


def seen(picture: Picture, placement: np.ndarray) -> np.ndarray:
    """Noise-free image of the part at a place, grey levels."""
    return image(placed(picture, placement))


def exact_information(picture: Picture) -> np.ndarray:
    """What an image tells of the part's place, and of what is estimated of the camera, (k, k), in units of what is
    known before; levels of faces left free.

    From central differences of whole images of displaced parts, pixel by pixel, without lines, corners or slopes.
    """
    steps = root(picture.scene).T * 1e-3
    moved = [(seen(picture, step) - seen(picture, -step)).ravel() / 2e-3 for step in steps]
    model = information(Pictures.of(picture), reach=np.inf).model
    image_, slopes = model.evaluate(model.start())
    levels, gain = response(picture.scene.noise, image_)
    weight = (gain / np.sqrt(levels.noise_variance))[:, None]
    free = slopes[:, 2 * model.free.size : -1] * weight
    basis, _ = np.linalg.qr(free[:, np.abs(free).sum(0) > 0])
    told = np.stack(moved, -1) * weight
    told -= basis @ (basis.T @ told)
    return told.T @ told
