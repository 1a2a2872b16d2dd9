"""The search by bounds is the search of all pairs, and says truly how far it is."""

import numpy as np
import pytest

import scenes
from planner.search import exhaustive
from planner.search.objective import SearchProblem
from tests.pairs import evaluate_pairs


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
    values = evaluate_pairs(task1, sensors, lights, model, objective)
    assert found.variance == pytest.approx(values.min(), rel=1e-12)
    k = int(values.argmin())
    assert values.reshape(len(poses), -1)[found.sensor, found.light] == pytest.approx(values[k], rel=1e-9)
    assert found.pairs == len(values)
    assert 0 < found.evaluated <= len(values) + len(poses)
    done, total = [fact[1] for fact in told], {fact[2] for fact in told}
    assert len(total) == 1
    assert done == sorted(done)
    assert max(done) <= total.pop()


@pytest.mark.parametrize("at_once", [24, 100_000])
def test_where_the_bound_is_far_from_the_value(at_once, poses, monkeypatch):
    """Values up to 3 times what the bound's model says, by chance: the least of all pairs is still found."""
    task1, exact = scenes.load("task1"), SearchProblem.values

    def worse(problem, sensors, lights):
        by_chance = np.sin(1e3 * (sensors @ [1.0, 2.0] + lights @ [3.0, 5.0])) ** 2
        return exact(problem, sensors, lights) * (1 + 2 * by_chance)

    monkeypatch.setattr(SearchProblem, "values", worse)
    monkeypatch.setattr(exhaustive, "_PAIRS", at_once)
    found = exhaustive.exhaustive(task1, poses, poses, "calibrated", "image", None, lambda *facts: None)
    sensors, lights = (part.reshape(-1, 2) for part in np.broadcast_arrays(poses[:, None], poses[None]))
    values = worse(SearchProblem.of(task1, "calibrated", "image"), sensors, lights).reshape(len(poses), -1)
    assert found.variance == pytest.approx(values.min(), rel=1e-12)
    assert values[found.sensor, found.light] == pytest.approx(values.min(), rel=1e-12)
