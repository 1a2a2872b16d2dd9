"""Faces that a part's file names, by their numbers in it, with the edges and circles that stand for them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from scenes.measurands.features import Centre, Side, along_of
from scenes.measurands.measurands import Measurand, Tolerance
from scenes.parts.pmi import Characteristic
from scenes.parts.solid import Circle, Edge, Solid
from scenes.parts.step import StepPart
from scenes.parts.surfaces import Cylinder, Plane
from scenes.units import Unit, in_unit

SAME = 1e-6  # of the part's size: in one place; rad: parallel


@dataclass(frozen=True, eq=False)
class Faces:
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
        return SAME * self.solid.extent

    def surfaces(self, numbers: tuple[int, ...]) -> list:
        """Surfaces of those."""
        return [self.part.surfaces[face] for face in self.of(numbers)]

    def edges_in(self, plane: Plane) -> list[Edge]:
        """Sharp straight edges that lie in a plane."""
        heights = np.abs((self.solid.vertices - plane.point) @ plane.normal) <= self.near
        return [edge for edge in self.solid.sharp if heights[list(edge.ends)].all()]

    def circles_of(self, cylinder: Cylinder) -> list[Circle]:
        """Whole rims of a cylinder."""
        return [circle for circle in self.rims_of(cylinder) if circle.ends is None]

    def rims_of(self, cylinder: Cylinder) -> list[Circle]:
        """The same with arcs."""
        axis = np.asarray(cylinder.axis) / np.linalg.norm(cylinder.axis)
        found = []
        for circle in self.solid.rims:
            away = circle.centre - cylinder.point
            beside = np.linalg.norm(away - axis * (away @ axis))
            alike = abs(circle.radius - cylinder.radius) <= self.near and abs(abs(circle.axis @ axis) - 1) <= SAME
            if alike and beside <= self.near:
                found.append(circle)
        return found

    def across(self, planes: list[Plane], angle: float, off: float) -> list[tuple[float, Edge, Edge]]:
        """Pairs of edges, of either plane one, in a face that stands across both, which meet at an angle, degrees.

        Minus the length of the shorter comes first.
        """
        solid, way = self.solid, np.cross(planes[0].normal, planes[1].normal)
        size, found = np.linalg.norm(way), []
        if size <= SAME:
            return []
        for one, other in product(*map(self.edges_in, planes)):
            shared = set(one.faces) & set(other.faces)
            upright = any(abs(abs(solid.normals[face] @ way) / size - 1) <= SAME for face in shared)
            if upright and one.name != other.name:
                along = [along_of(solid, side) for side in sides(one, other)]
                between = _degrees(*along)
                if min(abs(between - angle), abs(180 - between - angle)) <= off:
                    found.append((-min(solid.length(one), solid.length(other)), one, other))
        return found

    def different(self, planes: list[Plane]) -> list[Plane]:
        """Planes, each once."""
        found: list[Plane] = []
        for plane in planes:
            if not any(_is_same(plane, other, self.near) for other in found):
                found.append(plane)
        return found


def angle_of(solid: Solid, one: Edge, other: Edge) -> float:
    """Between two edges as it is measured (`scenes.measurands.angle`): from their common vertex, degrees."""
    shared = set(one.ends) & set(other.ends)
    out = (along_of(solid, side) * (1 if not shared or edge.ends[0] in shared else -1)
           for edge, side in zip((one, other), sides(one, other), strict=True))  # fmt: skip
    return _degrees(*out)


def _degrees(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other)), one @ other)))


def _is_same(one: Plane, other: Plane, near: float) -> bool:
    parallel = np.linalg.norm(np.cross(one.normal, other.normal)) <= SAME
    return bool(parallel and abs((np.asarray(one.point) - other.point) @ np.asarray(one.normal)) <= near)


def measurand(each: Characteristic, unit: Unit, kind: str, features: tuple, of: str) -> Measurand:
    """Of a dimension, with the file's value and limits; where both lie on one side, with their middle."""
    told = (each.value, each.plus, each.minus)
    nominal, plus, minus = (part if each.unit == "deg" else in_unit(part, "mm", unit) for part in told)
    if min(plus, minus) < 0:
        nominal, plus, minus = nominal + (plus - minus) / 2, (plus + minus) / 2, (plus + minus) / 2
    found = limited(each, kind, features, of, plus, minus)
    return found.model_copy(update={"nominal": float(f"{nominal:.9g}")})


def limited(each: Characteristic, kind: str, features: tuple, of: str, plus: float, minus: float) -> Measurand:
    """With limits in the scene's unit, or degrees."""
    tolerance = Tolerance(plus=float(f"{plus + 0.0:.6g}"), minus=float(f"{minus + 0.0:.6g}"))
    return Measurand(name=f"{each.kind} #{each.number} {of}", kind=kind, features=features, tolerance=tolerance)


def sides(*edges: Edge) -> tuple[Side, ...]:
    """Edges as features."""
    return tuple(Side(edge=edge.name) for edge in edges)


def centres(*circles: Circle) -> tuple[Centre, ...]:
    """Circles as features."""
    return tuple(Centre(circle=circle.name) for circle in circles)
