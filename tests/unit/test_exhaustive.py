"""The search by bounds is the search of all pairs, and says truly how far it is."""

import numpy as np
import pytest

import scenes
from planner.search import exhaustive


@pytest.fixture(scope="module")
def poses():
    polar, azimuth = np.meshgrid([10.0, 35.0, 60.0], np.arange(0.0, 360.0, 45.0))
    return np.column_stack([polar.ravel(), azimuth.ravel()])


@pytest.mark.parametrize("model", ["paper", "calibrated"])
@pytest.mark.parametrize("objective", ["image", "object"])
def test_every_pair(model, objective, poses):
    """The least of a plain loop over all pairs."""
    task1, told = scenes.load("task1"), []
    found = exhaustive.exhaustive(task1, poses, poses, model, objective, None, lambda *facts: told.append(facts))
    sensors, lights = (part.reshape(-1, 2) for part in np.broadcast_arrays(poses[:, None], poses[None]))
    values = exhaustive.evaluate_pairs(task1, sensors, lights, model, objective)
    assert found.variance == pytest.approx(values.min(), rel=1e-12)
    k = int(values.argmin())
    assert values.reshape(len(poses), -1)[found.sensor, found.light] == pytest.approx(values[k], rel=1e-9)
    assert found.pairs == len(values)
    assert 0 < found.evaluated <= len(values) + len(poses)
    done, total = [fact[1] for fact in told], {fact[2] for fact in told}
    assert len(total) == 1
    assert done == sorted(done)
    assert max(done) <= total.pop()
