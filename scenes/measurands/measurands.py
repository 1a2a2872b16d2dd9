"""What is to be measured - the measurands (VIM), each with its tolerance - and how its edges are located."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from scenes.measurands.between import AnyFeature, Crossing
from scenes.measurands.chain import linked
from scenes.measurands.features import Basic, Between, Centre, Corner, Feature, Side, basic_of, place_of
from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.zone import Zone
from scenes.model import Model, Name, Title
from scenes.parts.solid import Solid
from scenes.ranges import Coordinate, Positive, Spread
from scenes.registry import NameOf


class Tolerance(Model):
    """How far a value may lie above and below its nominal one, in the scene's unit or degrees."""

    plus: Spread
    """Above the nominal value, the scene's unit or degrees."""
    minus: Spread
    """Below it."""

    @property
    def half(self) -> float:
        """Half of the whole zone: what a standard deviation is compared with."""
        return (self.plus + self.minus) / 2

    def scaled(self, factor: float) -> Tolerance:
        """So many times as wide."""
        return self if factor == 1 else Tolerance(plus=factor * self.plus, minus=factor * self.minus)


def _both_ways(value: Any) -> Any:
    """A single number is meant for both sides."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"plus": value, "minus": value} if number else value


@dataclass(frozen=True)
class Quantity:
    """One number to be measured: a measurand, or one of several that it consists of.

    Attributes
    ----------
    name, kind : str
        Of the measurand; a position's two coordinates are NAME.x, from its first datum edge, and NAME.y, from its
        second; other kinds' numbers are NAME.part, too (`MeasurandKind.parts`).
    features : tuple
        A coordinate's are the feature and that datum edge; a ball has none. Some may lie between others.
    nominal : float or None
        The value that is wanted, in the scene's unit or degrees; the object's own where None.
    tolerance : Tolerance or None
    weight : float
        In the planner's weighted sum.
    terms : tuple of Quantity
        Of a chain (`scenes.measurands.chain`) the numbers that it is made of; its features are theirs.
    signs : tuple of int
        Of a chain +1 for each number that it adds, -1 for one that it takes off.
    """

    name: str
    kind: str
    features: tuple[Basic | Between, ...]
    nominal: float | None = None
    tolerance: Tolerance | None = None
    weight: float = 1.0
    terms: tuple[Quantity, ...] = ()
    signs: tuple[int, ...] = ()

    @property
    def edges(self) -> tuple[str, ...]:
        """Names of the edges and circles that it needs."""
        return sum((feature.edges for feature in self.features), ())

    @property
    def basic(self) -> tuple[Basic, ...]:
        """The features that are found for it, those of which others are made among them."""
        return basic_of(self.features)

    @property
    def crossings(self) -> tuple[Corner | Crossing, ...]:
        """Of its features those at which two edges' lines cross, each once."""
        found = (f for f in (*self.features, *self.basic) if isinstance(f, Corner | Crossing))
        return tuple(dict.fromkeys(found))

    @property
    def is_angle(self) -> bool:
        """Whether its unit is degrees."""
        return self.terms[0].is_angle if self.terms else MEASURANDS[self.kind].is_angle

    @property
    def told_of(self) -> str:
        """Of what it is, in words: its features, or the numbers of a chain."""
        if not self.terms:
            return " to ".join(map(place_of, self.features))
        signs = ("" if sign > 0 else "less " for sign in self.signs)
        return ", ".join(f"{sign}{term.name}" for sign, term in zip(signs, self.terms, strict=True))

    @property
    def axis(self) -> int:
        """Of a coordinate: 0 for x, 1 for y."""
        return int(self.name.endswith(".y"))

    def of(self, *features: Basic | Between) -> Quantity:
        """The same number of other features."""
        return replace(self, features=features)

    @property
    def part(self) -> str:
        """Which number of its measurand it is; of a single one without meaning."""
        return self.name.rpartition(".")[2]


class Measurand(Model):
    """What to measure, on the plane of its features.

    ``distance`` between two corners or centres of circles; ``width`` from the middle of the first edge to the line of
    the second; ``offset`` of a corner or centre from the line of an edge; ``angle`` between two edges; ``diameter`` or
    ``radius`` of a circle, an arc, a ball or a round wall, a cone's in its middle; ``taper`` of a cone, the angle
    between opposite lines of its wall; ``position`` of a corner or centre from two datum edges, as two offsets with two
    nominal values, or of a ball's centre in the scene's x and y, its z being that of the scene; ``slot`` of two round
    ends, NAME.width and NAME.length; ``pitch_circle`` of at least three circles, its diameter.

    Of several pictures adjusted together, and of none alone: ``height`` of a corner or centre over the plane of at
    least three others; ``face_angle`` between two faces, of edges two and two.

    Geometric tolerances, whose ``tolerance`` is the zone's width or diameter: ``true_position`` of a corner or centre
    in a datum system of two features, an edge and an edge or a point, or a point and a point or an edge, as NAME.x and
    NAME.y; ``concentricity``, also called ``coaxiality``, of two circles, the middle of a slot or the centre of a
    pattern among them, as NAME.x and NAME.y; ``symmetry`` of a line or a point about a line; ``parallelism`` and
    ``perpendicularity`` of an edge to a datum edge; forms, of all points of a feature: ``straightness`` of an edge,
    ``roundness`` of a circle, an arc or a ball.

    Chains, of the numbers of measurands before it that ``of`` names: ``mean``, ``sum`` (less those that ``minus``
    names), ``largest``, ``smallest``.
    """

    name: Title
    """What the drawing calls it; different for each."""
    kind: Annotated[str, NameOf(MEASURANDS)]
    """What is measured of the features."""
    features: Annotated[tuple[AnyFeature, ...], Field(max_length=64)] = ()
    """Corners, circles and edges, or what lies between some, in the order that the kind asks for; none of a chain."""
    of: Annotated[tuple[Title, ...], Field(max_length=64)] = ()
    """Of a chain: names of the numbers that it is made of (NAME, or NAME.part), which are listed before it."""
    minus: Annotated[tuple[Title, ...], Field(max_length=64)] = ()
    """Of a sum: names of those that are taken off."""
    nominal: Annotated[float, Field(ge=0, le=1e12)] | tuple[Coordinate, Coordinate] | None = None
    """The value that is wanted, the scene's unit or degrees; two for a place; the object's own if left out."""
    tolerance: Annotated[Tolerance | None, BeforeValidator(_both_ways)] = None
    """How far it may lie from it, the scene's unit or degrees: one number, or plus and minus; a zone's size, which may
    be 0 where it grows."""
    weight: Positive = 1.0
    """In the planner's weighted sum."""
    maximum_material: Title | None = None
    """Of a zone that grows as the feature departs from its maximum material size (ISO 2692): the name of the diameter,
    or of the slot's width (NAME.width), that is this size; its own tolerance says what is most."""

    @model_validator(mode="after")
    def _complete(self) -> Measurand:
        kind = MEASURANDS[self.kind]
        if not self.name or not self.name.isprintable():
            raise ValueError(f"name must be a printable text, got {self.name!r}")
        if not kind.takes(self.features):
            got = ", ".join(" ".join(feature.edges) for feature in self.features)
            raise ValueError(f"features must be {kind.wanted} for kind {self.kind}, got {got or 'none'}")
        if (self.of or self.minus) and not kind.is_chain:
            raise ValueError(f"of must be left out for kind {self.kind}, got {', '.join(self.of + self.minus)}")
        count = 0 if self.nominal is None else len(self.nominal) if isinstance(self.nominal, tuple) else 1
        if self.nominal is not None and count != kind.nominals:
            number = ("left out", "one number", "two numbers")[kind.nominals]
            raise ValueError(f"nominal must be {number} for kind {self.kind}, got {self.nominal}")
        kind.check_values(self)
        if self.tolerance is not None and self.maximum_material is None and not self.tolerance.half > 0:
            raise ValueError("tolerance must be greater than 0 above or below, got 0 for both")
        if self.maximum_material is not None and not (kind.takes_material and self.tolerance is not None):
            without = "without tolerance" if kind.takes_material else f"for kind {self.kind}"
            raise ValueError(f"maximum_material must be left out {without}, got {self.maximum_material!r}")
        return self

    @property
    def zone(self) -> Zone | None:
        """What a geometric tolerance limits; None of a dimension."""
        return MEASURANDS[self.kind].zone_of(self)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The numbers that it consists of: one, or several, as the two coordinates of a position."""
        return MEASURANDS[self.kind].quantities(self, Quantity)


class Task(Model):
    """Short form of one measurand: the distance between two features, or the angle between two edges.

    A distance needs ``start`` and ``end``, an angle ``lines``, the names of its two edges.
    """

    kind: Literal["distance", "angle"] = "distance"
    start: Feature | None = None
    end: Feature | None = None
    lines: tuple[str, str] | None = None

    @model_validator(mode="after")
    def _complete(self) -> Task:
        wanted = ("start", "end") if self.kind == "distance" else ("lines",)
        for key in ("start", "end", "lines"):
            value = getattr(self, key)
            if (value is None) == (key in wanted):
                got = "nothing" if value is None else repr(value)
                raise ValueError(f"task.{key} must be {'given' if key in wanted else 'left out'}, got {got}")
        return self

    @property
    def corners(self) -> tuple[Corner | Centre, ...]:
        """The two features of a distance; none for an angle."""
        return () if self.start is None or self.end is None else (self.start, self.end)

    @property
    def edges(self) -> tuple[str, ...]:
        """The required edges: those of the start feature, then those of the end feature; or the two lines."""
        return self.lines or sum((feature.edges for feature in self.corners), ())

    @property
    def quantity(self) -> Quantity:
        """The same as a quantity, named by its kind."""
        return Quantity(self.kind, self.kind, self.corners or tuple(Side(edge=name) for name in self.lines))


@lru_cache(maxsize=256)
def quantities_of(task: Task | None, measurands: tuple[Measurand, ...]) -> tuple[Quantity, ...]:
    """All numbers that a scene asks for; ValueError where a chain's are not there."""
    found = [] if task is None else [task.quantity]
    for i, measurand in enumerate(measurands):
        known = {each.name: each for each in found}
        for number in measurand.quantities:
            is_chain = bool(measurand.of + measurand.minus)
            key = f"measurands[{i}]"
            found.append(linked(number, measurand.of, measurand.minus, known, key) if is_chain else number)
    return widened(tuple(found), measurands)


def widened(quantities: tuple[Quantity, ...], measurands: tuple[Measurand, ...]) -> tuple[Quantity, ...]:
    """Numbers with the limits of zones that grow as of a feature in the middle of its size's limits."""
    sizes = {each.name: each.tolerance for each in quantities}
    more = {}
    for each in measurands:
        size = sizes.get(each.maximum_material) if each.maximum_material else None
        if size is not None and each.tolerance is not None:
            half = (each.tolerance.half + size.half) / MEASURANDS[each.kind].zone
            more |= {number.name: Tolerance(plus=half, minus=half) for number in each.quantities}
    return tuple(replace(each, tolerance=more[each.name]) if each.name in more else each for each in quantities)


class Locator(Model):
    """How edge points are found.

    ``scale_px`` is the standard deviation of the smoothing Gaussian, ``window_px`` how far to each side
    of the expected edge is searched, ``thresholds`` the gradient thresholds (grey levels a pixel) of the
    classic edge detector; the paper used 12 and 10. ``estimators`` are those by which ``ice validate`` measures: its
    verdict is about the first, the others are shown beside it; ``canny`` stands for one with each threshold.
    """

    scale_px: Annotated[float, Field(ge=0.8, le=10)] = 1.0
    window_px: Annotated[float, Field(ge=1, le=50)] = 3.0
    thresholds: tuple[Positive, ...] = (12.0, 10.0)
    estimators: Annotated[tuple[Name, ...], Field(min_length=1, max_length=20)] = ("gradient", "canny")


def check_quantity(solid: Solid, key: str, quantity: Quantity) -> None:
    """See that features, each of which is there, make a quantity: different ones, and what its kind asks for.

    Raises
    ------
    ValueError
        If they do not.
    """
    for one, other in combinations(quantity.features, 2):
        if place_of(one) == place_of(other):
            raise ValueError(f"{key} must be different features, got {place_of(one)!r} twice")
    MEASURANDS[quantity.kind].check(solid, key, quantity)
