"""Boundaries of plane faces, and which of them are circles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes.materials.vectors import cross
from scenes.parts.chains import SINGLE

MIN_SEGMENTS = 12  # a loop of fewer straight edges is a polygon, not a circle
_STEP = 2 * np.sin(np.pi / MIN_SEGMENTS) / 2  # radii: half that of so many
_WIDEST = 5.0  # of the middle step of a circle
_ROUND = 1e-4  # of the radius: how far a circle's vertices may be off it; more is another circle's


@dataclass(frozen=True, eq=False)
class Rim:
    """A closed boundary of a plane face whose vertices lie on a circle."""

    face: int
    loop: tuple[int, ...]
    centre: np.ndarray
    radius: float

    @property
    def pieces(self) -> list[tuple[int, int]]:
        """Ends of its straight pieces."""
        return list(zip(self.loop, self.loop[1:] + self.loop[:1], strict=True))


def boundaries(
    triangles: list[list[int]], kept: list[bool], vertices: np.ndarray, normal: np.ndarray
) -> list[tuple[int, ...]]:
    """Boundaries of a plane face, the outer one first.

    Parameters
    ----------
    triangles : list of list of int
        Three vertices of each that makes up the face.
    kept : list of bool
        Of all V vertices whether an edge ends there; others lie on straight edges and are left out.
    vertices : ndarray, shape (V, 3)
    normal : ndarray, shape (3,)

    Returns
    -------
    list of tuple of int
        Vertices of each, counter-clockwise around the face.
    """
    if len(triangles) == 1:
        return [tuple(v for v in triangles[0] if kept[v])]
    halves = [(each[i], each[k]) for i, k in ((0, 1), (1, 2), (2, 0)) for each in triangles]
    there = set(halves)
    after: dict[int, list[int]] = {}
    for a, b in halves:
        if (b, a) not in there:
            after.setdefault(a, []).append(b)
    loops = [tuple(v for v in loop if kept[v]) for loop in simple_loops(after)]
    return loops if len(loops) == 1 else sorted(loops, key=lambda loop: -_area(vertices[list(loop)], normal))


def simple_loops(after: dict[int, list[int]]) -> list[list[int]]:
    """Loops along the ways from each vertex, which are used up; two that touch in a vertex are told apart there."""
    loops = []
    while after:
        path = [next(iter(after))]
        at = {path[0]: 0}
        while path[-1] in after:
            here = path[-1]
            onward = after[here].pop()
            if not after[here]:
                del after[here]
            if onward in at:
                loops.append(path[at[onward] :])
                for vertex in path[at[onward] + 1 :]:
                    del at[vertex]
                del path[at[onward] + 1 :]
            else:
                at[onward] = len(path)
                path.append(onward)
    return loops


def _area(points: np.ndarray, normal: np.ndarray) -> float:
    """Area inside a closed line of points, positive if it runs counter-clockwise around the normal."""
    if len(points) < 3:
        return 0.0
    away = points - points[0]
    return float(np.cross(away[1:-1], away[2:]).sum(0) @ normal) / 2


def rims(loops: list[list[tuple[int, ...]]], vertices: np.ndarray, normals: np.ndarray) -> list[Rim]:
    """The circles among the boundaries of faces."""
    found, unsure = [], 2 * SINGLE * float(np.abs(vertices).max())
    for face, boundaries_ in enumerate(loops):
        for loop in boundaries_:
            if len(loop) >= MIN_SEGMENTS:
                centre, radius, off = circle_through(vertices[list(loop)], normals[face])
                steps = np.linalg.norm(np.roll(vertices[list(loop)], -1, 0) - vertices[list(loop)], axis=1) / radius
                if off <= _ROUND * radius + unsure and stepped(steps):
                    found.append(Rim(face, loop, centre, radius))
    return found


def stepped(step: np.ndarray) -> bool:
    """Whether each way to the next (n,), radii, is a step around a circle, not a chord that cuts a part of it off."""
    return bool(step.max() <= max(_WIDEST * np.median(step), _STEP))


def circle_through(points: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, float, float]:
    """The circle nearest to points of a plane, shape (n, 3): centre (3,), radius, and how far a point is off it.

    Least squares of |p - c|^2 - r^2, which is linear in the centre; exact for points of a circle, whatever their steps.

    Examples
    --------
    >>> angles = np.array([0, 0.1, 0.7, 2.0, 4.0])
    >>> points = np.stack([3 + 2 * np.cos(angles), 2 * np.sin(angles), 0 * angles], 1)
    >>> centre, radius, off = circle_through(points, np.array([0.0, 0, 1]))
    >>> (centre.round(9) + 0.0).tolist(), round(radius, 9), off < 1e-12
    ([3.0, 0.0, 0.0], 2.0, True)
    """
    points = np.asarray(points)  # a mesh tracks its arrays
    middle = points.mean(0)
    one = np.array(cross(normal, np.eye(3)[np.abs(normal).argmin()]))
    one /= np.linalg.norm(one)
    plane = np.stack([one, cross(normal, one)])
    flat = (points - middle) @ plane.T
    design = np.column_stack([2 * flat, np.ones(len(flat))])
    x, y, _ = np.linalg.lstsq(design, (flat**2).sum(1))[0]
    centre = middle + np.array([x, y]) @ plane
    away = np.linalg.norm(points - centre, axis=1)
    return centre, float(away.mean()), float(np.ptp(away))
