"""A block whose requirements lie on several sides, so that no single picture sees all of them well."""

from __future__ import annotations

from pathlib import Path

import scenes

_ABOUT = """
title = "A block with requirements on several sides"
object = { kind = "block", size = [10.0, 6.0, 4.0] }
material = { diffuse_reflectance = 0.9 }
camera = { width = 256, height = 240, focal_px = 800.0, distance = 100.0, blur_px = 0.6, exposure = 200.0 }
light = { distance = 100.0 }
noise = { dark_level = 20.0, sigma = 2.4, bits = 8 }
"""
_WIDTH = """
[[measurands]]
name = "{}"
kind = "width"
features = [{{ edge = "{}" }}, {{ edge = "{}" }}]
tolerance = 0.02
"""
_WIDTHS = {
    "front": ("e2", "e3"),
    "height": ("e1", "e4"),
    "top": ("e9", "e11"),
    "across": ("e4", "e7"),
    "back": ("e6", "e8"),
}


def sides(directory: Path, *names: str) -> scenes.Scene:
    """The scene with some of the widths: ``front`` and ``height`` of the front, ``top`` and ``across``, ``back``."""
    return scenes.load(written(directory, *names))


def written(directory: Path, *names: str) -> Path:
    """Its file."""
    path = directory / f"{'_'.join(names)}.toml"
    path.write_text(_ABOUT + "".join(_WIDTH.format(name, *_WIDTHS[name]) for name in names))
    return path
