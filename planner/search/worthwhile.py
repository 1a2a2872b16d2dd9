"""Candidate pairs for sets of pictures: those of a grid that no other pair dominates, from their fast evaluation.

``told`` (S, L, M) is the information (1 / variance) that each sensor x light pair has about each of M measurands.
"""

from __future__ import annotations

import numpy as np

from planner.search.aim import Aim
from planner.search.subsets import Information, front, greedy

_GROUPS = 24  # places of what is shared that are searched on


def worthwhile(told: np.ndarray, aim: Aim) -> np.ndarray:
    """Flat indices of pairs that no other dominates, and each sensor's best for the objective and each measurand."""
    flat = told.reshape(-1, told.shape[-1])
    best = [told[..., m].argmax(1) for m in range(told.shape[-1])]
    best.append(alone(told, aim).argmin(1))
    each = [np.arange(len(told)) * told.shape[1] + column for column in best]
    rows = np.unique(np.concatenate([front(all_ok(flat, aim)), *each]))
    return rows[flat[rows].any(1)]


def alone(told: np.ndarray, aim: Aim) -> np.ndarray:
    """What is minimised of each pair alone; infinite where not all is measured."""
    with np.errstate(divide="ignore"):
        parts = 1 / told
    return parts.max(-1) if aim.over == "minimax" else parts.sum(-1)


def shared(told: np.ndarray, aim: Aim, share: str, count: int) -> np.ndarray:
    """The same where pictures share their sensor, or their light (``share``).

    For each of its places the greedy set of ``count`` pictures is valued; the pairs that none dominates at the best
    places are returned.
    """
    axis = 0 if share == "sensor" else 1
    found = []
    for place in range(told.shape[axis]):
        table = all_ok(told.take(place, axis), aim)
        kept = front(table)
        if len(kept):
            own = table.only(kept)
            found.append((own.of_sets(np.array(greedy(own, count)[-1])).at(0), place, kept))
    found.sort(key=lambda each: each[0])
    rows = [np.ravel_multi_index((place, kept) if axis == 0 else (kept, place), told.shape[:2])
            for _, place, kept in found[:_GROUPS]]  # fmt: skip
    return np.concatenate(rows)


def all_ok(told: np.ndarray, aim: Aim) -> Information:
    return Information(told, np.zeros_like(told), aim.over)
