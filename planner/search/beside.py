"""Local refinement below the grid of one picture's poses, with the other pictures of the set held."""

from __future__ import annotations

import numpy as np

from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.search.constraints import Constraints
from planner.search.looked import Pool, information
from planner.search.refinement import refine
from planner.search.subsets import Information, better
from scenes.status import is_trusted

_SIZES = (0.7, 0.15)  # grid steps: of the first simplex of a descent


def descend(
    pool: Pool, row: int, rest: tuple[np.ndarray, np.ndarray], constraints: Constraints, step_deg: float
) -> int:
    """Refine a row of the pool, glancing, and look closely at what is found.

    Parameters
    ----------
    rest : pair of ndarray, shape (M,)
        What the other pictures of its set tell, ``ok`` and ``clutter``.

    Returns
    -------
    int
        Number of the new row, or of the old one if none is better.

    What is clutter in the row is taken to stay so on the way. If the close look does not bear out what was glanced at,
    a shorter descent is tried.
    """
    sensor, light = pool.poses[row, :2], pool.poses[row, 2:]
    cluttered = np.array([not is_trusted(each.status) for each in pool.closely[row].measurands])

    def told(s: np.ndarray, k: np.ndarray) -> np.ndarray:
        errors = variance_model(pool.model)(Pictures.of(pool.scene, s[None], k[None]))
        return information(errors.variances_object[0], pool.aim)

    def score(values: np.ndarray) -> tuple[int, float, float]:
        ok, clutter = np.where(cluttered, 0.0, values), np.where(cluttered, values, 0.0)
        table = Information((rest[0] + ok)[None], (rest[1] + clutter)[None], pool.aim.over)
        return table.of_sets(np.zeros(1, int)).at(0)

    def value(s: np.ndarray, k: np.ndarray) -> float:
        here = score(told(s, k))
        return here[1] if here[0] <= begun[0] else np.inf

    def closely(which: int) -> tuple[int, float, float]:
        known, at = pool.known(), int(np.searchsorted(pool.seen, which))
        return Information(rest[0] + known.ok, rest[1] + known.clutter, pool.aim.over).of_sets(np.array([at])).at(0)

    begun = score(told(sensor, light))
    for size in _SIZES:
        how = pool.model, pool.aim, step_deg, constraints, value
        *poses, least = refine(pool.scene, sensor, light, *how, sizes=(size,))
        if least < begun[1]:
            found = pool.add(*poses, told(*poses))
            pool.look(found)
            if better(closely(found), closely(row)):
                return found
    return row
