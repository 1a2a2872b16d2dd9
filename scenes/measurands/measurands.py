"""What is to be measured - the measurands (VIM), each with its tolerance - and how its edges are located."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from scenes.measurands.features import AnyFeature, Centre, Corner, Feature, Side, Wall, place_of
from scenes.measurands.kinds import MEASURANDS
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

    @model_validator(mode="after")
    def _not_empty(self) -> Tolerance:
        if not self.plus + self.minus > 0:
            raise ValueError("tolerance must be greater than 0 above or below, got 0 for both")
        return self

    @property
    def half(self) -> float:
        """Half of the whole zone: what a standard deviation is compared with."""
        return (self.plus + self.minus) / 2


def _both_ways(value: Any) -> Any:
    """A single number is meant for both sides."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"plus": value, "minus": value} if number else value


@dataclass(frozen=True)
class Quantity:
    """One number to be measured: a measurand, or one coordinate of a position.

    Attributes
    ----------
    name, kind : str
        Of the measurand; a position's two coordinates are NAME.x, from its first datum edge, and NAME.y, from its
        second.
    features : tuple
        A coordinate's are the feature and that datum edge; a ball has none.
    nominal : float or None
        The value that is wanted, in the scene's unit or degrees; the object's own where None.
    tolerance : Tolerance or None
    weight : float
        In the planner's weighted sum.
    """

    name: str
    kind: str
    features: tuple[Corner | Centre | Side | Wall, ...]
    nominal: float | None = None
    tolerance: Tolerance | None = None
    weight: float = 1.0

    @property
    def edges(self) -> tuple[str, ...]:
        """Names of the edges and circles that it needs."""
        return sum((feature.edges for feature in self.features), ())

    @property
    def is_angle(self) -> bool:
        """Whether its unit is degrees."""
        return MEASURANDS[self.kind].is_angle

    @property
    def axis(self) -> int:
        """Of a ball's coordinate: 0 for x, 1 for y."""
        return int(self.name.endswith(".y"))


class Measurand(Model):
    """What to measure, on the plane of its features.

    ``distance`` between two corners or centres of circles; ``width`` from the middle of the first edge to the line of
    the second; ``offset`` of a corner or centre from the line of an edge; ``angle`` between two edges; ``diameter`` of
    a circle, a ball or a round wall, a cone's in its middle; ``taper`` of a cone, the angle between opposite lines of
    its wall; ``position`` of a corner or centre from two datum edges, as two offsets with two nominal values, or of a
    ball's centre in the scene's x and y, its z being that of the scene.
    """

    name: Title
    """What the drawing calls it; different for each."""
    kind: Annotated[str, NameOf(MEASURANDS)]
    """What is measured of the features."""
    features: Annotated[tuple[AnyFeature, ...], Field(min_length=1, max_length=3)]
    """Corners, circles and edges, in the order that the kind asks for."""
    nominal: Annotated[float, Field(ge=0, le=1e12)] | tuple[Coordinate, Coordinate] | None = None
    """The value that is wanted, the scene's unit or degrees; two for a position; the object's own if left out."""
    tolerance: Annotated[Tolerance | None, BeforeValidator(_both_ways)] = None
    """How far the value may lie from it, the scene's unit or degrees: one number for both sides, or plus and minus."""
    weight: Positive = 1.0
    """In the planner's weighted sum."""

    @model_validator(mode="after")
    def _complete(self) -> Measurand:
        kind = MEASURANDS[self.kind]
        if not self.name or not self.name.isprintable():
            raise ValueError(f"name must be a printable text, got {self.name!r}")
        if not kind.takes(self.features):
            got = ", ".join(" ".join(feature.edges) for feature in self.features)
            raise ValueError(f"features must be {kind.wanted} for kind {self.kind}, got {got}")
        if self.nominal is not None and isinstance(self.nominal, tuple) != (self.kind == "position"):
            number = "two numbers" if self.kind == "position" else "one number"
            raise ValueError(f"nominal must be {number} for kind {self.kind}, got {self.nominal}")
        if isinstance(self.nominal, tuple) and len(self.features) > 1 and not min(self.nominal) > 0:
            raise ValueError(f"nominal must be two numbers greater than 0 from datum edges, got {self.nominal}")
        return self

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The numbers that it consists of: one, or the two coordinates of a position."""
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
    """All numbers that a scene asks for."""
    return sum((measurand.quantities for measurand in measurands), () if task is None else (task.quantity,))


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
