"""The file of a fitted scene: the user's own document with what the photographs have told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import scenes
from measure.fitting.parameters import size_of
from measure.fitting.result import Fit
from scenes import Lens
from scenes.cameras.binning import binned
from scenes.files.door import read_toml
from scenes.numbers import number_at
from scenes.scene import Scene
from scenes.uncertain import taken_out
from validation import copied_scene

_CAMERA = ("roll_deg", "exposure", "blur_px")
_SIZE = {"camera.distance": ("distance", "focal_px"), "camera.magnification": ("magnification", "pixel_pitch_um")}
_NOISE = ("sigma", "gain", "dark_level")
_SAID_ELSE = "black_level", "focal_length_mm", "wavelength_nm"  # other names of what has been fitted


def write(found: Fit, source: str, path: Path) -> Scene:
    """Write the fitted scene of a bundled scene or file, and load it; what stays keeps its comments.

    Raises
    ------
    InvalidInput
        If the file cannot be written, or what was fitted makes no scene: a sensor within the part, say.
    """
    origin = scenes.find(source)
    document = binned(taken_out(read_toml(origin)))  # what numbers were uncertain by, the photographs have told
    document.pop("uncertain", None)
    document = _document(found, document)
    head = f"# {origin.name} as photographs show it: camera, noise and settings were fitted (status {found.status}).\n"
    return copied_scene.write(document, origin, path, "--output", head)


def _document(found: Fit, document: dict[str, Any]) -> dict[str, Any]:
    scene = found.scene
    size = _SIZE[size_of(scene.camera)]
    again = ("working_distance_mm",) if "distance" in size else ("focal_px",)
    camera = {key: value for key, value in document["camera"].items() if key not in (*_SAID_ELSE, *again)}
    camera |= {key: number_at(scene, f"camera.{key}") for key in (*size, *_CAMERA)}
    camera["look_at"] = list(scene.camera.look_at)
    if scene.camera.blur_field is not None:  # a transfer would say the blur in the middle once more
        camera["blur_field"] = scene.camera.blur_field.without_middle()
    lens = scene.camera.lens
    if isinstance(lens, Lens) and lens.bends:
        camera["lens"] = {**camera.get("lens", {}), "distortion": list(lens.coefficients)}
    noise = document["noise"] | {key: number_at(scene, f"noise.{key}") for key in _NOISE}
    settings = [setting.model_dump(mode="json", exclude_none=True) for setting in scene.settings]
    return document | {"camera": camera, "noise": noise, "settings": settings, "same_scale": []}
