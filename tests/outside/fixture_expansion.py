"""An influence quantity of a user's own: a fixture grows with its temperature and lifts the part."""

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from planner.budgeting.station import Station
from scenes.influences import INFLUENCES, InfluenceQuantity
from scenes.ranges import Length


@INFLUENCES.add("fixture_expansion")
class FixtureExpansion(InfluenceQuantity):
    """The fixture's temperature less that at which the station was set up."""

    kind: Literal["fixture_expansion"]
    """fixture_expansion"""
    height: Length
    """Of the fixture below the part [length]."""
    expansion_per_K: Annotated[float, Field(ge=0, le=1e-3)]  # noqa: N815 - the unit
    """Coefficient of linear thermal expansion [1/K]."""

    unit = "K"

    def moved(self, station: Station, step: float) -> Station:
        x, y, z = station.shift
        return replace(station, shift=(x, y, z + self.height * self.expansion_per_K * step))
