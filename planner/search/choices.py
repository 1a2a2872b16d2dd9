"""Other polarisers, lamps and filters as candidates for the pictures of a set, each picture with its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from planner.design import Choice, Hold, angles_of, bands_of, own_choice, with_choice
from planner.search.candidates import SettingUp
from planner.search.grid import Grid
from planner.search.objective import Report
from planner.search.pool import Pool, World, fast_table
from planner.search.sets import alone, undominated
from planner.search.varying import ANGLE_STEP, BANDS_WITH


def join_choices(pool: Pool, vary: tuple[str, ...], hold: Hold, grid: Grid, report: Report) -> None:
    """All angles of what is varied, and all bands with the best of them, each at the pairs of a grid that no other pair
    with the same choice can stand in for."""
    scene = pool.worlds[0].problem.scene
    angles = angles_of(scene, vary, ANGLE_STEP)
    bands = bands_of(scene)[1:] if "band" in vary else []
    whole = len(angles) - 1 + len(bands) * min(BANDS_WITH, len(angles))
    least = {own_choice(scene): float(alone(pool.told, pool.aim).min())}
    for choice in angles[1:]:
        least[choice] = _joined(pool, choice, hold, grid)
        report("trying choices", len(least) - 1, whole)
    best = sorted(least, key=lambda choice: least[choice])[:BANDS_WITH]
    for number, (choice, (lamp, filter_)) in enumerate(product(best, bands), len(angles)):
        _joined(pool, replace(choice, lamp=lamp, filter=filter_), hold, grid)
        report("trying choices", number, whole)


def join_turned(pool: Pool, rows: set[int], vary: tuple[str, ...], hold: Hold, step_deg: float) -> None:
    """Rows as they are, but with polarisers turned by a step either way."""
    scene = pool.worlds[0].problem.scene
    for row in sorted(rows):
        poses = pool.poses[row][None]
        for choice in _turned(pool.world(row).choice or own_choice(scene), vary, step_deg):
            world = _world(pool, choice, hold)
            pool.join(world, poses, _told(world, poses[:, :2], poses[:, 2:])[0])


def _turned(choice: Choice, vary: tuple[str, ...], step_deg: float) -> Iterator[Choice]:
    for name, angle in (("analyser", choice.analyser_deg), ("polarisation", choice.polarisation_deg)):
        if name in vary and angle is not None:
            for turn in (-step_deg, step_deg):
                yield replace(choice, **{f"{name}_deg": (angle + turn) % 180})


def _joined(pool: Pool, choice: Choice, hold: Hold, grid: Grid) -> float:
    """Its candidates in the pool; what is minimised of the best of them alone."""
    world = _world(pool, choice, hold)
    told = _told(world, grid.sensors, grid.lights)
    s, k = np.unravel_index(undominated(told, pool.aim), told.shape[:2])
    pool.join(world, np.concatenate([grid.sensors[s], grid.lights[k]], 1), told[s, k])
    return float(alone(told, pool.aim).min())


def _world(pool: Pool, choice: Choice, hold: Hold) -> World:
    ways = pool.worlds[0].ways
    scene = with_choice(ways.problem.scene, choice, hold)
    return World(choice, SettingUp(replace(ways.problem, scene=scene), ways.held))


def _told(world: World, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Information of all pairs of sensors (S, 2) and lights (L, 2), (S, L, M)."""
    return fast_table(world.problem, sensors, lights, lambda *_: None, uncut=True)
