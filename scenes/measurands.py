"""What is to be measured, and how its edges are located."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from scenes.model import Model
from scenes.ranges import Positive


class Corner(Model):
    """A vertex of the object and the two edges whose images are intersected to find it."""

    vertex: str
    edges: tuple[str, str]


class Centre(Model):
    """The centre of a circular edge, found by fitting the ellipse that is its image."""

    circle: str

    @property
    def edges(self) -> tuple[str, ...]:
        """The circle's own name, for it is the one edge that is needed."""
        return (self.circle,)


def _tag_of_feature(value: Any) -> str:
    return "centre" if isinstance(value, Centre) or (isinstance(value, dict) and "circle" in value) else "corner"


Feature = Annotated[Annotated[Corner, Tag("corner")] | Annotated[Centre, Tag("centre")], Discriminator(_tag_of_feature)]


class Task(Model):
    """What to measure: the distance in the image between two features, or the angle between two edges.

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


class Locator(Model):
    """How edge points are found.

    ``scale_px`` is the standard deviation of the smoothing Gaussian, ``window_px`` how far to each side
    of the expected edge is searched, ``thresholds`` the gradient thresholds (grey levels a pixel) of the
    classic edge detector; the paper used 12 and 10.
    """

    scale_px: Annotated[float, Field(ge=0.8, le=10)] = 1.0
    window_px: Annotated[float, Field(ge=1, le=50)] = 3.0
    thresholds: tuple[Positive, ...] = (12.0, 10.0)
