"""What a search asks of pairs of camera and lens, found for those that it will ask of next, by several processes."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from functools import partial
from typing import Any

from planner.designing.close import Close, look
from planner.designing.evaluation import Problem, Rated, Viewed, rate_light, views
from scenes.catalogue import ListedLens, ListedLight, ListedSensor

_TOGETHER, _LIGHTS_TOGETHER = 16, 8  # pairs whose views are found at a time, and lights that a pair is rated with
Parts = tuple[ListedSensor, ListedLens]
At = tuple[float, float, int, int]  # cost, least ratio, pair, number of the light


class Ahead:
    """Views and ratings, each found once.

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
        self._seen: dict[int, tuple[Viewed, ...] | str] = {}
        self._rated: dict[tuple[int, int], Rated | str] = {}

    def parts(self, pair: int) -> Parts:
        """Camera and lens of a pair."""
        i, j = divmod(pair, len(self.lenses))
        return self.sensors[i], self.lenses[j]

    def views(self, pair: int, queue: list[At]) -> tuple[Viewed, ...] | str:
        """Of a pair; those of the next ones in the queue are found with it."""
        if pair not in self._seen:
            ahead = [pair, *(each[2] for each in heapq.nsmallest(_TOGETHER, queue))]
            wanted = [each for each in dict.fromkeys(ahead) if each not in self._seen][:_TOGETHER]
            made = self.mapped(partial(_viewed, self.problem), [self.parts(each) for each in wanted])
            self._seen |= dict(zip(wanted, made, strict=True))
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


def _viewed(problem: Problem, parts: Parts) -> tuple[Viewed, ...] | str:
    return views(problem, *parts)


def _rated(problem: Problem, parts: Parts, seen: tuple[Viewed, ...], light: ListedLight) -> Rated | str:
    return rate_light(problem, *parts, light, seen)
