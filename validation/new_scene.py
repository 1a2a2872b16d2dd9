"""A scene to begin with: a part, a camera that sees all of it, what could be measured of it, a setting."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np

import scenes
from scenes import InvalidInput, Measurand, Mesh, Scene, Solid
from scenes.load import from_document
from scenes.measurands.features import AnyFeature
from scenes.measurands.proposed import proposed
from scenes.parts import step
from scenes.parts.mesh_file import SAY_UNIT
from scenes.parts.step_file import Step
from scenes.units import in_unit
from validation.first_look import FirstLook, first_look

_SENSOR = {"width": 1280, "height": 1024, "pixel_pitch_um": 4.8}
_SHORT_MM, _LONG_MM = 12.0, 100.0  # focal lengths
_FILLS = 0.7  # of the field of view's height, by the part's diagonal
_NEAR = 8.0  # focal lengths between the short lens and the part, at least

_TEXT = """\
# Lengths in {units}, image lengths in px, angles in degrees (polar, azimuth), brightness in grey levels.
# What else can be said: docs/scene-format.md. What this part has to name: ice show {name}
title = "{title}"
units = "{units}" # of all lengths here: mm, cm, m or inch

[object]
{part}

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
"""
_ASKED = """\

# What could be measured, as ice new proposes it, with tolerances of ISO 2768-1, class m: put in those of the drawing.
{measurands}
[[settings]] # where they stand for ice validate; ice plan proposes better places
sensor = {sensor}
light = {light}
"""
_NOTHING = """
# Nothing to measure was found: [[measurands]] say what is wanted (docs/requirements.md).
"""


def written(
    part: Path,
    path: Path,
    units: str,
    report: Callable[[str, int, int], None] = lambda *_: None,
    body: str | int | None = None,
) -> tuple[Scene, FirstLook | None]:
    """Write a scene of a part's file.

    Parameters
    ----------
    part : Path
        STL, PLY, OBJ, GLB, 3MF or STEP.
    path : Path
        The scene's file.
    units : str
        Of the scene, and of a mesh's numbers where its file says none.
    report : callable
        Called with what is done, how many steps are done, and of how many.
    body : str or int, optional
        One of several bodies by its name or number; all where not given.

    Returns
    -------
    scene : Scene
    look : FirstLook or None
        What is proposed to be measured; None where nothing is.

    Raises
    ------
    InvalidInput
        If the part cannot be read.
    """
    if units not in scenes.UNITS:
        raise InvalidInput(f"--units must be one of {', '.join(scenes.UNITS)}, got {units!r}")
    report("reading", 0, 5)
    record = _record(part, units, body)
    text = _text(record, path, units, *_box(record.solid_in(units)))
    scene = _loaded(text, path, record)
    candidates = proposed(scene.all_walls, units)
    look = first_look(scene, candidates, report) if candidates else None
    text += _NOTHING if look is None else _asked(look)
    made = _loaded(text, path, record)
    path.write_text(text, encoding="utf-8")
    return made, look


def _record(part: Path, units: str, body: str | int | None) -> Step | Mesh:
    """The part as a scene would say it."""
    if part.suffix.lower() in step.FORMATS:
        return Step(kind="step", file=part, body=body)
    return Mesh(kind="mesh", file=part, units=None if part.suffix.lower() in SAY_UNIT else units, body=body)


def _box(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates, (3,) each."""
    return solid.vertices.min(0), solid.vertices.max(0)


def _text(record: Step | Mesh, path: Path, units: str, low: np.ndarray, high: np.ndarray) -> str:
    """All but what is measured, and where."""
    focal, distance = _lens(in_unit(float(np.linalg.norm(high - low)), units, "mm"))
    said = [f'kind = "{record.kind}"', f"file = {_quoted(os.path.relpath(record.file, path.parent))}"]
    if record.body is not None:
        said.append(f"body = {json.dumps(record.body)} # one of several")
    if getattr(record, "units", None):
        said.append(f'units = "{units}" # of the numbers in that file')
    return _TEXT.format(
        units=units,
        name=path.name,
        title=record.file.stem.replace('"', "'").replace("\\", "/"),
        part="\n".join(said),
        **_SENSOR,
        focal=f"{focal:.1f}",
        distance=f"{in_unit(distance, 'mm', units):.6g}",
        look_at=[float(f"{x:.6g}") for x in (low + high) / 2],
    )


def _asked(look: FirstLook) -> str:
    """What is measured, and where."""
    measurands = "\n".join(map(_measurand, look.measurands))
    poses = ([float(x) for x in pose] for pose in (look.sensor, look.light))
    return _ASKED.format(measurands=measurands, **dict(zip(("sensor", "light"), poses, strict=True)))


def _measurand(each: Measurand) -> str:
    features = ", ".join(map(_inline, each.features))
    return (
        f"[[measurands]]\nname = {json.dumps(each.name)}\nkind = {json.dumps(each.kind)}\n"
        f"features = [{features}]\ntolerance = {each.tolerance.plus}\n"
    )


def _inline(feature: AnyFeature) -> str:
    """A feature as a table in one line."""
    said = (f"{key} = {json.dumps(value)}" for key, value in feature.model_dump(mode="json").items())
    return "{ " + ", ".join(said) + " }"


def _loaded(text: str, path: Path, record: Step | Mesh) -> Scene:
    """The scene that a text says, of a part that has been read."""
    return from_document(path, {**tomllib.loads(text), "object": record})


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "/").replace('"', '\\"') + '"'


def _lens(diagonal: float) -> tuple[float, float]:
    """Focal length and distance, mm, at which a part of this size fills its share of the picture.

    The long lens keeps its distance from what is so small that the short one would stand nearer than lenses focus.
    """
    height = _SENSOR["height"] * _SENSOR["pixel_pitch_um"] / 1000
    lengths = 1 + diagonal / (_FILLS * height)
    focal = _SHORT_MM if lengths >= _NEAR else _LONG_MM
    return focal, focal * lengths
