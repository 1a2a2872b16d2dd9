"""Where a plan for tolerances begins, and what its worst case is over."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from planner import robustness
from planner.robustness import Tolerances, robust
from scenes import InvalidInput, Pose

BEST = np.array([31.0, 70.0, 12.0, 300.0])  # sensor and light


@dataclass(frozen=True)
class Problem:
    """What is minimised: a factor times 1 and the squared degrees from the best poses."""

    scene: float

    def values(self, sensors, lights):
        return self.scene * (1 + ((np.concatenate([sensors, lights], -1) - BEST) ** 2).sum(-1))


def setting(sensor, light, edges="ours"):
    return SimpleNamespace(sensor=Pose(*sensor), light=Pose(*light), edges=edges)


PLAN = SimpleNamespace(
    poses=(Pose(40, 70), Pose(12, 300)), scene=SimpleNamespace(required="ours", lights=(1,), free=(0,)),
    candidates=[setting((31, 80), (30, 300)), setting((33, 70), (15, 300)), setting((31, 70), (12, 300), "others")],
)  # fmt: skip


@pytest.fixture
def began(monkeypatch):
    """Where the descent begins, which stays there."""
    starts = []

    def refine(problem, start, step, value):
        starts.append((start, value(*start)))
        return SimpleNamespace(sensor=start[0], lights=start[1], value=value(*start))

    monkeypatch.setattr(robustness, "refine", refine)
    monkeypatch.setattr(robustness, "_problem", lambda plan, constraints: Problem(1.0))
    monkeypatch.setattr(robustness, "altered", lambda scene, factors: float(np.prod(list(factors.values()))))
    monkeypatch.setattr(robustness, "_move", lambda plan, problem, name, by: (name, round(by, 9)))
    monkeypatch.setattr(robustness, "shifted", lambda pose, by: pose + by)
    return starts


def test_a_robust_plan_begins_at_the_best_worst_case_of_its_candidates(began):
    """Of those with the plan's edges; over all corners of the tolerances, and the sensor off in four ways."""
    found = robust(PLAN, Tolerances(noise=0.2, roughness=0.1, sensor_deg=3.0))
    ((start, worst),) = began
    assert [part.tolist() for part in start] == [[33.0, 70.0], [15.0, 300.0]]
    assert worst == found.worst == pytest.approx(1.2 * 1.1 * (1 + 5.0**2 + 3.0**2))
    assert (found.sensor, found.light) == (Pose(33, 70), Pose(15, 300))
    assert found.nominal == pytest.approx(1 + 2.0**2 + 3.0**2)
    assert found.plan_worst == pytest.approx(1.2 * 1.1 * (1 + 12.0**2))
    assert found.cases == 4 * 5
    assert found.moves == (("roughness", -0.1), ("roughness", 0.1), ("noise", -0.2), ("noise", 0.2))


def test_no_more_than_six_candidates_are_looked_at(began):
    seventh = setting((31, 70), (12, 300))
    far = [setting((50, 70 + k), (12, 300)) for k in range(6)]
    robust(SimpleNamespace(**{**vars(PLAN), "candidates": [*far, seventh]}), Tolerances(light_deg=1.0))
    robust(SimpleNamespace(**{**vars(PLAN), "candidates": [*far[1:], seventh]}), Tolerances(light_deg=1.0))
    assert [start[0].tolist() for start, _ in began] == [[40.0, 70.0], [31.0, 70.0]]


def test_nothing_can_always_measure(began, monkeypatch):
    monkeypatch.setattr(Problem, "values", lambda self, sensors, lights: np.full(len(sensors), np.inf))
    with pytest.raises(InvalidInput, match="tolerances must leave a setting that can always measure, got none"):
        robust(PLAN, Tolerances(noise=0.2))
    assert began == []
