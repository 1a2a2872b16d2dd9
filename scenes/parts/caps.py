"""Caps: triangles that close what a file leaves open, of which nobody knows what is there.

The boundaries of what is open are closed by triangles in their planes, those of one plane together, so that the open
end of a tube gets a ring. What a cap and the faces around it share is no edge of the part: it is there to hide, shade
and be seen, but to measure nothing by.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import trimesh

from scenes.parts.chains import Chain
from scenes.parts.facets import Facets
from scenes.parts.rims import Rim, simple_loops
from scenes.parts.surfaces import axes_beside

_FLAT = 1e-3  # of its size: how far corners of a boundary may be off its plane, to be closed together with others in it
_SAME = np.cos(np.radians(0.1))  # between planes
_BENDS = np.cos(np.radians(12.0))  # most between facets of a curved surface, as files divide them
SAID = 3  # places


def caps(vertices: np.ndarray, halves: np.ndarray) -> list[np.ndarray]:
    """Triangles (n, 3) that close each open place, by the half edges (h, 2) that go around it against those there.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    >>> [len(cap) for cap in caps(square, np.array([[0, 1], [1, 2], [2, 3], [3, 0]]))]
    [2]
    """
    import manifold3d  # slow to load, and rarely needed

    after: dict[int, list[int]] = {}
    for start, stop in halves.tolist():
        after.setdefault(start, []).append(stop)
    found = []
    for loops, frame in _in_planes([np.array(loop) for loop in simple_loops(after) if len(loop) > 2], vertices):
        flat = [vertices[loop] @ frame.T for loop in loops]
        cap = np.concatenate(loops)[manifold3d.triangulate(flat)]
        found.append(cap[(cap != np.roll(cap, 1, 1)).all(1)])  # loops may touch in a vertex
    return found


def _in_planes(loops: list[np.ndarray], vertices: np.ndarray) -> Iterator[tuple[list[np.ndarray], np.ndarray]]:
    """Loops of one plane together, with its frame (2, 3): about its normal the larger ones go counter-clockwise."""
    area = np.array([_area(vertices[loop]) for loop in loops]).reshape(-1, 3)
    size = np.linalg.norm(area, axis=1)
    left = np.argsort(-size, kind="stable").tolist()
    while left:
        first, middle = left[0], vertices[loops[left[0]]].mean(0)
        normal = area[first] / max(size[first], np.finfo(float).tiny)
        near = _FLAT * float(np.ptp(vertices[loops[first]], axis=0).max())
        there = [
            k
            for k in left[1:]
            if abs(area[k] @ normal) >= _SAME * size[k] and np.abs((vertices[loops[k]] - middle) @ normal).max() <= near
        ]
        flat = np.abs((vertices[loops[first]] - middle) @ normal).max() <= near
        together = [first, *(there if flat else ())]
        left = [k for k in left if k not in together]
        yield [loops[k] for k in together], np.stack(axes_beside(normal))


def _area(points: np.ndarray) -> np.ndarray:
    """Vector area inside of a closed line of points (n, 3)."""
    away = points - points[0]
    return np.cross(away[1:-1], away[2:]).sum(0) / 2


def unknown(chains: list[Chain], normals: np.ndarray, filled: np.ndarray) -> np.ndarray:
    """Which of the faces that fill holes, bool (F,), are caps; not one between two that it bends to as facets do."""
    if not filled.any():
        return filled
    faces = np.array([faces for _, faces, _ in chains if filled[list(faces)].sum() == 1], int).reshape(-1, 2)
    slight = (normals[faces[:, 0]] * normals[faces[:, 1]]).sum(1) >= _BENDS
    return filled & (np.bincount(faces[slight].ravel(), minlength=len(filled)) < 2)


def bordered(known: Facets, chains: list[Chain], capped: np.ndarray) -> Facets:
    """What chains and faces are where some of the faces are caps, bool (F,)."""
    border = np.array([capped[list(faces)].any() for _, faces, _ in chains], bool)
    region, beside = (np.where(capped, -1, each) for each in (known.region, known.beside))
    return replace(known, region=region, beside=beside, smooth=known.smooth & ~border, rim=known.rim | border)


def clear_of(circular: list[Rim], chains: list[Chain], capped: np.ndarray) -> list[Rim]:
    """Circles that no cap has a part of."""
    border = {frozenset(ends) for ends, faces, _ in chains if capped[list(faces)].any()}
    return [rim for rim in circular if not any(frozenset(piece) in border for piece in rim.pieces)]


def said(mesh: trimesh.Trimesh, group: np.ndarray, capped: np.ndarray) -> list[str]:
    """How many places have faces of their own as caps, and where the largest of them are."""
    place = np.where(capped[group], mesh.face_attributes["cap"], 0)
    area = np.bincount(place, mesh.area_faces, int(place.max()) + 1)[1:]
    largest = np.argsort(-area, kind="stable")[: min(SAID, int((area > 0).sum()))] + 1
    if not len(largest):
        return []
    middles = [
        np.average(mesh.triangles_center[place == k], axis=0, weights=mesh.area_faces[place == k]) for k in largest
    ]
    return [
        f"open places closed by faces of which nothing is known: {(area > 0).sum()}, at"
        f" {listed(np.round(middles, 9) + 0.0)}; edges beside them measure nothing"
    ]


def listed(places: np.ndarray) -> str:
    """Places (n, 3) in words."""
    return ", ".join("({:.4g}, {:.4g}, {:.4g})".format(*each) for each in places)
