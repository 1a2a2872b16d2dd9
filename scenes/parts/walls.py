"""Curved surfaces of a part from a file that can be measured by their limbs: whole ones, seen from outside.

A cylinder or cone counts where its facets go once around between two circles across its axis, a sphere where they close
it. What is cut off, drilled through or goes part of a turn stays its facets, as do hollow walls: a bore is known by its
rims.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from scenes.parts.curved import Curved
from scenes.parts.recognised import cylinders
from scenes.parts.rims import MIN_SEGMENTS
from scenes.parts.solid import Solid
from scenes.parts.surfaces import Cone, Cylinder, Sphere, Surface, axes_beside
from scenes.parts.surfaces.ruled import Ruled

_LIMBED = Sphere | Cylinder | Cone
_SAME = 1e-7  # of the part's size: two surfaces are one, a corner lies at an end
_STEP = 2 * np.pi / MIN_SEGMENTS * (1 + 1e-6)  # rad: a facet is not wider
_LOOSE = 1e-3  # of the radius: the same of surfaces that were recognised


@lru_cache(maxsize=64)
def recognised_walls(solid: Solid) -> tuple[Curved, ...]:
    """Of a mesh: the whole outer ones of `scenes.parts.recognised.cylinders`, by the same names.

    Examples
    --------
    >>> import trimesh
    >>> from scenes.parts.mesh import solid
    >>> rod = recognised_walls(solid(trimesh.creation.cylinder(2.0, 5.0, sections=48)))[0]
    >>> rod.name, round(rod.radius, 9), [round(z, 9) for z in rod.surface.ends], len(rod.faces)
    ('k1', 2.0, [-2.5, 2.5], 48)
    """
    found = (_whole(solid, k.name, k.surface, k.faces, _LOOSE * k.surface.radius) for k in cylinders(solid))
    return tuple(wall for wall in found if wall is not None)


def exact_walls(
    solid: Solid, owners: np.ndarray, surfaces: tuple[Surface | None, ...], names: tuple[str, ...]
) -> tuple[Curved, ...]:
    """Of a part whose surfaces are known; several of its faces may lie on one, as two halves of a cylinder do.

    Parameters
    ----------
    solid : Solid
    owners : ndarray of int, shape (F,)
        For each plane face of the solid which of the part's faces it is a facet of.
    surfaces : tuple of Surface or None
        Of the part's faces.
    names : tuple of str
        Of the part's faces, empty where they have none; then a wall is called k1, k2, ...
    """
    near = _SAME * solid.extent
    kinds = _kinds(surfaces, near)[owners]
    taken = {part.name for part in (*solid.rims, *solid.edges)} | set(solid.vertex_names)
    found: list[Curved] = []
    for faces in _pieces(solid, kinds):
        owner = int(owners[faces[0]])
        given, called = names[owner], {wall.name for wall in found}
        name = given if given and given not in taken | called else f"k{len(found) + 1}"
        surface = surfaces[owner]
        wall = _whole(solid, name, surface, faces, near) if isinstance(surface, _LIMBED) else None
        if wall is not None:
            found.append(wall)
    return tuple(found)


def _kinds(surfaces: tuple[Surface | None, ...], near: float) -> np.ndarray:
    """A number for each different outer sphere, cylinder and cone, -1 for all else."""
    kinds, known = np.full(len(surfaces), -1), []
    for i, surface in enumerate(surfaces):
        if isinstance(surface, _LIMBED) and not surface.hollow:
            same = (k for k, other in enumerate(known) if _alike(surface, other, near))
            kinds[i] = next(same, len(known))
            if kinds[i] == len(known):
                known.append(surface)
    return kinds


def _alike(one: Sphere | Ruled, other: Sphere | Ruled, near: float) -> bool:
    """Whether two surfaces are one, wherever they end."""
    if isinstance(one, Sphere) or isinstance(other, Sphere):
        if not (isinstance(one, Sphere) and isinstance(other, Sphere)):
            return False
        return bool(np.abs([*(one.centre - other.centre), one.radius - other.radius]).max() <= near)
    away = other.point - one.point
    along = float(away @ one.axis)
    turned = float(one.axis @ other.axis)
    slope, slopes = (np.arctan(s.slope) for s in (one, other))
    radius = one.radius + one.slope * along
    off = [*(away - along * one.axis), radius - other.radius, (1 - abs(turned)) * one.radius]
    return bool(np.abs(off).max() <= near and abs(slopes * np.sign(turned) - slope) <= _SAME)


def _pieces(solid: Solid, kinds: np.ndarray) -> list[np.ndarray]:
    """Faces of one kind that meet in edges, in the order of their first."""
    pairs = np.array([edge.faces for edge in solid.edges], int).reshape(-1, 2)
    pairs = pairs[(kinds[pairs[:, 0]] == kinds[pairs[:, 1]]) & (kinds[pairs[:, 0]] >= 0)]
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(kinds),) * 2)
    group = connected_components(graph, directed=False)[1]
    return [np.flatnonzero(group == g) for g in dict.fromkeys(group[kinds >= 0].tolist())]


def _whole(
    solid: Solid, name: str, surface: Sphere | Cylinder | Cone, faces: Iterable[int], near: float
) -> Curved | None:
    """The surface between its ends, its point in their middle; None where it is hollow or not whole."""
    loops, faces = [solid.faces[f] for f in faces], tuple(int(f) for f in faces)
    if surface.hollow or any(solid.holes[f] for f in faces if solid.holes):
        return None
    if isinstance(surface, Sphere):
        return None if len(_borders(loops)) else Curved(name, surface, faces)
    corners = np.array(sorted({corner for loop in loops for corner in loop}))
    heights = (solid.vertices[corners] - surface.point) @ surface.axis
    low, high = float(heights.min()), float(heights.max())
    borders = np.searchsorted(corners, _borders(loops))  # (B, 2)
    at_end = [(np.abs(heights - end) <= near)[borders].all(-1) for end in (low, high)]
    if high - low <= near or not (at_end[0] | at_end[1]).all() or not (at_end[0].any() and at_end[1].any()):
        return None
    ends = solid.vertices[corners[borders[at_end[0]].ravel()]]
    if _widest(ends, surface) > _STEP:
        return None
    middle, half = (low + high) / 2, (high - low) / 2
    radius = surface.radius + surface.slope * middle
    if radius <= half * abs(surface.slope):
        return None
    point = surface.point + middle * surface.axis
    return Curved(name, replace(surface, point=point, radius=radius, ends=(-half, half)), faces)


def _widest(points: np.ndarray, surface: Ruled) -> float:
    """Largest step around the axis between points (n, 3), rad: a flat is no facet."""
    one, two = axes_beside(surface.axis)
    away = points - surface.point
    angle = np.sort(np.arctan2(away @ two, away @ one))
    return float(np.diff(angle, append=angle[0] + 2 * np.pi).max())


def _borders(loops: list[tuple[int, ...]]) -> np.ndarray:
    """Edges of one of the faces alone, shape (B, 2)."""
    sides = Counter(tuple(sorted(pair)) for loop in loops for pair in zip(loop, (*loop[1:], loop[0]), strict=True))
    return np.array([pair for pair, count in sides.items() if count == 1], int).reshape(-1, 2)
