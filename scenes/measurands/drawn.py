"""Measurands that a part's file asks for: its dimensions, on the edges and circles of the faces that they are of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from scenes.measurands.drawn_faces import SAME, Faces, angle_of, centres, measurand, sides
from scenes.measurands.drawn_places import Place, pattern_of, places_of
from scenes.measurands.drawn_tolerances import toleranced
from scenes.measurands.features import Side, along_of
from scenes.measurands.measurands import Measurand
from scenes.parts.pmi import Characteristic, Pmi
from scenes.parts.solid import Edge
from scenes.parts.step import StepPart
from scenes.parts.surfaces import Cylinder, Plane
from scenes.units import Unit, in_unit

_AS_DRAWN = 1e-3  # of a value: how far the model's own may be off
_MOST = 8  # pairs of edges that are offered for one distance
_NO_VALUE = "the file has its presentation alone, no value"
_NO_LIMITS = "the file gives no limits: put in a tolerance, or a general one with --general"
_WITHOUT = {
    "theoretical": "it is theoretically exact: the tolerances that refer to it have the limits",
    "auxiliary": "it is auxiliary, for information alone",
}
_NO_FACES = "the file says of no face what it is of"
_NOT_YET = "not yet among the kinds of measurand"


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
    known = Faces(part, {place: face for face, place in enumerate(part.places) if place >= 0}, pmi.order)
    return tuple(_drawn(known, each, pmi.datums, unit) for each in pmi.characteristics)


def _drawn(known: Faces, each: Characteristic, datums: dict[str, tuple[int, ...]], unit: Unit) -> Drawn:
    faces = tuple(known.told(number) for number in dict.fromkeys((*each.faces, *each.others)))
    if each.is_tolerance:
        found = toleranced(known, each, datums, unit)
        return Drawn(each, faces, reason=found) if isinstance(found, str) else Drawn(each, faces, found)
    if each.value is None:
        return Drawn(each, faces, reason=_NO_VALUE)
    if each.note in _WITHOUT and each.plus is None:
        return Drawn(each, faces, reason=_WITHOUT[each.note])
    if not faces:
        return Drawn(each, faces, reason=_NO_FACES)
    if each.plus is None or each.minus is None or not each.plus + each.minus > 0:
        return Drawn(each, faces, reason=_NO_LIMITS)
    candidates = tuple(tuple(some) for some in _features(known, each, unit) if some)
    return Drawn(each, faces, candidates, "" if candidates else _why_not(known, each))


def _features(known: Faces, each: Characteristic, unit: Unit) -> Iterator[list[Measurand]]:
    one, other = (known.surfaces(part) for part in (each.faces, each.others))
    walls = [surface for surface in one if isinstance(surface, Cylinder)]
    if each.kind in ("diameter", "radius"):
        yield from _round(known, each, unit, walls)
        return
    pairs = _pairs(known, *([surface for surface in some if isinstance(surface, Plane)] for some in (one, other)))
    if each.unit == "deg":
        yield _angles(known, each, pairs)
    elif each.kind in ("linear distance", "thickness", "width"):
        yield _widths(known, each, unit, pairs)
        yield from _apart(known, each, unit, (one, other))


def _pairs(known: Faces, one: list[Plane], other: list[Plane]) -> list[tuple[Plane, Plane]]:
    """Between which two planes a dimension lies: of a size both of its own, of a location one of either feature."""
    if other:
        both = product(known.different(one), known.different(other))
        return [pair for pair in both if len(known.different(list(pair))) > 1]
    planes = known.different(one)
    return [(planes[0], planes[1])] if len(planes) == 2 else []


def _why_not(known: Faces, each: Characteristic) -> str:
    if each.kind in ("diameter", "radius"):
        return f"no {'whole rim' if each.kind == 'diameter' else 'rim'} of it is an edge of the part"
    if each.kind in ("linear distance", "thickness", "width", "angle"):
        return "no two straight edges or centres of its faces are as far apart as it says"
    return _NOT_YET


def _round(known: Faces, each: Characteristic, unit: Unit, walls: list[Cylinder]) -> Iterator[list[Measurand]]:
    """Of each bore or shaft among cylinders, mostly of two halves, by one of its rims; a radius by an arc, too."""
    told: set[str] = set()
    for wall in walls:
        rims = known.rims_of(wall) if each.kind == "radius" else known.circles_of(wall)
        rims = [circle for circle in rims if circle.name not in told]
        told |= {circle.name for circle in rims}
        yield [measurand(each, unit, each.kind, centres(rim), rim.name) for rim in rims]


def _widths(known: Faces, each: Characteristic, unit: Unit, pairs: list[tuple[Plane, Plane]]) -> list[Measurand]:
    """Between two parallel planes: by two parallel edges in a plane across both, the longest first."""
    found = []
    for planes in pairs:
        if np.linalg.norm(np.cross(planes[0].normal, planes[1].normal)) <= SAME:
            found += _across(known, in_unit(each.value, "mm", unit), planes)
    return _by_sides(each, unit, "width", found)


def _apart(known: Faces, each: Characteristic, unit: Unit, both: tuple[list, list]) -> Iterator[list[Measurand]]:
    """Of each bore, slot or pattern that lies so far from another one, or from an edge of a plane, in one plane."""
    rounds = [[surface for surface in some if isinstance(surface, Cylinder)] for some in both]
    wanted, planes = in_unit(each.value, "mm", unit), [s for some in both for s in some if isinstance(s, Plane)]
    if all(rounds):
        ways = [[*places_of(known, walls), *([pattern_of(known, walls)] if len(walls) > 1 else [])] for walls in rounds]
        pairs = [(one, other) for some in ways[0] for one in some for rest in ways[1] for other in rest]
        level = [(one, other) for one, other in pairs if one.is_level(other.at, known.near)]
        near = [pair for pair in level if abs(np.linalg.norm(pair[0].at - pair[1].at) - wanted) <= _AS_DRAWN * wanted]
        yield [_between(each, unit, "distance", one, (other.feature, other.name)) for one, other in near]
    elif any(rounds) and planes:
        for some in places_of(known, rounds[0] or rounds[1]):
            yield [m for place in some for m in _from_planes(known, each, unit, place, planes, wanted)]


def _from_planes(
    known: Faces, each: Characteristic, unit: Unit, place: Place, planes: list[Plane], wanted: float
) -> Iterator[Measurand]:
    """From an edge of a plane, in the plane of a rim, the longest first."""
    solid = known.solid
    edges = [edge for plane in planes for edge in known.edges_in(plane)]
    for edge in sorted(edges, key=lambda each: -solid.length(each)):
        ends = solid.vertices[list(edge.ends)]
        away = np.linalg.norm(np.cross(place.at - ends[0], along_of(solid, Side(edge=edge.name))))
        if all(place.is_level(end, known.near) for end in ends) and abs(away - wanted) <= _AS_DRAWN * wanted:
            yield _between(each, unit, "offset", place, (sides(edge)[0], edge.name))


def _between(each: Characteristic, unit: Unit, kind: str, place: Place, other: tuple[Any, str]) -> Measurand:
    return measurand(each, unit, kind, (place.feature, other[0]), f"{place.name} {other[1]}")


def _across(known: Faces, wanted: float, planes: tuple[Plane, Plane]) -> list[tuple[float, Edge, Edge]]:
    """Pairs of parallel edges, of either plane one, that are as far apart as is wanted; minus the shorter's length
    first."""
    solid, normal, found = known.solid, np.asarray(planes[0].normal), []
    for one, other in product(*map(known.edges_in, planes)):
        start, stop = (solid.vertices[edge.ends[0]] for edge in (one, other))
        along = [along_of(solid, Side(edge=edge.name)) for edge in (one, other)]
        away = stop - start
        away = away - along[0] * (away @ along[0])
        is_square = np.linalg.norm(np.cross(away, normal)) <= SAME * np.linalg.norm(away)
        is_parallel = np.linalg.norm(np.cross(*along)) <= SAME
        if is_parallel and is_square and abs(np.linalg.norm(away) - wanted) <= _AS_DRAWN * wanted:
            found.append((-min(solid.length(one), solid.length(other)), one, other))
    return found


def _angles(known: Faces, each: Characteristic, pairs: list[tuple[Plane, Plane]]) -> list[Measurand]:
    """Between two planes: by two edges of a face that stands across both, the longest first."""
    off, found = _AS_DRAWN * each.value, []
    beside = replace(each, value=180 - each.value, plus=each.minus, minus=each.plus)  # of lines the other angle
    for pair in (pair for planes in pairs for pair in known.across(list(planes), each.value, off)):
        told = each if abs(angle_of(known.solid, *pair[1:]) - each.value) <= off else beside
        found.append((pair[0], _by_sides(told, "mm", "angle", [pair])))
    found.sort(key=lambda row: row[0])
    return [each for _, some in found[:_MOST] for each in some]


def _by_sides(each: Characteristic, unit: Unit, kind: str, pairs: list[tuple[float, Edge, Edge]]) -> list[Measurand]:
    """By pairs of edges, the first number least first."""
    best = [pair for _, *pair in sorted(pairs, key=lambda row: row[0])[:_MOST]]
    return [measurand(each, unit, kind, sides(*pair), " ".join(edge.name for edge in pair)) for pair in best]
