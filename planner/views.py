"""Several pictures that together measure all quantities best: where sensor and light stand for each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from imaging.models import DEFAULT_MODEL, ModelName
from planner.combining import Combination, combine
from planner.constraints import Constraints
from planner.design import DEFAULT_HOLD, Hold, Vary, check_vary
from planner.planning import COARSE_STEP
from planner.search.candidates import SettingUp
from planner.search.choices import join_choices, join_turned
from planner.search.exhaustive import has_bound
from planner.search.grid import Grid, as_poses
from planner.search.objective import DEFAULT_OBJECTIVE, DEFAULT_OVER, Aim, Objective, Over, Report, SearchProblem
from planner.search.pool import Pool, World, fast_table, settings_of
from planner.search.sets import (
    MOST_SETS,
    PictureInformation,
    all_ok,
    alone,
    every_set,
    front,
    greedy,
    least_value,
    sets_of,
    undominated,
    undominated_shared,
)
from planner.search.varying import POSE_STEP
from planner.view_sets import View, Views, ViewSet
from scenes import InvalidInput, Pose, Quantity, Scene

Share = Literal["sensor", "light"]
MOST_VIEWS = 12
_FINE_STEP = 5.0  # degrees, where a pair takes microseconds
_MOST_NUMBERS = 30_000_000  # pairs x quantities that a grid may have
_TRACED = 20  # settings for each picture of a set that are ray-traced at most
_TURNS = (15.0, 7.5)  # degrees that polarisers of chosen pictures are turned by, one after the other


def plan_views(
    scene: Scene,
    count: int,
    objective: Objective = DEFAULT_OBJECTIVE,
    *,
    over: Over = DEFAULT_OVER,
    model: ModelName = DEFAULT_MODEL,
    step_deg: float | None = None,
    constraints: Constraints | None = None,
    sensor: Any = None,
    light: Any = None,
    share: Share | None = None,
    refined: bool = True,
    vary: tuple[Vary, ...] | None = None,
    hold: Hold = DEFAULT_HOLD,
    report: Report | None = None,
) -> Views:
    """Find ``count`` pictures, each of one sensor and light, that together measure all quantities best.

    Each quantity is combined by inverse variance from the pictures in which it is ``ok``, and what is minimised is
    what `plan` minimises, of these variances. N pictures take N times as long as one: compare them with one picture
    taken N times, whose variances are an Nth. Several sensors at a time are several pictures.

    All pairs of a grid are evaluated fast; of those that no other can stand in for, sets are chosen greedily with
    exchange. What is chosen is ray-traced (clutter, light between surfaces), and chosen again, until all that is chosen
    has been; then the poses of each picture descend, those of the others held. Of several free lights each sensor of
    the grid has those that are best for all quantities together, and for each alone, with the scene's intensities.

    Parameters
    ----------
    scene : Scene
    count : int
        1 to 12.
    objective : {"object"}
        Values in different images do not combine.
    over, model, constraints, sensor, light, refined
        As of `plan`.
    step_deg : float, optional
        Grid step; by default 5 where a pair takes microseconds (convex, diffuse, straight edges) and nothing is
        shared, else 10 degrees.
    share : {"sensor", "light"}, optional
        Hold one the same in all pictures of a set: one camera and several lamps, or the reverse. Not refined; of one
        free light.
    vary, hold
        As of `plan`: polarisers, lamp and filter are chosen for each picture (`View.choice`), angles first every 30
        degrees; `Views.own` are the best sets with the scene's own. Not with ``share``.

    Raises
    ------
    InvalidInput
        If an argument is none of its choices, or no allowed setting can measure anything.

    Examples
    --------
    >>> import scenes
    >>> found = plan_views(scenes.load("task1"), 2, step_deg=10)
    >>> round(found.sets[1].over_repeats, 6)  # of one quantity, the best picture twice
    1.0
    """
    aim = _aim(scene, count, objective, over, model, share)
    if share is not None and len(scene.free) != 1:
        raise InvalidInput(f"share must be left out unless one light is free, got {share!r} of {len(scene.free)}")
    if vary is not None:
        check_vary(scene, vary, hold)
        if share is not None:
            raise InvalidInput(f"vary must be left out with share, got {','.join(vary)}")
    if not scene.placement.is_known:
        source = scene.placement.source
        raise InvalidInput(f"placement.from must be known for pictures that are not adjusted together, got {source!r}")
    report, limits = report or (lambda *_: None), (constraints or Constraints()).on_side_of(scene)
    problem = SearchProblem(scene, model, aim, limits)
    fast = has_bound(scene, model) and share is None
    step = (_FINE_STEP if fast else COARSE_STEP) if step_deg is None else step_deg
    grid = Grid.of(scene, problem.constraints, step, sensor, light)
    pairs = _checked_size(grid, len(scene.quantities))
    told, poses = _glanced(problem, grid, report)
    if not told.any():
        raise InvalidInput("constraints must leave a setting that can measure, got none")
    pool, groups = _pool(problem, grid, poses, told, share, count)
    refine_by = step if refined and grid.free and share is None else None
    _look(pool, groups, count, refine_by, report)
    is_whole = share is None and len(scene.free) < 2
    bounds, most = _bounds(aim, told, count) if is_whole else ([None] * count, None)
    sets, own = _sets(pool, groups, count, bounds), None
    if vary is not None:
        own, coarse = sets, Grid.of(scene, problem.constraints, max(POSE_STEP, step), sensor, light)
        _vary(pool, vary, hold, coarse, count, refine_by and coarse.step_deg, report)
        sets, most = _sets(pool, None, count, [None] * count), None
    guarantee = _guarantee(step, share, len(scene.free), varied=vary is not None)
    return Views(scene, aim.over, model, share, sets, pairs, len(pool.traced), guarantee, most, vary, hold, own)


def _look(pool: Pool, groups: np.ndarray | None, count: int, step: float | None, report: Report) -> None:
    """Closely at what is chosen, and, with a grid's step, at what a descent of its poses finds."""
    _trace(pool, groups, count, report)
    if step is not None:
        _refine(pool, count, step, report)


def _vary(
    pool: Pool, vary: tuple[Vary, ...], hold: Hold, grid: Grid, count: int, step: float | None, report: Report
) -> None:
    """Let pictures have other choices: at the pairs of a coarse grid, then turned a little where they were chosen."""
    join_choices(pool, vary, hold, grid, report)
    _look(pool, None, count, step, report)
    for turn in _TURNS:
        chosen = _chosen(pool.known(), np.arange(len(pool.seen)), None, count)
        rows = {int(pool.seen[member]) for members in chosen for member in members}
        join_turned(pool, rows, vary, hold, turn)
        _trace(pool, None, count, report)


def _glanced(problem: SearchProblem, grid: Grid, report: Report) -> tuple[np.ndarray, np.ndarray]:
    """What settings of a grid tell by fast evaluation, (S, L, M), and their poses (S, L, 2 + 2 F).

    All pairs; of several free lights each sensor with those that are best for all quantities together, and for each
    alone.
    """
    if len(problem.scene.free) > 1 and not grid.held[1]:
        poses, told = settings_of(problem, grid, report)
        return told[:, None], poses[:, None]
    told = fast_table(problem, grid.sensors, grid.lights, report)
    sensors = np.broadcast_to(grid.sensors[:, None], (*told.shape[:2], 2))
    lights = np.broadcast_to(grid.lights, (*told.shape[:2], grid.lights.shape[1]))
    return told, np.concatenate([sensors, lights], -1)


def _checked_size(grid: Grid, quantities: int) -> int:
    """How many pairs a grid has, if they are not too many to keep."""
    pairs = len(grid.sensors) * len(grid.lights)
    if pairs * quantities > _MOST_NUMBERS:
        most, got = f"{_MOST_NUMBERS:.0e} pairs times measurands", f"{grid.step_deg:g} ({pairs:.2g} pairs)"
        raise InvalidInput(f"step must leave at most {most} for several pictures, got {got}")
    return pairs


def _aim(scene: Scene, count: int, objective: str, over: str, model: str, share: str | None) -> Aim:
    """What is minimised, once the arguments are seen to be usable."""
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_VIEWS:
        raise InvalidInput(f"views must be 1 to {MOST_VIEWS}, got {count}")
    if share not in (None, "sensor", "light"):
        raise InvalidInput(f"share must be one of sensor, light, got {share!r}")
    if model not in ("calibrated", "paper"):
        raise InvalidInput(f"model must be one of calibrated, paper for several pictures, got {model!r}")
    aim = Aim.of(scene.quantities, objective, over)
    if aim.unit != "object":
        raise InvalidInput(f"objective must be object for several pictures, got {aim.unit!r}")
    return aim


def _pool(
    problem: SearchProblem, grid: Grid, poses: np.ndarray, told: np.ndarray, share: str | None, count: int
) -> tuple[Pool, np.ndarray | None]:
    """The candidates, and which of them share a place."""
    aim = problem.objective
    rows = undominated(told, aim) if share is None else undominated_shared(told, aim, share, count)
    s, k = np.unravel_index(rows, told.shape[:2])
    pool = Pool(World(None, SettingUp(problem, grid.held)), poses[s, k], told.reshape(-1, told.shape[-1])[rows])
    return pool, None if share is None else s if share == "sensor" else k


def _chosen(
    table: PictureInformation, rows: np.ndarray, groups: np.ndarray | None, count: int
) -> tuple[tuple[int, ...], ...]:
    """For 1 to ``count`` pictures the best sets of some rows of a table, those of one group where there are groups."""
    best: list[tuple] = []
    for _, own in _grouped(rows, groups):
        kept = own[front(table.only(own))]
        if not len(kept):
            continue
        some = table.only(kept)
        found = greedy(some, count)
        told = [(some.of_sets(np.array(each)).at(0), tuple(int(kept[i]) for i in each)) for each in found]
        best = [min(pair, key=lambda each: each[0]) for pair in zip(best, told, strict=True)] if best else told
    return tuple(members for _, members in best)


def _grouped(rows: np.ndarray, groups: np.ndarray | None) -> Iterator[tuple[int, np.ndarray]]:
    if groups is None:
        yield 0, rows
        return
    for group in np.unique(groups[rows]):
        yield int(group), rows[groups[rows] == group]


def _trace(pool: Pool, groups: np.ndarray | None, count: int, report: Report) -> None:
    """Choose, ray-trace what is chosen and choose again, until nothing new is chosen or 20 a picture were traced."""
    everything, most = np.arange(len(pool.poses)), len(pool.traced) + _TRACED * count
    while len(pool.traced) < most:
        chosen = _chosen(pool.expected(), everything, groups, count)
        fresh = [row for row in dict.fromkeys(row for members in chosen for row in members) if row not in pool.traced]
        if not fresh:
            return
        for row in fresh[: most - len(pool.traced)]:
            pool.trace(row)
            report("looking closely", len(pool.traced), most)


def _refine(pool: Pool, count: int, step: float, report: Report) -> None:
    """Refine the poses of each chosen picture, once, the others of its set held; what is found joins the pool."""
    done: set[int] = set()
    for size in range(1, count + 1):
        seen, known = pool.seen, pool.known()
        members = _chosen(known, np.arange(len(seen)), None, size)[-1]
        for position, member in enumerate(members):
            row = int(seen[member])
            if row not in done:
                others = list(members[:position] + members[position + 1 :])
                done |= {row, pool.refine(row, known.together(others), step)}
        report("descending", size, count)


def _bounds(aim: Aim, told: np.ndarray, count: int) -> tuple[list[float | None], float | None]:
    """Of each number of pictures, by a glance at the whole grid; and over how many repeats they can be better."""
    table = all_ok(told.reshape(-1, told.shape[-1]), aim)
    table = table.only(front(table))
    found = [least_value(table, size) for size in range(1, count + 1)]
    if not math.isfinite(found[0]):
        return [None] * count, None
    single = float(alone(table.ok, aim).min())
    return list(found), single / found[0] if math.isfinite(single) else None


def _sets(pool: Pool, groups: np.ndarray | None, count: int, bounds: list[float | None]) -> tuple[ViewSet, ...]:
    seen, table = pool.seen, pool.known()
    own = None if groups is None else groups[seen]
    rows = np.arange(len(seen))
    chosen = _chosen(table, rows, own, count)
    first = table.of_sets(np.array(chosen[0])).at(0)
    made, quantities = [], pool.worlds[0].problem.scene.quantities
    for members, bound in zip(chosen, bounds, strict=True):
        lost, value, _ = table.of_sets(np.array(members)).at(0)
        views = tuple(_view(pool, int(seen[member])) for member in members)
        combination = combine([view.prediction for view in views])
        over_one = first[1] / value if lost == first[0] else None
        made.append(
            ViewSet(
                views=views,
                combination=combination,
                minimised=value,
                lost=tuple(q.name for q, used in zip(quantities, combination.used.any(0), strict=True) if not used),
                over_one=over_one,
                over_repeats=None if over_one is None else over_one / len(members),
                exhaustive=_exhaustive(table, rows, own, len(members)),
                bound=bound,
                hard=_hard(quantities, combination, [pool.steady[int(seen[member])] for member in members]),
            )
        )  # fmt: skip
    return tuple(made)


def _hard(quantities: tuple[Quantity, ...], combination: Combination, steady: list[np.ndarray]) -> tuple[str, ...]:
    """Names of the quantities that no picture tells that measures them around its poses, too."""
    firm = (combination.used & np.array(steady)).any(0)
    told = zip(quantities, combination.used.any(0), firm, strict=True)
    return tuple(each.name for each, used, is_firm in told if used and not is_firm)


def _exhaustive(table: PictureInformation, rows: np.ndarray, groups: np.ndarray | None, count: int) -> float | None:
    """What is minimised by the best of all sets of the rows; None where they are too many to try."""
    kept = [own[front(table.only(own))] for _, own in _grouped(rows, groups)]
    if sum(sets_of(len(own), count) for own in kept) > MOST_SETS:
        return None
    found = [(table.only(own), every_set(table.only(own), count)) for own in kept if len(own)]
    return min(some.of_sets(np.array(best)).at(0) for some, best in found)[1]


def _view(pool: Pool, row: int) -> View:
    sensor, lights = pool.setting(row)
    return View(Pose(*map(float, sensor)), as_poses(lights), pool.traced[row], pool.world(row).choice)


def _guarantee(step: float, share: str | None, lights: int, *, varied: bool) -> str:
    held = "" if share is None else f", the same {share} in all"
    rest = f"of all pairs of the {step:g} degree grid only the bound is known"
    if lights > 1:
        rest = "where else several lights might stand is not known"
    if varied:
        rest = f"other choices were tried at the pairs of a {max(POSE_STEP, step):g} degree grid alone"
    return f"no exchange of one picture for another that was looked at makes a set better{held}; {rest}"
