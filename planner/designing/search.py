"""The station of least cost that meets a drawing, and what less U costs, among all combinations of a catalogue.

Combinations come in the order of their cost; a pair of camera and lens takes the first light that does. What cannot be
is left out by what makes it impossible, for many at once: entries that contradict themselves or lack something, parts
that another dominates, pairs that do not fit or whose least noise is too much. What is left is rated at a glance from a
few places (`evaluation.rate_light`), and looked at closely where it meets the requirements, until the first does.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from planner.designing.bounds import REASONS, pairs
from planner.designing.close import Close, look
from planner.designing.dominance import of_lens, of_light, of_sensor, undominated
from planner.designing.evaluation import OWN_LIGHT, Problem, Rated, Viewed, floor, rate_light, views
from planner.designing.stations import station
from scenes import InvalidInput, Scene
from scenes.cameras.pinhole import MOST_PIXELS
from scenes.catalogue import Catalogue, Entry, ListedLens, ListedLight, ListedSensor

Report = Callable[[str, int, int], None]
CONTRADICTORY, INCOMPLETE, PRICELESS, COLOUR, LARGE, BUDGET, DOMINATED = (
    "contradictory", "incomplete", "no price", "colour filters", "too many pixels", "budget", "dominated",
)  # fmt: skip
PLACES = "places in the image"
MOST_RATED = 20_000  # pairs that are rated at most, before the search gives up
_BESIDE = 24  # pairs that are rated for the front beyond the cheapest that does
_TOGETHER, _LIGHTS_TOGETHER = 16, 8  # pairs whose views are found at a time, and lights that a pair is rated with
_BETTER = 0.98  # of the ratio before: what is worth more cost
_SHOWN = 12  # of the front
_MOST_ASIDE = 16384  # columns or rows, of a scene's camera
_LOOKS, _SIDE_BY_SIDE = 24, 2  # close looks for it at most, and at a time
_SURE = 0.5  # of a noise that another camera's picture tells
_OF_RATING = ("visibility", "light in the way", "exposure time", "depth of field", "light", "rolling shutter")


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
        return self.cost, float(f"{self.ratio:.3g}"), self.order

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


def design(
    scene_problem: Problem,
    catalogue: Catalogue,
    *,
    report: Report = lambda *_: None,
    mapped: Callable[..., Any] = map,
    own_light: bool = False,
    beside: int = _BESIDE,
    most: int = MOST_RATED,
) -> Design:
    """Search a catalogue for a scene.

    Parameters
    ----------
    scene_problem : Problem
    catalogue : Catalogue
    report : callable, optional
        Called with what is done, how many, and of how many at most.
    mapped : callable
        As `map`, of several processes.
    own_light : bool
        Whether the scene's own lights stay, at no cost; so they do where the catalogue has none.
    beside : int
        Pairs that are looked at for the front once the cheapest station is known.
    most : int
        Pairs that are looked at until then.

    Raises
    ------
    InvalidInput
        If nothing of the catalogue is left to be looked at; the text says what left how much.
    """
    if own_light or not catalogue.lights:
        catalogue = catalogue.model_copy(update={"lights": (OWN_LIGHT,)})
    return _Search(scene_problem, catalogue, report, mapped, beside, most).run()


def usable(catalogue: Catalogue) -> tuple[dict[str, list[Any]], dict[str, Counter]]:
    """Entries of each table that a station can be made of, and how many are left out by what."""
    wrong = {each.entry for each in catalogue.contradictions()}
    kept: dict[str, list[Any]] = {}
    out: dict[str, Counter] = {}
    for table in ("sensors", "lenses", "lights"):
        kept[table], out[table] = [], Counter()
        for each in _offered(getattr(catalogue, table), wrong):
            why = _unusable(each, wrong, catalogue.priced)
            if why:
                out[table][why] += 1
            else:
                kept[table].append(each)
    return kept, out


def _offered(entries: tuple[Entry, ...], wrong: set[str]) -> Iterator[Entry]:
    """The entries of a table, with every mode of binning of those that can be used."""
    for each in entries:
        some = isinstance(each, ListedSensor) and not each.missing and each.told not in wrong
        yield from each.modes if some else (each,)


def _unusable(each: Entry, wrong: set[str], priced: bool) -> str:
    if each.told in wrong:
        return CONTRADICTORY
    if each.missing and each != OWN_LIGHT:
        return INCOMPLETE
    if priced and each.price is None and each != OWN_LIGHT:
        return PRICELESS
    if isinstance(each, ListedSensor) and (
        np.prod(each.resolution) > MOST_PIXELS or max(each.resolution) > _MOST_ASIDE
    ):
        return LARGE
    return COLOUR if isinstance(each, ListedSensor) and each.colour and each.filters is None else ""


class _Search:
    """One search as it goes on: what was rated so far, which lights do not show the edges, what was left out."""

    def __init__(
        self, problem: Problem, catalogue: Catalogue, report: Report, mapped: Callable[..., Any], beside: int, most: int
    ) -> None:
        self.problem, self.catalogue, self.report, self.mapped = problem, catalogue, report, mapped
        self.beside, self.most = beside, most
        self.offers: list[Offer] = []
        self.hard: dict[tuple, float] = {}  # of a light's shape: least factor of noise over the bound of its pair
        self.seen: dict[int, tuple[Viewed, ...] | str] = {}
        self.ahead: dict[tuple[int, int], Rated | str] = {}  # of pairs and numbers of lights
        self.counts: Counter = Counter()
        self.out: Counter = Counter()

    def run(self) -> Design:
        kept, out = usable(self.catalogue)
        comparisons = {"sensors": of_sensor, "lenses": of_lens, "lights": of_light}
        for table, compared in comparisons.items():
            left = undominated(kept[table], compared)
            out[table][DOMINATED] += len(kept[table]) - len(left)
            kept[table] = left
            if not left:
                told = ", ".join(f"{count} {why}" for why, count in out[table].items() if count) or "none given"
                raise InvalidInput(f"catalogue must have {table} that a station can be made of, got {told}")
        if math.isnan(self.problem.otherwise_um) and not all(lens.mtf for lens in kept["lenses"]):
            raise InvalidInput(
                "lens_blur_um (--lens-blur) must be given for lenses without an MTF where the scene's camera has no"
                " pixel_pitch_um, got nothing"
            )
        self.sensors: list[Any] = kept["sensors"]
        self.lenses, self.lights = kept["lenses"], kept["lights"]
        self.lights = sorted(self.lights, key=lambda each: each.price or 0.0)
        queue = self._queue()
        winner = self._cheapest(queue)
        complete = self.counts["views"] < self.most or winner is not None
        self._front(queue, winner)
        return self._told(winner, out, complete)

    def _queue(self) -> list[tuple[float, float, int, int]]:
        """Pairs by cost with the cheapest light: (cost, least ratio, pair, number of the light)."""
        self.report("bounds", 0, 1)
        found = pairs(self.problem, self.sensors, self.lenses)
        for k, name in enumerate(REASONS):
            self.out[name] += int((found.reason == k + 1).sum())
        possible = np.flatnonzero(found.reason == 0)
        costs = self._costs().ravel()[possible] + self._light_cost(0)
        budget_limit = self.problem.wishes.budget or math.inf
        self.out[BUDGET] += int((costs > budget_limit).sum())
        least = found.least.ravel()[possible]
        queue = [
            (float(cost), float(bound), int(pair), 0)
            for cost, bound, pair in zip(costs, least, possible, strict=True)
            if cost <= budget_limit
        ]
        heapq.heapify(queue)
        return queue

    def _costs(self) -> np.ndarray:
        if not self.catalogue.priced:
            pixels = np.array([float(np.prod(each.resolution)) / 1e6 for each in self.sensors])
            return np.repeat(pixels[:, None], len(self.lenses), 1)
        return np.add.outer(*(np.array([each.price for each in some], float) for some in (self.sensors, self.lenses)))

    def _light_cost(self, number: int) -> float:
        return (self.lights[number].price or 0.0) if self.catalogue.priced else 0.0

    def _parts(self, pair: int) -> tuple[ListedSensor, ListedLens]:
        i, j = divmod(pair, len(self.lenses))
        return self.sensors[i], self.lenses[j]

    def _views(self, pair: int, queue: list) -> tuple[Viewed, ...] | str:
        """Of a pair; those of the next ones are found with it."""
        if pair not in self.seen:
            ahead = [pair, *(each[2] for each in heapq.nsmallest(_TOGETHER, queue))]
            wanted = [each for each in dict.fromkeys(ahead) if each not in self.seen][:_TOGETHER]
            made = self.mapped(partial(_viewed, self.problem), [self._parts(each) for each in wanted])
            self.seen |= dict(zip(wanted, made, strict=True))
        return self.seen[pair]

    def _cheapest(self, queue: list) -> Offer | None:
        """The cheapest station that meets all, looked at closely; of equal cost that of the least ratio."""
        passing: list[Offer] = []
        while queue:
            if passing and queue[0][0] > passing[0].cost:
                found = self._closest(passing)
                if found:
                    return found
                passing = []
            if self.counts["views"] >= self.most:
                break
            offer = self._next(queue, 1.0)
            if offer is not None and offer.ratio <= 1:
                passing.append(offer)
        return self._closest(passing)

    def _next(self, queue: list, limit: float) -> Offer | None:
        """Rate the next combination; its pair comes back with the next light."""
        cost, least, pair, number = heapq.heappop(queue)
        if number == 0:
            self.counts["views"] += 1
            self.report("pairs of camera and lens", self.counts["views"], self.counts["views"] + len(queue))
        seen = self._views(pair, queue)
        if isinstance(seen, str):
            self.out[seen] += 1
            return None
        beaten = min(floor(self.problem, each) for each in seen) > limit
        record = min((each.ratio for each in self.offers), default=math.inf)
        if beaten and not self._worth(seen, record):
            self.out[PLACES] += number == 0
            return None
        return self._rated(queue, (cost, least, pair, number), seen, beaten)

    def _worth(self, seen: tuple[Viewed, ...], record: float) -> bool:
        """Whether a pair that does not meet all may still be the best of its cost."""
        return min(floor(self.problem, each) for each in seen) < record * _BETTER

    def _rated(self, queue: list, at: tuple[float, float, int, int], seen: tuple, beaten: bool) -> Offer | None:
        cost, least, pair, number = at
        self.counts["rated"] += 1
        found = self._rate(pair, number, seen)
        offer = None if isinstance(found, str) else Offer(cost, found, order=(pair, number), least=least)
        if offer is None:
            self.counts[found] += 1
        else:
            self.offers.append(offer)
            offer = self._probed(offer)
        done = offer is not None and (beaten or offer.ratio <= 1)
        further = number + 1 < len(self.lights) and not done
        if further:
            more = cost - self._light_cost(number) + self._light_cost(number + 1)
            if more <= (self.problem.wishes.budget or math.inf):
                heapq.heappush(queue, (more, least, pair, number + 1))
        return offer

    def _rate(self, pair: int, number: int, seen: tuple[Viewed, ...]) -> Rated | str:
        """Of a pair and a light; where the first light does not do, those of the next ones are found with it."""
        if (pair, number) not in self.ahead:
            last = number + 1 if number == 0 else min(number + _LIGHTS_TOGETHER, len(self.lights))
            made = self.mapped(partial(_rated, self.problem, self._parts(pair), seen), self.lights[number:last])
            self.ahead |= {(pair, number + k): each for k, each in enumerate(made)}
        return self.ahead.pop((pair, number))

    def _closest(self, passing: list[Offer]) -> Offer | None:
        """The first, by preference, that meets all when it is looked at closely."""
        for offer in sorted(passing, key=lambda each: each.preference):
            close = self._look(offer)
            if close is not None and close.ratio <= 1:
                return close
        return None

    def _probed(self, offer: Offer) -> Offer | None:
        """An offer whose light is known to show the edges: the first of each shape is looked at closely."""
        if offer.shape in self.hard:
            if self.hard[offer.shape] * offer.least <= 1:
                return offer
            self.counts["light"] += 1
            self._forget(offer)
            return None
        close = self._look(offer)
        if close is not None and close.close.noise > 1:
            self._forget(close)
            return None
        return close

    def _look(self, offer: Offer, looked: Close | None = None) -> Offer | None:
        """An offer looked at closely; None where another camera already showed that its light does not do.

        Noise of the same picture is less by no more than the cameras' least noises tell, within a factor 2. ``looked``
        is what a look tells, where it was done.
        """
        if offer.close is not None:
            return offer
        if self.hard.get(offer.shape, 0.0) * offer.least > 1:
            self.counts["light"] += 1
            self._forget(offer)
            return None
        self.counts["close"] += 1
        self.report("close looks", self.counts["close"], self.counts["close"] + 1)
        close = replace(offer, close=looked or look(self.problem, offer.rated))
        hard = _SURE * close.close.noise / max(offer.least, 1e-12) if close.close.noise > 1 else 0.0
        self.hard[offer.shape] = min(hard, self.hard.get(offer.shape, math.inf))
        self.offers = [close if each is offer else each for each in self.offers]
        return close

    def _forget(self, offer: Offer) -> None:
        self.offers = [each for each in self.offers if each is not offer]

    def _front(self, queue: list, winner: Offer | None) -> None:
        """Look for less U at more cost, best promise first, for a number of pairs."""
        if winner is None or not queue:
            return
        allowed = self.counts["views"] + self.beside
        while queue and self.counts["views"] < min(allowed, self.most + self.beside):
            record = min(each.ratio for each in self.offers)
            if queue[0][1] >= record * _BETTER:
                heapq.heappop(queue)
                self.out["no better"] += 1
                continue
            self._next(queue, record * _BETTER)

    def _told(self, winner: Offer | None, out: dict[str, Counter], complete: bool) -> Design:
        front = self._looked_front()
        best = winner or min(front, key=lambda each: each.ratio, default=None)
        catalogue = self.catalogue
        self.out |= {name: self.counts[name] for name in _OF_RATING if self.counts[name]}
        searched = Tally(
            len(catalogue.sensors), len(catalogue.lenses), len(catalogue.lights),
            {table: {why: n for why, n in some.items() if n} for table, some in out.items()},
            len(self.sensors) * len(self.lenses), {why: n for why, n in self.out.items() if n},
            self.counts["views"], self.counts["rated"], self.counts["close"], complete,
        )  # fmt: skip
        return Design(self.problem, best, winner is not None, front, searched, catalogue.priced, tuple(self.lights))

    def _looked_front(self) -> tuple[Offer, ...]:
        """The front of what was rated, each of it looked at closely."""
        for _ in range(_LOOKS // _SIDE_BY_SIDE):
            front = tuple(_front(self.offers))
            open_ones = [each for each in front if each.close is None][-_SIDE_BY_SIDE:]
            if not open_ones:
                return front
            looked = self.mapped(partial(look, self.problem), [each.rated for each in open_ones])
            for offer, close in zip(open_ones, looked, strict=True):
                self._look(offer, close)
        return tuple(_front([offer for offer in self.offers if offer.close is not None]))


def _viewed(problem: Problem, parts: tuple[ListedSensor, ListedLens]) -> tuple[Viewed, ...] | str:
    return views(problem, *parts)


def _rated(
    problem: Problem, parts: tuple[ListedSensor, ListedLens], seen: tuple[Viewed, ...], light: ListedLight
) -> Rated | str:
    return rate_light(problem, *parts, light, seen)


def _front(offers: list[Offer]) -> Iterator[Offer]:
    """By rising cost, each of less ratio than all before."""
    record, kept = math.inf, []
    for offer in sorted(offers, key=lambda each: (each.cost, each.ratio)):
        if offer.ratio < record * (_BETTER if kept else 1.0) and math.isfinite(offer.ratio):
            record = offer.ratio
            kept.append(offer)
    yield from kept[-_SHOWN:]
