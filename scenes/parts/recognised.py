"""Round walls recognised among the facets of a mesh: cylinders by least squares, with what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes.parts.rims import circle_through
from scenes.parts.solid import Solid
from scenes.parts.surfaces import Cylinder, axes_beside

_ROUND = 1e-3  # of the radius: largest residual of a cylinder
_LEAST_FACETS = 4
_LEAST_TURN = np.radians(30)  # of the normals: a smaller piece does not tell its axis from its radius


@dataclass(frozen=True, eq=False)
class Recognised:
    """A cylinder that facets stand for.

    Attributes
    ----------
    name : str
        k1, k2, ... in the order of the first facet.
    surface : Cylinder
        Between the outermost vertices along its axis; ``hollow`` for the wall of a hole.
    faces : tuple of int
        The facets.
    residual : float
        Root mean square distance of their vertices from it, the solid's unit.
    largest : float
        Largest such distance.
    turn_deg : float
        How much of a turn the facets take, degrees; 360 for a whole wall.
    """

    name: str
    surface: Cylinder
    faces: tuple[int, ...]
    residual: float
    largest: float
    turn_deg: float


def cylinders(solid: Solid) -> tuple[Recognised, ...]:
    """The cylinders among the curved surfaces of a solid.

    Facets that smooth edges join are one surface. Their normals are across the axis, so it is the direction in which
    they vary least; a circle through the vertices seen along it begins the fit of axis and radius by distance.

    Examples
    --------
    >>> import trimesh
    >>> from scenes.parts.mesh import solid
    >>> rod = cylinders(solid(trimesh.creation.cylinder(2.0, 5.0, sections=48)))[0]
    >>> round(rod.surface.radius, 9), rod.residual < 1e-9, rod.surface.hollow, round(rod.turn_deg)
    (2.0, True, False, 360)
    """
    found = []
    for faces in _regions(solid):
        fitted = _fitted(solid, faces)
        if fitted is not None:
            found.append(Recognised(f"k{len(found) + 1}", *fitted))
    return tuple(found)


def _regions(solid: Solid) -> list[np.ndarray]:
    """Facets of each curved surface, at least `_LEAST_FACETS`, in the order of their first face."""
    if solid.regions is None:
        return []
    found = dict.fromkeys(solid.regions[solid.regions >= 0].tolist())
    sizes = np.bincount(solid.regions[solid.regions >= 0])
    return [np.flatnonzero(solid.regions == g) for g in found if sizes[g] >= _LEAST_FACETS]


def _fitted(solid: Solid, faces: np.ndarray) -> tuple | None:
    """Cylinder, faces, residuals and turn; None where they are no cylinder's."""
    normals = solid.normals[faces]
    points = solid.vertices[np.unique(np.concatenate([solid.faces[f] for f in faces]))]
    axis = np.linalg.svd(normals, full_matrices=len(normals) < 3)[2][2]
    if np.abs(normals @ axis).max() > 0.1 or len(points) < 6:
        return None
    centre, radius, _ = circle_through(points - (points @ axis)[:, None] * axis, axis)
    point, axis, radius, away = _least_squares(points, centre + (points @ axis).mean() * axis, axis, radius)
    heights = (points - point) @ axis
    turn = _turn(normals, axis)
    if not 0 < radius < 1e8 or np.abs(away).max() > _ROUND * radius or turn < _LEAST_TURN:
        return None
    middles = np.array([solid.vertices[list(solid.faces[f])].mean(0) for f in faces]) - point
    beside = middles - (middles @ axis)[:, None] * axis
    hollow = bool((beside * normals).sum() < 0)
    surface = Cylinder(point, axis, radius, (float(heights.min()), float(heights.max())), hollow)
    rms = float(np.sqrt(np.mean(away**2)))
    return surface, tuple(faces.tolist()), rms, float(np.abs(away).max()), float(np.degrees(turn))


def _least_squares(points: np.ndarray, point: np.ndarray, axis: np.ndarray, radius: float):
    """Point of the axis, axis, radius and distances, by two shifts, two tilts and the radius; lengths in radii."""
    beside = np.stack(axes_beside(axis))
    away = (points - point) / radius
    size = max(float(np.abs(away @ axis).max()), 1.0)

    def line(numbers):
        turned = axis + numbers[2:4] @ beside / size
        return numbers[:2] @ beside, turned / np.linalg.norm(turned)

    def across(numbers):
        start, way = line(numbers)
        along = (away - start) @ way
        beyond = away - start - along[:, None] * way
        return along, beyond, np.linalg.norm(beyond, axis=1)

    def distances(numbers):
        return across(numbers)[2] - numbers[4]

    def slopes(numbers):
        along, beyond, far = across(numbers)
        out = beyond @ beside.T / far[:, None]
        tilts = -along[:, None] * out / (size * np.linalg.norm(axis + numbers[2:4] @ beside / size))
        return np.column_stack([-out, tilts, -np.ones(len(away))])

    from scipy.optimize import least_squares  # slow to load, and rarely needed

    begin = [0.0, 0.0, 0.0, 0.0, 1.0]
    done = least_squares(distances, begin, slopes, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    start, way = line(done.x)
    way = way * np.sign(way[np.abs(way).argmax()])
    return point + radius * start, way, float(radius * done.x[4]), radius * distances(done.x)


def _turn(normals: np.ndarray, axis: np.ndarray) -> float:
    """Angle that the normals' directions take around the axis, with one step for the last facet's own width, rad."""
    one, two = axes_beside(axis)
    angles = np.sort(np.arctan2(normals @ two, normals @ one))
    steps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    gap = steps.max()
    rest = np.delete(steps, steps.argmax())
    whole = gap <= 1.5 * max(rest.max(initial=0.0), 1e-9)
    return float(2 * np.pi if whole else 2 * np.pi - gap + rest.mean())
