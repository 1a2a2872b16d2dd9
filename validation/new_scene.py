"""A scene to begin with: a part, a camera that sees all of it, what could be measured of it, a setting."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import scenes
from scenes import InvalidInput, Measurand, Mesh, Scene, Solid
from scenes.files.door import read_bytes
from scenes.load import from_document
from scenes.measurands.between import AnyFeature
from scenes.measurands.drawn import Drawn, drawn
from scenes.measurands.drawn_material import asks_for_material, with_material
from scenes.measurands.proposed import proposed
from scenes.parts import limits, pmi, step
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

# {whose}
{measurands}
[[settings]] # where they stand for ice validate; ice plan proposes better places
sensor = {sensor}
light = {light}
"""
_UNSEEN = """\
# The file asks for this, too; it is not seen from there; with the # away, ice plan --coverage finds pictures that do:
{measurands}
"""
_PROPOSED = (
    "What could be measured, as ice new proposes it, with tolerances of ISO 2768-1, class m: "
    "put in those of the drawing."
)
_DRAWN = "What the part's file asks for, with its limits."
_NOTHING = """
# Nothing to measure was found: [[measurands]] say what is wanted (docs/requirements.md).
"""


@dataclass(frozen=True)
class NewScene:
    """A scene that was written.

    Attributes
    ----------
    scene : Scene
    look : FirstLook or None
        What is proposed to be measured; None where nothing is.
    drawn : tuple of Drawn
        Dimensions and tolerances of the part's file, if it has any.
    """

    scene: Scene
    look: FirstLook | None
    drawn: tuple[Drawn, ...] = ()

    @property
    def characteristics(self) -> list[dict[str, Any]]:
        """For JSON: one for each dimension and tolerance of the file."""
        return [_facts(each, self.scene) for each in self.drawn]


def written(
    part: Path,
    path: Path,
    units: str,
    report: Callable[[str, int, int], None] = lambda *_: None,
    body: str | int | None = None,
    general: str | None = None,
) -> NewScene:
    """Write a scene of a part's file; of the dimensions in the file, where it has any (STEP AP242).

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
    general : {"f", "m", "c", "v"}, optional
        Class of ISO 2768-1 that gives the file's lengths limits where they have none; the one that the file states,
        if any, where not given.

    Raises
    ------
    InvalidInput
        If the part cannot be read.
    """
    if units not in scenes.UNITS:
        raise InvalidInput(f"--units must be one of {', '.join(scenes.UNITS)}, got {units!r}")
    if general is not None and general not in limits.CLASSES:
        raise InvalidInput(f"--general must be one of {', '.join(limits.CLASSES)}, got {general!r}")
    report("reading", 0, 5)
    record = _record(part, units, body)
    text = _text(record, path, units, *_box(record.solid_in(units)))
    scene = _loaded(text, path, record)
    asked = _asked_by_file(record, units, general)
    options = [measurand for each in asked for some in each.candidates for measurand in some]
    candidates = tuple(options) or proposed(scene.all_walls, units)
    look = None
    if candidates:
        look = first_look(scene, candidates, report, **({"most": len(options)} if options else {}))
        look = _each_once(look, asked) if options else look
        look = replace(look, measurands=with_material(scene.solid, look.measurands, asked))
    text += _NOTHING if look is None else _measured(look, asked)
    made = _loaded(text, path, record)
    path.write_text(text, encoding="utf-8")
    return NewScene(made, look, asked)


def _asked_by_file(record: Step | Mesh, units: str, general: str | None) -> tuple[Drawn, ...]:
    """Dimensions and tolerances of the part's file."""
    if not isinstance(record, Step):
        return ()
    found = pmi.read(read_bytes(record.file, step.MOST_BYTES))
    if general := general or found.general:
        found = replace(found, characteristics=tuple(pmi.with_general(each, general) for each in found.characteristics))
    return drawn(record.part_in(units), found, units) if found.characteristics else ()


def _each_once(look: FirstLook, asked: tuple[Drawn, ...]) -> FirstLook:
    """By one measurand each feature of a characteristic, in the file's order."""
    shown = {measurand.name: k for k, measurand in enumerate(look.measurands)}
    groups = (some for each in asked for some in each.candidates)
    kept = [next(iter([shown[m.name] for m in some if m.name in shown]), None) for some in groups]
    rows = [k for k in kept if k is not None]
    reasons = look.reasons or ("",) * len(look.measurands)
    return replace(look, **{
        name: tuple(values[k] for k in rows)
        for name, values in (("measurands", look.measurands), ("statuses", look.statuses), ("reasons", reasons))
    })  # fmt: skip


def _facts(each: Drawn, scene: Scene) -> dict[str, Any]:
    """A characteristic, by which measurands of the scene it is measured, or why not."""
    told, known = each.characteristic, {measurand.name for measurand in scene.measurands}
    measured = [m.name for some in each.candidates for m in some if m.name in known]
    lost, features = len(each.candidates) - len(measured), len(each.candidates)
    unseen = f"{lost} of {features} " * (features > 1) + "not seen from the setting that is proposed" if lost else ""
    return {
        "number": told.number, "kind": told.kind, "value": told.value, "plus": told.plus, "minus": told.minus,
        "fit": told.fit or None, "general": told.general or None, "note": told.note or None, "zone": told.zone,
        "round_zone": told.is_round, "modifiers": list(told.modifiers),
        "datums": list(told.datums), "datum_modifiers": list(told.datum_modifiers), "unit": told.unit,
        "faces": list(each.faces),
        "measurand": measured[0] if measured else None, "measurands": measured, "reason": each.reason or unseen or None,
    }  # fmt: skip


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


def _measured(look: FirstLook, asked: tuple[Drawn, ...]) -> str:
    """What is measured, and where; what the file asks for and is not seen, commented out."""
    material = asks_for_material(asked)
    measurands = "\n".join(_measurand(each, each.name in material) for each in look.measurands)
    poses = ([float(x) for x in pose] for pose in (look.sensor, look.light))
    whose = _DRAWN if any(each.candidates for each in asked) else _PROPOSED
    text = _ASKED.format(whose=whose, measurands=measurands, **dict(zip(("sensor", "light"), poses, strict=True)))
    shown = {measurand.name for measurand in look.measurands}
    unseen = [some[0] for each in asked for some in each.candidates if shown.isdisjoint(m.name for m in some)]
    if not unseen:
        return text
    lines = "\n".join(map(_measurand, unseen)).splitlines()
    return text + "\n" + _UNSEEN.format(measurands="\n".join(f"# {line}".rstrip() for line in lines))


def _measurand(each: Measurand, is_growing: bool = False) -> str:
    """A measurand as a scene has it; whether the file says that its zone grows with its size."""
    features = ", ".join(map(_inline, each.features))
    limits = each.tolerance
    tolerance = limits.plus if limits.plus == limits.minus else f"{{ plus = {limits.plus}, minus = {limits.minus} }}"
    nominal = "" if each.nominal is None else f"nominal = {_value(each.nominal)}\n"
    return (
        f"[[measurands]]\nname = {json.dumps(each.name)}\nkind = {json.dumps(each.kind)}\n"
        f"features = [{features}]\n{nominal}tolerance = {tolerance}\n{_material(each, is_growing)}"
    )


def _material(each: Measurand, is_growing: bool) -> str:
    if each.maximum_material is not None:
        return f"maximum_material = {json.dumps(each.maximum_material)} # whose size lets the zone grow (ISO 2692)\n"
    return "# at maximum material: its diameter with limits is not measured here\n" * is_growing


def _inline(feature: AnyFeature) -> str:
    """A feature as a table in one line."""
    return _value(feature.model_dump(mode="json"))


def _value(value: Any) -> str:
    """Names, lists and tables of them as TOML has them in a line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(part)}" for key, part in value.items()) + " }"
    return f"[{', '.join(map(_value, value))}]" if isinstance(value, list) else json.dumps(value)


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
