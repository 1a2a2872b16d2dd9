"""A part from a STEP file: exact surfaces and edges, and a solid of plane facets that today's pictures are made of."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import KDTree

from scenes.errors import InvalidInput
from scenes.files.door import Unreadable, read_bytes
from scenes.parts import mesh, step_kernel
from scenes.parts.chains import components
from scenes.parts.curved import Curved
from scenes.parts.facets import Facets
from scenes.parts.solid import Circle, Solid
from scenes.parts.surfaces import Cone, Cylinder, Plane, Sphere, Surface, Torus
from scenes.parts.walls import exact_walls
from scenes.units import Unit, in_unit

FORMATS = (".step", ".stp")
MOST_BYTES = 32 << 20
MOST_SECONDS = 120
SEGMENTS = 96  # pieces of a full turn; fewer where there are many curved faces
MOST_FACES = 20_000  # of the file's; then so many plane ones, about, of all of them
TANGENT = math.radians(1.0)  # faces that meet at less join smoothly
_SAME = 1e-6  # of the part's size: a circle of the mesh is that of an edge
_MISSING = (
    "object.file must be of a kind that can be read: a STEP file needs OpenCASCADE, pip install 'ice-vision[step]'"
)


@dataclass(frozen=True, eq=False)
class StepEdge:
    """An edge of the part.

    Attributes
    ----------
    kind : str
        ``line``, ``circle``, ``ellipse`` or ``other``.
    faces : tuple of int
        Numbers of the faces that meet in it.
    ends : ndarray, shape (2, 3)
    centre, axis : ndarray, shape (3,), or None
        Of a circle or an ellipse.
    radii : tuple of float
        One of a circle, both half axes of an ellipse, none otherwise.
    bend : float
        Angle between the normals of its faces in the middle of it, rad.
    straight : bool
        Whether it is a line, whatever its kind.
    """

    kind: str
    faces: tuple[int, ...]
    ends: np.ndarray
    centre: np.ndarray | None
    axis: np.ndarray | None
    radii: tuple[float, ...]
    bend: float = math.pi / 2
    straight: bool = False

    def holds(self, points: np.ndarray, near: float) -> bool:
        """Whether it is straight and points (n, 3) lie on its line."""
        start, way = self.ends[0], self.ends[1] - self.ends[0]
        if not self.straight or not way.any():
            return False
        return bool(np.linalg.norm(np.cross(points - start, way / np.linalg.norm(way)), axis=1).max() <= near)


@dataclass(frozen=True, eq=False)
class StepPart:
    """A part as its file says it, in one unit of length.

    Attributes
    ----------
    names : tuple of str
        Names of the F faces in the file, empty where it has none or most have the same.
    surfaces : tuple of Surface or None
        What each face lies on; None where it is no plane, cylinder, cone, sphere or torus.
    edges : tuple of StepEdge
    triangles : ndarray, shape (T, 3, 3)
    triangle_faces : ndarray of int, shape (T,)
    places : tuple of int
        Which instance of the file each face is, counted from 0; -1 where that is not known.
    mended : tuple of str
        What was done to get there.
    """

    names: tuple[str, ...]
    surfaces: tuple[Surface | None, ...]
    edges: tuple[StepEdge, ...]
    triangles: np.ndarray
    triangle_faces: np.ndarray
    places: tuple[int, ...] = ()
    mended: tuple[str, ...] = ()

    @cached_property
    def solid(self) -> Solid:
        """The part as plane facets; circles are exact, and plane faces have the file's names where it gives them one.

        Raises
        ------
        InvalidInput
            As `mesh.solid`.
        """
        body = trimesh.Trimesh(self.triangles.reshape(-1, 3), np.arange(self.triangles.size // 3).reshape(-1, 3))
        with np.errstate(all="ignore"):  # triangles of no area
            found = mesh.solid(body, self._facets)
        circles = tuple(exact or circle for circle, exact in self._exact(found.circles, found.extent))
        arcs = tuple(exact for _, exact in self._exact(found.arcs, found.extent) if exact)  # others are of splines
        mended = (*self.mended, *found.mended)
        return replace(found, face_names=self._face_names(found), circles=circles, arcs=arcs, mended=mended)

    def _facets(self, ends: np.ndarray, sources: np.ndarray, of_faces: np.ndarray) -> Facets:
        """What chains (C, 2, 3) between triangles ``sources`` (C, 2) are; faces by a triangle each, (F,)."""
        owners = np.sort(self.triangle_faces[sources], 1)
        smooth, straight = owners[:, 0] == owners[:, 1], np.zeros(len(ends), bool)
        known: dict[tuple[int, ...], list[StepEdge]] = {}
        for edge in self.edges:
            known.setdefault(edge.faces[:2], []).append(edge)
        near = _SAME * float(np.ptp(self.triangles.reshape(-1, 3), axis=0).max())
        for row in np.flatnonzero(~smooth):
            there = known.get(tuple(owners[row].tolist()), [])
            smooth[row] = bool(there) and all(edge.bend < TANGENT for edge in there)
            straight[row] = any(edge.bend >= TANGENT and edge.holds(ends[row], near) for edge in there)
        straight[straight] = self._between_ends(ends[straight], near)
        faces = self.triangle_faces[of_faces]
        flat = np.array([isinstance(each, Plane) for each in self.surfaces])[faces]
        several = self._smooth, self._smooth + self._coaxial(near)
        region, beside = (np.where(flat, -1, components(len(self.surfaces), pairs)[faces]) for pairs in several)
        return Facets(region, beside, smooth, ~smooth & ~straight)

    def _between_ends(self, ends: np.ndarray, near: float) -> np.ndarray:
        """Which chains (C, 2, 3) begin and end on sharp straight edges: one that goes on in a facet does not; (C,)."""
        edges = [edge.ends for edge in self.edges if edge.straight and edge.bend >= TANGENT]
        starts, stops = np.array(edges).reshape(-1, 2, 3).swapaxes(0, 1)
        way = stops - starts
        found = np.zeros(len(ends), bool)
        for row, both in enumerate(ends):
            away = both[:, None] - starts
            along = np.clip((away * way).sum(-1) / np.maximum((way**2).sum(-1), np.finfo(float).tiny), 0, 1)
            aside = np.linalg.norm(away - along[..., None] * way, axis=-1)
            found[row] = bool((aside.min(1) <= near).all())
        return found

    @cached_property
    def _smooth(self) -> list[tuple[int, int]]:
        """Pairs of curved faces that continue each other smoothly."""
        curved = [not isinstance(surface, Plane) for surface in self.surfaces]
        return [e.faces[:2] for e in self.edges if e.bend < TANGENT and all(curved[f] for f in e.faces[:2])]

    def _coaxial(self, near: float) -> list[tuple[int, int]]:
        """Pairs of faces of one cylinder, though they touch in a point alone or nowhere."""
        known = {f: each for f, each in enumerate(self.surfaces) if isinstance(each, Cylinder)}
        if len(known) < 2:
            return []
        size = float(np.ptp(self.triangles.reshape(-1, 3), axis=0).max())
        numbers = [
            [*(each.point - (each.point @ each.axis) * each.axis), *(size * way * each.axis), each.radius, each.hollow]
            for way in (1, -1)
            for each in known.values()
        ]
        walls = list(known)
        pairs = KDTree(np.array(numbers, float)).query_pairs(near, p=np.inf)
        return [(walls[i % len(walls)], walls[k % len(walls)]) for i, k in pairs]

    @cached_property
    def curved(self) -> tuple[Curved, ...]:
        """Whole outer spheres, cylinders and cones, as exact as the file, with the file's names or k1, k2, ..."""
        return exact_walls(self.solid, self._owners(self.solid), self.surfaces, self.names)

    def _owners(self, solid: Solid) -> np.ndarray:
        """The part's face that each plane face of the solid belongs to, shape (F,); -1 of what closes open places."""
        _, first = np.unique(solid.triangle_faces, return_index=True)
        found = self.triangle_faces[solid.triangle_sources[first]]
        found[list(solid.caps)] = -1
        return found

    def _face_names(self, solid: Solid) -> tuple[str, ...]:
        names, given = list(solid.face_names), set(solid.face_names)
        counts: dict[str, int] = {}
        for face, owner in enumerate(self._owners(solid).tolist()):
            name = self.names[owner] if owner >= 0 else ""
            if not name:
                continue
            counts[name] = counts.get(name, 0) + 1
            wanted = name if counts[name] == 1 and isinstance(self.surfaces[owner], Plane) else f"{name}.{counts[name]}"
            if wanted not in given:
                given.add(wanted)
                names[face] = wanted
        return tuple(names)

    def _exact(self, circles: tuple[Circle, ...], extent: float) -> Iterator[tuple[Circle, Circle | None]]:
        """The mesh's circles, each with that of the centre, axis and radius of the edge that it stands for, if any."""
        known = [edge for edge in self.edges if edge.kind == "circle"]
        places = np.array([[*edge.centre, *edge.radii] for edge in known]).reshape(-1, 4)
        for circle in circles:
            off = np.abs(places - [*circle.centre, circle.radius]).max(1)
            if off.min(initial=np.inf) > _SAME * extent:
                yield circle, None
                continue
            edge = known[int(off.argmin())]
            (radius,), axis = edge.radii, edge.axis * math.copysign(1.0, float(edge.axis @ circle.axis))
            yield circle, replace(circle, centre=edge.centre, axis=axis, radius=radius)


def read(path: Path, unit: Unit = "mm", body: str | int | None = None) -> StepPart:
    """The part of a STEP file in a unit of length, or one of its bodies by name or number; the file says its own.

    Raises
    ------
    InvalidInput
        If the kernel is not installed, or the file is none, of no solid, too large, or ends the kernel's process.
    """
    if path.suffix.lower() not in FORMATS:
        raise InvalidInput(f"object.file must be one of {', '.join(FORMATS)}, got {path.name!r}")
    try:
        data = read_bytes(path, MOST_BYTES)
    except Unreadable as error:
        raise InvalidInput(f"object.file must be a readable STEP file, got {path} ({error.reason})") from None
    if find_spec("OCP") is None:
        raise InvalidInput(f"{_MISSING}, got {path}")
    if b"ISO-10303-21" not in data[:1000]:
        raise InvalidInput(f"object.file must be a readable STEP file, got {path} (without its first line)")
    return part(_asked(path, data, body), unit)


def _asked(path: Path, data: bytes, body: str | int | None) -> dict[str, Any]:
    """The kernel's record, from a process of its own."""
    command = [sys.executable, "-P", step_kernel.__file__, str(SEGMENTS), str(MOST_FACES)]
    command += [] if body is None else [json.dumps(body)]
    try:
        done = subprocess.run(command, input=data, capture_output=True, timeout=MOST_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise InvalidInput(f"object.file must be read within {MOST_SECONDS} s, got {path}") from None
    if done.returncode == 0:
        return json.loads(done.stdout)
    if done.returncode == 3:
        raise InvalidInput(f"{_MISSING}, got {path}")
    told = done.stderr.decode("utf-8", "replace").strip().splitlines() if done.returncode == 2 else []
    why = told[-1] if told else "readable by OpenCASCADE, got one at which it breaks down"
    raise InvalidInput(f"object.file must be {why}: {path}")


def part(record: dict[str, Any], unit: Unit = "mm") -> StepPart:
    """The part of a kernel's record (`scenes.parts.step_kernel`), in a unit of length.

    Raises
    ------
    InvalidInput
        If it is none.
    """
    if record.get("format") != step_kernel.FORMAT:
        raise InvalidInput(f"object.file must be a record of format {step_kernel.FORMAT}, got {record.get('format')!r}")
    scale = in_unit(1.0, record["unit"], unit)
    faces, edges = record["faces"], record["edges"]
    nodes = [scale * np.array(face["nodes"]).reshape(-1, 3) for face in faces]
    corners = [at[np.array(face["triangles"], int).reshape(-1, 3)] for at, face in zip(nodes, faces, strict=True)]
    uncut = record.get("uncut")
    return StepPart(
        names=_face_names([face["name"] for face in faces]),
        surfaces=tuple(_surface(face, scale) for face in faces),
        edges=tuple(_edge(edge, scale) for edge in edges),
        triangles=np.concatenate(corners),
        triangle_faces=np.repeat(np.arange(len(faces)), [len(c) for c in corners]),
        places=tuple(face.get("place", -1) for face in faces),
        mended=(f"faces that cannot be cut into triangles left open: {uncut}",) if uncut else (),
    )


def _face_names(given: list[str]) -> tuple[str, ...]:
    """What the file calls its faces, empty where most are called alike: by their body's name, or by none ('NONE').

    Examples
    --------
    >>> _face_names(["PartBody", "PartBody", "PartBody", "datum plane"])
    ('', '', '', 'datum plane')
    """
    common, count = Counter(given).most_common(1)[0]
    is_name = count == 1 or 2 * count <= len(given)
    return tuple(each if is_name or each != common else "" for each in given)


def _surface(face: dict[str, Any], scale: float) -> Surface | None:
    kind = face["kind"]
    if kind == "other":
        return None
    point = scale * np.array(face["point"])
    if kind == "plane":
        return Plane(point, face["normal"])
    axis, radius, hollow = face["axis"], scale * face["radius"], face["hollow"]
    if kind == "sphere":
        return Sphere(point, radius, hollow)
    if kind == "torus":
        tube = scale * face["tube"]
        return Torus(point, axis, radius, tube, hollow) if tube < radius else None
    if kind == "cylinder":
        return Cylinder(point, axis, radius, tuple(scale * z for z in face["ends"]), hollow)
    angle = face["half_angle"]
    ends = sorted(scale * v * math.cos(angle) for v in face["along"])
    return _cone(point, np.array(axis), radius, angle, ends, hollow)


def _cone(point: np.ndarray, axis: np.ndarray, radius: float, angle: float, ends: list[float], hollow: bool) -> Cone:
    """With its radius in the middle of the face, where it is not 0 as it may be at the file's own point."""
    middle = sum(ends) / 2
    wide = radius + math.tan(angle) * middle
    ends = ends[0] - middle, ends[1] - middle
    return Cone(point + middle * axis, axis, wide, ends, hollow, half_angle_deg=math.degrees(angle))


def _edge(edge: dict[str, Any], scale: float) -> StepEdge:
    round_ = edge["kind"] in ("circle", "ellipse")
    radii = edge.get("radii") or ([edge["radius"]] if "radius" in edge else [])
    return StepEdge(
        kind=edge["kind"],
        faces=tuple(edge["faces"]),
        ends=scale * np.array(edge["ends"]),
        centre=scale * np.array(edge["point"]) if round_ else None,
        axis=np.array(edge["axis"]) if round_ else None,
        radii=tuple(scale * r for r in radii),
        bend=edge["bend"],
        straight=edge["straight"],
    )
