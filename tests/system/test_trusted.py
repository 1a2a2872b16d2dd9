"""A plan takes the best setting in which everything can be trusted, and says which better ones it set aside."""

import numpy as np
import pytest

import planner
import scenes
from planner.constraints import Constraints
from planner.search.candidates import DEAREST, RayTraced, trusted
from planner.search.objective import SearchProblem
from validation.report.plan_table import report


@pytest.fixture(scope="module")
def wedge():
    """Straight above it the far side faces lie along the edges."""
    return scenes.load("wedge")


@pytest.fixture(scope="module")
def found(wedge):
    return planner.plan(wedge, step_deg=45, refined=False)


def test_what_is_set_aside_is_better_and_not_to_be_trusted(wedge, found, capsys):
    assert found.prediction.status == "ok"
    assert found.set_aside
    for each in found.set_aside:
        # margin: what is set aside is better, by its kind; DEAREST is 4
        assert each.variance < found.variance < DEAREST * each.variance
        assert planner.predict(wedge, each.sensor, each.light).status != "ok"
    assert tuple(found.grid_sensor) == tuple(found.set_aside[0].sensor)
    from rich.console import Console

    Console(width=200).print(report(found, None, None, 1.0))
    assert "passed over" in capsys.readouterr().out


def test_nothing_is_set_aside_for_what_costs_too_much(wedge, found):
    best = tuple(np.array(list(pose)) for pose in (found.grid_sensor, found.grid_light))
    problem = SearchProblem.of(wedge, found.model, found.objective, Constraints())
    variance = found.grid_variance / (2 * DEAREST)
    taken, set_aside = trusted(problem, RayTraced.of(problem, *best), found.candidates, variance)
    assert not set_aside
    assert taken.untrusted > 0
    assert (taken.sensor == best[0]).all()


def test_a_trusted_best_is_taken_as_it_is(task1):
    found = planner.plan(task1, step_deg=10, refined=False)
    assert found.prediction.status == "ok"
    assert found.set_aside == ()
    assert (found.sensor, found.light) == (found.grid_sensor, found.grid_light)
