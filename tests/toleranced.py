"""A plate with geometric tolerances and features between others, each with its values from the plate's numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes import Scene
from tests import parts


def _circle(name: str) -> dict[str, str]:
    return {"circle": name}


def _edge(name: str) -> dict[str, str]:
    return {"edge": name}


_B, _C, _D = map(_circle, ("c2", "c6", "c4"))  # bores about (8, 8), (52, 8), (30, 32)
_ENDS = _circle("c8"), _circle("c10")  # round ends of the slot
_LEFT, _FRONT, _BACK, _RIGHT = map(_edge, ("e4", "e5", "e8", "e15"))
_SLOT = {"centre_line": ["e10", "e12"]}
_PLATE = {"centre_line": ["e5", "e8"]}
_CORNER = {"vertex": "v8", "edges": ["e8", "e15"]}
_BORES = np.array([(x, y) for x, y, _ in parts.TOLERANCED])
CENTRE = np.linalg.solve(2 * (_BORES[1:] - _BORES[0]), (_BORES[1:] ** 2).sum(1) - (_BORES[0] ** 2).sum())

ASKED: tuple[tuple[str, str, list, float | None, dict[str, float]], ...] = (
    ("round end", "radius", [_ENDS[0]], 0.05, {"round end": 3.0}),
    ("slot", "slot", [*_ENDS], 0.1, {"slot.width": 6.0, "slot.length": 20.0}),
    ("bolts", "pitch_circle", [_B, _C, _D], 0.1, {"bolts": 2 * np.linalg.norm(_BORES[0] - CENTRE)}),
    ("in edges", "true_position", [_D, _FRONT, _LEFT], 0.2, {"in edges.x": 30.0, "in edges.y": 32.0}),
    ("from a bore", "true_position", [_D, _FRONT, _B], 0.2, {"from a bore.x": 22.0, "from a bore.y": 32.0}),
    ("about a bore", "true_position", [_D, _B, _FRONT], 0.2, {"about a bore.x": 22.0, "about a bore.y": 24.0}),
    ("in bores", "true_position", [_D, _B, _C], 0.2, {"in bores.x": 22.0, "in bores.y": 24.0}),
    ("backwards", "true_position", [_D, _C, _B], 0.2, {"backwards.x": 22.0, "backwards.y": -24.0}),
    ("centres", "concentricity", [_B, _C], None, {"centres.x": -44.0, "centres.y": 0.0}),
    ("slot to plate", "symmetry", [_SLOT, _PLATE], 0.2, {"slot to plate": -2.0}),
    ("bore to slot", "symmetry", [_D, _SLOT], 0.2, {"bore to slot": 14.0}),
    ("back", "parallelism", [_BACK, _FRONT], 0.1, {"back": 0.0}),
    ("right", "perpendicularity", [_RIGHT, _FRONT], 0.1, {"right": 0.0}),
    ("to the middle", "distance", [_CORNER, {"midpoint": list(_ENDS)}], 0.1, {"to the middle": np.hypot(30, 22)}),
    ("to the crossing", "distance", [_D, {"crossing": ["e5", "e4"]}], 0.1, {"to the crossing": np.hypot(30, 32)}),
    ("to the foot", "distance", [_B, {"foot": _D, "on": "e5"}], 0.1, {"to the foot": np.hypot(22, 8)}),
    ("from the line", "offset", [_D, {"through": [_B, _C]}], 0.1, {"from the line": 24.0}),
    ("to the pattern", "offset", [{"pitch_circle": ["c2", "c6", "c4"]}, _FRONT], 0.1, {"to the pattern": CENTRE[1]}),
    ("slot to bores", "width", [{"centre_line": ["e4", "e15"]}, {"square_at": [_B, _C]}], 0.2, {"slot to bores": 22.0}),
    ("wall", "width", [_SLOT, _BACK], 0.1, {"wall": 22.0}),
    ("lines", "angle", [{"through": [_B, _D]}, _FRONT], 0.1, {"lines": np.degrees(np.arctan2(24, 22))}),
)  # fmt: skip
"""Name, kind, features, tolerance, and the values of its numbers: mm, degrees."""
VALUES: dict[str, float] = {name: value for *_, values in ASKED for name, value in values.items()}


def scene(folder: Path, names: tuple[str, ...] = (), facets: int = 96, **camera: object) -> Scene:
    """The plate in a folder, with all measurands or those of some names, bores of so many facets, 12 px a mm."""
    file = folder / "toleranced.ply"
    parts.toleranced(facets).export(file)
    asked = [
        {"name": name, "kind": kind, "features": features} | ({} if tolerance is None else {"tolerance": tolerance})
        for name, kind, features, tolerance, _ in ASKED
        if not names or name in names
    ]
    return Scene.model_validate({
        "name": "toleranced", "units": "mm", "object": {"kind": "mesh", "units": "mm", "file": str(file)},
        "material": {"diffuse_reflectance": 0.8}, "light": {"distance": 300.0}, "measurands": asked,
        "camera": {"width": 900, "height": 720, "focal_px": 3400.0, "distance": 300.0, "look_at": [30.0, 20.0, 6.0],
                   "blur_px": 0.7, "exposure": 180.0, **camera},
        "noise": {"dark_level": 16.0, "sigma": 1.5, "bits": 8},
    })  # fmt: skip
