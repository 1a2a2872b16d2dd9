"""Measurement system analysis: analysis of variance against published figures, tests of components against draws."""

import numpy as np
import pytest

import scenes
from planner.budgeting.budgets import budget
from planner.uncertainty.msa import (
    COMPONENTS,
    Components,
    Study,
    cheapest_guard,
    check,
    found_by,
    smallest_study,
    too_large,
)
from planner.uncertainty.risks import Limits, global_risks
from tests.proofs.msa import GUARDS, found, guard
from validation import msa

# The example of the AIAG manual (Measurement Systems Analysis, 4th edition): three appraisers, ten parts, three trials.
AIAG = np.array([
    [[0.29, -0.56, 1.34, 0.47, -0.80, 0.02, 0.59, -0.31, 2.26, -1.36],
     [0.41, -0.68, 1.17, 0.50, -0.92, -0.11, 0.75, -0.20, 1.99, -1.25],
     [0.64, -0.58, 1.27, 0.64, -0.84, -0.21, 0.66, -0.17, 2.01, -1.31]],
    [[0.08, -0.47, 1.19, 0.01, -0.56, -0.20, 0.47, -0.63, 1.80, -1.68],
     [0.25, -1.22, 0.94, 1.03, -1.20, 0.22, 0.55, 0.08, 2.12, -1.62],
     [0.07, -0.68, 1.34, 0.20, -1.28, 0.06, 0.83, -0.34, 2.19, -1.50]],
    [[0.04, -1.38, 0.88, 0.14, -1.46, -0.29, 0.02, -0.46, 1.77, -1.49],
     [-0.11, -1.13, 1.09, 0.20, -1.07, -0.67, 0.01, -0.56, 1.45, -1.77],
     [-0.15, -0.96, 0.67, 0.11, -1.45, -0.49, 0.21, -0.49, 1.87, -2.16]],
])  # fmt: skip
SHAPE = (3, 10, 3)
TOLD = Components(1.0, 0.5, 0.8, 4.0)


def drawn(rng, told=TOLD):
    effects = ((told.repeats, SHAPE), (told.both, (3, 10, 1)), (told.operators, (3, 1, 1)), (told.parts, (1, 10, 1)))
    return Study(sum((sigma * rng.standard_normal(shape) for sigma, shape in effects), np.zeros(SHAPE)))


def test_mean_squares_are_those_of_the_manual():
    study = Study(AIAG.transpose(0, 2, 1))
    assert study.dof.tolist() == [60, 18, 2, 9]
    np.testing.assert_allclose(study.mean_squares, [0.04598, 0.01994, 1.58363, 9.81799], rtol=2e-4)  # margin: 5 digits
    found = study.components
    assert (found.repeats, found.both) == (pytest.approx(0.04598**0.5, rel=1e-3), 0.0)  # margin: 4 digits
    assert found.operators == pytest.approx(((1.58363 - 0.01994) / 30) ** 0.5, rel=1e-3)  # margin: 4 digits
    assert found.parts == pytest.approx(((9.81799 - 0.01994) / 9) ** 0.5, rel=1e-3)  # margin: 4 digits
    assert found.grr == pytest.approx(np.hypot(found.repeats, found.operators))


def test_expected_mean_squares_are_means_of_draws():
    rng = np.random.default_rng(2)
    found = np.mean([drawn(rng).mean_squares for _ in range(4000)], 0)
    wanted = TOLD.mean_squares(*SHAPE)
    spread = np.sqrt(2 / np.array([60, 18, 2, 9]) / 4000)
    assert (np.abs(found / wanted - 1) < 4 * spread).all()  # margin: 4 standard errors


def test_intervals_hold_the_prediction_as_often_as_they_say():
    """200 studies: of each component 95 % of the intervals hold 1, p is uniform."""
    rng = np.random.default_rng(3)
    rows = [check(drawn(rng), TOLD) for _ in range(200)]
    for k, name in enumerate(COMPONENTS):
        each = [row[k] for row in rows]
        assert {row.name for row in each} == {name}
        held = np.mean([row.low <= 1 <= row.high for row in each])
        assert held > 0.95 - 4 * 0.0154  # margin: 4 standard deviations of 200
        assert abs(np.mean([row.p for row in each]) - 0.5) < 4 * 0.0204  # margin: 4 standard errors
    assert np.mean([bool(too_large(row)) for row in rows]) < 0.01 + 4 * 0.007  # margin: 4 standard deviations


@pytest.mark.parametrize("name", COMPONENTS)
def test_a_component_that_is_much_too_large_is_named_and_no_other(name):
    """Operators are three: four times as large is found in most studies, repeats twice as large in all."""
    rng, times = np.random.default_rng(4), {"repeats": 2.0, "operators x parts": 6.0, "operators": 12.0, "parts": 5.0}
    field = {"repeats": "repeats", "operators x parts": "both", "operators": "operators", "parts": "parts"}[name]
    wrong = Components(**{
        each: getattr(TOLD, each) * (times[name] if each == field else 1)
        for each in ("repeats", "both", "operators", "parts")
    })  # fmt: skip
    named = [too_large(check(drawn(rng, wrong), TOLD)) for _ in range(50)]
    assert np.mean([name in each for each in named]) > 0.75  # margin: all but operators above 0.95
    assert np.mean([bool(set(each) - {name}) for each in named]) < 0.15  # margin: 0.01 by chance


@pytest.mark.parametrize("shape", [(3, 10, 3), (8, 6, 2)])
def test_how_likely_a_study_finds_what_is_twice_as_large_is_how_often_it_does(shape):
    """400 drawn studies each; a component that is as predicted is named in 1 % of them and not that often."""
    told = found_by(TOLD, *shape)
    for name, rate in found(400, 5, shape).items():
        assert abs(rate - told[name]) < 4 * np.sqrt(told[name] * (1 - told[name]) / 400) + 1e-3
    for name, rate in found(400, 6, shape, times=1.0).items():
        assert rate < 0.0025 + 4 * np.sqrt(0.0025 / 400), name
        assert found_by(TOLD, *shape, times=1.0)[name] == pytest.approx(1 - 0.99**0.25, rel=1e-9)


def test_the_smallest_study_finds_each_and_no_smaller_one_does():
    o, p, r = smallest_study(TOLD)
    assert min(found_by(TOLD, o, p, r).values()) >= 0.9
    for size in np.ndindex(o + 6, p + 6, r + 2):
        if min(size) >= 2 and np.prod(size) < o * p * r:
            assert min(found_by(TOLD, *size).values()) < 0.9
    assert smallest_study(Components(1.0, 0.0, 0.001, 4.0)) is None  # operators are lost beside repeats


def test_what_is_derived_of_components():
    told = Components(3.0, 0.0, 4.0, 12.0)
    assert (told.appraisers, told.grr, told.total) == (4.0, 5.0, 13.0)
    assert told.grr_of_total == pytest.approx(5 / 13)
    assert told.grr_of(60.0) == pytest.approx(0.5)
    assert told.ndc == 3  # 1.41 * 12 / 5
    assert (Components(3.0, 0, 0, None).ndc, Components(3.0, 0, 0, None).grr_of_total) == (None, None)
    assert Components(3.0, 0, 0, 0.1).ndc == 1
    assert [row.name for row in check(drawn(np.random.default_rng(1)), Components(1.0, 0.5, 0.8, None))] == list(
        COMPONENTS[:3]
    )


@pytest.mark.parametrize("shape", [(1, 10, 3), (3, 1, 3), (3, 10, 1), (3, 10)])
def test_a_study_needs_two_of_each(shape):
    with pytest.raises(scenes.InvalidInput, match="at least 2 operators, 2 parts and 2 repeats"):
        Study(np.zeros(shape))


def test_the_cheapest_guard_band_is_the_least_of_a_scan():
    zone = Limits(-2.0, 2.0)
    found = cheapest_guard(0.3, 1.0, 0.25, zone, 20.0, 1.0)
    widths = np.linspace(-1, 1.4, 241)
    costs = []
    for width in widths:
        risks = global_risks(0.3, 1.0, 0.25, zone, Limits(-2 + width, 2 - width))
        costs.append(20 * risks.wrong_acceptance + risks.wrong_rejection)
    assert found.cost <= min(costs) * (1 + 1e-9)
    assert abs(found.width - widths[np.argmin(costs)]) < 0.01  # margin: the scan's step


@pytest.mark.parametrize("asked", GUARDS)
def test_the_cheapest_guard_band_costs_as_told_and_least_of_drawn_parts(asked):
    found = guard(200_000, 6, *asked)
    assert abs(found["told"] - found["drawn"]) < 4 * found["error"]  # margin: 4 standard errors
    assert found["more"] > 2  # half of u wider or narrower costs more, beyond chance


# --- a station


@pytest.fixture(scope="module")
def rig():
    scene = scenes.load("calibrated_rig")
    said = scene.uncertainty.model_copy(update={"process_sd": 0.01, "part_shift": scenes.Uncertain(sd=0.01),
                                                "light_deg": scenes.Uncertain(sd=1.0)})  # fmt: skip
    first = scene.settings[0]
    return budget(scene.model_copy(update={"uncertainty": said}), first.sensor, first.light)


def test_a_budget_is_parted_into_what_a_study_shows_and_what_not(rig):
    (told,) = msa.predicted(rig)
    (each,) = rig
    parts = {row.source: row.contribution for row in each.contributions}
    placed = sum(parts[name] ** 2 for name in parts if name.startswith(("part_shift", "part_tilt")))
    assert placed > 0
    rounded = parts.get("rounding", 0.0) ** 2
    assert told.components.repeats == pytest.approx(np.sqrt(each.repeatability**2 + placed + rounded))
    assert told.components.both == 0
    assert told.u == pytest.approx(each.u)
    (once,) = msa.predicted(rig, placed_once=True)
    assert once.components.both == pytest.approx(np.sqrt(placed))
    assert once.components.grr == pytest.approx(told.components.grr)
    assert (told.components.parts, once.u) == (0.01, pytest.approx(each.u))
    assert told.cg == pytest.approx(0.2 * told.width / (6 * told.components.repeats))
    assert told.cgk == pytest.approx((0.1 * told.width - told.constant) / (3 * told.components.repeats))


def test_a_study_of_the_station_is_as_predicted_and_twice_the_noise_is_not(rig):
    (told,) = msa.predicted(rig)
    rng = np.random.default_rng(5)
    study = Study(told.nominal + drawn(rng, told.components).values)
    assert too_large(check(study, told.components)) == ()
    noisy = Study(study.values + 2 * told.components.repeats * rng.standard_normal(SHAPE))
    assert "repeats" in too_large(check(noisy, told.components))


def test_a_study_is_read_by_its_columns(tmp_path):
    file = tmp_path / "study.csv"
    rows = [(o, p, k, o + 10 * p + 0.1 * k) for o in (1, 2) for p in (1, 2, 3) for k in (1, 2)]
    file.write_text("operator,part,repeat,bore\n" + "".join(f"{o},{p},{k},{v}\n" for o, p, k, v in rows))
    (found,) = msa.read(file, ("bore", "slot")).values()
    np.testing.assert_allclose(found.values[1, 2], [32.1, 32.2])
    file.write_text(file.read_text().replace("bore", "value"))
    assert list(msa.read(file, ("length",))) == ["length"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "must have the columns operator, part and one of bore, got none"),
        ("operator,bore\n1,2\n", "must have the columns operator, part and one of bore, got operator, bore"),
        ("operator,part,bore\n1,1,x\n", "bore must be a number, got 'x'"),
        ("operator,part,bore\n1,1,2\n1,2,2\n2,1,2\n", "must have each operator and part as often as the others"),
        ("operator,part,bore\n1,1,2\n", "at least 2 operators"),
    ],
)
def test_a_bad_study_is_refused(tmp_path, text, said):
    file = tmp_path / "study.csv"
    file.write_text(text)
    with pytest.raises(scenes.InvalidInput, match=said):
        msa.read(file, ("bore",))
