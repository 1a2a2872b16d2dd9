"""What a scene's object has to name: vertices, edges, circles and curved surfaces, with places and lengths."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Group
from rich.table import Table
from rich.text import Text

from scenes import AnyLight, Curved, Mesh, Scene
from scenes.parts.recognised import Recognised, cylinders


def facts(scene: Scene) -> dict[str, Any]:
    """For JSON; lengths in the scene's unit."""
    solid = scene.solid
    here = {name: solid.vertex(name).tolist() for name in solid.corner_names}
    facets = {each.name: each for each in (cylinders(solid) if isinstance(scene.object, Mesh) else ())}
    return {
        "scene": scene.name,
        "units": scene.units,
        "vertices": [{"name": name, "at": at} for name, at in here.items()],
        "edges": [
            {
                "name": edge.name,
                "ends": [solid.vertex_names[end] for end in edge.ends],
                "length": float(np.linalg.norm(np.subtract(*solid.vertices[list(edge.ends)]))),
                "convex": edge.convex,
            }
            for edge in solid.sharp
        ],
        "circles": [
            {
                "name": circle.name,
                "centre": circle.centre.tolist(),
                "axis": circle.axis.tolist(),
                "diameter": 2 * circle.radius,
                "hole": circle.hole,
            }
            for circle in solid.circles
        ],
        "faces": [
            {
                "name": solid.face_names[f],
                "at": solid.vertices[list(face)].mean(0).tolist(),
                "normal": solid.normals[f].tolist(),
                "material": _material(scene, f),
            }
            for f, face in enumerate(solid.faces)
            if solid.plane[f]
        ],
        "cylinders": [
            {
                "name": each.name,
                "point": each.surface.point.tolist(),
                "axis": each.surface.axis.tolist(),
                "diameter": 2 * each.surface.radius,
                "hole": each.surface.hollow,
                "length": each.surface.ends[1] - each.surface.ends[0],
                "turn": each.turn_deg,
                "facets": len(each.faces),
                "residual": each.residual,
                "largest": each.largest,
            }
            for each in facets.values()
        ],
        "surfaces": [_surface(wall, facets.get(wall.name)) for wall in scene.all_walls.curved],
        "lights": [light.model_dump(mode="json", exclude_defaults=True) | _kind(light) for light in scene.lights],
    }


def report(scene: Scene) -> Group:
    """The same as tables."""
    known, unit, camera = facts(scene), scene.units, scene.camera
    size = " x ".join(f"{x:.4g}" for x in np.ptp(scene.solid.vertices, axis=0))
    view = " x ".join(f"{x:.4g}" for x in camera.field_of_view)
    parts = [
        Text(
            f"{scene.title or scene.name}\n"
            f"Object {size} {unit}, field of view {view} {unit} at {camera.distance:g} {unit}"
        )
    ]
    corners = _table(f"\nVertices, {unit}", "name", "x", "y", "z")
    for vertex in known["vertices"]:
        corners.add_row(vertex["name"], *map(_number, vertex["at"]))
    edges = _table(f"\nEdges, {unit}", "name", "from", "to", "length", "")
    for edge in known["edges"]:
        edges.add_row(edge["name"], *edge["ends"], _number(edge["length"]), "" if edge["convex"] else "inner")
    circles = _table(f"\nCircles, {unit}", "name", "x", "y", "z", "diameter", "")
    for circle in known["circles"]:
        row = circle["name"], *map(_number, circle["centre"]), _number(circle["diameter"])
        circles.add_row(*row, "hole" if circle["hole"] else "outer")
    walls = _table(f"\nCylinders among the facets, {unit}", "name", "x", "y", "z", "axis", "diameter", "residual", "")
    for wall in known["cylinders"]:
        axis = " ".join(f"{x:z.2f}" for x in wall["axis"])
        row = wall["name"], *map(_number, wall["point"]), axis, _number(wall["diameter"])
        walls.add_row(*row, f"{wall['residual']:.1e}", "hole" if wall["hole"] else "outer")
    curved = _table(
        f"\nCurved surfaces to measure, {unit}", "name", "kind", "x", "y", "z", "axis", "radius", "residual"
    )
    for each in known["surfaces"]:
        axis = " ".join(f"{x:z.2f}" for x in each["axis"] or ())
        residual = "" if each["residual"] is None else f"{each['residual']:.1e}"
        curved.add_row(
            each["name"], each["kind"], *map(_number, each["centre"]), axis, _number(each["radius"]), residual
        )
    faces = _table(f"\nPlane faces, by their middles, {unit}", "name", "x", "y", "z", "normal", "material")
    for face in known["faces"]:
        normal = " ".join(f"{x:z.2f}" for x in face["normal"])
        faces.add_row(face["name"], *map(_number, face["at"]), normal, face["material"] or "")
    lights = _table(f"\nLights, {unit}", "kind", "mount", "distance", "intensity", "half size")
    for light in scene.lights:
        numbers = light.distance, light.intensity, light.half_size
        lights.add_row(light.kind, light.mount, *(f"{value:.4g}" for value in numbers))
    tables = (t for t in (corners, edges, circles, walls, curved, faces, lights) if t.row_count)
    return Group(*parts, *tables, Text(_smooth(scene)))


def _surface(wall: Curved, recognised: Recognised | None) -> dict[str, Any]:
    """A curved surface; what is left of its recognition, None where the surface is known exactly."""
    surface = wall.surface
    axis, ends = getattr(surface, "axis", None), getattr(surface, "ends", None)
    return {
        "name": wall.name,
        "kind": surface.kind,
        "centre": wall.centre.tolist(),
        "axis": None if axis is None else axis.tolist(),
        "radius": wall.radius,
        "half_angle": getattr(surface, "half_angle_deg", None),
        "length": None if ends is None else ends[1] - ends[0],
        "residual": recognised and recognised.residual,
    }


def _kind(light: AnyLight) -> dict[str, str]:
    return {"kind": light.kind, "mount": light.mount}


def _material(scene: Scene, face: int) -> str | None:
    """Name of a face's own material; None where it is the scene's."""
    kind = scene.surfaces.kinds[face]
    return scene.materials[kind - 1].name if kind else None


def _smooth(scene: Scene) -> str:
    left = len(scene.solid.edges) - len(scene.solid.sharp)
    return (
        f"\n{left} more edges stand for curved surfaces and their rims: nothing can be measured by them."
        if left
        else ""
    )


def _number(value: float) -> str:
    return f"{value + 0.0:.6g}" if abs(value) > 1e-9 else "0"


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1), title_style="bold")
    for name in columns:
        table.add_column(name, justify="left" if name in ("name", "kind", "mount", "") else "right", no_wrap=True)
    return table
