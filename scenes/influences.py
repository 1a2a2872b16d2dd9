"""Influence quantities of a user's own: what is not exactly as a scene says, and what of the station it moves."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from scenes.registry import OneOf, Registry
from scenes.uncertain import Uncertain


class InfluenceQuantity(Uncertain):
    """A deviation from what the scene says, of expectation 0, and how well it is known (VIM 2.52).

    A new kind is a class in one file, made known by ``@INFLUENCES.add(name)``: its fields, `unit`, `moves`, and what it
    does to a station (`moved`). In a scene it is a table ``[[uncertainty.influences]]``.
    """

    kind: str
    """Its kind's name; the source of the budget is called so."""

    unit: ClassVar[str] = ""
    moves: ClassVar[Literal["geometry", "brightness"]] = "geometry"
    """Whether it moves places in the image, or levels alone."""
    small: ClassVar[float] = 1.0
    """A change over which a derivative may be taken, of its unit."""

    def moved(self, station: Any, step: float) -> Any:
        """The `planner.budgeting.station.Station` with this quantity changed by a step."""
        raise NotImplementedError


INFLUENCES: Registry[type[InfluenceQuantity]] = Registry("uncertainty.influences.kind")
AnyInfluence = Annotated[InfluenceQuantity, OneOf(INFLUENCES)]
