"""Geometric tolerances of a part's file as measurands: on edges and circles that lie in one plane with their datums."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from scenes.measurands.between import CentreLine, SquareAt, Through
from scenes.measurands.drawn_faces import SAME, Faces, centres, limited, sides
from scenes.measurands.drawn_places import Place, pattern_of, places_of
from scenes.measurands.features import along_of, face_beside
from scenes.measurands.measurands import Measurand
from scenes.parts.pmi import Characteristic
from scenes.parts.solid import Edge
from scenes.parts.surfaces import Cylinder, Plane
from scenes.units import Unit, in_unit

_MOST = 8  # measurands that are offered for one feature
_OFF = 1e-3  # degrees: of an angle that the model has
_SURFACE = {"flatness", "cylindricity", "profile of a surface", "circular runout", "total runout"}
_INSIDE = "it needs the form of a whole surface, which edges in a picture do not show"
_OF_THE_SCENE = "its zone is about a place in its datums, and kind profile is about the scene's own"
_NO_ZONE = "the file gives no size of the zone"
_ZERO = "its zone is 0 at maximum material: write it with tolerance 0 and the name of its size (maximum_material)"
_NO_FACES = "the file says of no face what it is of"
_AXIS = "the direction of an axis shows in no one plane"
_NO_DATUM = "the file says of no face what datum {} is"
_ELSEWHERE = "no edge or circle of it lies in one plane with those of its datums"
_FACE_ONLY = "its datums fix no place in the plane in which it shows"
_ONE_WAY = "its zone is between two planes, and the file does not say which way they stand"
_GENERATRIX = "the lines along a curved wall, and its axis, are no edges of the part"
_NO_EDGE = "no straight edge of it shows how far its lines bend"
_NO_RIM = "no rim of it is an edge of the part"
_NO_RIMS = "no whole rim of it, or of its datum, is an edge of the part"
_KINDS = {"concentricity", "coaxiality", "position", "perpendicularity", "parallelism", "angularity", "symmetry",
          "straightness", "roundness"}  # fmt: skip

Found = tuple[tuple[Measurand, ...], ...]


@dataclass(frozen=True, eq=False)
class _Asked:
    """A tolerance, what it is of, and its datums in their order."""

    known: Faces
    each: Characteristic
    size: float
    walls: tuple[Cylinder, ...]
    planes: tuple[Plane, ...]
    datums: tuple[tuple[Cylinder | Plane, ...], ...]

    def made(self, kind: str, features: tuple, of: str, share: float = 1.0) -> Measurand:
        """A measurand whose limits are a share of the zone's size."""
        return limited(self.each, kind, features, of, share * self.size, share * self.size)


def toleranced(known: Faces, each: Characteristic, datums: dict[str, tuple[int, ...]], unit: Unit) -> Found | str:
    """For each feature of a geometric tolerance the measurands of which one does; or why there is none.

    Parameters
    ----------
    known : Faces
    each : Characteristic
        A geometric tolerance.
    datums : dict of str to tuple of int
        Numbers of the faces of each datum, by letter.
    unit : str
        The part's.
    """
    if each.kind not in _KINDS:
        return _INSIDE if each.kind in _SURFACE else _OF_THE_SCENE  # profile of a line
    if not each.zone:
        return _ZERO if each.zone == 0 and "M" in each.modifiers else _NO_ZONE
    lost = [letter for letter in _letters(each) if not known.of(datums.get(letter, ()))]
    if not each.faces or not known.of(each.faces) or lost:
        return _NO_DATUM.format(lost[0]) if lost else _NO_FACES
    surfaces = known.surfaces(each.faces)
    walls = tuple(surface for surface in surfaces if isinstance(surface, Cylinder))
    planes = tuple(known.different([surface for surface in surfaces if isinstance(surface, Plane)]))
    asked = _Asked(
        known, each, in_unit(each.zone, "mm", unit), walls, planes,
        tuple(tuple(known.surfaces(datums[letter])) for letter in _letters(each)),
    )  # fmt: skip
    rows = {
        "position": _positions, "concentricity": _concentric, "coaxiality": _concentric, "symmetry": _symmetric,
        "perpendicularity": _turned, "parallelism": _turned, "angularity": _turned,
        "straightness": _straight, "roundness": _round,
    }[each.kind]  # fmt: skip
    found = rows(asked)
    if isinstance(found, str):
        return found
    return tuple(tuple(some[:_MOST]) for some in found if some) or _ELSEWHERE


def _letters(each: Characteristic) -> list[str]:
    """Of its datums; a common datum's one by one."""
    return [letter for system in each.datums for letter in system.split("-")]


def _positions(asked: _Asked) -> list[list[Measurand]] | str:
    """Of bores and shafts by a rim each, of slots by their round ends, of the middle between two parallel planes by two
    edges."""
    if len(asked.planes) == 2 and not (asked.walls and asked.each.is_round):
        return [_middle_position(asked)]
    if not asked.walls:
        return _ELSEWHERE
    axis = np.asarray(asked.walls[0].axis)
    if not any(_fixes(datum, axis) for datum in asked.datums):
        return _FACE_ONLY
    if not asked.each.is_round:
        return _ONE_WAY
    return [[m for p in places for m in _position(asked, p)] for places in places_of(asked.known, asked.walls)]


def _fixes(datum: tuple, axis: np.ndarray) -> bool:
    """Whether a datum fixes a place in the plane across an axis: a bore along it, or a plane along it."""
    upright = axis / np.linalg.norm(axis)
    return any(
        np.linalg.norm(np.cross(each.axis, upright)) <= SAME * np.linalg.norm(each.axis)
        if isinstance(each, Cylinder)
        else isinstance(each, Plane) and abs(np.asarray(each.normal) @ upright) <= SAME
        for each in datum
    )


def _position(asked: _Asked, place: Place) -> list[Measurand]:
    """In the plane of a rim: about a true place from two datums, at a true distance from one; bores at other heights
    are seen along the axis."""
    datums = [datum for datum in asked.datums if _fixes(datum, place.axis)]
    system = [_datum_at(asked, datum, place) for datum in datums]
    if len(system) > 1 and not all(system):
        system = [_nearest_bore(asked, datum, place) for datum in datums]
    if not system or not all(system):
        return []
    first, *rest = system
    of = f"{place.name} " + " ".join(each.name for each in system[:2])
    features = tuple(each.feature if isinstance(each, Place) else sides(each)[0] for each in system[:2])
    if rest:
        return [asked.made("true_position", (place.feature, *features), of)]
    kind = "distance" if isinstance(first, Place) else "offset"
    return [asked.made(kind, (place.feature, *features), of, 0.5)]


def _datum_at(asked: _Asked, datum: tuple, place: Place) -> Place | Edge | None:
    """What stands for a datum in the plane of a rim: a bore's own or that of a pattern, or a plane's longest edge."""
    known = asked.known
    found = pattern_of(known, [wall for wall in datum if isinstance(wall, Cylinder)])
    level = [each for each in found if each.name != place.name and place.is_level(each.at, known.near)]
    edges = [edge for plane in datum if isinstance(plane, Plane) for edge in known.edges_in(plane)]
    flat = [edge for edge in edges if _in_plane(asked, edge, place.at, place.axis)]
    return next(iter(level), None) or max(flat, key=known.solid.length, default=None)


def _nearest_bore(asked: _Asked, datum: tuple, place: Place) -> Place | None:
    """The rim of a datum's bore, or those of its pattern, whose height is nearest to that of another rim."""
    found = pattern_of(asked.known, [wall for wall in datum if isinstance(wall, Cylinder)])
    away = [round(abs(float((each.at - place.at) @ place.axis)), 6) for each in found]
    return found[int(np.argmin(away))] if found else None


def _in_plane(asked: _Asked, edge: Edge, point: np.ndarray, normal: np.ndarray) -> bool:
    ends = asked.known.solid.vertices[list(edge.ends)]
    return bool((np.abs((ends - point) @ normal) <= asked.known.near).all())


def _middles(asked: _Asked, planes: tuple[Plane, ...]) -> list[tuple[Edge, Edge]]:
    """Pairs of parallel edges of two parallel planes, in a plane square to them, the longest first."""
    solid, found = asked.known.solid, []
    if len(planes) != 2 or np.linalg.norm(np.cross(planes[0].normal, planes[1].normal)) > SAME:
        return []
    for one, other in product(*map(asked.known.edges_in, planes)):
        along, second = (along_of(solid, side) for side in sides(one, other))
        away = solid.vertices[other.ends[0]] - solid.vertices[one.ends[0]]
        away = away - along * (away @ along)
        square = np.linalg.norm(np.cross(away, planes[0].normal)) <= SAME * np.linalg.norm(away)
        if square and np.linalg.norm(np.cross(along, second)) <= SAME:
            found.append((one, other))
    return sorted(found, key=lambda pair: -min(map(solid.length, pair)))


def _level(asked: _Asked, pair: tuple[Edge, Edge], plane: Plane) -> tuple[np.ndarray, np.ndarray]:
    """A point and the normal of the plane that a pair of edges lies in."""
    normal = np.cross(along_of(asked.known.solid, sides(pair[0])[0]), plane.normal)
    return asked.known.solid.vertices[pair[0].ends[0]], normal / np.linalg.norm(normal)


def _middle_position(asked: _Asked) -> list[Measurand]:
    """Its true distance from a datum edge, from the line through two bores, or from that across it at the first."""
    found, solid = [], asked.known.solid
    for pair in _middles(asked, asked.planes):
        point, normal = _level(asked, pair, asked.planes[0])
        across = np.asarray(asked.planes[0].normal)
        for datum in _datum_lines(asked, point, normal, across):
            if abs(along_of(solid, datum) @ across) <= _ALONG:
                middle = CentreLine(centre_line=tuple(edge.name for edge in pair))
                of = " ".join([*(edge.name for edge in pair), *datum.edges])
                found.append(asked.made("width", (middle, datum), of, 0.5))
                break
    return found


_ALONG = 1e-3  # cosine of the angle between what is parallel and a normal


def _datum_lines(asked: _Asked, point: np.ndarray, normal: np.ndarray, across: np.ndarray) -> Iterator:
    """Lines that datums have in a plane, in their order: of planes those that say where something is across."""
    known, bores = asked.known, []
    for datum in asked.datums:
        planes = [each for each in datum if isinstance(each, Plane) and abs(abs(each.normal @ across) - 1) <= SAME]
        flat = [e for plane in planes for e in known.edges_in(plane) if _in_plane(asked, e, point, normal)]
        if flat:
            yield sides(max(flat, key=known.solid.length))[0]
        circles = [circle for wall in datum if isinstance(wall, Cylinder) for circle in known.circles_of(wall)]
        bores += [c for c in circles if abs((c.centre - point) @ normal) <= known.near][:1]
    if len(bores) > 1:
        yield Through(through=centres(*bores[:2]))
        yield SquareAt(square_at=centres(*bores[:2]))


def _concentric(asked: _Asked) -> list[list[Measurand]] | str:
    """A rim, or the middle of a slot, and the datum's own, the nearest to it first."""
    others = pattern_of(asked.known, [w for datum in asked.datums for w in datum if isinstance(w, Cylinder)])
    found = []
    for places in places_of(asked.known, asked.walls):
        pairs = [(place, other) for place in places for other in others]
        pairs = [pair for pair in pairs if abs(abs(pair[0].axis @ pair[1].axis) - 1) <= SAME]
        pairs.sort(key=lambda pair: round(abs(float((pair[1].at - pair[0].at) @ pair[0].axis)), 6))
        made = (("concentricity", (one.feature, other.feature), f"{one.name} {other.name}") for one, other in pairs)
        found.append([asked.made(*each) for each in made])
    return found if any(found) else _NO_RIMS


def _symmetric(asked: _Asked) -> list[list[Measurand]]:
    """The middle of two planes about that of the datum's two."""
    found, datum = [], tuple(plane for planes in asked.datums for plane in planes if isinstance(plane, Plane))
    datum = tuple(asked.known.different(list(datum)))
    for one, other in product(_middles(asked, asked.planes), _middles(asked, datum)):
        point, normal = _level(asked, one, asked.planes[0])
        if all(_in_plane(asked, edge, point, normal) for edge in other):
            lines = [CentreLine(centre_line=tuple(edge.name for edge in pair)) for pair in (one, other)]
            of = " ".join(edge.name for edge in (*one, *other))
            found.append(asked.made("symmetry", tuple(lines), of))
    return [found]


def _turned(asked: _Asked) -> list[list[Measurand]] | str:
    """Of planes by an edge of each and one of the datum plane, in a face that stands across both."""
    if asked.walls and not asked.planes:
        return _AXIS
    datum = [plane for plane in (asked.datums[0] if asked.datums else ()) if isinstance(plane, Plane)]
    return [_turned_about(asked, plane, asked.known.different(datum)) for plane in asked.planes]


def _turned_about(asked: _Asked, plane: Plane, datum: list[Plane]) -> list[Measurand]:
    known, kind = asked.known, asked.each.kind
    if not datum:
        return []
    if kind == "parallelism":
        pairs = _middles(asked, (plane, datum[0]))
        return [asked.made(kind, sides(*pair), " ".join(edge.name for edge in pair)) for pair in pairs]
    slope = abs(float(np.asarray(plane.normal) @ np.asarray(datum[0].normal)))
    angle = 90.0 if kind == "perpendicularity" else float(np.degrees(np.arccos(min(slope, 1.0))))
    pairs = sorted(known.across([plane, datum[0]], angle, _OFF), key=lambda row: row[0])
    if kind == "perpendicularity":
        return [asked.made(kind, sides(*pair), " ".join(edge.name for edge in pair)) for _, *pair in pairs]
    found = []
    for _, *pair in pairs:
        limit = float(np.degrees(np.arctan2(asked.size, known.solid.length(pair[0]))))
        found.append(limited(asked.each, "angle", sides(*pair), " ".join(edge.name for edge in pair), limit, limit))
    return found


def _straight(asked: _Asked) -> list[list[Measurand]] | str:
    """Of planes by edges that bend as they do: in a face that stands across, the longest first."""
    if not asked.planes:
        return _GENERATRIX
    known, found = asked.known, []
    for plane in asked.planes:
        edges = sorted(known.edges_in(plane), key=lambda edge: -known.solid.length(edge))
        across = [e for e in edges if abs(face_beside(known.solid, sides(e)[0]) @ plane.normal) <= SAME]
        found.append([asked.made("straightness", sides(edge), edge.name) for edge in across])
    return found if any(found) else _NO_EDGE


def _round(asked: _Asked) -> list[list[Measurand]] | str:
    """Of bores and shafts by a rim, whole ones first."""
    found = []
    for wall in asked.walls:
        rims = sorted(asked.known.rims_of(wall), key=lambda rim: rim.ends is not None)
        found.append([asked.made("roundness", centres(rim), rim.name) for rim in rims])
    return found if any(found) else _NO_RIM
