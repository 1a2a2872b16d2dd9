"""Features between others: midpoints, centre lines, crossings, pitch circles, feet of perpendiculars.

Each is constructed from what is found of its parts, so that a measurand's derivatives, and with them the joint
covariance, go through it to their edges and circles.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Discriminator, Field, Tag

from scenes.measurands.evaluated import Line, Point, beside, circle_through, crossing, foot, mean
from scenes.measurands.features import (
    Between,
    Centre,
    Corner,
    Feature,
    Side,
    Wall,
    along_of,
    check_off_line,
    check_parallel,
    places,
)
from scenes.measurands.features import tag_of_feature as _tag_of_basic
from scenes.parts.solid import Solid

_ACROSS = np.sin(np.radians(5.0))  # of edges that have a crossing, at least

EdgeName = Annotated[str, Field(min_length=1)]


class Midpoint(Between):
    """The middle between two corners or centres."""

    midpoint: tuple[Feature, Feature]
    """The corners or centres of circles."""

    @property
    def parts(self) -> tuple[Corner | Centre, ...]:
        return self.midpoint

    def made(self, seen: Any, plane: np.ndarray | None) -> Point:
        """Their mean."""
        return mean([seen.point(part, plane) for part in self.midpoint])


class Through(Between):
    """The line through two corners or centres, from the first to the second."""

    is_line: ClassVar[bool] = True

    through: tuple[Feature, Feature]
    """The corners or centres of circles."""

    @property
    def parts(self) -> tuple[Corner | Centre, ...]:
        return self.through

    def made(self, seen: Any, plane: np.ndarray | None) -> Line:
        """Both of them."""
        return Line(*(seen.point(part, plane) for part in self.through))


class SquareAt(Between):
    """The line through the first of two corners or centres that is square to the way to the second, and as long."""

    is_line: ClassVar[bool] = True

    square_at: tuple[Feature, Feature]
    """The corners or centres of circles."""

    @property
    def parts(self) -> tuple[Corner | Centre, ...]:
        return self.square_at

    def made(self, seen: Any, plane: np.ndarray | None) -> Line:
        """From the first, to the left of that way, seen from outside."""
        first, second = (seen.point(part, plane) for part in self.square_at)
        return Line(first, beside(first, second, plane, seen.left(self.parts, plane)))


class CentreLine(Between):
    """The line in the middle between two edges that are parallel, along the first: of a slot, a rib, a plate."""

    is_line: ClassVar[bool] = True

    centre_line: tuple[EdgeName, EdgeName]
    """The edges."""

    @property
    def parts(self) -> tuple[Side, ...]:
        return tuple(Side(edge=name) for name in self.centre_line)

    def check(self, solid: Solid, key: str) -> None:
        """Within 1 degree of parallel."""
        super().check(solid, key)
        check_parallel(solid, key, self.parts, self.centre_line)

    def made(self, seen: Any, plane: np.ndarray | None) -> Line:
        """From the middle between the first edge's first end and the second edge to that between its last and it."""
        first, second = (seen.line(part, plane) for part in self.parts)
        return Line(*(mean([end, foot(end, second)]) for end in (first.start, first.stop)))


class Crossing(Between):
    """Where the lines of two edges cross, which need not meet there."""

    crossing: tuple[EdgeName, EdgeName]
    """The edges."""

    @property
    def parts(self) -> tuple[Side, ...]:
        return tuple(Side(edge=name) for name in self.crossing)

    def check(self, solid: Solid, key: str) -> None:
        """At least 5 degrees from parallel."""
        super().check(solid, key)
        if np.linalg.norm(np.cross(*(along_of(solid, part) for part in self.parts))) < _ACROSS:
            raise ValueError(f"{key} must be edges at least 5 degrees from parallel, got {', '.join(self.crossing)}")

    def made(self, seen: Any, plane: np.ndarray | None) -> Point:
        """Of their lines."""
        return crossing(*(seen.line(part, plane) for part in self.parts), plane)


class PitchCircle(Between):
    """The centre of the circle through the centres of at least three circles, by least squares."""

    pitch_circle: Annotated[tuple[EdgeName, ...], Field(min_length=3, max_length=64)]
    """The circles."""

    @property
    def parts(self) -> tuple[Centre, ...]:
        return tuple(Centre(circle=name) for name in self.pitch_circle)

    def check(self, solid: Solid, key: str) -> None:
        """Not on one line."""
        super().check(solid, key)
        check_off_line(key, places(solid, self.parts), self.pitch_circle)

    def made(self, seen: Any, plane: np.ndarray | None) -> Point:
        """Its centre."""
        return circle_through([seen.point(part, plane) for part in self.parts], plane)[0]


class Foot(Between):
    """The place on an edge's line that is nearest to a corner or a centre."""

    foot: Feature
    """The corner or centre of a circle."""
    on: EdgeName
    """The edge."""

    @property
    def parts(self) -> tuple[Corner | Centre | Side, ...]:
        return self.foot, Side(edge=self.on)

    def made(self, seen: Any, plane: np.ndarray | None) -> Point:
        """The foot of the perpendicular."""
        return foot(seen.point(self.foot, plane), seen.line(self.parts[1], plane))


_KEYS = {"midpoint": Midpoint, "through": Through, "square_at": SquareAt, "centre_line": CentreLine,
         "crossing": Crossing, "pitch_circle": PitchCircle, "foot": Foot}  # fmt: skip


def _tag_of_feature(value: Any) -> str:
    for tag, kind in _KEYS.items():
        if isinstance(value, kind) or (isinstance(value, dict) and tag in value):
            return tag
    return _tag_of_basic(value)


AnyFeature = Annotated[
    Annotated[Corner, Tag("corner")]
    | Annotated[Centre, Tag("centre")]
    | Annotated[Side, Tag("side")]
    | Annotated[Wall, Tag("wall")]
    | Annotated[Midpoint, Tag("midpoint")]
    | Annotated[Through, Tag("through")]
    | Annotated[SquareAt, Tag("square_at")]
    | Annotated[CentreLine, Tag("centre_line")]
    | Annotated[Crossing, Tag("crossing")]
    | Annotated[PitchCircle, Tag("pitch_circle")]
    | Annotated[Foot, Tag("foot")],
    Discriminator(_tag_of_feature),
]
