"""One rule, `scenes.status.is_trusted`: what is not ok is neither decided, nor signed, nor counted as shown."""

from dataclasses import replace

import numpy as np
import pytest

import measure
import planner
import scenes
from planner.budgeting.plans import Placed
from planner.uncertainty import decide
from scenes import Tolerance, status
from validation import budgets, inspection, vary_check, views_check
from validation.cli import plan_capability
from validation.report import budget_table
from validation.statistics import verdict

DOUBTFUL = sorted(status.ALL - {status.OK})


def test_only_ok_is_trusted():
    assert [name for name in status.ALL if status.is_trusted(name)] == [status.OK]
    assert status.is_trusted(np.array(["ok", "clutter", "misfit"], object)).tolist() == [True, False, False]


@pytest.mark.parametrize("state", DOUBTFUL)
def test_a_value_that_is_not_ok_is_undecided_however_far_from_its_limits(state):
    zone = Tolerance(plus=0.02, minus=0.01)
    for value, decision in ((10.0, "pass"), (11.0, "fail")):
        assert decide(value, 1e-4, 10.0, zone, status=status.OK) == decision
        assert decide(value, 1e-4, 10.0, zone, status=state) == "undecided"


@pytest.mark.parametrize("state", DOUBTFUL)
def test_a_value_that_is_not_ok_is_not_signed(state):
    budget = planner.budget(scenes.load("calibrated_rig"), (10, 60), (20, 280)).measurands[0]
    assert "+-" in budget_table.sentence(budget, "distance", status.OK)
    said = budget_table.sentence(budget, "distance", state)
    assert said.endswith(f"is not signed: {status.doubt(state)}")
    assert "+-" not in said


@pytest.mark.parametrize("state", DOUBTFUL)
def test_a_row_that_is_not_ok_is_neither_agreement_nor_contradiction(state):
    told = ["ok", state, "ok"]
    for wrong in (1.0, 5.0):
        found = verdict([1.0, wrong, 1.02], [1000] * 3, status=told, bias_px=[0, 9, 0], sigma_px=[1, 1, 1])
        assert (found.agrees, found.rows, found.inside, found.not_proven) == (True, 2, 2, {state: 1})
        assert f"2 of 3 rows proven, 1 not: {state} 1" in found.text
    assert found.pooled.ratio == pytest.approx(1.01)
    assert found.bias.rows == 2
    found = verdict([5.0, 1.0, 1.0], [1000] * 3, status=told)
    assert found.reasons == ("rows", "pooled")
    assert "2 of 3 rows judged, 1 not" in found.text  # what is contradicted is not proven


def test_nothing_proven_is_no_agreement():
    found = verdict([1.0, 1.0, np.nan], [1000] * 3, status=["clutter", "misfit", "short"])
    assert (found.agrees, found.reasons, found.not_measured) == (False, ("not proven",), 1)
    assert found.text == "contradict: none of 3 rows could be proven: clutter 1, misfit 1, so nothing is shown."


@pytest.fixture(scope="module")
def doubtful():
    """One of its values is clutter at its first setting, the others are ok."""
    return scenes.load("plate")


@pytest.fixture(scope="module")
def budget(doubtful):
    found = planner.budget(doubtful, doubtful.settings[0].sensor, doubtful.settings[0].light)
    assert {"ok", "clutter"} == set(found.statuses)
    return found


def test_the_budgets_document_signs_and_rates_only_what_is_ok(budget):
    for row, each, state in zip(
        budgets.facts(budget, [], None, None)["measurands"], budget, budget.statuses, strict=True
    ):
        assert (row["status"], row["signed"]) == (state, state == "ok")
        assert (row["capability"] is not None) == (state == "ok")
        assert ("+-" in row["sentence"]) == ("not signed" not in row["sentence"]) == (state == "ok")
        assert f"{each.name} not signed: clutter, bias unknown" in repr(budget) or state == "ok"
    for m, state in enumerate(budget.statuses):
        assert ("not signed" in budget_table.note(budget, m)) == (state != "ok")


def test_a_rendered_pictures_statuses_take_the_place_of_the_predicted_ones(doubtful):
    states = ("misfit", *["ok"] * (len(doubtful.quantities) - 1))
    found = planner.budget(doubtful, doubtful.settings[0].sensor, doubtful.settings[0].light, statuses=states)
    assert found.statuses == states


def test_a_capability_of_what_is_not_ok_is_not_stated(budget):
    placed = Placed(budget.picture.sensor, budget.picture.lights, budget)
    told = plan_capability._placed(placed)
    assert told["worst_ratio"] is None
    for row, state in zip(told["measurands"], budget.statuses, strict=True):
        assert (row["ratio"] is None) == (state != "ok") == (row["status"] != "ok")


def test_measured_values_that_are_not_ok_are_undecided():
    """All edges of a plain block, measured exactly: the same values, once called clutter."""
    scene = scenes.load("calibrated_rig")
    image = planner.image(scene, (10, 60), (20, 280))
    found = measure.measure(image, scene, (10, 60), (20, 280))
    (row,) = inspection.inspect(found).rows
    (doubted,) = inspection.inspect(replace(found, status=np.array([status.CLUTTER], object))).rows
    assert (row.requirement.status, row.decision, doubted.decision) == ("ok", "pass", "undecided")


def test_a_gain_between_values_that_are_not_ok_is_not_agreed():
    row = vary_check.Scatter("d", 2.0, 2.0, 2.0, 1.0, 300, 0, (1.7, 2.3), "ok")
    better = replace(row, predicted=1.0, propagated=1.0, measured=1.0)
    assert vary_check.judged(row, better).agrees
    for pair in ((replace(row, status="clutter"), better), (row, replace(better, status="clutter"))):
        found = vary_check.judged(*pair)
        assert not found.agrees
        assert "not proven, for the values are not: clutter 1" in found.verdict


def test_of_several_pictures_only_what_is_ok_is_judged():
    def row(name, state, ratio):
        known = dict.fromkeys(("ratio_least_squares", "interval_least_squares"))
        return views_check.CheckedQuantity(
            pictures=2, name=name, unit="mm", status=state, predicted=1.0, propagated=1.0, empirical=ratio, n=300,
            failed=0, ratio=ratio, ratio_interval=(0.8, 1.2), bias=0.0, correction=0.0, u_bias=0.0, render_noise=0.0,
            judged=status.is_trusted(state), **known,
        )  # fmt: skip

    values = np.random.default_rng(5).standard_normal((2, 300))
    found = views_check.judge([(row("a", "ok", 1.0), values[0]), (row("b", "clutter", 9.0), values[1])], 0.0)
    assert found.verdict.agrees
    assert found.verdict.not_proven == {"clutter": 1}
    none = views_check.judge([(row("b", "clutter", 1.0), values[1])], 0.0)
    assert none.verdict is None
    assert none.reason == "nothing that is measured is proven (clutter 1)"
