"""What a scene's object has to name: vertices, edges, circles and curved surfaces, with places and lengths."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from rich.console import Group
from rich.text import Text

from scenes import Curved, Mesh, Scene
from scenes.measurands.measurands import quantities_of
from scenes.parts.recognised import Recognised, cylinders
from scenes.parts.solid import Circle, Edge, Solid
from scenes.results import picked
from validation.report import camera_words
from validation.report.cells import table, zone
from validation.strict_json import plain


def facts(scene: Scene) -> dict[str, Any]:
    """For JSON; lengths in the scene's unit."""
    solid = scene.solid
    facets = {each.name: each for each in (cylinders(solid) if isinstance(scene.object, Mesh) else ())}
    return plain({
        "scene": scene.name,
        "units": scene.units,
        "vertices": [{"name": name, "at": solid.vertex(name)} for name in solid.corner_names],
        "edges": [_edge(solid, edge) for edge in solid.sharp],
        "circles": list(map(_circle, solid.rims)),
        "faces": [_face(scene, f) for f in range(len(solid.faces)) if solid.plane[f]],
        "cylinders": list(map(_cylinder, facets.values())),
        "surfaces": [_surface(wall, facets.get(wall.name)) for wall in scene.all_walls.curved],
        "mended": solid.mended,
        "lights": [
            light.model_dump(mode="json", exclude_defaults=True) | picked(light, "kind", "mount")
            for light in scene.lights
        ],
        **({} if (board := scene.placement.board) is None else {"board": board.model_dump(mode="json")}),
    })  # fmt: skip


def _edge(solid: Solid, edge: Edge) -> dict[str, Any]:
    ends = [solid.vertex_names[end] for end in edge.ends]
    return {"name": edge.name, "ends": ends, "length": solid.length(edge), "convex": edge.convex}


def _circle(circle: Circle) -> dict[str, Any]:
    told = {
        "name": circle.name, "centre": circle.centre, "axis": circle.axis, "diameter": 2 * circle.radius,
        "hole": circle.hole,
    }  # fmt: skip
    return told if circle.ends is None else told | {"turn": math.degrees(circle.turn)}


def _face(scene: Scene, f: int) -> dict[str, Any]:
    solid = scene.solid
    at = solid.vertices[list(solid.faces[f])].mean(0)
    return {"name": solid.face_names[f], "at": at, "normal": solid.normals[f], "material": _material(scene, f)}


def _cylinder(each: Recognised) -> dict[str, Any]:
    """A cylinder that facets stand for."""
    surface = each.surface
    return {
        "name": each.name, "point": surface.point, "axis": surface.axis, "diameter": 2 * surface.radius,
        "hole": surface.hollow, "length": surface.ends[1] - surface.ends[0], "turn": each.turn_deg,
        "facets": len(each.faces), "residual": each.residual, "largest": each.largest,
    }  # fmt: skip


def sides(lengths: Iterable[float]) -> str:
    """
    >>> sides((60, 40, 12.00004))
    '60 x 40 x 12'
    """
    return " x ".join(f"{x:.4g}" for x in lengths)


def report(scene: Scene) -> Group:
    """The same as tables."""
    unit, camera = scene.units, scene.camera
    size, view = sides(np.ptp(scene.solid.vertices, axis=0)), sides(camera.field_of_view)
    parts = [
        Text(
            f"{scene.title or scene.name}\n"
            f"Object {size} {unit}, field of view {view} {unit} at {camera.distance:g} {unit}"
            + "".join(f"\n{each}" for each in (camera_words.lens(camera, unit),) if each)
            + "".join(f"\nMended: {each}" for each in scene.solid.mended)
        )
    ]
    found = (table(f"\n{title}, {unit}", *columns, rows=rows, words=_WORDS) for title, columns, rows in _tables(scene))
    return Group(*parts, *(made for made in found if made.row_count), Text(_TERMS), Text(_smooth(scene)))


_TERMS = """
inner: an edge as at the foot of a step. hole, outer: of which side a circle is the rim. residual: how far the mesh is
from the exact surface, rms. mount: free, with the camera, or fixed. [[measurands]] of a scene file refer to names."""
_WORDS = ("name", "kind", "of", "mount", "")


def _tables(scene: Scene) -> Iterator[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Title, columns and rows of each table."""
    known = facts(scene)
    yield "What is measured", ("name", "kind", "of", "tolerance"), list(_requirements(scene))
    yield "Vertices", ("name", *"xyz"), [(each["name"], *_place(each["at"])) for each in known["vertices"]]
    yield "Edges", ("name", "from", "to", "length", ""), [
        (each["name"], *each["ends"], _number(each["length"]), "" if each["convex"] else "inner")
        for each in known["edges"]
    ]  # fmt: skip
    yield "Circles", ("name", *"xyz", "diameter", ""), [
        (each["name"], *_place(each["centre"]), _number(each["diameter"]), _arc(each)) for each in known["circles"]
    ]  # fmt: skip
    yield "Cylinders among the facets", ("name", *"xyz", "axis", "diameter", "residual", ""), [
        (each["name"], *_place(each["point"]), _direction(each["axis"]), _number(each["diameter"]),
         f"{each['residual']:.1e}", _side(each))
        for each in known["cylinders"]
    ]  # fmt: skip
    yield "Curved surfaces to measure", ("name", "kind", *"xyz", "axis", "radius", "residual"), [
        (each["name"], each["kind"], *_place(each["centre"]), _direction(each["axis"]), _number(each["radius"]),
         "" if each["residual"] is None else f"{each['residual']:.1e}")
        for each in known["surfaces"]
    ]  # fmt: skip
    yield "Plane faces, by their middles", ("name", *"xyz", "normal", "material"), [
        (each["name"], *_place(each["at"]), _direction(each["normal"]), each["material"] or "")
        for each in known["faces"]
    ]  # fmt: skip
    yield "Lights", ("kind", "mount", "distance", "intensity", "half size"), [
        (light.kind, light.mount, *(f"{value:.4g}" for value in (light.distance, light.intensity, light.half_size)))
        for light in scene.lights
    ]  # fmt: skip


def _requirements(scene: Scene) -> Iterator[tuple[str, ...]]:
    """A row a number that the scene asks for; none of a scene that asks for nothing."""
    for each in quantities_of(scene.task, scene.measurands):
        unit = scene.unit_of(each)
        yield (
            each.name,
            each.kind,
            each.told_of,
            f"{zone(each.tolerance)} {unit}".replace("±", "+-"),
        )


def _place(at: list[float]) -> tuple[str, ...]:
    return tuple(map(_number, at))


def _direction(axis: list[float] | None) -> str:
    return " ".join(f"{x:z.2f}" for x in axis or ())


def _side(circle: dict[str, Any]) -> str:
    return "hole" if circle["hole"] else "outer"


def _arc(circle: dict[str, Any]) -> str:
    turn = f", arc of {circle['turn']:.0f} degrees" if "turn" in circle else ""
    return f"{_side(circle)}{turn}"


def _surface(wall: Curved, recognised: Recognised | None) -> dict[str, Any]:
    """A curved surface; what is left of its recognition, None where the surface is known exactly."""
    surface = wall.surface
    axis, ends = getattr(surface, "axis", None), getattr(surface, "ends", None)
    return {
        "name": wall.name,
        "kind": surface.kind,
        "centre": wall.centre,
        "axis": axis,
        "radius": wall.radius,
        "half_angle": getattr(surface, "half_angle_deg", None),
        "length": None if ends is None else ends[1] - ends[0],
        "residual": recognised and recognised.residual,
    }


def _material(scene: Scene, face: int) -> str | None:
    """Name of a face's own material; None where it is the scene's."""
    kind = scene.surfaces.kinds[face]
    return scene.materials[kind - 1].name if kind else None


def _smooth(scene: Scene) -> str:
    left = len(scene.solid.edges) - len(scene.solid.sharp)
    return (
        f"{left} more edges stand for curved surfaces and their rims: nothing can be measured by them." if left else ""
    )


def _number(value: float) -> str:
    return f"{value + 0.0:.6g}" if abs(value) > 1e-9 else "0"
