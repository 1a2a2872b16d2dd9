"""Measurands that a part offers: bores, distances of holes, widths between parallel edges, shafts, corners, slots.

What a drawing of the part would ask for, with the general tolerances of ISO 2768-1, class m; for `ice new`, whose user
keeps what is wanted.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import combinations, islice

import numpy as np

from scenes.materials.vectors import components, cross, dot
from scenes.measurands.features import Centre, Corner, Side, Wall
from scenes.measurands.measurands import Measurand
from scenes.parts.solid import Circle, Edge, Solid
from scenes.units import Unit, in_unit

_GENERAL = (6, 0.1), (30, 0.2), (120, 0.3), (400, 0.5), (1000, 0.8), (2000, 1.2), (np.inf, 2.0)
"""ISO 2768-1, class m: lengths up to, mm, and how far they may be off."""
_SHARE = 0.2  # of a length: more than that no drawing tolerates
_SAME = 1e-6  # of the part's size: in one plane; rad: parallel
_DIGITS = 9  # by which lengths are put in order: what differs by rounding alone stays in the part's own order
_MOST = {"diameter": 16, "holes": 8, "width": 16, "shaft": 4, "corners": 8, "arc": 8, "slot": 4}  # of each sort
_ROUND_END = np.radians(150.0)  # of an arc: less is a rounded corner, which no drawing asks for by its own


def proposed(solid: Solid, unit: Unit) -> tuple[Measurand, ...]:
    """The measurands, the largest of each sort first.

    Parameters
    ----------
    solid : Solid
        With all its curved surfaces (`Scene.all_walls`).
    unit : str
        Of its lengths.

    Examples
    --------
    >>> from scenes.parts.solid import block
    >>> [(m.name, m.kind, m.tolerance.plus) for m in proposed(block((60, 40, 4)), "mm")][:3]
    [('width e1 e5', 'width', 0.3), ('width e10 e12', 'width', 0.3), ('width e4 e7', 'width', 0.3)]
    """
    sorts = {
        "diameter": _diameters(solid),
        "holes": _hole_distances(solid),
        "width": _widths(solid),
        "shaft": _shafts(solid),
        "corners": _corner_distances(solid),
        "arc": _arc_diameters(solid),
        "slot": _slot_lengths(solid),
    }
    found = (each for sort, rows in sorts.items() for each in islice(rows, _MOST[sort]))
    return tuple(
        Measurand(name=name, kind=kind, features=features, tolerance=_tolerance(value, unit))
        for name, kind, features, value in found
    )


_Row = tuple[str, str, tuple, float]  # name, kind, features, value


def _tolerance(value: float, unit: Unit) -> float:
    """How far a length may be off, in its unit, as few digits as can be."""
    length = in_unit(value, unit, "mm")
    allowed = next(off for most, off in _GENERAL if length <= most)
    return float(f"{in_unit(min(allowed, _SHARE * length), 'mm', unit):.2g}")


def _largest(size: float) -> float:
    """The key that puts the largest first, on any machine in the same order."""
    return -float(f"{size:.{_DIGITS}g}")


def _diameters(solid: Solid) -> Iterator[_Row]:
    for circle in sorted(solid.circles, key=lambda each: _largest(each.radius)):
        yield f"diameter {circle.name}", "diameter", (Centre(circle=circle.name),), 2 * circle.radius


def _hole_distances(solid: Solid) -> Iterator[_Row]:
    """Between circles in one plane, the farthest first."""
    groups: dict[int, list[Circle]] = defaultdict(list)
    for circle in solid.circles:
        groups[_plane_number(solid, circle.face)].append(circle)
    near = _SAME * solid.extent
    pairs = [
        (float(np.linalg.norm(one.centre - other.centre)), one, other)
        for group in groups.values()
        for one, other in combinations(sorted(group, key=lambda each: _largest(each.radius))[:8], 2)
    ]
    for apart, one, other in sorted(pairs, key=lambda pair: _largest(pair[0])):
        if apart > near:
            yield _distance(one, other, apart)


def _arc_diameters(solid: Solid) -> Iterator[_Row]:
    """Of half bores and round ends, a slot's once."""
    told = {arc.name for _, _, arc in slots(solid)}
    for arc in sorted(_round_ends(solid), key=lambda each: _largest(each.radius)):
        if arc.name not in told:
            yield f"diameter {arc.name}", "diameter", (Centre(circle=arc.name),), 2 * arc.radius


def _slot_lengths(solid: Solid) -> Iterator[_Row]:
    """Between the centres of the round ends of slots, the longest first."""
    for apart, one, other in sorted(slots(solid), key=lambda slot: _largest(slot[0])):
        yield _distance(one, other, apart)


def _distance(one: Circle, other: Circle, apart: float) -> _Row:
    features = Centre(circle=one.name), Centre(circle=other.name)
    return f"distance {one.name} {other.name}", "distance", features, apart


def _round_ends(solid: Solid) -> list[Circle]:
    return [arc for arc in solid.arcs if arc.turn >= _ROUND_END]


def slots(solid: Solid) -> list[tuple[float, Circle, Circle]]:
    """Round ends of one face, as wide as each other, which turn away from each other: how far apart, and both."""
    found = []
    for one, other in combinations(_round_ends(solid), 2):
        way = other.centre - one.centre
        apart, near = float(np.linalg.norm(way)), _SAME * solid.extent
        alike = one.face == other.face and one.hole == other.hole and abs(one.radius - other.radius) <= 10 * near
        if alike and apart > near:
            beyond = [(arc.around(3)[1] - arc.centre) @ way / (apart * arc.radius) for arc in (one, other)]
            if beyond[0] < _SAME - 1 and beyond[1] > 1 - _SAME:
                found.append((apart, one, other))
    return found


def _plane_number(solid: Solid, face: int) -> int:
    """The first of the faces that lie in one plane with this one and look the same way."""
    same = (solid.normals @ solid.normals[face] > 1 - _SAME) & (
        np.abs(solid.offsets - solid.offsets[face]) <= _SAME * solid.extent
    )
    return int(np.flatnonzero(same)[0])


def _widths(solid: Solid) -> Iterator[_Row]:
    """Between parallel edges of a face, one pair for each direction; the largest product of sides first."""
    around: dict[int, list[Edge]] = defaultdict(list)
    for edge in solid.sharp:
        for face in edge.faces:
            around[face].append(edge)
    rows = [row for edges in around.values() for row in _parallel(solid, edges)]
    told = set()
    for _, apart, one, other in sorted(rows, key=lambda row: _largest(row[0])):
        if (pair := frozenset((one.name, other.name))) not in told:
            told.add(pair)
            yield f"width {one.name} {other.name}", "width", (Side(edge=one.name), Side(edge=other.name)), apart


def _parallel(solid: Solid, edges: list[Edge]) -> Iterator[tuple[float, float, Edge, Edge]]:
    """Of each direction among a face's edges the best pair: what it is worth, how far apart."""
    best: dict[int, tuple[float, float, Edge, Edge]] = {}
    starts, stops = solid.vertices[[edge.ends for edge in edges]].swapaxes(0, 1)
    lengths = np.linalg.norm(stops - starts, axis=-1)
    along = (stops - starts) / lengths[:, None]
    direction = (np.linalg.norm(np.cross(along[:, None], along), axis=-1) <= _SAME).argmax(1)  # number of the first
    for i, number in enumerate(direction.tolist()):
        others = i + 1 + np.flatnonzero(direction[i + 1 :] == number)
        across = cross(components(starts[others] - starts[i]), along[i])
        apart = np.sqrt(dot(across, across))
        worth = apart * np.minimum(lengths[others], lengths[i])
        for k in np.flatnonzero(apart > _SAME * solid.extent):
            if worth[k] > best.get(number, (0.0,))[0] * (1 + _SAME):
                best[number] = float(worth[k]), float(apart[k]), edges[i], edges[others[k]]
    yield from best.values()


def _shafts(solid: Solid) -> Iterator[_Row]:
    for wall in sorted(solid.curved, key=lambda each: _largest(each.radius)):
        yield f"diameter {wall.name}", "diameter", (Wall(surface=wall.name),), 2 * wall.radius


def _corner_distances(solid: Solid) -> Iterator[_Row]:
    """Between the ends of the longest outer edges, where other edges meet them."""
    corners = set(solid.corner_names)
    for edge in sorted(solid.sharp, key=lambda each: _largest(solid.length(each))):
        names = [solid.vertex_names[end] for end in edge.ends]
        if edge.convex and corners.issuperset(names):
            features = tuple(_corner(solid, name, edge) for name in names)
            yield f"length {edge.name}", "distance", features, solid.length(edge)


def _corner(solid: Solid, vertex: str, edge: Edge) -> Corner:
    """An edge's end with the longest of the other edges there."""
    other = min(
        (each for each in solid.edges_at(vertex) if each is not edge), key=lambda each: _largest(solid.length(each))
    )
    return Corner(vertex=vertex, edges=(edge.name, other.name))
