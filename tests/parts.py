"""Parts of known dimensions as triangle meshes: prisms with round through holes, triangulated unevenly.

What is known of them (corners, faces, circles) comes from the numbers that they are made of, not from the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import Delaunay


@dataclass(frozen=True)
class Hole:
    """A round hole along z: centre (x, y), radius, angles of its rim's vertices, heights that it runs between."""

    x: float
    y: float
    radius: float
    angles: np.ndarray
    bottom: float
    top: float

    def rim(self, height: float) -> np.ndarray:
        """Its vertices at a height, shape (n, 3)."""
        x, y = self.x + self.radius * np.cos(self.angles), self.y + self.radius * np.sin(self.angles)
        return np.column_stack([x, y, np.full_like(x, height)])


def evenly(count: int) -> np.ndarray:
    """Angles of a rim of equal steps."""
    return np.linspace(0, 2 * np.pi, count, endpoint=False)


def unevenly(rng: np.random.Generator, count: int) -> np.ndarray:
    """Angles of unequal steps: between a third of the mean one and some twice of it."""
    steps = rng.uniform(0.35, 2.0, count)
    return rng.uniform(0, 2 * np.pi) + np.cumsum(steps) * 2 * np.pi / steps.sum()


def _flat(corners: np.ndarray, holes: list[Hole], height: float, more: np.ndarray, up: bool) -> np.ndarray:
    """Triangles of a horizontal convex face with holes, shape (n, 3, 3); ``more`` are further points (n, 2) in it."""
    clear = [p for p in more if all(np.hypot(p[0] - h.x, p[1] - h.y) > 1.02 * h.radius for h in holes)]
    points = np.concatenate([corners, *(hole.rim(0)[:, :2] for hole in holes), np.array(clear).reshape(-1, 2)])
    found = points[Delaunay(points).simplices]
    for hole in holes:
        chord = hole.radius * (1 + 1e-9)
        own = (np.hypot(found[..., 0] - hole.x, found[..., 1] - hole.y) <= chord).all(1)
        found = found[~own]
    one, two = found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]
    ways = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    found = found[np.abs(ways) > 1e-12]
    ways = ways[np.abs(ways) > 1e-12]
    found = np.where((ways > 0)[:, None, None] == up, found, found[:, ::-1])
    return np.concatenate([found, np.full((*found.shape[:2], 1), height)], -1)


def _wall(hole: Hole) -> np.ndarray:
    """Triangles of a hole's wall, its normals towards the axis."""
    low, high = hole.rim(hole.bottom), hole.rim(hole.top)
    low2, high2 = np.roll(low, -1, 0), np.roll(high, -1, 0)
    return np.concatenate([np.stack([low, high, low2], 1), np.stack([low2, high, high2], 1)])


def prism(profile: list[tuple[float, float]], width: float, holes: list[Hole] = (), seed: int | None = None):
    """A profile (x, z), counter-clockwise and with flat stretches only where holes start and end, drawn along y.

    Parameters
    ----------
    profile : list of (x, z)
        A fan of triangles about the first point has to cover it.
    width : float
        From y = 0.
    holes : list of Hole
        Through holes.
    seed : int, optional
        Of further points in the faces that have holes, so that triangles are unequal.

    Returns
    -------
    trimesh.Trimesh
    """
    rng = np.random.default_rng(seed)
    points = np.array(profile, float)
    near = np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]])
    far = near + [0, width, 0]
    parts = [np.stack([near[[0] * (len(near) - 2)], near[1:-1], near[2:]], 1)]
    parts.append(parts[0][:, ::-1] + [0, width, 0])
    for i, (start, stop) in enumerate(zip(points, np.roll(points, -1, 0), strict=True)):
        j = (i + 1) % len(points)
        low, high = sorted((start[0], stop[0]))
        level = start[1] == stop[1] and high > low
        here = [h for h in holes if level and low < h.x < high and start[1] in (h.bottom, h.top)]
        if level and (here or seed is not None):
            corners = np.array([[low, 0], [high, 0], [high, width], [low, width]])
            more = rng.uniform(corners[0], corners[2], (0 if seed is None else 6, 2))
            parts.append(_flat(corners, here, start[1], more, up=stop[0] < start[0]))
        else:
            parts.append(np.array([[near[j], near[i], far[i]], [near[j], far[i], far[j]]]))
    parts += [_wall(hole) for hole in holes]
    return trimesh.Trimesh(**_merged(np.concatenate(parts)), process=False)


def _merged(triangles: np.ndarray) -> dict[str, np.ndarray]:
    vertices, numbers = np.unique(triangles.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    return {"vertices": vertices, "faces": numbers.reshape(-1, 3)}


BRACKET = ((0.0, 0.0), (60.0, 0.0), (60.0, 6.0), (35.0, 6.0), (35.0, 12.0), (3.0, 12.0), (0.0, 9.0))


def bracket(count: int = 96, angles: np.ndarray | None = None, seed: int | None = None) -> trimesh.Trimesh:
    """60 x 40 x 12 mm, the step at x = 35 down to 6, a chamfer of 3, holes of radius 4 and 5 mm through it."""
    around = evenly(count) if angles is None else angles
    holes = [Hole(18.0, 20.0, 4.0, around, 0.0, 12.0), Hole(48.0, 20.0, 5.0, around, 0.0, 6.0)]
    return prism(BRACKET, 40.0, holes, seed)
