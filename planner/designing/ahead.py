"""What a search asks of pairs of camera and lens, found for those that it will ask of next, by several processes."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from functools import partial
from typing import Any

from planner.designing.close import Close, look
from planner.designing.evaluation import Problem, Rated, Viewed, floor, rate_light, views
from scenes.catalogue import ListedLens, ListedLight, ListedSensor

_TOGETHER, _LIGHTS_TOGETHER = 16, 4  # pairs that are promised at a time, and lights that a pair is rated with
Parts = tuple[ListedSensor, ListedLens]
At = tuple[float, float, int, int]  # cost, what its pair promises, pair, number of the light


class Ahead:
    """Promises, views and ratings, each found once.

    Parameters
    ----------
    problem : Problem
    sensors, lenses, lights : list
        Numbered as a search has them: a pair is sensor x lenses + lens.
    mapped : callable
        As `map`, of several processes.
    """

    def __init__(
        self, problem: Problem, sensors: list[ListedSensor], lenses: list[ListedLens], lights: list[ListedLight],
        mapped: Callable[..., Any],
    ) -> None:  # fmt: skip
        self.problem, self.mapped = problem, mapped
        self.sensors, self.lenses, self.lights = sensors, lenses, lights
        self._promised: dict[int, float | str] = {}
        self._seen: dict[int, tuple[Viewed, ...] | str] = {}
        self._rated: dict[tuple[int, int], Rated | str] = {}

    def parts(self, pair: int) -> Parts:
        """Camera and lens of a pair."""
        i, j = divmod(pair, len(self.lenses))
        return self.sensors[i], self.lenses[j]

    def promised(self, pair: int, queue: list[At]) -> float | str:
        """U over what is allowed that no light makes less, by straight edges alone; or what keeps a pair from it.

        That of the next pairs in the queue is found with it.
        """
        if pair not in self._promised:
            ahead = [pair, *(each[2] for each in heapq.nsmallest(_TOGETHER, queue))]
            wanted = [each for each in dict.fromkeys(ahead) if each not in self._promised][:_TOGETHER]
            made = self.mapped(partial(_promised, self.problem), [self.parts(each) for each in wanted])
            self._promised |= dict(zip(wanted, made, strict=True))
        return self._promised[pair]

    def views(self, pair: int) -> tuple[Viewed, ...] | str:
        """Of a pair."""
        if pair not in self._seen:
            self._seen[pair] = views(self.problem, *self.parts(pair))
        return self._seen[pair]

    def rated(self, pair: int, number: int, seen: tuple[Viewed, ...]) -> Rated | str:
        """Of a pair and a light; where the first light does not do, those of the next ones are found with it."""
        if (pair, number) not in self._rated:
            last = number + 1 if number == 0 else min(number + _LIGHTS_TOGETHER, len(self.lights))
            made = self.mapped(partial(_rated, self.problem, self.parts(pair), seen), self.lights[number:last])
            self._rated |= {(pair, number + k): each for k, each in enumerate(made)}
        return self._rated.pop((pair, number))

    def looked(self, rated: list[Rated]) -> list[Close]:
        """Stations looked at closely."""
        return list(self.mapped(partial(look, self.problem), rated))


def _promised(problem: Problem, parts: Parts) -> float | str:
    seen = views(problem, *parts, of_rims=False)
    return seen if isinstance(seen, str) else min(floor(problem, each) for each in seen)


def _rated(problem: Problem, parts: Parts, seen: tuple[Viewed, ...], light: ListedLight) -> Rated | str:
    return rate_light(problem, *parts, light, seen)
