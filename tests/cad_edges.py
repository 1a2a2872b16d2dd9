"""Which straight and circular sharp edges a STEP file has, asked of OpenCASCADE alone: an oracle of recognised ones.

Curves of other kinds (splines, ellipses, very short arcs) may be straight as nearly as features are compared: they
need not be offered, and may be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

TANGENT = math.radians(1.0)  # faces that meet at less join smoothly
SAME = 1e-3  # mm
_ALONG = 65  # places of a curve by which it is told where it runs
_PLACES = (0.02, 0.25, 0.5, 0.75, 0.98)  # along an edge, where its faces' normals are asked


@dataclass(frozen=True)
class Sharp:
    """What can be offered of a part, in mm.

    Attributes
    ----------
    lines : ndarray, shape (n, 2, 3)
        Ends of straight edges, those that continue each other joined.
    nearly : ndarray, shape (l, 2, 3)
        Ends of other sharp edges of which no place is farther than `SAME` off the line between the ends.
    curves : ndarray, shape (c, p, 3)
        Places along all other sharp edges.
    circles : ndarray, shape (m, 4)
        Centres and radii of whole circles.
    smooth : ndarray, shape (k, 2, 3)
        Ends of straight edges in which faces join smoothly.
    bends : tuple of float
        Of all edges: the largest angle between the faces, rad.
    """

    lines: np.ndarray
    nearly: np.ndarray
    curves: np.ndarray
    circles: np.ndarray
    smooth: np.ndarray
    bends: tuple[float, ...]


@dataclass(eq=False)
class _Edge:
    kind: str
    curve: Any
    faces: list[Any] = field(default_factory=list)


def sharp_edges(path: Path) -> Sharp:
    """Of all solids of a file."""
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    lines, smooth, arcs, bends, curves = [], [], [], [], []
    for edge in _edges(reader.OneShape()):
        normals = [_normals(edge.curve[0], face) for face in edge.faces]
        angle = np.arctan2(np.linalg.norm(np.cross(*normals), axis=1), (normals[0] * normals[1]).sum(1))
        bends.append(float(angle.max()))
        is_sharp = float(np.median(angle)) >= TANGENT
        ends = _points(edge.curve[1], (0.0, 1.0))
        if edge.kind == "line" or _is_straight(edge.curve[1]):
            (lines if is_sharp else smooth).append((ends, normals[0][[0, -1]], normals[1][[0, -1]]))
            continue
        if is_sharp:
            curves.append(_points(edge.curve[1], tuple(np.linspace(0, 1, _ALONG))))
        if edge.kind == "circle" and is_sharp:
            circle = edge.curve[1].Circle()
            turn = edge.curve[1].LastParameter() - edge.curve[1].FirstParameter()
            place, way = circle.Location(), circle.Axis().Direction()
            around = np.array([place.X(), place.Y(), place.Z(), circle.Radius()])
            arcs.append((around, np.array([way.X(), way.Y(), way.Z()]), turn))
    bare = np.array([ends for ends, *_ in smooth]).reshape(-1, 2, 3)
    nearly = np.array([points[[0, -1]] for points in curves if _off(points) <= SAME]).reshape(-1, 2, 3)
    bent = np.array([points for points in curves if _off(points) > SAME]).reshape(-1, _ALONG, 3)
    return Sharp(_joined(lines), nearly, bent, _whole(arcs), bare, tuple(bends))


def _edges(shape: Any) -> list[_Edge]:
    """Edges of solids in which two different faces meet."""
    from OCP import TopAbs, TopExp, TopoDS
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    def parts(whole: Any, kind: str, cast: str) -> list[Any]:
        explorer = TopExp.TopExp_Explorer(whole, getattr(TopAbs.TopAbs_ShapeEnum, f"TopAbs_{kind}"))
        found = []
        while explorer.More():
            found.append(getattr(TopoDS.TopoDS, cast)(explorer.Current()))
            explorer.Next()
        return found

    known: dict[int, list[tuple[Any, _Edge]]] = {}
    for solid in parts(shape, "SOLID", "Solid"):
        for face in parts(solid, "FACE", "Face"):
            for edge in parts(face, "EDGE", "Edge"):
                here = known.setdefault(hash(edge), [])
                made = next((each for other, each in here if edge.IsSame(other)), None)
                if made is None:
                    curve = BRepAdaptor_Curve(edge)
                    made = _Edge(str(curve.GetType()).rsplit("_", 1)[-1].lower(), (edge, curve))
                    here.append((edge, made))
                if not any(face.IsSame(other) for other in made.faces):
                    made.faces.append(face)
    return [edge for here in known.values() for _, edge in here if len(edge.faces) == 2]


def _is_straight(curve: Any) -> bool:
    """Whether a curve of another kind is straight, as boundaries of splines may be."""
    points = _points(curve, tuple(np.linspace(0, 1, 12)))
    return _off(points) <= 1e-6 * np.linalg.norm(points[-1] - points[0])


def _off(points: np.ndarray) -> float:
    """How far the farthest of points (n, 3) is off the line from the first to the last; inf where that is none."""
    away = points - points[0]
    size = np.linalg.norm(away[-1])
    return float(np.linalg.norm(np.cross(away, away[-1]), axis=1).max() / size) if size > 0 else np.inf


def _points(curve: Any, places: tuple[float, ...]) -> np.ndarray:
    first, last = curve.FirstParameter(), curve.LastParameter()
    found = [curve.Value(first + place * (last - first)) for place in places]
    return np.array([[point.X(), point.Y(), point.Z()] for point in found])


def _normals(edge: Any, face: Any) -> np.ndarray:
    """Outward unit normals of a face along an edge, at `_PLACES`, shape (n, 3)."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d, BRepAdaptor_Surface
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopAbs import TopAbs_Orientation

    flat, surface = BRepAdaptor_Curve2d(edge, face), BRepAdaptor_Surface(face)
    turned = -1.0 if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else 1.0
    first, last = flat.FirstParameter(), flat.LastParameter()
    found = []
    for place in _PLACES:
        at, one, two = flat.Value(first + place * (last - first)), gp_Vec(), gp_Vec()
        surface.D1(at.X(), at.Y(), gp_Pnt(), one, two)
        normal = one.Crossed(two)
        found.append([turned * x for x in (normal.X(), normal.Y(), normal.Z())])
    normals = np.array(found)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)


def _joined(lines: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> np.ndarray:
    """Ends of straight edges; pieces that follow each other in a line between faces of the same normals are one."""
    ends = np.array([line[0] for line in lines]).reshape(-1, 3)
    if not len(ends):
        return ends.reshape(-1, 2, 3)
    meeting = KDTree(ends).query_pairs(SAME / 10)
    pairs = [(i // 2, j // 2) for i, j in meeting if i // 2 != j // 2 and _continued(lines, i, j)]
    graph = coo_array((np.ones(len(pairs)), np.array(pairs, int).reshape(-1, 2).T), shape=(len(lines),) * 2)
    group = connected_components(graph, directed=False)[1]
    return np.array([_farthest(ends[np.repeat(group, 2) == g]) for g in range(group.max() + 1)])


def _continued(lines: list[tuple[np.ndarray, np.ndarray, np.ndarray]], i: int, j: int) -> bool:
    """Whether two edges continue each other where their ends of these numbers meet."""
    (one, k), (other, m) = ((lines[n // 2], n % 2) for n in (i, j))
    ways = one[0][1 - k] - one[0][k], other[0][1 - m] - other[0][m]
    if ways[0] @ ways[1] > -(1 - 1e-9) * np.linalg.norm(ways[0]) * np.linalg.norm(ways[1]):
        return False
    off = [[np.abs(one[a][k] - other[b][m]).max() for b in (1, 2)] for a in (1, 2)]
    return min(max(off[0][0], off[1][1]), max(off[0][1], off[1][0])) < 1e-4


def _farthest(points: np.ndarray) -> np.ndarray:
    """The two of points (n, 3) of a line that are farthest apart."""
    first = points[np.linalg.norm(points - points[0], axis=1).argmax()]
    return np.stack([first, points[np.linalg.norm(points - first, axis=1).argmax()]])


def _whole(arcs: list[tuple[np.ndarray, np.ndarray, float]]) -> np.ndarray:
    """Circles of which the arcs go once around."""
    found: list[tuple[np.ndarray, np.ndarray, float]] = []
    for around, axis, turn in arcs:
        same = next(
            (
                k
                for k, (other, way, _) in enumerate(found)
                if np.abs(other - around).max() < SAME / 10 and abs(way @ axis) > 1 - 1e-9
            ),
            None,
        )
        if same is None:
            found.append((around, axis, turn))
        else:
            found[same] = (*found[same][:2], found[same][2] + turn)
    return np.array([around for around, _, turn in found if turn > 2 * math.pi - 1e-6]).reshape(-1, 4)
