"""What is proved of all pairs of a grid, for scenes in which things hide and shade each other.

Every pair has a lower bound of what it is worth at a glance (`planner.search.pair_bounds`); the pairs of the lowest
bounds are evaluated. What is left has its bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.search.grid import Grid
from planner.search.objective import Report, SearchProblem
from planner.search.pair_bounds import PairBounds

_AT_ONCE = 4096  # pairs that are evaluated


@dataclass(frozen=True, eq=False)
class Proven:
    """What is known of all pairs of a grid.

    Attributes
    ----------
    value : float
        The least value found, at a glance.
    sensor, light : ndarray, shape (2,), (2 F,)
        Where, degrees.
    least : float
        What no pair of the grid is below.
    pairs : int
        How many there are.
    within_scale : bool
        Whether that is said only of pairs by which the end of the scale cuts off no level.
    """

    value: float
    sensor: np.ndarray
    light: np.ndarray
    least: float
    pairs: int
    within_scale: bool

    @classmethod
    def of(
        cls,
        problem: SearchProblem,
        grid: Grid,
        start: tuple[np.ndarray, np.ndarray],
        share: float,
        most: int,
        report: Report,
    ) -> Proven:
        """Whether any pair is better than a start by a share; at most so many are evaluated.

        Where the end of the scale cuts off nothing from the start, what is cut off elsewhere does not count.
        """
        values_of, within = problem.values_from(*start), not problem.cuts_off(*start)
        value = float(values_of(*(pose[None] for pose in start))[0])
        bounds = PairBounds.of(problem, grid.sensors, grid.lights, within_scale=within)
        rows, columns, bound, beyond = _open(bounds, value, share, most, report)
        best, lowest = (value, *start), np.inf
        for at in range(0, len(bound), _AT_ONCE):
            if bound[at] >= (1 - share) * best[0]:
                beyond = min(beyond, float(bound[at]))
                break
            some = slice(at, at + _AT_ONCE)
            sensors, lights = grid.sensors[rows[some]], grid.lights[columns[some]]
            values = values_of(sensors, lights)
            k = int(np.argmin(values))
            lowest = min(lowest, float(values[k]))
            if values[k] < best[0]:
                best = float(values[k]), sensors[k], lights[k]
            report("evaluating the pairs of the lowest bounds", min(at + _AT_ONCE, len(bound)), len(bound))
        spared = within and bounds.lit.may_be_cut_off
        return cls(*best, min(lowest, beyond), len(grid.sensors) * len(grid.lights), spared)


def _open(
    bounds: PairBounds, value: float, share: float, most: int, report: Report
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Sensors, lights and bounds, rising, of the pairs that may be better by a share, the ``most`` lowest of them; and
    what no other pair is below."""
    seeing, beyond = np.flatnonzero(bounds.measures), np.inf
    found = np.zeros((0, 2), int), np.zeros(0, np.float32)
    for done, (rows, bound) in enumerate(bounds.blocks(seeing, (1 - share) * value)):
        near = bound < (1 - share) * value
        beyond = min(beyond, float(np.where(near, np.inf, bound).min()))
        row, column = np.nonzero(near)
        found = np.concatenate([found[0], np.column_stack([rows[row], column])]), np.append(found[1], bound[near])
        if len(found[1]) > most:
            order = np.argpartition(found[1], most)
            beyond = min(beyond, float(found[1][order[most]]))
            found = tuple(part[order[:most]] for part in found)
        report("bounding all pairs", min((done + 1) * len(rows), len(seeing)), len(seeing))
    order = np.argsort(found[1], kind="stable")
    return *found[0][order].T, found[1][order], beyond
