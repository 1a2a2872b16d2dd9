"""Measurands that a part's file asks for: its dimensions, on the edges and circles of the faces that they are of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from scenes.measurands.features import Centre, Side, along_of
from scenes.measurands.measurands import Measurand, Tolerance
from scenes.parts.pmi import Characteristic, Pmi
from scenes.parts.solid import Circle, Edge, Solid
from scenes.parts.step import StepPart
from scenes.parts.surfaces import Cylinder, Plane
from scenes.units import Unit, in_unit

_SAME = 1e-6  # of the part's size: in one place; rad: parallel
_AS_DRAWN = 1e-3  # of a value: how far the model's own may be off
_MOST = 8  # pairs of edges that are offered for one distance
_NO_VALUE = "the file has its presentation alone, no value"
_NO_LIMITS = "the file gives no limits: put in a tolerance"
_NO_FACES = "the file says of no face what it is of"
_INSIDE = "it needs the form of a whole surface, which edges in a picture do not show"
_NOT_YET = "not yet among the kinds of measurand"
_SURFACE = {"flatness", "cylindricity", "profile of a surface", "circular runout", "total runout", "straightness"}


@dataclass(frozen=True)
class Drawn:
    """A characteristic of the file and what could be measured of it.

    Attributes
    ----------
    characteristic : Characteristic
    faces : tuple of str
        What it is of, as "#766 cylinder".
    candidates : tuple of tuple of Measurand
        For each of its features (of a pattern there are several) the measurands of which one does, the first best.
    reason : str
        Why nothing can be measured of it; empty where something can.
    """

    characteristic: Characteristic
    faces: tuple[str, ...]
    candidates: tuple[tuple[Measurand, ...], ...] = ()
    reason: str = ""


def drawn(part: StepPart, pmi: Pmi, unit: Unit) -> tuple[Drawn, ...]:
    """All characteristics of a file, each with what could be measured of it.

    Parameters
    ----------
    part : StepPart
        In a unit of length.
    pmi : Pmi
        Of the same file, mm.
    unit : str
        The part's.
    """
    known = _Faces(part, {place: face for face, place in enumerate(part.places) if place >= 0}, pmi.order)
    return tuple(_drawn(known, each, unit) for each in pmi.characteristics)


@dataclass(frozen=True, eq=False)
class _Faces:
    """The part's faces by the numbers that they have in the file."""

    part: StepPart
    by_place: dict[int, int]
    order: dict[int, int]

    def of(self, numbers: tuple[int, ...]) -> list[int]:
        """Those that were found in the part."""
        found = (self.by_place.get(self.order.get(number, -1)) for number in numbers)
        return [face for face in found if face is not None]

    def told(self, number: int) -> str:
        (face,) = self.of((number,)) or (None,)
        surface = None if face is None else self.part.surfaces[face]
        kind = "face" if face is None else "other surface" if surface is None else type(surface).__name__.lower()
        return f"#{number} {kind}"

    @property
    def solid(self) -> Solid:
        return self.part.solid

    @property
    def near(self) -> float:
        return _SAME * self.solid.extent

    def edges_in(self, plane: Plane) -> list[Edge]:
        """Sharp straight edges that lie in a plane."""
        heights = np.abs((self.solid.vertices - plane.point) @ plane.normal) <= self.near
        return [edge for edge in self.solid.sharp if heights[list(edge.ends)].all()]

    def circles_of(self, cylinder: Cylinder) -> list[Circle]:
        """Rims of a cylinder."""
        axis = np.asarray(cylinder.axis) / np.linalg.norm(cylinder.axis)
        found = []
        for circle in self.solid.circles:
            away = circle.centre - cylinder.point
            beside = np.linalg.norm(away - axis * (away @ axis))
            alike = abs(circle.radius - cylinder.radius) <= self.near and abs(abs(circle.axis @ axis) - 1) <= _SAME
            if alike and beside <= self.near:
                found.append(circle)
        return found


def _drawn(known: _Faces, each: Characteristic, unit: Unit) -> Drawn:
    faces = tuple(known.told(number) for number in dict.fromkeys((*each.faces, *each.others)))
    if each.is_tolerance:
        return Drawn(each, faces, reason=_INSIDE if each.kind in _SURFACE else _NOT_YET)
    if each.value is None:
        return Drawn(each, faces, reason=_NO_VALUE)
    if not faces:
        return Drawn(each, faces, reason=_NO_FACES)
    if each.plus is None or each.minus is None or not each.plus + each.minus > 0:
        return Drawn(each, faces, reason=_NO_LIMITS)
    candidates = tuple(tuple(some) for some in _features(known, each, unit) if some)
    return Drawn(each, faces, candidates, "" if candidates else _why_not(known, each))


def _features(known: _Faces, each: Characteristic, unit: Unit) -> Iterator[list[Measurand]]:
    one, other = ([known.part.surfaces[face] for face in known.of(part)] for part in (each.faces, each.others))
    if each.kind == "diameter":
        yield from _diameters(known, each, unit, [surface for surface in one if isinstance(surface, Cylinder)])
        return
    planes = [surface for surface in (*one, *other) if isinstance(surface, Plane)]
    if each.unit == "deg":
        yield _angles(known, each, _different(known, planes))
    elif each.kind in ("linear distance", "thickness", "width"):
        yield _widths(known, each, unit, _different(known, planes))


def _why_not(known: _Faces, each: Characteristic) -> str:
    if each.kind == "diameter":
        return "no whole rim of it is an edge of the part"
    if each.kind in ("linear distance", "thickness", "width", "angle"):
        return "no two straight edges of its faces are as far apart as it says"
    return _NOT_YET


def _diameters(known: _Faces, each: Characteristic, unit: Unit, walls: list[Cylinder]) -> Iterator[list[Measurand]]:
    """Of each bore or shaft among cylinders, mostly of two halves: by one of its rims."""
    told: set[str] = set()
    for wall in walls:
        rims = [circle for circle in known.circles_of(wall) if circle.name not in told]
        told |= {circle.name for circle in rims}
        yield [_measurand(each, unit, "diameter", (Centre(circle=rim.name),), rim.name) for rim in rims]


def _different(known: _Faces, planes: list[Plane]) -> list[Plane]:
    """Planes, each once."""
    found: list[Plane] = []
    for plane in planes:
        if not any(_is_same(plane, other, known.near) for other in found):
            found.append(plane)
    return found


def _is_same(one: Plane, other: Plane, near: float) -> bool:
    parallel = np.linalg.norm(np.cross(one.normal, other.normal)) <= _SAME
    return bool(parallel and abs((np.asarray(one.point) - other.point) @ np.asarray(one.normal)) <= near)


def _widths(known: _Faces, each: Characteristic, unit: Unit, planes: list[Plane]) -> list[Measurand]:
    """Between two parallel planes: by two parallel edges in a plane across both, the longest first."""
    if len(planes) != 2 or np.linalg.norm(np.cross(planes[0].normal, planes[1].normal)) > _SAME:
        return []
    solid, normal, wanted = known.solid, np.asarray(planes[0].normal), in_unit(each.value, "mm", unit)
    found = []
    for one, other in product(*map(known.edges_in, planes)):
        start, stop = (solid.vertices[edge.ends[0]] for edge in (one, other))
        along = [along_of(solid, Side(edge=edge.name)) for edge in (one, other)]
        away = stop - start
        away = away - along[0] * (away @ along[0])
        is_square = np.linalg.norm(np.cross(away, normal)) <= _SAME * np.linalg.norm(away)
        is_parallel = np.linalg.norm(np.cross(*along)) <= _SAME
        if is_parallel and is_square and abs(np.linalg.norm(away) - wanted) <= _AS_DRAWN * wanted:
            found.append((-min(solid.length(one), solid.length(other)), one, other))
    return _by_sides(each, unit, "width", found)


def _angles(known: _Faces, each: Characteristic, planes: list[Plane]) -> list[Measurand]:
    """Between two planes: by two edges of a face that stands across both, the longest first."""
    if len(planes) != 2:
        return []
    solid, across = known.solid, np.cross(planes[0].normal, planes[1].normal)
    size, found = np.linalg.norm(across), []
    if size <= _SAME:
        return []
    for one, other in product(*map(known.edges_in, planes)):
        shared = set(one.faces) & set(other.faces)
        upright = any(abs(abs(solid.normals[face] @ across) / size - 1) <= _SAME for face in shared)
        if upright and one.name != other.name:
            along = [along_of(solid, Side(edge=edge.name)) for edge in (one, other)]
            between = np.degrees(np.arctan2(np.linalg.norm(np.cross(*along)), along[0] @ along[1]))
            if min(abs(between - each.value), abs(180 - between - each.value)) <= _AS_DRAWN * each.value:
                found.append((-min(solid.length(one), solid.length(other)), one, other))
    return _by_sides(each, "mm", "angle", found)


def _by_sides(each: Characteristic, unit: Unit, kind: str, pairs: list[tuple[float, Edge, Edge]]) -> list[Measurand]:
    """By pairs of edges, the first number least first."""
    sides = [(one.name, other.name) for _, one, other in sorted(pairs, key=lambda row: row[0])[:_MOST]]
    return [_measurand(each, unit, kind, (Side(edge=one), Side(edge=other)), f"{one} {other}") for one, other in sides]


def _measurand(each: Characteristic, unit: Unit, kind: str, features: tuple, of: str) -> Measurand:
    """With the file's limits."""
    plus, minus = (
        abs(part) if each.unit == "deg" else in_unit(abs(part), "mm", unit) for part in (each.plus, each.minus)
    )
    tolerance = Tolerance(plus=float(f"{plus:.6g}"), minus=float(f"{minus:.6g}"))
    return Measurand(name=f"{each.kind} #{each.number} {of}", kind=kind, features=features, tolerance=tolerance)
