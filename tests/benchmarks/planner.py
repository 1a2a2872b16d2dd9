"""Maps against the scalar reference, then everything of `planner.benchmark`: ``python -m tests.benchmarks.planner``."""

import time

import numpy as np

import planner
import scenes
from tests.benchmarks import search as benchmark
from tests.scalar import variance_evaluate

_SAMPLE = 100  # directions that the scalar version models; it is the same work for each that can be seen


def compare() -> None:
    """Processor time a direction, map and scalar version in one run."""
    task1, space = scenes.load("task1"), planner.ViewingSpace()
    picked = np.random.default_rng(1).choice(len(space), _SAMPLE, replace=False)
    print(f"Scalar VarianceEvaluate on {_SAMPLE} of {len(space)} directions, and the map of all")
    for fixed in ({"sensor": (40, 41)}, {"light": (4, 27)}):
        role, pose = next(iter(fixed.items()))
        began = time.process_time()
        reference = []
        for other in space.poses[picked].tolist():
            reference.append(variance_evaluate(task1, *((pose, other) if role == "sensor" else (other, pose))))
        scalar = (time.process_time() - began) / _SAMPLE * len(space)
        fast = []
        for _ in range(5):
            began = time.process_time()
            values = planner.variance_map(task1, **fixed, space=space, model="paper", objective="image")
            fast.append(time.process_time() - began)
        finite = np.isfinite(reference)
        off = np.abs(values[picked][finite] / np.array(reference)[finite] - 1).max()
        ratio = scalar / min(fast)
        print(f"  {role} fixed: {scalar:.0f} s, {min(fast):.3f} s: {ratio:.0f} times; largest deviation {off:.1e}")
    print()


if __name__ == "__main__":
    compare()
    benchmark.main()
