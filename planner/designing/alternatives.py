"""Other places and lights for a camera and a lens: what to try where a render contradicts a station that was found."""

from __future__ import annotations

import math
from collections.abc import Iterator

from planner.designing.close import look
from planner.designing.evaluation import Rated, rate_light, views
from planner.designing.outcome import Design, Offer
from scenes.catalogue import ListedLight


def alternatives(design: Design, offer: Offer) -> Iterator[Offer]:
    """Stations of an offer's camera and lens that meet all when looked at closely, the least unsure place first.

    From its other places under its own light, then under the other lights, by their cost, from all places: what a step
    of the part shows beside an edge, and how that depends on the light, is another thing from each.
    """
    problem, settings = design.problem, offer.rated.settings
    seen = views(problem, settings.sensor, settings.lens)
    if isinstance(seen, str):
        return
    for light in (settings.light, *(each for each in design.lights if each != settings.light)):
        cost = offer.cost + (_cost(light) - _cost(settings.light) if design.priced else 0.0)
        if cost > (problem.wishes.budget or math.inf):
            continue
        for view in seen:
            rated = rate_light(problem, settings.sensor, settings.lens, light, (view,))
            if not isinstance(rated, Rated) or rated.ratio > 1 or _is_same(rated, offer.rated):
                continue
            close = look(problem, rated)
            if close.ratio <= 1:
                yield Offer(cost, rated, close)


def _cost(light: ListedLight) -> float:
    return light.price or 0.0


def _is_same(one: Rated, other: Rated) -> bool:
    return (one.settings.light, one.sensor) == (other.settings.light, other.sensor)
