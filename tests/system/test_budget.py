"""The uncertainty budget of scenes: in Python, by Monte Carlo, by pictures, and as a command."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy import stats

import planner
import scenes
from planner.budgeting.plans import plan_capability
from planner.uncertainty.improve import needed, scaled
from tests.commands import ice
from tests.proofs.stations import attained, is_true
from validation import budgets, coverage
from validation.chain import Chain
from validation.report import budget_table


@lru_cache
def _found(name: str) -> planner.SceneBudget:
    scene = scenes.load(name)
    return planner.budget(scene, scene.settings[0].sensor, scene.settings[0].light)


@pytest.mark.parametrize("name", ["calibrated_rig", "bracket_station"])
def test_leaving_a_source_out_takes_its_share(name: str) -> None:
    for each in _found(name):
        assert sum(row.share for row in each.contributions) == pytest.approx(1)
        for row in each.contributions:
            assert each.without(row.source).u ** 2 == pytest.approx(each.u**2 * (1 - row.share), abs=1e-12 * each.u**2)


def test_repeatability_is_the_predicted_noise() -> None:
    found = _found("bracket_station")
    for each, told in zip(found, found.prediction.measurands, strict=True):
        assert each.repeatability**2 == pytest.approx(told.variance_object)
        assert each.repeatability**2 + each.accuracy**2 == pytest.approx(each.u**2)


def test_uncertainties_change_nothing_else() -> None:
    """The prediction of the station is that of the scene without uncertainties and without its fixed pattern."""
    plain, found = scenes.load("bracket_mm"), _found("bracket_station")
    told = planner.predict(plain, plain.settings[0].sensor, plain.settings[0].light)
    for with_them, without in zip(found.prediction.measurands, told.measurands, strict=True):
        assert with_them.variance_object == without.variance_object


def test_monte_carlo_agrees_and_says_what_it_misses() -> None:
    rows = budgets.monte_carlo(_found("calibrated_rig"), seed=1, margin=2.0)
    assert [row["verdict"] for row in rows] == ["agree"]
    assert rows[0]["missed"] < 1e-3


def test_the_expansion_is_the_closed_form() -> None:
    """At draws of three times the size, too; of seven measurands through lines and circles."""
    chain = Chain(_found("bracket_station"))
    errors = 3 * chain.deviations(np.random.default_rng(1), 20)
    exact = chain.exact(errors)
    for m, each in enumerate(chain.budget):
        assert np.abs(chain.expanded(errors, m) - exact[:, m]).max() < 1e-3 * each.u


def test_pictures_of_stations_scatter_as_stated() -> None:
    """60 stations: the interval holds at least 50 of them, which 95 % do in all but 3e-4 of all cases."""
    how, (row, *_) = attained(scenes.load("calibrated_rig"), 60, 3, "gradient")
    assert how == coverage.PICTURES
    assert row.failed == 0
    assert row.held >= 50 / 60  # margin: chance: 49 or fewer of 60 in 3e-4 of all cases
    assert 0.63 < row.sigma / row.u < 1.37  # margin: 4 standard errors
    assert is_true(row, 1)


@pytest.mark.parametrize("name", ["grey_floor", "shaft_ring", "bracket_station"])
def test_intervals_of_scenes_without_a_closed_form_of_pictures_hold_as_stated(name: str) -> None:
    """1000 stations; intervals a fifth too short hold less often than they say."""
    how, rows = attained(scenes.load(name), 1000, 5)
    assert how == coverage.CLOSED
    assert all(is_true(row, len(rows)) for row in rows)
    fifth = 2 * stats.norm.cdf(0.8 * stats.norm.isf(0.025)) - 1
    assert not any(is_true(replace(row, held=fifth), len(rows)) for row in rows)


def test_temperature_and_rounding() -> None:
    said = scenes.Uncertainty(
        temperature_K={"value": 2.0, "sd": 0.5}, expansion_per_K={"value": 2e-5, "half_width": 3e-6}, rounding=0.01
    )
    task1 = scenes.load("task1").model_copy(update={"uncertainty": said})
    (found,) = planner.budget(task1, (30, 135), (15, 315))
    length = found.value
    assert found.of("temperature_K").contribution == pytest.approx(length * 2e-5 * 0.5)
    assert found.of("expansion_per_K").contribution == pytest.approx(length * 2.0 * 3e-6 / 3**0.5)
    assert found.of("rounding").contribution == pytest.approx(0.005 / 3**0.5)


def test_calibrated_parameters_count_as_one_group() -> None:
    found = _found("bracket_station")["step"]
    row = found.of("camera calibration")
    assert [each.source for each in row.members] == ["fx", "cx", "cy", "k1", "k2"]
    told = scenes.load("bracket_station").uncertainty.covariance
    slopes = np.array([found.sensitivities[name] for name in told.names])
    assert row.contribution**2 == pytest.approx(slopes @ np.array(told.matrix) @ slopes)
    assert row.share == pytest.approx(sum(each.share for each in row.members))


def test_numbers_know_what_measurands_share() -> None:
    """A scale that is wrong is wrong for both lengths: of their ratio less is uncertain than of either."""
    found = _found("bracket_station")
    numbers = found.ufloats()
    for each in found:
        assert numbers[each.name].s == pytest.approx(each.u)
    ratio = numbers["step"] / numbers["across"]
    # margin: the order is said: 0.25, and independent errors would give more than 1
    assert ratio.s < 0.3 * numbers["step"].s / 40


@pytest.mark.parametrize(
    "said",
    [
        {"temperature_K": {"value": 1.0, "sd": 50.0}, "expansion_per_K": {"value": 1e-3, "sd": 1e-9}},
        {"temperature_K": {"value": 50.0, "sd": 1e-6}, "expansion_per_K": {"value": 1e-3, "sd": 1e-3}},
    ],
    ids=["temperature", "expansion"],
)
def test_lengths_of_a_part_share_its_temperature_and_its_expansion(said) -> None:
    """Each is 5 % uncertain by one of them, as the other is: their ratio hardly at all."""
    scene = scenes.load("two_lights").with_(uncertainty=said)
    numbers = planner.budget(scene, scene.settings[0].sensor, scene.settings[0].light).ufloats()
    for each in numbers.values():
        assert each.s / each.n == pytest.approx(0.05, rel=0.01)
    ratio = numbers["top"] / numbers["front"]
    assert ratio.s / ratio.n < 0.01  # margin: noise alone, 0.2 %; independent lengths would give 7 %


def test_what_is_needed_reaches_it() -> None:
    (found,) = _found("calibrated_rig")
    wanted = 0.97 * found.U
    answer = needed(found, wanted, "camera.focal_px")
    assert answer.reachable
    assert pytest.approx(wanted) == scaled(found, "camera.focal_px", answer.factor).U


def test_the_plan_moves_where_the_pose_dominates() -> None:
    scene = scenes.load("calibrated_rig")
    found = plan_capability(scene, refined=False)
    best, quiet = found.best.ratios[0], found.quiet.ratios[0]
    assert best < 0.98 * quiet  # margin: the order is said; 2 % so that it is no rounding
    # margin: the order of two plans: one is the least of all by what is compared
    assert found.quiet.budget.measurands[0].repeatability <= found.best.budget.measurands[0].repeatability


def test_command(tmp_path) -> None:
    done = ice("budget", "calibrated_rig", "--json", "--csv", tmp_path / "b.csv")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    (each,) = told["measurands"]
    assert {"name", "unit", "value", "u", "U", "k", "dof", "contributions"} <= set(each)
    keys = {"source", "u", "sensitivity", "contribution", "share", "type"}
    assert all(keys <= set(row) for row in each["contributions"])
    assert each["U"] == pytest.approx(each["k"] * each["u"])
    assert told["monte_carlo"] == []
    with (tmp_path / "b.csv").open() as file:
        assert [row["source"] for row in csv.DictReader(file)] == [row["source"] for row in each["contributions"]]


def test_pictures_of_stations_need_a_plain_scene() -> None:
    done = ice("budget", "plate", "--stations", 50)
    assert done.returncode == 2
    assert "--stations must be 0 but for one convex body before darkness" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--p", 1.5), "--p must be at most 0.9999"),
        (("--reach", -1), "--reach must be greater than 0"),
        (("--stations", 3), "--stations must be 0 or at least 50"),
        (("--sensor", "1"), "--sensor must be two numbers"),
        (("--csv", "table.txt"), "--csv must end in .csv"),
    ],
)
def test_bad_options(arguments, text) -> None:
    done = ice("budget", "calibrated_rig", *arguments)
    assert done.returncode == 2
    assert text in done.stderr


def test_the_page_has_the_budgets_rows() -> None:
    found = _found("calibrated_rig")
    rows = budget_table.lines(found.measurands[0])
    assert rows[0][0] == "camera.focal_px"
    assert len(rows) == len(found.measurands[0].contributions)
    assert "The distance 'diagonal' is 14.5774 cm +- 0.0062 cm, k = 2.0." in budget_table.note(found, 0)
