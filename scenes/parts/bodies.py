"""Files that may hold several bodies, and that say their unit: GLB (metres) and 3MF."""

from __future__ import annotations

import io
import json
import re
import zipfile
from importlib.util import find_spec
from pathlib import Path

import trimesh

from scenes.errors import InvalidInput
from scenes.parts.package import in_one_model

MOST_BODIES = 10_000
_NAMED = 12  # bodies in a message
_MOST_UNPACKED = 512 << 20  # bytes of a 3MF file's XML
_HOW = {"glb": {"skip_materials": True}, "3mf": {}}  # its own joining of primitives asks for their materials
_MISSING = "object.file must be of a kind that can be read: a 3MF file needs lxml, pip install 'ice-vision[3mf]'"


def read(path: Path, data: bytes, most_triangles: int) -> tuple[dict[str, trimesh.Trimesh], float]:
    """Bodies by their names, in the file's order and where they stand in it, and the length of its unit, mm.

    Raises
    ------
    InvalidInput
        If it says of itself that it is too large, or what reads it is not installed. What the reader raises.
    """
    kind = path.suffix.lower()[1:]
    if kind == "3mf" and find_spec("lxml") is None:
        raise InvalidInput(f"{_MISSING}, got {path}")
    {"glb": _check_glb, "3mf": _check_3mf}[kind](path, data, most_triangles)
    data = in_one_model(data) if kind == "3mf" else data
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=None, **_HOW[kind])
    nodes = scene.graph.transforms.node_data.items()
    found = {node: scene.geometry[facts["geometry"]] for node, facts in nodes if "geometry" in facts}
    found = {node: body for node, body in found.items() if isinstance(body, trimesh.Trimesh)}
    count = sum(len(body.faces) for body in found.values())
    if len(found) > MOST_BODIES or count > most_triangles:
        most = f"{most_triangles} triangles and {MOST_BODIES} bodies"
        raise InvalidInput(f"object.file must be of at most {most}, got {path} with {count} and {len(found)}")
    placed: dict[str, list[trimesh.Trimesh]] = {}
    for node, body in found.items():
        placed.setdefault(_owner(scene, node), []).append(body.copy().apply_transform(scene.graph[node][0]))
    joined = {name: parts[0] if len(parts) == 1 else trimesh.util.concatenate(parts) for name, parts in placed.items()}
    return joined, trimesh.units.unit_conversion(scene.units or "millimeters", "millimeters")


def _owner(scene: trimesh.Scene, node: str) -> str:
    """The node of the file that a node of the scene is, or is one of several primitives of (one for each colour)."""
    above = scene.graph.transforms.parents[node]
    is_primitive = scene.geometry[scene.graph.transforms.node_data[node]["geometry"]].metadata.get(
        "from_gltf_primitive"
    )
    return above if is_primitive and re.fullmatch(re.escape(above) + r"_\w{6}", node) else node


def chosen(bodies: dict[str, trimesh.Trimesh], body: str | int | None) -> trimesh.Trimesh:
    """One of several by its name or its number from 1, or all of them together.

    Raises
    ------
    InvalidInput
        If there is none of that name; the message lists them.
    """
    if body is None:
        return trimesh.util.concatenate(list(bodies.values()))
    names = list(bodies)
    if isinstance(body, int) and 0 < body <= len(names):
        return bodies[names[body - 1]]
    if body in bodies:
        return bodies[body]
    raise InvalidInput(f"object.body must be one of {listed(names)}, got {body!r}")


def listed(names: list[str]) -> str:
    """Numbers and names of bodies, in one line; without names that are numbers, as of objects that have none (3MF).

    >>> listed(["lid", "", "box", "1"])
    "1 'lid', 2, 3 'box', 4"
    """
    named = enumerate(names[:_NAMED], 1)
    told = [f"{number} {name!r}" if name and not name.isdecimal() else str(number) for number, name in named]
    return ", ".join(told) + (f", ... {len(names)}" if len(names) > _NAMED else "")


def _check_glb(path: Path, data: bytes, most: int) -> None:
    """Refuse counts for which a reader would take memory though the file has no such numbers."""
    try:
        facts = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
        counts = [accessor["count"] for accessor in facts.get("accessors", ())]
        told = max((int(count) for count in counts), default=0)
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InvalidInput(f"object.file must be a readable mesh, got {path} (a broken GLB header)") from None
    if told > 3 * most:
        raise InvalidInput(f"object.file must be of at most {most} triangles, got {path} with {told} numbers")


def _check_3mf(path: Path, data: bytes, most: int) -> None:
    """Refuse an archive that unpacks to more than a part of ``most`` triangles needs."""
    try:
        unpacked = sum(each.file_size for each in zipfile.ZipFile(io.BytesIO(data)).infolist())
    except zipfile.BadZipFile:
        raise InvalidInput(f"object.file must be a readable mesh, got {path} (no archive)") from None
    if unpacked > _MOST_UNPACKED:
        raise InvalidInput(
            f"object.file must be of at most {most} triangles, got {path} of {unpacked >> 20} MiB unpacked"
        )
