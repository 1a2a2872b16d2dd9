"""The search by bounds is the search of all pairs, and says truly how far it is."""

from types import SimpleNamespace

import numpy as np
import pytest

import scenes
from imaging.geometry.projection import direction
from planner import Constraints
from planner.search import exhaustive
from planner.search.objective import Aim, SearchProblem
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


@pytest.mark.parametrize("name", ["plate", "bracket"])
def test_sensors_that_do_not_see_all_measure_with_no_light(name):
    """None of them under any of some lights; of the others some do."""
    scene = scenes.load(name)
    polar, azimuth = np.meshgrid([20.0, 60.0, 89.9, 130.0], np.arange(0.0, 360.0, 60.0))
    sensors = np.column_stack([polar.ravel(), azimuth.ravel()])
    seeing = exhaustive._seeing(scene, sensors)
    problem = SearchProblem.of(scene, "calibrated", Aim.of(scene.quantities, "object"))
    lights = sensors[polar.ravel() < 80]
    values = problem.values(*(each.reshape(-1, 2) for each in np.broadcast_arrays(sensors[:, None], lights[None])))
    measures = np.isfinite(values.reshape(len(sensors), -1)).any(1)
    assert not measures[~seeing].any()
    assert measures.sum() >= 4
    assert 6 <= seeing.sum() <= len(seeing) - 6


def test_pair_by_pair_the_least_of_each_sensor_is_told():
    """None where nothing can be measured or is allowed; what the scale's end has cut off only where all are."""
    levels = np.array([[5.0, np.inf, 3.0, 8.0], [np.inf] * 4, [2.0, 9.0, 7.0, 6.0], [4.0, 4.5, 1.0, 9.5]])
    allowed = np.array([[1, 1, 1, 1], [1, 1, 1, 1], [1, 0, 0, 1], [0, 0, 0, 0]], bool)
    cut = np.array([[0, 0, 1, 0], [0, 0, 0, 0], [1, 0, 0, 1], [0, 0, 0, 0]], bool)

    def found(cut):
        def table(sensors, lights, report):
            for part in (slice(0, 3), slice(3, 4)):
                yield part, SimpleNamespace(values=levels[part], cut=cut[part]), allowed[part]

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(exhaustive, "_seeing", lambda scene, sensors: np.ones(len(sensors), bool))
            patch.setattr(exhaustive, "minimised", lambda errors, aim: errors.values)
            patch.setattr(exhaustive, "cut_off", lambda errors: errors.cut)
            problem = SimpleNamespace(table=table, objective=None, scene=None)
            return exhaustive._one_by_one(problem, np.zeros((4, 2)), np.zeros((4, 2)), None)

    plain = found(np.zeros_like(cut))
    assert (plain.sensor, plain.light, plain.variance) == (2, 0, 2.0)
    assert plain.best_light.tolist() == [2, -1, 0, -1]
    assert plain.least.tolist() == [3.0, np.inf, 2.0, np.inf]
    assert (plain.pairs, plain.evaluated, plain.within_scale) == (16, 16, False)
    within = found(cut)
    assert (within.sensor, within.light, within.variance) == (0, 0, 5.0)
    assert within.best_light.tolist() == [0, -1, -1, -1]
    assert within.least.tolist() == [5.0, np.inf, np.inf, np.inf]
    assert within.within_scale
    everything = found(np.ones_like(cut))
    assert (everything.sensor, everything.light, everything.within_scale) == (2, 0, False)


def test_sensors_that_can_measure_by_no_light_have_none(poses):
    """From below, or within 80 degrees of every light; each other one's bound is below the values of all its pairs."""
    task1, sensors = scenes.load("task1"), np.concatenate([[[175.0, 10.0]], poses, [[179.0, 200.0]]])
    limits = Constraints(min_separation_deg=80, camera_body=0, light_body=0)
    found = exhaustive.exhaustive(task1, sensors, poses, "calibrated", "image", limits, lambda *_: None)
    pairs = [part.reshape(-1, 2) for part in np.broadcast_arrays(sensors[:, None], poses[None])]
    values = evaluate_pairs(task1, *pairs, "calibrated", "image")
    apart = np.einsum("ij,ij->i", *map(direction, pairs)) <= np.cos(np.radians(80))
    values = np.where(apart, values, np.inf).reshape(len(sensors), -1)
    lost = ~np.isfinite(values).any(1)
    assert lost[[0, 1, -1]].all()  # at a polar angle of 10 degrees, 70 degrees from any light at most
    assert not lost.all()
    assert ((found.best_light == -1) == lost).all()
    assert (np.isinf(found.least) == lost).all()
    # margin: a bound that holds by its kind
    assert (found.least <= values.min(1) * (1 + 1e-9)).all()
    assert not lost[found.sensor]
    assert values[found.sensor, found.light] == pytest.approx(values.min(), rel=1e-12)
