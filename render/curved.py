"""Curved surfaces as Mitsuba's shapes: exact spheres, cylinders and discs; cones as meshes with smooth normals.

A cone of n pieces has its silhouette r (1 - cos(pi / n)) inside at most: with 1024 pieces 5e-6 of its radius, below
1e-3 px for every radius up to 200 px.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from render.meshes import mesh
from scenes import Circle, Curved, Solid
from scenes.parts.surfaces import Cone, Cylinder, Sphere, axes_beside

_PIECES = 1024


def curved_shapes(mitsuba: Any, solid: Solid, bsdf: dict, own: np.ndarray) -> list[Any]:
    """Shapes of one material, that of the faces ``own`` (bool, (F,)): those which `stands_for` says no mesh has."""
    if not solid.curved:
        return []
    found = [shape(mitsuba, each, bsdf) for each in solid.curved if own[each.faces[0]]]
    found += [_disc(mitsuba, circle, bsdf) for circle in _ends(solid) if own[circle.face]]
    lunes = [_lunes(solid, circle) for circle in _rims(solid) if own[circle.face]]
    return found + ([mesh(mitsuba, np.concatenate(lunes), bsdf)] if lunes else [])


def stands_for(solid: Solid) -> np.ndarray:
    """Faces in whose place there are such shapes, bool, shape (F,)."""
    found = np.zeros(len(solid.faces), bool)
    for each in solid.curved:
        found[list(each.faces)] = True
    if solid.curved:
        found[[circle.face for circle in _ends(solid)]] = True
    return found


def shape(mitsuba: Any, curved: Curved, bsdf: dict) -> Any:
    """One surface, its outside shining back."""
    surface = curved.surface
    if isinstance(surface, Sphere):
        return {"type": "sphere", "center": surface.centre.tolist(), "radius": surface.radius, "bsdf": bsdf}
    if isinstance(surface, Cylinder):
        p0, p1 = (surface.point + z * surface.axis for z in surface.ends)
        return {"type": "cylinder", "p0": p0.tolist(), "p1": p1.tolist(), "radius": surface.radius, "bsdf": bsdf}
    return _cone(mitsuba, surface, bsdf)


def _cone(mitsuba: Any, surface: Cone, bsdf: dict) -> Any:
    angle = 2 * np.pi * np.arange(_PIECES + 1) / _PIECES
    one, two = axes_beside(surface.axis)
    radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
    slope = np.tan(np.radians(surface.half_angle_deg))
    low, high = (surface.point + z * surface.axis + (surface.radius + slope * z) * radial for z in surface.ends)
    a, b, c, d = low[:-1], low[1:], high[1:], high[:-1]
    corners = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return mesh(mitsuba, corners, bsdf, normals=surface.normals(corners))


def _ends(solid: Solid) -> list[Circle]:
    """Circles of curved surfaces in whose place discs can be: each the widest of a plane face that only such have cut.

    What is inside it lies within the part or on the face.
    """
    shapes = {face for each in solid.curved for face in each.faces}
    of_face: dict[int, list[Circle]] = {}
    for circle in solid.circles:
        of_face.setdefault(circle.face, []).append(circle)
    found = []
    for face, circles in of_face.items():
        loops = 1 + (len(solid.holes[face]) if solid.holes else 0)
        widest = max(circles, key=lambda circle: circle.radius)
        if len(circles) == loops and not any(c.hole for c in circles) and _wall(solid, widest) in shapes:
            found.append(widest)
    return found


def _rims(solid: Solid) -> list[Circle]:
    """Circles that bound other plane faces: the polygon that the mesh has there lies within the curved surface."""
    shapes, ends = {face for each in solid.curved for face in each.faces}, {circle.name for circle in _ends(solid)}
    outer = {circle.name: set(solid.faces[circle.face]) for circle in solid.circles if not circle.hole}
    return [
        circle
        for circle in solid.circles
        if circle.name not in ends
        and _wall(solid, circle) in shapes
        and {end for name in circle.edges for end in solid.edge(name).ends} <= outer.get(circle.name, set())
    ]


def _wall(solid: Solid, circle: Circle) -> int:
    """One facet of the wall at a circle."""
    return next(face for face in solid.edge(circle.edges[0]).faces if face != circle.face)


def _lunes(solid: Solid, circle: Circle) -> np.ndarray:
    """What lies between a circle and the polygon that stands for it, as triangles (T, 3, 3), outwards."""
    one, two = axes_beside(circle.axis)
    ends = solid.vertices[[solid.edge(name).ends for name in circle.edges]] - circle.centre
    angle = np.arctan2(ends @ two, ends @ one)
    step = (angle[:, 1] - angle[:, 0] + np.pi) % (2 * np.pi) - np.pi
    first, step = np.where(step > 0, angle[:, 0], angle[:, 1]), np.abs(step)
    pieces = -(-_PIECES // len(angle))
    at = first[:, None] + step[:, None] * np.arange(pieces + 1) / pieces
    arc = circle.centre + circle.radius * (np.cos(at)[..., None] * one + np.sin(at)[..., None] * two)
    corner = np.broadcast_to(arc[:, :1], arc[:, 1:-1].shape)
    return np.stack([corner, arc[:, 1:-1], arc[:, 2:]], -2).reshape(-1, 3, 3)


def _disc(mitsuba: Any, circle: Circle, bsdf: dict) -> dict:
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([*axes_beside(circle.axis), circle.axis], -1)
    matrix[:3, 3] = circle.centre
    world = mitsuba.ScalarTransform4f(matrix.tolist()).scale(circle.radius)
    return {"type": "disk", "to_world": world, "bsdf": bsdf}
