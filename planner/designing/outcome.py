"""What a search of a catalogue answers: stations with their cost, the front of cost and U, and what was left out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from planner.designing.close import Close
from planner.designing.evaluation import Problem, Rated
from planner.designing.stations import station
from scenes import Scene
from scenes.catalogue import ListedLight

BETTER = 0.98  # of the ratio before: what is worth more cost
_SHOWN = 12  # of the front


@dataclass(frozen=True, eq=False)
class Offer:
    """A station with its cost.

    Attributes
    ----------
    cost : float
        Sum of the prices; without prices the camera's megapixels.
    rated : Rated
    close : Close, optional
        Looked at closely, where it was.
    order : tuple of int
        Place of its pair and light among those that were left, which decides between equals.
    least : float
        Lower bound of its pair's ratio, by noise alone.
    """

    cost: float
    rated: Rated
    close: Close | None = None
    order: tuple[int, int] = (0, 0)
    least: float = 0.0

    @property
    def ratio(self) -> float:
        """Largest U over what is allowed: looked at closely where that was done."""
        return self.rated.ratio if self.close is None else self.close.ratio

    @property
    def preference(self) -> tuple[float, float, tuple[int, int]]:
        """By cost, then by the ratio to three digits, then as the catalogue has them."""
        return self.cost, to_three(self.ratio), self.order

    @property
    def shape(self) -> tuple:
        """What makes a light show edges or not, whatever the camera's noise: its form and the places of both."""
        light = self.rated.settings.light
        form: tuple = (light.kind, light.outer_diameter_mm, light.inner_diameter_mm, light.size_mm)
        form = form[:1] if light.kind == "backlight" else form  # behind the part, whatever its size
        return (*form, self.rated.sensor, self.rated.light, self.rated.settings.lens.is_telecentric)


@dataclass(frozen=True)
class Tally:
    """What was looked at, and what was left out by what.

    Attributes
    ----------
    sensors, lenses, lights : int
        In the catalogue.
    left_out : dict of str to dict of str to int
        Of each table, entries by reason.
    pairs : int
        Of sensors and lenses that were left.
    pairs_left_out : dict of str to int
        By reason.
    views, rated, close : int
        Pairs looked at from their places, combinations rated, and looked at closely.
    complete : bool
        Whether nothing that may be cheaper was left unrated.
    """

    sensors: int
    lenses: int
    lights: int
    left_out: dict[str, dict[str, int]]
    pairs: int
    pairs_left_out: dict[str, int]
    views: int
    rated: int
    close: int
    complete: bool

    @property
    def combinations(self) -> int:
        """Of all entries of the catalogue."""
        return self.sensors * self.lenses * self.lights


@dataclass(frozen=True, eq=False)
class Design:
    """The outcome.

    Attributes
    ----------
    problem : Problem
    best : Offer or None
        Of least cost that meets all; else that of the least ratio, None where nothing can be measured.
    reached : bool
        Whether it meets all.
    front : tuple of Offer
        By rising cost, each with less U than all before.
    searched : Tally
    priced : bool
        Whether costs are prices.
    lights : tuple of ListedLight
        That were left to choose from, by price.
    """

    problem: Problem
    best: Offer | None
    reached: bool
    front: tuple[Offer, ...]
    searched: Tally
    priced: bool
    lights: tuple[ListedLight, ...] = ()

    @property
    def scene(self) -> Scene:
        """The station that was found."""
        return station(self.problem.scene, self.best.rated.settings)


def to_three(ratio: float) -> float:
    """Rounded to three digits: what is less than that apart is equal."""
    return float(f"{ratio:.3g}")


def front_of(offers: Iterable[Offer]) -> Iterator[Offer]:
    """By rising cost, each of less ratio than all before."""
    record, kept = math.inf, []
    for offer in sorted(offers, key=lambda each: (each.cost, each.ratio)):
        if offer.ratio < record * (BETTER if kept else 1.0) and math.isfinite(offer.ratio):
            record = offer.ratio
            kept.append(offer)
    yield from kept[-_SHOWN:]
