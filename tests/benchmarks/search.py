"""What maps and searches cost: ``python -m planner.benchmark``."""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

import planner
import scenes
from planner.search.exhaustive import exhaustive
from planner.search.grid import ViewingSpace
from planner.search.local import alternating
from planner.search.objective import SearchProblem
from tests.pairs import evaluate_pairs

PAPER_PAIR = np.array([[30.0, 135.0]]), np.array([[15.0, 315.0]])
TABLE_1 = (((40, 41), (4, 27), 0.1023), ((32, 140), (4, 27), 0.0960), ((32, 140), (14, 303), 0.0703))


def local_minima(space: ViewingSpace, values: np.ndarray) -> np.ndarray:
    """Indices of the finite local minima of a map, the deepest first.

    Directions of equal value that touch (such as azimuth 0 and 360 on the equator) count as one.
    """
    a, b = np.array([(i, j) for i in range(len(space)) for j in space.neighbours(i) if i < j]).T
    beaten = np.zeros(len(values), bool)
    beaten[a[values[b] < values[a]]] = True
    beaten[b[values[a] < values[b]]] = True
    same = values[a] == values[b]
    beaten[np.maximum(a[same], b[same])] = True
    found = np.flatnonzero(~beaten & np.isfinite(values))
    return found[np.argsort(values[found])]


def main() -> None:
    """Print maps, exhaustive searches at several steps, minima of the maps, and Table 1."""
    task1, part1 = scenes.load("task1"), scenes.load("task1_part1")
    maps(task1)
    searches(task1)
    minima(task1)
    table_1(task1, part1)


def maps(scene: scenes.Scene) -> None:
    """Processor time of one full map, the least of five."""
    space = ViewingSpace()
    print(f"One map of {len(space)} directions, {scene.name}, processor seconds (all threads)")
    for model in ("paper", "calibrated"):
        for fixed in ({"sensor": (40, 41)}, {"light": (4, 27)}):
            seconds = []
            for _ in range(5):
                began = time.process_time()
                planner.variance_map(scene, **fixed, space=space, model=model)
                seconds.append(time.process_time() - began)
            print(f"  {model:10s} {next(iter(fixed))} fixed: {min(seconds):.3f}")


def searches(scene: scenes.Scene) -> None:
    """Exhaustive searches of the upper hemisphere."""
    print("\nAll pairs of the upper hemisphere; 'evaluated' of them one by one, the others excluded by a lower bound")
    print(
        "  step  model       units   pairs      evaluated  seconds  peak GiB  sensor         light          to paper's"
    )
    for step in (4.0, 2.0, 1.0, 0.5):
        poses = ViewingSpace(step, (0, 90)).poses
        for model in ("paper", "calibrated"):
            for units in ("image", "object"):
                began = time.perf_counter()
                found = exhaustive(scene, poses, poses, model, units)
                seconds = time.perf_counter() - began
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 if sys.platform == "darwin" else 1024)
                there = evaluate_pairs(scene, *PAPER_PAIR, model, units)[0]
                print(
                    f"  {step:4g}  {model:10s}  {units:6s}  {found.pairs:9.3g}  {found.evaluated:6d}  {seconds:7.2f}"
                    f"  {peak / 1024:8.2f}  {_pose(poses[found.sensor]):14s}  {_pose(poses[found.light]):14s}"
                    f"  {100 * (found.variance / there - 1):+.1f} %"
                )


def minima(scene: scenes.Scene) -> None:
    """How many local minima the maps have; the paper claims one."""
    space = ViewingSpace(1.0, (0, 90))
    print("\nLocal minima of the maps over the upper hemisphere, image units (the paper: convex, one minimum)")
    for fixed in ({"sensor": (40, 41)}, {"sensor": (30, 135)}, {"light": (4, 27)}, {"light": (14, 303)}):
        for model in ("paper", "calibrated"):
            values = planner.variance_map(scene, **fixed, space=space, model=model, objective="image")
            found = local_minima(space, values)
            deep = (values[found] < 1.1 * values[found[0]]).sum()
            role, pose = next(iter(fixed.items()))
            print(f"  {role} at {_pose(pose)}, {model}: {len(found)}, {deep} of them within 10 % of the least")


def table_1(scene: scenes.Scene, part1: scenes.Scene) -> None:
    """The paper's search beside ours, scaled by Table 3's one free factor."""
    ice = [s.paper_ice for s in scene.settings]
    ours = [planner.predict(scene, s.sensor, s.light, "paper").variance_px2 for s in scene.settings]
    scale = float(np.median(np.array(ice) / ours))
    print("\nTable 1: the paper's search and its model by ours (one free factor, from Table 3)")
    for sensor, light, printed in TABLE_1:
        value = scale * planner.predict(part1, sensor, light, "paper").variance_px2
        off = value / printed - 1
        print(f"  sensor {_pose(sensor)}, light {_pose(light)}: {printed:.4f}, ours {value:.4f} ({off:+.1%})")
    space = ViewingSpace(1.0, (0, 90))
    found = alternating(SearchProblem.of(part1, "paper", "image"), space, space, np.array([40.0, 41.0]))
    print("Our alternating search from the same sensor")
    for step in found.trace:
        print(f"  {step.fixed} at {step.fixed_pose}: {step.found} to {step.found_pose}, {scale * step.variance:.4f}")


def _pose(pose) -> str:
    polar, azimuth = pose
    return f"({polar:.3g}, {azimuth:.4g})"


if __name__ == "__main__":
    main()
