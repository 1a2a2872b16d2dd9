"""A scene to begin with: a part, a camera that sees all of it, a task between two of its corners, a setting."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

import planner
import scenes
from scenes import Edge, InvalidInput, Scene, Solid
from scenes.load import from_document
from scenes.parts import mesh
from scenes.status import is_trusted
from scenes.units import in_unit

_SENSOR = {"width": 1280, "height": 1024, "pixel_pitch_um": 4.8}
_FOCAL_MM = (4, 6, 8, 12, 16, 25, 35, 50, 75, 100)
_FILLS = 0.7  # of the field of view's height, by the part's diagonal
_NEAR, _FAR = 8.0, 20.0  # focal lengths between lens and part
_TASKS = 4  # distances that are tried
_TRIED = 24  # settings of least variance, of which the first that is not cluttered is taken
_SENSORS = list(itertools.product((20, 35, 50), range(0, 360, 30)))
_LIGHTS = list(itertools.product((25, 45, 60), range(0, 360, 60)))

_TEXT = """\
# Lengths in {units}, image lengths in px, angles in degrees (polar, azimuth), brightness in grey levels.
# What else can be said: docs/scene-format.md. What this part has to name: ice show {name}
title = "{title}"
units = "{units}" # of all lengths here: mm, cm, m or inch

[object]
kind = "mesh"
file = {file}
units = "{units}" # of the numbers in that file

[material]
diffuse_reflectance = 0.8 # matt and bright; give specular_fraction, refractive_index, roughness for gloss

[camera] # as on the data sheets of sensor and lens
width = {width}
height = {height}
pixel_pitch_um = {pixel_pitch_um}
focal_length_mm = {focal}
distance = {distance} # from the lens to look_at
look_at = {look_at} # the part's middle
blur_px = 0.8 # of the lens: standard deviation
exposure = 180.0 # grey levels of a white surface that faces light and camera

[light]
distance = {distance} # from look_at

[noise]
dark_level = 16.0
sigma = 1.5 # grey levels, temporal
bits = 8

[task] # the distance between two corners, each where two edges meet
kind = "distance"
start = {start}
end = {end}

[[settings]] # where they stand for ice validate; ice plan proposes better places
sensor = {sensor}
light = {light}
"""


def written(part: Path, path: Path, units: str, report: Callable[[str, int, int], None] = lambda *_: None) -> Scene:
    """Write a scene of a mesh file and load it.

    Parameters
    ----------
    part : Path
        STL, PLY or OBJ.
    path : Path
        The scene's file.
    units : str
        Of the part's numbers, and then of the scene.
    report : callable
        Called with what is done, how many steps are done, and of how many.

    Raises
    ------
    InvalidInput
        If the part cannot be read, or has no two corners that a camera could see at once.
    """
    if units not in scenes.UNITS:
        raise InvalidInput(f"--units must be one of {', '.join(scenes.UNITS)}, got {units!r}")
    report("reading", 0, _TASKS + 1)
    solid = mesh.read(part)
    low, high = solid.vertices.min(0), solid.vertices.max(0)
    diagonal = in_unit(float(np.linalg.norm(high - low)), units, "mm")
    focal, distance = _lens(diagonal)
    values = {
        "units": units,
        "name": path.name,
        "title": f"Distance on {part.stem}".replace('"', "'").replace("\\", "/"),
        "file": _quoted(os.path.relpath(part, path.parent)),
        **_SENSOR,
        "focal": f"{focal:.1f}",
        "distance": f"{in_unit(distance, 'mm', units):.6g}",
        "look_at": [float(f"{x:.6g}") for x in (low + high) / 2],
    }
    tasks = _tasks(solid)
    if not tasks:
        raise InvalidInput(f"PART must have two corners of sharp edges, got none in {part}")
    text, best = "", (True, np.inf)
    for step, (start, end) in enumerate(tasks[:_TASKS], 1):
        report("looking from everywhere", step, _TASKS + 1)
        made = _TEXT.format(**values, start=start, end=end, sensor="[30.0, 30.0]", light="[30.0, 90.0]")
        scene = _loaded(made, path)
        found, poses = _setting(scene)
        if found < best:
            best, text = found, _TEXT.format(**values, start=start, end=end, **poses)
    if not text:
        raise InvalidInput(f"PART must have two corners that can be seen at once, got none such in {part}")
    path.write_text(text, encoding="utf-8")
    return scenes.load(path)


def _setting(scene: Scene) -> tuple[tuple[bool, float], dict[str, list[float]]]:
    """How good the best setting of a coarse grid is (not ``ok``, variance), and its poses."""
    variance = planner.variances(scene, np.array(_SENSORS)[:, None], np.array(_LIGHTS)[None], objective="image")
    first = None
    for sensor, light in zip(*np.unravel_index(variance.ravel().argsort()[:_TRIED], variance.shape), strict=True):
        poses = {"sensor": list(map(float, _SENSORS[sensor])), "light": list(map(float, _LIGHTS[light]))}
        clear = np.isfinite(variance[sensor, light]) and is_trusted(planner.predict(scene, *poses.values()).status)
        if clear:
            return (False, float(variance[sensor, light])), poses
        first = first or ((True, float(variance[sensor, light])), poses)
    return first


def _loaded(text: str, path: Path) -> Scene:
    import tomllib

    return from_document(path, tomllib.loads(text))


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "/").replace('"', '\\"') + '"'


def _lens(diagonal: float) -> tuple[float, float]:
    """Focal length and distance, mm: the shortest that keeps its distance from a part of this size."""
    height = _SENSOR["height"] * _SENSOR["pixel_pitch_um"] / 1000
    enlarged = _FILLS * height / diagonal
    for focal in _FOCAL_MM:
        distance = focal * (1 + 1 / enlarged)
        if distance >= max(3 * diagonal, _NEAR * focal):
            break
    return float(focal), max(distance, 2 * diagonal)


def _tasks(solid: Solid) -> list[tuple[str, str]]:
    """Pairs of corners at the ends of the longest edges, the highest first, as they stand in a scene's file."""
    vertices, height = solid.vertices, np.ptp(solid.vertices[:, 2])
    rows = []
    for edge in solid.sharp:
        corners = [_corner(solid, edge, end) for end in edge.ends]
        if edge.convex and all(corners):
            ends = vertices[list(edge.ends)]
            level = np.round(ends[:, 2].mean() / max(height, 1e-12), 3)
            rows.append((-level, -float(np.linalg.norm(ends[1] - ends[0])), edge.name, tuple(corners)))
    return [row[-1] for row in sorted(rows)]


def _corner(solid: Solid, edge: Edge, end: int) -> str | None:
    """An edge's end with the other edge there that lies most in the horizontal."""
    name = solid.vertex_names[end]
    others = [other for other in solid.edges_at(name) if other is not edge] if name in solid.corner_names else []
    if not others:
        return None
    best = min(others, key=lambda other: abs(np.subtract(*solid.vertices[list(other.ends)])[2]))
    return f'{{ vertex = "{name}", edges = ["{edge.name}", "{best.name}"] }}'
