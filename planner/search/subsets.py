"""Which pictures together: sets, with repeats, chosen from a table of what each picture tells of each quantity."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations_with_replacement, islice

import numpy as np

from planner.search.trusted import DEAREST

MOST_SETS = 200_000  # that are tried one by one
_CHUNK = 20_000
_BLOCK = 4096  # pictures compared at a time with those that are kept
_SEEDS, _SMALL = 64, 4  # pictures, of them all and of a set, that are few enough to begin it with each of them
_LESS = 1 - 1e-9  # times what is minimised: what differs less is the same


@dataclass(frozen=True, eq=False)
class Information:
    """What each of P pictures tells of each of M quantities: 1 / (share x variance), so that information adds.

    Attributes
    ----------
    ok, clutter : ndarray, shape (P, M)
        Of quantities that are ``ok``, and of those that are ``clutter``; 0 where there is none. Clutter counts only
        where no picture of a set is ok, and then as if its variance were `DEAREST` times as large, as much as a plan
        pays to be without.
    over : {"minimax", "sum"}
        Whether the largest of the M combined parts is minimised, or their sum.
    """

    ok: np.ndarray
    clutter: np.ndarray
    over: str

    def __len__(self) -> int:
        return len(self.ok)

    def only(self, rows: np.ndarray) -> Information:
        """Some of the pictures."""
        return Information(self.ok[rows], self.clutter[rows], self.over)

    def of_sets(self, members: np.ndarray) -> Score:
        """Of sets of pictures, indices (..., K)."""
        return self._score(self.ok[members].sum(-2), self.clutter[members].sum(-2))

    def with_each(self, members: tuple[int, ...]) -> Score:
        """Of a set of K pictures and each of the P as one more."""
        kept = list(members)
        return self._score(self.ok[kept].sum(0) + self.ok, self.clutter[kept].sum(0) + self.clutter)

    def _score(self, ok: np.ndarray, clutter: np.ndarray) -> Score:
        told = np.where(ok > 0, ok, clutter / DEAREST)
        parts = np.where(told > 0, 1 / np.where(told > 0, told, 1.0), 0.0)
        whole = parts.sum(-1)
        return Score((told == 0).sum(-1), parts.max(-1) if self.over == "minimax" else whole, whole)


@dataclass(frozen=True, eq=False)
class Score:
    """What is minimised of several sets: first how many quantities no picture measures, then the value of the others.

    Attributes
    ----------
    lost : ndarray of int, shape (...)
    value : ndarray, shape (...)
        Largest or sum of share x combined variance.
    whole : ndarray, shape (...)
        Their sum, which decides between sets of the same value: what limits them all may be the same quantity.
    """

    lost: np.ndarray
    value: np.ndarray
    whole: np.ndarray

    def best(self) -> int:
        """Flat index of the least."""
        value = np.where(self.lost == self.lost.min(), self.value, np.inf)
        return int(np.argmin(np.where(value * _LESS <= value.min(), self.whole, np.inf)))

    def at(self, index: int) -> tuple[int, float, float]:
        return int(self.lost.flat[index]), float(self.value.flat[index]), float(self.whole.flat[index])


def better(one: tuple[int, float, float], other: tuple[int, float, float]) -> bool:
    """Whether one set's score is clearly less than another's."""
    if one[0] != other[0]:
        return one[0] < other[0]
    if not one[1] * _LESS <= other[1] <= one[1] / _LESS:
        return one[1] < other[1]
    return one[2] < _LESS * other[2]


def front(table: Information) -> np.ndarray:
    """Indices of the pictures that no other one can stand in for in every set without making it worse.

    One can that tells at least as much of every quantity; where a quantity is clutter in some picture, it must not be
    ok where the other one's is not, for that would put the clutter of the rest of the set aside.
    """
    counts = np.concatenate([table.ok, table.clutter], 1)
    hidden = (table.clutter > 0).any(0)
    counts = np.concatenate([counts, table.ok[:, hidden] == 0], 1)
    order = np.argsort(-(table.ok + table.clutter).sum(1), kind="stable")
    order = order[(table.ok + table.clutter).any(1)[order]]
    kept = np.empty((0, counts.shape[1]))
    chosen: list[int] = []
    for at in range(0, len(order), _BLOCK):
        block = order[at : at + _BLOCK]
        for each in kept:
            block = block[(counts[block] > each).any(1)]
        for row in block:
            if not (kept >= counts[row]).all(1).any():
                kept = np.concatenate([kept, counts[row][None]])
                chosen.append(int(row))
    return np.array(chosen, int)


def greedy(table: Information, count: int) -> tuple[tuple[int, ...], ...]:
    """For 1, 2, ... ``count`` pictures a set that no exchange of one picture for another makes better.

    Each is the best of the one before with one picture more, and of sets that begin with the picture that sees one
    quantity best, or with each picture if they and the set are few, or with what is whole in the best set of parts of
    pictures. So none is worse than the one before with a picture repeated.
    """
    best = [(int(row),) for row in np.unique(table.ok.argmax(0))]
    each = [(row,) for row in range(len(table))] if len(table) <= _SEEDS else best
    told = np.maximum(table.ok, table.clutter / DEAREST)
    parts = _relaxed(told[:, told.any(0)], table.over)[1]
    chosen: list[tuple[int, ...]] = []
    for size in range(1, count + 1):
        whole = tuple(
            int(row) for row in np.repeat(np.arange(len(table)), np.floor(size * parts + 1e-9).astype(int))[:size]
        )
        starts = [chosen[-1] if chosen else (), whole, *(each if size <= _SMALL else best)]
        tried = [_exchanged(table, _filled(table, start, size)) for start in starts]
        score = table.of_sets(np.array(tried))
        chosen.append(tuple(sorted(tried[score.best()])))
    return tuple(chosen)


def _filled(table: Information, members: tuple[int, ...], size: int) -> tuple[int, ...]:
    while len(members) < size:
        members = (*members, table.with_each(members).best())
    return members


def _exchanged(table: Information, members: tuple[int, ...]) -> tuple[int, ...]:
    """One picture at a time is exchanged for the best other one until none makes the set better."""
    here = table.of_sets(np.array(members)).at(0)
    moved = True
    while moved:
        moved = False
        for position in range(len(members)):
            rest = members[:position] + members[position + 1 :]
            score = table.with_each(rest)
            best = score.best()
            if better(score.at(best), here):
                members, here, moved = (*rest, best), score.at(best), True
    return members


def sets_of(pictures: int, count: int) -> int:
    """How many sets of ``count`` pictures there are, repeats allowed.

    >>> sets_of(10, 2)
    55
    """
    return math.comb(pictures + count - 1, count)


def every_set(table: Information, count: int) -> tuple[int, ...]:
    """The best of all sets of ``count`` pictures, tried one by one."""
    best: tuple[int, ...] = ()
    least = (len(table.ok[0]) + 1, math.inf, math.inf)
    for members in _chunks(combinations_with_replacement(range(len(table)), count)):
        score = table.of_sets(members)
        index = score.best()
        if better(score.at(index), least):
            best, least = tuple(int(i) for i in members[index]), score.at(index)
    return best


def _chunks(sets: Iterator[tuple[int, ...]]) -> Iterator[np.ndarray]:
    while some := list(islice(sets, _CHUNK)):
        yield np.array(some)


def least_value(table: Information, count: int) -> float:
    """What no set of ``count`` pictures that measures every quantity can stay below, whatever the search.

    Pictures are counted in parts, ``count`` in all (`_relaxed`); infinite where some quantity is never measured.
    """
    told = np.maximum(table.ok, table.clutter / DEAREST)
    return _relaxed(told, table.over)[0] / count if told.any(0).all() else math.inf


def _relaxed(told: np.ndarray, over: str) -> tuple[float, np.ndarray]:
    """Lower bound of what is minimised for weights of pictures that add to 1, and such weights.

    A linear program for the largest part; for the sum the tangent at its solution, which lies below a convex function.
    """
    if over != "minimax":
        return _least_sum(told)
    from scipy.optimize import linprog  # slow to load, and rarely needed

    (pictures, quantities), scale = told.shape, told.max()
    found = linprog(
        np.r_[np.zeros(pictures), -1.0], A_ub=np.c_[-told.T / scale, np.ones(quantities)], b_ub=np.zeros(quantities),
        A_eq=np.r_[np.ones(pictures), 0.0][None], b_eq=[1.0],
    )  # fmt: skip
    return float(1 / (scale * -found.fun)), found.x[:-1]


def _least_sum(told: np.ndarray, rounds: int = 300) -> tuple[float, np.ndarray]:
    """The same of the sum of 1 / (w @ told), by multiplicative steps (Torsney 1983)."""
    weights, bound = np.full(len(told), 1 / len(told)), 0.0
    for _ in range(rounds):
        whole = weights @ told
        slope = (told / whole**2).sum(1)  # less is more: minus the derivative by each weight
        bound = max(bound, 2 * float((1 / whole).sum()) - float(slope.max()))
        weights = weights * np.sqrt(slope / (weights @ slope))
        weights /= weights.sum()
    return bound, weights
