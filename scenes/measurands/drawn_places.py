"""Points that stand for round features of a drawing: centres of bores, middles of slots, centres of patterns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from scenes.measurands.between import Midpoint, PitchCircle
from scenes.measurands.drawn_faces import SAME, Faces, centres
from scenes.measurands.features import Centre, check_off_line
from scenes.measurands.proposed import slots
from scenes.parts.solid import Circle
from scenes.parts.surfaces import Cylinder


@dataclass(frozen=True, eq=False)
class Place:
    """A point that is found by rims in one plane.

    Attributes
    ----------
    feature : Centre, Midpoint or PitchCircle
    at, axis : ndarray, shape (3,)
        Where it is on the part, and the unit normal of its rims' plane.
    name : str
        Of its rims.
    """

    feature: Centre | Midpoint | PitchCircle
    at: np.ndarray
    axis: np.ndarray
    name: str

    @classmethod
    def of(cls, circles: Sequence[Circle]) -> Place:
        """The middle of one or two circles; of more the centre of the circle through their centres."""
        sides, first = centres(*circles), circles[0]
        name = " ".join(circle.name for circle in circles)
        if len(circles) == 1:
            return cls(sides[0], first.centre, first.axis, name)
        if len(circles) == 2:
            return cls(Midpoint(midpoint=sides), (first.centre + circles[1].centre) / 2, first.axis, name)
        at = np.array([circle.centre for circle in circles])
        check_off_line("a pattern", at, tuple(circle.name for circle in circles))
        return cls(PitchCircle(pitch_circle=tuple(c.name for c in circles)), _centre(at), first.axis, name)

    def is_level(self, point: np.ndarray, near: float) -> bool:
        """Whether a point (3,) lies in its plane."""
        return bool(abs((point - self.at) @ self.axis) <= near)


def places_of(known: Faces, walls: Sequence[Cylinder]) -> Iterator[list[Place]]:
    """Of each bore or shaft among cylinders, mostly of two halves, a place at each of its rims; then of each slot."""
    told: set[str] = set()
    for wall in walls:
        rims = [circle for circle in known.circles_of(wall) if circle.name not in told]
        told |= {circle.name for circle in rims}
        if rims:
            yield [Place.of([rim]) for rim in rims]
    ends = {rim.name for wall in walls for rim in known.rims_of(wall)}
    found = [Place.of(pair) for _, *pair in slots(known.solid) if {each.name for each in pair} <= ends]
    while found:
        first = found[0]
        same = [place for place in found if _is_same_axis(first, place, known.near)]
        yield same
        found = [place for place in found if place not in same]


def pattern_of(known: Faces, walls: Sequence[Cylinder]) -> list[Place]:
    """What all of some bores say of one place, a slot its own: the middle of two, the centre of a pattern.

    At each height at which all of them have a rim; nothing where three or more lie on one line.
    """
    features: list[list[Place]] = []
    for places in places_of(known, walls):
        same = next((each for each in features if _is_same_axis(each[0], places[0], known.near)), None)
        if same is None:
            features.append(list(places))
        else:
            same.extend(places)
    if len(features) < 2:
        return features[0] if features else []
    found = []
    for first in features[0]:
        level = [next((p for p in places if first.is_level(p.at, known.near)), None) for places in features]
        circles = [known.solid.circle(p.feature.circle) for p in level if p and isinstance(p.feature, Centre)]
        if len(circles) == len(features):
            try:
                found.append(Place.of(circles))
            except ValueError:  # on one line
                return []
    return found


def _is_same_axis(one: Place, other: Place, near: float) -> bool:
    away = other.at - one.at
    across = away - one.axis * (away @ one.axis)
    return abs(abs(one.axis @ other.axis) - 1) <= SAME and bool(np.linalg.norm(across) <= near)


def _centre(at: np.ndarray) -> np.ndarray:
    """Of the circle through points (n, 3) of a plane by least squares, (3,)."""
    middle = at.mean(0)
    frame = np.linalg.svd(at - middle)[2][:2]
    flat = (at - middle) @ frame.T
    solved = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(at))]), (flat**2).sum(1), rcond=None)[0]
    return middle + solved[:2] @ frame
