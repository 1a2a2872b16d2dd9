"""The station of least cost that meets a drawing, and what less U costs, among all combinations of a catalogue.

Combinations come in the order of their cost; a pair of camera and lens takes the first light that does. What cannot be
is left out by what makes it impossible, for many at once: entries that contradict themselves or lack something, parts
that another dominates (`usable`), pairs that do not fit or whose least noise is too much (`bounds`). What is left is
rated at a glance from a few places (`evaluation.rate_light`), and looked at closely where it meets the requirements,
until the first does.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from planner.designing.ahead import Ahead, At
from planner.designing.bounds import REASONS, pairs
from planner.designing.close import Close, look
from planner.designing.evaluation import OWN_LIGHT, Problem, Viewed, floor
from planner.designing.outcome import BETTER, Design, Offer, Tally, front_of, to_three
from planner.designing.usable import worthwhile
from scenes import InvalidInput
from scenes.catalogue import Catalogue

Report = Callable[[str, int, int], None]
BUDGET, PLACES = "budget", "places in the image"
MOST_RATED = 20_000  # pairs that are rated at most, before the search gives up
_BESIDE = 24  # pairs that are rated for the front beyond the cheapest that does
_LOOKS, _SIDE_BY_SIDE = 24, 2  # close looks for it at most, and at a time
_CONTRADICTED = 3  # lights of a pair that close looks contradict, before it is given up
_SURE = 0.5  # of a noise that another camera's picture tells
_OF_RATING = ("visibility", "light in the way", "exposure time", "depth of field", "light", "rolling shutter")


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


class _Search:
    """One search as it goes on: what was rated so far, which lights do not show the edges, what was left out."""

    def __init__(
        self, problem: Problem, catalogue: Catalogue, report: Report, mapped: Callable[..., Any], beside: int, most: int
    ) -> None:
        self.problem, self.catalogue, self.report = problem, catalogue, report
        self.beside, self.most = beside, most
        kept, self.unused = worthwhile(catalogue)
        if math.isnan(problem.otherwise_um) and not all(lens.mtf for lens in kept["lenses"]):
            raise InvalidInput(
                "lens_blur_um (--lens-blur) must be given for lenses without an MTF where the scene's camera has no"
                " pixel_pitch_um, got nothing"
            )
        self.sensors, self.lenses = kept["sensors"], kept["lenses"]
        self.lights = sorted(kept["lights"], key=lambda each: each.price or 0.0)
        self.ahead = Ahead(problem, self.sensors, self.lenses, self.lights, mapped)
        self.begun: set[int] = set()  # pairs of which it is known what they promise
        self.least: dict[int, float] = {}  # ratio of a pair by noise alone, which none of its stations has less than
        self.offers: list[Offer] = []
        self.hard: dict[tuple, float] = {}  # of a light's shape: least factor of noise over the bound of its pair
        self.contradicted: Counter = Counter()  # by pair: how many lights close looks have contradicted
        self.counts: Counter = Counter()
        self.out: Counter = Counter()

    def run(self) -> Design:
        queue = self._queue()
        winner = self._cheapest(queue)
        complete = self.counts["views"] < self.most or winner is not None
        self._front(queue, winner)
        return self._told(winner, complete)

    def _queue(self) -> list[At]:
        """Pairs by cost with the cheapest light, then by what they promise: at first the least ratio by noise."""
        self.report("bounds", 0, 1)
        found = pairs(self.problem, self.sensors, self.lenses)
        for k, name in enumerate(REASONS):
            self.out[name] += int((found.reason == k + 1).sum())
        possible = np.flatnonzero(found.reason == 0)
        costs = self._costs().ravel()[possible] + self._light_cost(0)
        budget_limit = self.problem.wishes.budget or math.inf
        self.out[BUDGET] += int((costs > budget_limit).sum())
        least = found.least.ravel()[possible]
        self.least = dict(zip(possible.tolist(), least.tolist(), strict=True))
        queue = [(cost, self.least[pair], pair, 0) for cost, pair in zip(costs.tolist(), self.least, strict=True)
                 if cost <= budget_limit]  # fmt: skip
        heapq.heapify(queue)
        return queue

    def _costs(self) -> np.ndarray:
        if not self.catalogue.priced:
            pixels = np.array([float(np.prod(each.resolution)) / 1e6 for each in self.sensors])
            return np.repeat(pixels[:, None], len(self.lenses), 1)
        return np.add.outer(*(np.array([each.price for each in some], float) for some in (self.sensors, self.lenses)))

    def _light_cost(self, number: int) -> float:
        return (self.lights[number].price or 0.0) if self.catalogue.priced else 0.0

    def _cheapest(self, queue: list[At]) -> Offer | None:
        """The cheapest station that meets all, looked at closely; of equal cost that of the least ratio."""
        passing: list[Offer] = []
        while True:
            best, done = min(passing, key=lambda each: each.preference, default=None), self._is_done(queue)
            if best is None and done:
                return None
            if best is not None and (done or best.preference[:2] < (queue[0][0], to_three(queue[0][1]))):
                if best.close is not None:  # nothing that is left may be preferred
                    return best
                passing.remove(best)
                close = self._met(best, queue)
                passing += [] if close is None else [close]  # its ratio may be another
                continue
            offer = self._next(queue, 1.0)
            if offer is not None and offer.ratio <= 1:
                passing.append(offer)

    def _is_done(self, queue: list[At]) -> bool:
        return not queue or self.counts["views"] >= self.most

    def _next(self, queue: list[At], limit: float) -> Offer | None:
        """Look at the next combination more closely: at what its pair promises, then rate it with its light.

        A pair that promises enough comes back in its place among those of equal cost, a rated one with its next light.
        """
        at = _, promise, pair, number = heapq.heappop(queue)
        if pair not in self.begun:
            self._begin(queue, at, limit)
            return None
        if self._is_hopeless(promise, limit):
            self.out[PLACES] += number == 0
            return None
        seen = self.ahead.views(pair)
        if isinstance(seen, str):
            self.out[seen] += 1
            return None
        seen = tuple(each for each in seen if not self._is_hopeless(floor(self.problem, each), limit))
        if not seen:
            self.out[PLACES] += number == 0
            return None
        return self._rated(queue, at, seen, min(floor(self.problem, each) for each in seen) > limit)

    def _begin(self, queue: list[At], at: At, limit: float) -> None:
        """Ask what a pair promises; it comes back where that is enough."""
        cost, least, pair, number = at
        self.begun.add(pair)
        self.counts["views"] += 1
        self.report("pairs of camera and lens", self.counts["views"], self.counts["views"] + len(queue))
        promise = self.ahead.promised(pair, queue)
        if isinstance(promise, str):
            self.out[promise] += 1
        elif self._is_hopeless(promise, limit):
            self.out[PLACES] += 1
        else:
            heapq.heappush(queue, (cost, max(least, promise), pair, number))

    def _is_hopeless(self, ratio: float, limit: float) -> bool:
        """Whether what has at least this ratio neither meets the limit nor may be the best of its cost."""
        record = min((each.ratio for each in self.offers), default=math.inf)
        return ratio > limit and ratio >= record * BETTER

    def _rated(self, queue: list[At], at: At, seen: tuple[Viewed, ...], beaten: bool) -> Offer | None:
        cost, _, pair, number = at
        self.counts["rated"] += 1
        found = self.ahead.rated(pair, number, seen)
        offer = None if isinstance(found, str) else Offer(cost, found, order=(pair, number), least=self.least[pair])
        if offer is None:
            self.counts[found] += 1
        else:
            self.offers.append(offer)
            offer = self._probed(offer)
        if offer is None or not (beaten or offer.ratio <= 1):
            self._put_back(queue, at)
        return offer

    def _put_back(self, queue: list[At], at: At) -> None:
        """A pair, with its next light."""
        cost, promise, pair, number = at
        if number + 1 < len(self.lights):
            more = cost - self._light_cost(number) + self._light_cost(number + 1)
            if more <= (self.problem.wishes.budget or math.inf):
                heapq.heappush(queue, (more, promise, pair, number + 1))

    def _met(self, offer: Offer, queue: list[At]) -> Offer | None:
        """An offer that meets all when it is looked at closely; else its pair comes back with its next light."""
        close, pair = self._look(offer), offer.order[0]
        if close is not None and close.ratio <= 1:
            return close
        self.contradicted[pair] += close is not None
        if self.contradicted[pair] < _CONTRADICTED:  # of thousands of lights each would be looked at
            self._put_back(queue, (offer.cost, offer.least, *offer.order))
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

    def _front(self, queue: list[At], winner: Offer | None) -> None:
        """Look for less U at more cost, best promise first, for a number of pairs."""
        if winner is None:
            return
        allowed = min(self.counts["views"], self.most) + self.beside
        while queue and self.counts["views"] < allowed:
            self._next_better(queue)
        begun = [each for each in queue if each[2] in self.begun and each[3] == 0]
        heapq.heapify(begun)
        while begun and begun[0][3] == 0:
            self._next_better(begun)

    def _next_better(self, queue: list[At]) -> None:
        """The next that may have less U than all before."""
        record = min(each.ratio for each in self.offers)
        if queue[0][1] >= record * BETTER:
            heapq.heappop(queue)
            self.out["no better"] += 1
        else:
            self._next(queue, record * BETTER)

    def _told(self, winner: Offer | None, complete: bool) -> Design:
        front = self._looked_front()
        best = winner or min(front, key=lambda each: each.ratio, default=None)
        catalogue = self.catalogue
        self.out |= {name: self.counts[name] for name in _OF_RATING if self.counts[name]}
        searched = Tally(
            len(catalogue.sensors), len(catalogue.lenses), len(catalogue.lights),
            {table: {why: n for why, n in some.items() if n} for table, some in self.unused.items()},
            len(self.sensors) * len(self.lenses), {why: n for why, n in self.out.items() if n},
            self.counts["views"], self.counts["rated"], self.counts["close"], complete,
        )  # fmt: skip
        return Design(self.problem, best, winner is not None, front, searched, catalogue.priced, tuple(self.lights))

    def _looked_front(self) -> tuple[Offer, ...]:
        """The front of what was rated, each of it looked at closely."""
        for _ in range(_LOOKS // _SIDE_BY_SIDE):
            front = tuple(front_of(self.offers))
            open_ones = [each for each in front if each.close is None][-_SIDE_BY_SIDE:]
            if not open_ones:
                return front
            looked = self.ahead.looked([each.rated for each in open_ones])
            for offer, close in zip(open_ones, looked, strict=True):
                self._look(offer, close)
        return tuple(front_of(offer for offer in self.offers if offer.close is not None))
