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
    return found + [_disc(mitsuba, circle, bsdf) for circle in _ends(solid) if own[circle.face]]


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
    """Of each plane face around the axis its widest circle: what is inside it lies within the part or on the face."""
    widest: dict[int, Circle] = {}
    for circle in solid.circles:
        if circle.face not in widest or circle.radius > widest[circle.face].radius:
            widest[circle.face] = circle
    return list(widest.values())


def _disc(mitsuba: Any, circle: Circle, bsdf: dict) -> dict:
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([*axes_beside(circle.axis), circle.axis], -1)
    matrix[:3, 3] = circle.centre
    world = mitsuba.ScalarTransform4f(matrix.tolist()).scale(circle.radius)
    return {"type": "disk", "to_world": world, "bsdf": bsdf}
