"""Parts of known dimensions as triangle meshes: prisms with round through holes, triangulated unevenly.

What is known of them (corners, faces, circles) comes from the numbers that they are made of, not from the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import Delaunay

from scenes import Scene


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

    def away(self, points: np.ndarray) -> np.ndarray:
        """Distances of points (..., 2) from its axis."""
        return np.hypot(points[..., 0] - self.x, points[..., 1] - self.y)


@dataclass(frozen=True)
class Slot:
    """A hole with straight sides of ``length`` along x and round ends of ``count`` facets, about (x, y)."""

    x: float
    y: float
    radius: float
    length: float
    count: int
    bottom: float
    top: float

    def rim(self, height: float) -> np.ndarray:
        """Its vertices at a height, shape (n, 3)."""
        turn = np.linspace(-np.pi / 2, np.pi / 2, self.count + 1)
        x, y = self.length / 2 + self.radius * np.cos(turn), self.radius * np.sin(turn)
        return np.column_stack([np.r_[x, -x] + self.x, np.r_[y, -y] + self.y, np.full(2 * len(x), height)])

    def away(self, points: np.ndarray) -> np.ndarray:
        """Distances of points (..., 2) from the line between the ends' axes."""
        beyond = np.maximum(np.abs(points[..., 0] - self.x) - self.length / 2, 0)
        return np.hypot(beyond, points[..., 1] - self.y)


def evenly(count: int) -> np.ndarray:
    """Angles of a rim of equal steps."""
    return np.linspace(0, 2 * np.pi, count, endpoint=False)


def unevenly(rng: np.random.Generator, count: int) -> np.ndarray:
    """Angles of unequal steps: between a third of the mean one and some twice of it."""
    steps = rng.uniform(0.35, 2.0, count)
    return rng.uniform(0, 2 * np.pi) + np.cumsum(steps) * 2 * np.pi / steps.sum()


def _flat(corners: np.ndarray, holes: list[Hole | Slot], height: float, more: np.ndarray, up: bool) -> np.ndarray:
    """Triangles of a horizontal convex face with holes, shape (n, 3, 3); ``more`` are further points (n, 2) in it."""
    clear = [p for p in more if all(h.away(p) > 1.02 * h.radius for h in holes)]
    points = np.concatenate([corners, *(hole.rim(0)[:, :2] for hole in holes), np.array(clear).reshape(-1, 2)])
    found = points[Delaunay(points).simplices]
    for hole in holes:
        own = (hole.away(found) <= hole.radius * (1 + 1e-9)).all(1)
        found = found[~own]
    one, two = found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]
    ways = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    found = found[np.abs(ways) > 1e-12]
    ways = ways[np.abs(ways) > 1e-12]
    found = np.where((ways > 0)[:, None, None] == up, found, found[:, ::-1])
    return np.concatenate([found, np.full((*found.shape[:2], 1), height)], -1)


def _wall(hole: Hole | Slot) -> np.ndarray:
    """Triangles of a hole's wall, its normals towards the axis."""
    low, high = hole.rim(hole.bottom), hole.rim(hole.top)
    low2, high2 = np.roll(low, -1, 0), np.roll(high, -1, 0)
    return np.concatenate([np.stack([low, high, low2], 1), np.stack([low2, high, high2], 1)])


def prism(profile: list[tuple[float, float]], width: float, holes: list[Hole | Slot] = (), seed: int | None = None):
    """A profile (x, z), counter-clockwise and with flat stretches only where holes start and end, drawn along y.

    Parameters
    ----------
    profile : list of (x, z)
        A fan of triangles about the first point has to cover it.
    width : float
        From y = 0.
    holes : list of Hole or Slot
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


def newcomers_plate() -> trimesh.Trimesh:
    """50 x 30 x 8 mm, a step of 2 x 2 mm at x = 50, three holes of 6, 6 and 8 mm and a slot of 4 x 14 mm through it."""
    bores = [Hole(x, y, radius, evenly(72), 0.0, 8.0) for x, y, radius in ((8, 8, 3), (8, 22, 3), (39, 15, 4))]
    profile = [(0.0, 0.0), (50.0, 0.0), (50.0, 6.0), (48.0, 6.0), (48.0, 8.0), (0.0, 8.0)]
    return prism(profile, 30.0, [*bores, Slot(23.0, 15.0, 2.0, 10.0, 24, 0.0, 8.0)])


_ASKED = (
    ("length", "width", ({"edge": "e4"}, {"edge": "e16"}), 0.1),
    ("depth", "width", ({"edge": "e5"}, {"edge": "e8"}), 0.1),
    ("step", "width", ({"edge": "e14"}, {"edge": "e21"}), 0.02),
    ("slot", "width", ({"edge": "e10"}, {"edge": "e12"}), 0.03),
    ("bore 1", "diameter", ({"circle": "c2"},), 0.05),
    ("bore 2", "diameter", ({"circle": "c4"},), 0.05),
    ("bore 3", "diameter", ({"circle": "c6"},), 0.05),
    ("bore to bore", "distance", ({"circle": "c2"}, {"circle": "c4"}), 0.05),
    ("along", "distance", ({"circle": "c2"}, {"circle": "c6"}), 0.05),
    ("square", "angle", ({"edge": "e5"}, {"edge": "e16"}), 0.05),
)


def newcomers(folder: Path) -> Scene:
    """The plate with ten requirements, seen by a small camera from 20 degrees beside the vertical."""
    newcomers_plate().export(folder / "plate.stl")
    asked = [dict(zip(("name", "kind", "features", "tolerance"), each, strict=True)) for each in _ASKED]
    return Scene.model_validate({
        "name": "newcomer", "title": "Plate of 50 x 30 x 8 mm with a step, three holes and a slot", "units": "mm",
        "object": {"kind": "mesh", "units": "mm", "file": str(folder / "plate.stl")},
        "material": {"diffuse_reflectance": 0.8}, "light": {"distance": 217.0}, "measurands": asked,
        "camera": {"width": 640, "height": 512, "focal_px": 1250.0, "distance": 217.0, "look_at": [25.0, 15.0, 4.0],
                   "blur_px": 0.5, "exposure": 180.0},
        "noise": {"dark_level": 16.0, "sigma": 1.5, "bits": 8},
        "settings": [{"sensor": [20, 0], "light": [20, 45]}],
    })  # fmt: skip


def arc(centre: tuple[float, float], radius: float, begin: float, stop: float, step: float = 3.75) -> np.ndarray:
    """Points (n, 2) on an arc from one angle to another, degrees, clockwise where the second is less."""
    angle = np.radians(np.linspace(begin, stop, round(abs(stop - begin) / step) + 1))
    return np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)])


def plate(outline: np.ndarray, height: float, holes: list[Slot] = ()) -> trimesh.Trimesh:
    """What a counter-clockwise outline (n, 2) bounds, z from 0 to a height; its Delaunay triangles must have its sides.

    Raises
    ------
    ValueError
        If they have not.
    """
    points = np.concatenate([outline, *(hole.rim(0)[:, :2] for hole in holes)])
    found = points[Delaunay(points).simplices]
    found = found[_inside(found.mean(1), outline)]
    for hole in holes:
        found = found[~(hole.away(found) <= hole.radius * (1 + 1e-9)).all(1)]
    top = np.concatenate([found, np.full((*found.shape[:2], 1), height)], -1)
    one, two = found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]
    top = np.where((one[:, 0] * two[:, 1] > one[:, 1] * two[:, 0])[:, None, None], top, top[:, ::-1])
    low, high = (np.column_stack([outline, np.full(len(outline), z)]) for z in (0.0, height))
    low2, high2 = np.roll(low, -1, 0), np.roll(high, -1, 0)
    sides = np.concatenate([np.stack([low, low2, high], 1), np.stack([low2, high2, high], 1)])
    parts = [top, top[:, ::-1] * [1, 1, 0], sides, *map(_wall, holes)]
    made = trimesh.Trimesh(**_merged(np.concatenate(parts)), process=False)
    if not made.is_volume:
        raise ValueError("outline must be sides of its points' Delaunay triangles, got others")
    return made


def _inside(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Whether points (n, 2) lie within an outline: a ray to the right crosses it an odd number of times."""
    start, stop = outline, np.roll(outline, -1, 0)
    above = (start[:, 1] > points[:, 1, None]) != (stop[:, 1] > points[:, 1, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (points[:, 1, None] - start[:, 1]) / (stop[:, 1] - start[:, 1])
    return (above & (points[:, 0, None] < start[:, 0] + share * (stop[:, 0] - start[:, 0]))).sum(1) % 2 == 1


def cornered(turn: float, radius: float = 10.0) -> trimesh.Trimesh:
    """A plate of 8 mm whose one corner, at the origin, is rounded by a tangent arc of ``turn`` degrees about (10, 10).

    Its sides at the corner are 25 mm long beyond the arc.
    """
    rounded = arc((radius, radius), radius, 225 - turn / 2, 225 + turn / 2)
    away = [np.array([1.0, -1.0]) @ turned(side * turn / 2).T / np.sqrt(2) for side in (-1, 1)]
    ends = rounded[0] - 25 * away[0], rounded[-1] + 25 * away[1]
    return plate(np.concatenate([[ends[0]], rounded, [ends[1]], [[38.0, 38.0]]]), 8.0)


def turned(degrees: float) -> np.ndarray:
    """Turn in the plane (2, 2), counter-clockwise."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, -sine], [sine, cosine]])


def slotted() -> trimesh.Trimesh:
    """50 x 30 x 8 mm with a slot whose round ends, of 6 mm radius, are about (15, 15) and (35, 15)."""
    corners = np.array([[0, 0], [50, 0], [50, 30], [0, 30]], float)
    return plate(corners, 8.0, [Slot(25.0, 15.0, 6.0, 20.0, 48, 0.0, 8.0)])


def notched(turn: float = 180.0, radius: float = 8.0) -> trimesh.Trimesh:
    """50 x 30 x 8 mm with a part of a bore, ``turn`` degrees of it, at the middle of its edge along x."""
    depth = radius * np.cos(np.radians(turn / 2))
    bore = arc((25.0, -depth), radius, 90 + turn / 2, 90 - turn / 2)
    far = np.array([[50, 0], [50, 30], [0, 30], [0, 0]], float)
    return plate(np.concatenate([bore, far]), 8.0)


TOLERANCED = ((8.0, 8.0, 3.0), (52.0, 8.0, 3.5), (30.0, 32.0, 4.0))  # centres and radii of its bores


def toleranced(facets: int = 96) -> trimesh.Trimesh:
    """60 x 40 x 6 mm, three bores, and a slot of 6 mm whose round ends are about (23, 18) and (37, 18)."""
    bores = [Hole(x, y, radius, evenly(facets), 0.0, 6.0) for x, y, radius in TOLERANCED]
    profile = [(0.0, 0.0), (60.0, 0.0), (60.0, 6.0), (0.0, 6.0)]
    return prism(profile, 40.0, [*bores, Slot(30.0, 18.0, 3.0, 14.0, facets // 2, 0.0, 6.0)])
