"""The uncertainty budget, its Monte Carlo check and what to improve: identities, oracles and what is refused."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from planner.uncertainty import (
    Enough,
    Group,
    Input,
    as_ufloats,
    budget,
    coverage_factor,
    effective_dof,
    improvements,
    monte_carlo,
    monte_carlo_all,
    needed,
    numerical_tolerance,
    scaled,
    shortest_interval,
    validate,
)
from scenes import InvalidInput

CALIBRATION = Group(
    (Input("fx", 3500.0, 2.0, dof=30), Input("k1", 0.01, 0.001, dof=12)), ((1, -0.7), (-0.7, 1)), "camera"
)
INPUTS = (
    Input("repeats", 0.0, 3.0, "t", dof=9, type="A", unit="um", kind="noise"),
    Input.from_half_width("scale", 1.0, 0.02),
    CALIBRATION,
)
SLOPES = {"repeats": 1.0, "scale": -200.0, "fx": 1.5, "k1": 2000.0}


def made(inputs=INPUTS, slopes=SLOPES, p=0.95):
    return budget("width", "um", 200.0, inputs, slopes, p)


def test_combined_is_the_quadratic_form():
    c, u = np.array(list(SLOPES.values())), np.array([3.0, 0.02 / math.sqrt(3), 2.0, 0.001])
    r = np.eye(4)
    r[2, 3] = r[3, 2] = -0.7
    found = made()
    assert found.u**2 == pytest.approx((c * u) @ r @ (c * u), rel=1e-12)
    assert found.correlated == pytest.approx(2 * 1.5 * 2000.0 * 2.0 * 0.001 * -0.7, rel=1e-12)
    assert found.u != pytest.approx(np.linalg.norm(c * u), rel=0.05)  # margin: 17 % is what the correlation takes away


def test_shares_add_to_one_and_a_group_is_one_row():
    found = made()
    assert [row.source for row in found.contributions] == ["repeats", "scale", "camera"]
    assert sum(row.share for row in found.contributions) == pytest.approx(1, abs=1e-12)
    camera = found.of("camera")
    assert camera.contribution**2 == pytest.approx(9 + 4 - 2 * 0.7 * 6, rel=1e-12)
    assert [each.source for each in camera.members] == ["fx", "k1"]
    assert sum(each.share for each in camera.members) == pytest.approx(camera.share, rel=1e-12)
    assert camera.members[1].share < 0 < camera.members[0].share
    assert (camera.type, camera.dof, camera.sensitivity) == ("B", 12, 1.0)


def test_leaving_a_source_out_takes_its_share():
    found = made()
    for row in found.contributions:
        less = found.without(row.source)
        assert less.u**2 == pytest.approx(found.u**2 * (1 - row.share), rel=1e-12)
        assert row.source not in [each.source for each in less.contributions]
    with pytest.raises(InvalidInput, match="source must be one of repeats, scale, camera, got fx"):
        found.without("fx")


def test_repeatability_and_accuracy():
    found = made()
    assert found.repeatability == 3.0
    assert found.repeatability**2 + found.accuracy**2 == pytest.approx(found.u**2, rel=1e-12)


def test_rows_are_json():
    rows = json.loads(json.dumps(made().as_rows(), allow_nan=False))
    assert [list(row) for row in rows] == 3 * [["source", "u", "sensitivity", "contribution", "share", "type", "dof"]]
    assert [row["dof"] for row in rows] == [9, None, 12]
    assert [row["type"] for row in rows] == ["A", "B", "B"]


def test_no_uncertainty_at_all():
    found = budget("width", "um", 1.0, [Input("a", 0, 0.0, dof=3)], {"a": 2.0})
    assert (found.u, found.U, found.dof, found.of("a").share) == (0, 0, math.inf, 0)
    assert budget("width", "um", 1.0, [], {}).u == 0


def test_fully_cancelling_correlation():
    group = Group((Input("a", 0, 0.3), Input("b", 0, 0.3)), ((1, 1), (1, 1)))
    assert budget("d", "", 0.0, [group], {"a": 1.0, "b": -1.0}).u == pytest.approx(0, abs=1e-9)


def test_welch_satterthwaite_lies_between_the_least_and_the_sum(rng):
    for _ in range(200):
        u, dof = rng.exponential(1, 5), rng.integers(1, 30, 5)
        # margin: bounds that hold by their kind, but for rounding
        assert dof.min() * (1 - 1e-12) <= effective_dof(u, dof) <= dof.sum() * (1 + 1e-12)
    assert effective_dof([1.0, 1.0], [7, 7]) == pytest.approx(14)
    assert effective_dof([1.0], [math.inf]) == math.inf


def test_coverage_factor_is_students(rng):
    assert coverage_factor(0.9545) == pytest.approx(2.0, abs=1e-3)
    assert [round(coverage_factor(0.95, dof), 2) for dof in (1, 2, 5, 10.9, 50)] == [12.71, 4.30, 2.57, 2.23, 2.01]
    assert coverage_factor(0.95, 9 - 1e-12) == coverage_factor(0.95, 9)
    for p in (0, 1, -0.1, math.nan):
        with pytest.raises(InvalidInput, match=f"p must be between 0 and 1, got {p}"):
            coverage_factor(p)
    with pytest.raises(InvalidInput, match=r"dof must be at least 1, got 0\.5"):
        coverage_factor(0.95, 0.5)


def test_stated_intervals_cover(rng):
    """Stations of five repeats and two of a second effect: y +- U covers the truth in 95 %, y +- 1.96 u in fewer."""
    stations, hits = 2000, np.zeros(2)
    for _ in range(stations):
        repeats, other = rng.normal(0, 3, 5), rng.normal(0, 1, 6)
        inputs = (
            Input("repeats", 0, repeats.std(ddof=1) / math.sqrt(5), dof=4),
            Input("other", 0, other.std(ddof=1) / math.sqrt(6), dof=5),
        )
        found = budget("y", "", repeats.mean() + other.mean(), inputs, {"repeats": 1.0, "other": 1.0})
        hits += [abs(found.value) <= found.U, abs(found.value) <= coverage_factor(0.95) * found.u]
    low, high = stats.binom.ppf([1e-3, 1 - 1e-3], stations, 0.95)
    assert low <= hits[0] <= high + 0.015 * stations  # rounding dof down is cautious
    assert hits[1] < low  # margin: counts: 89 % of 2000, 9 standard errors below


@pytest.mark.parametrize(
    ("inputs", "slopes", "message"),
    [
        (INPUTS[:2], {"repeats": 1.0}, "sensitivity of scale must be given, got nothing"),
        (INPUTS[:1], {"repeats": math.inf}, "sensitivity of repeats must be a finite number, got inf"),
        (INPUTS[:1], {"repeats": 1.0, "focus": 2.0}, "sensitivities must be of known inputs, got focus"),
        ((INPUTS[0], INPUTS[0]), {"repeats": 1.0}, "inputs must be of different names, got repeats 2 times"),
        ((Input("camera", 0, 1), CALIBRATION), SLOPES | {"camera": 1}, "different names, got camera 2 times"),
    ],
)
def test_bad_budgets(inputs, slopes, message):
    with pytest.raises(InvalidInput, match=message):
        made(inputs, slopes)


def test_bad_values():
    with pytest.raises(InvalidInput, match="value must be a finite number, got nan"):
        budget("y", "", math.nan, [], {})
    with pytest.raises(InvalidInput, match=r"p must be between 0 and 1, got 1\.5"):
        made(p=1.5)


MEANS = {"repeats": 0.0, "scale": 1.0, "fx": 3500.0, "k1": 0.01}


def linear(x):
    return 200.0 + sum(SLOPES[name] * (values - MEANS[name]) for name, values in x.items())


def test_monte_carlo_of_a_linear_model():
    """Same mean; the standard deviation is u_c but for Student's t, whose own is larger by sqrt(9 / 7)."""
    drawn = monte_carlo(linear, INPUTS, 11, margin=5)
    exact = math.sqrt(made().u ** 2 + 9.0 * (9 / 7 - 1))
    assert abs(drawn.y - 200) < 5 * drawn.spread[0]
    assert abs(drawn.u - exact) < 5 * drawn.spread[1]
    assert abs(drawn.u - made().u) > 5 * drawn.spread[1]


def test_monte_carlo_keeps_its_tolerance():
    """Nearly all of 60 runs have all results within the numerical tolerance; two small blocks have not."""
    inputs = [Input(f"X{k}", 0, 1.0) for k in range(4)]

    def total(x):
        return sum(x.values())

    runs = [monte_carlo(total, inputs, seed) for seed in range(60)]
    assert all(each.converged for each in runs)
    wrong = [max(abs(each.u - 2), abs(each.y), abs(each.symmetric[1] - 3.92)) > 0.05 for each in runs]
    assert np.mean(wrong) <= 0.1
    short = [monte_carlo(total, inputs, seed, block=200, most=400) for seed in range(60)]
    # margin: chance: 60 runs, 4.6 standard errors
    assert np.mean([max(abs(each.u - 2), abs(each.y)) > 0.05 for each in short]) > 0.5


def test_monte_carlo_is_repeated_by_its_seed():
    a, b, c = (monte_carlo(linear, INPUTS, seed) for seed in (3, 3, 4))
    assert a == b
    assert a.y != c.y


def test_several_measurands_share_their_draws():
    x = Input("x", 1.0, 0.1)
    both = monte_carlo_all(lambda d: np.stack([d["x"], 3 * d["x"]], 1), ("one", "three"), [x], 1)
    assert [each.name for each in both] == ["one", "three"]
    assert 3 * both[0].y == pytest.approx(both[1].y, rel=1e-12)
    assert 3 * both[0].u == pytest.approx(both[1].u, rel=1e-9)
    assert both[0].draws == both[1].draws


def test_all_measurands_have_to_be_stable():
    """A heavy tail needs more draws than the normal measurand beside it, and both get them."""
    inputs = [Input("x", 0, 1.0), Input("tail", 0, 1.0, "t", dof=5)]
    both = monte_carlo_all(
        lambda d: np.stack([d["x"], d["tail"]], 1), ("x", "tail"), inputs, 2, enough=Enough(block=2000)
    )
    alone = monte_carlo(lambda d: d["x"], inputs, 2, block=2000)
    assert all(each.converged for each in both)
    assert both[0].draws == both[1].draws > alone.draws


def test_failed_draws_are_counted():
    def model(x):
        return np.where(x["x"] > 2, np.nan, x["x"])

    drawn = monte_carlo(model, [Input("x", 0, 1)], 1)
    assert drawn.failed / (drawn.failed + drawn.draws) == pytest.approx(stats.norm.sf(2), abs=3e-3)
    assert drawn.y == pytest.approx(-stats.norm.pdf(2) / stats.norm.cdf(2), abs=0.02)
    found = validate(budget("y", "", 0.0, [Input("x", 0, 1)], {"x": 1.0}), drawn)
    assert found.reason.endswith(f"{drawn.failed} of {drawn.failed + drawn.draws} draws gave no value")


def test_too_few_draws_are_said():
    drawn = monte_carlo(linear, INPUTS, 1, block=100, most=200, digits=3)
    assert not drawn.converged
    assert (drawn.draws, drawn.failed) == (200, 0)
    found = validate(made(), drawn)
    assert found.verdict == "undecided"
    assert "200 draws tell the ends to" in found.reason


def test_a_constant_model():
    drawn = monte_carlo(lambda x: 0 * x["x"] + 5.0, [Input("x", 0, 1)], 1)
    assert (drawn.y, drawn.u, drawn.symmetric, drawn.converged) == (5.0, 0.0, (5.0, 5.0), True)
    assert validate(budget("y", "", 5.0, [Input("x", 0, 1)], {"x": 0.0}), drawn).verdict == "agree"


def test_shortest_interval_of_a_skew_distribution(rng):
    """Of exponential draws it begins at 0 and ends at the 95 % quantile; the symmetric one is longer."""
    low, high = shortest_interval(rng.exponential(1, 100_000), 0.95)
    assert low < 0.01
    assert high == pytest.approx(-math.log(0.05), rel=0.02)
    assert high - low < -math.log(0.025) + math.log(0.975)  # margin: the order is said; the difference is 18 %


def test_numerical_tolerances():
    assert [numerical_tolerance(u, 1) for u in (0.035, 0.096, 3.0, 96.0)] == [0.005, 0.05, 0.5, 50]
    assert numerical_tolerance(0.0) == 0
    with pytest.raises(InvalidInput, match="digits must be at least 1, got 0"):
        numerical_tolerance(1.0, 0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"p": 1.0}, "p must be between 0 and 1, got 1"),
        ({"digits": 0}, "digits must be at least 1, got 0"),
        ({"block": 39}, r"block must be at least 40 for p = 0\.95, got 39"),
        ({"most": 100}, "most must be at least two blocks, 20000, got 100"),
        ({"margin": 0.5}, r"margin must be at least 1, got 0\.5"),
    ],
)
def test_bad_options(options, message):
    with pytest.raises(InvalidInput, match=message):
        monte_carlo(linear, INPUTS, 1, **options)


def test_bad_models():
    with pytest.raises(InvalidInput, match=r"the model's values must be of shape \(10000, 1\), got \(10000, 2, 1\)"):
        monte_carlo(lambda x: np.zeros((10_000, 2)), INPUTS, 1)
    with pytest.raises(InvalidInput, match="the model must give at least 2 finite values a block, got 0"):
        monte_carlo(lambda x: x["fx"] * np.nan, INPUTS, 1)


def test_comparison_needs_the_same_probability():
    drawn = monte_carlo(linear, INPUTS, 1)
    with pytest.raises(InvalidInput, match=r"p must be the same in both, got 0\.99 and 0\.95"):
        validate(made(p=0.99), drawn)
    with pytest.raises(InvalidInput, match="interval must be one of symmetric, shortest, got widest"):
        validate(made(), drawn, interval="widest")


def test_few_degrees_of_freedom_are_a_reason():
    given = Input("x", 0, 1.0, "t", dof=3)
    gum = replace(budget("y", "", 0.0, [given], {"x": 1.0}), k=2.0, U=2.0)
    found = validate(gum, monte_carlo(lambda x: x["x"], [given], 1))
    assert found.verdict == "differ"
    assert "few degrees of freedom: the distributions' standard deviation is 1.7, not 1" in found.reason


def test_a_distribution_without_variance_is_no_nonlinearity():
    given = Input("x", 0, 1.0, "t", dof=2)
    gum = replace(budget("y", "", 0.0, [given], {"x": 1.0}), k=2.0, U=2.0)
    found = validate(gum, monte_carlo(lambda x: x["x"], [given], 1, most=50_000))
    assert "nonlinear" not in found.reason
    assert "x (t) has 100 % of the variance" in found.reason


def test_agreement_of_a_t_with_its_own_factor():
    given = Input("x", 0, 1.0, "t", dof=3)
    gum = budget("y", "", 0.0, [given], {"x": 1.0})
    assert validate(gum, monte_carlo(lambda x: x["x"], [given], 1, margin=2)).verdict == "agree"


def test_halving_each_source():
    found = made()
    best = improvements(found)
    assert [each.gain for each in best] == sorted((each.gain for each in best), reverse=True)
    for each in best:
        row = found.of(each.source)
        assert each.u**2 == pytest.approx(found.u**2 * (1 - 0.75 * row.share), rel=1e-12)
        assert each.gain == pytest.approx(1 - each.U / found.U)
    assert best[0].source == "repeats"
    with pytest.raises(InvalidInput, match="factor must be a finite number of at least 0, got -1"):
        scaled(found, "repeats", -1)


@pytest.mark.parametrize("source", ["repeats", "scale", "camera"])
@pytest.mark.parametrize("part", [0.85, 0.95, 1.0, 1.3])
def test_needed_reaches_what_is_wanted(source, part):
    """Put back, the answer gives U_wanted from below (dof, so k, changes by steps); a little more exceeds it."""
    found = made()
    wanted = part * found.U
    answer = needed(found, wanted, source)
    if not answer.reachable:
        assert answer.floor == found.without(source).U > wanted
        return
    row = found.of(source)
    reached, beyond = (scaled(found, source, factor * answer.u / row.u).U for factor in (1.0, 1.0001))
    # margin: from below, by a step of dof at most; equality where there is none
    assert 0.97 * wanted < reached <= wanted * (1 + 1e-9)
    assert beyond > wanted * (1 - 1e-9)  # margin: that a ten-thousandth more is too much is what is said


def test_needed_in_closed_form():
    """All known exactly: u = sqrt((U / k)^2 - rest^2) / |c|. Density of Sandia's example: the balance for 1.5 %."""
    k, h, d, rho = 12.870369, 0.5, 0.25, 2.0
    w = rho * k * d**2 * h
    inputs = (Input("w", w, 0.01), Input("d", d, 0.0005), Input("h", h, 0.0005))
    slopes = {"w": rho / w, "d": -2 * rho / d, "h": -rho / h}
    found = budget("density", "g/cm3", rho, inputs, slopes)
    answer = needed(found, coverage_factor(0.95) * 0.03, "w")
    exact = math.sqrt(0.03**2 - (2 * rho / d * 0.0005) ** 2 - (rho / h * 0.0005) ** 2) * w / rho
    assert answer.u == pytest.approx(exact, rel=1e-12)
    assert answer.factor == pytest.approx(exact / 0.01, rel=1e-12)
    assert scaled(found, "w", answer.factor).u == pytest.approx(0.03, rel=1e-12)


def test_needed_where_only_an_exact_source_does():
    """U of the others alone is wanted: hardly anything is left, and never less than nothing by rounding."""
    for k in range(40):
        inputs = (Input("a", 0, 0.3 + 0.017 * k), Input("b", 0, 0.7), Input("c", 0, 0.11 * (k + 1)))
        found = budget("y", "", 0.0, inputs, {"a": 1.0, "b": 0.9, "c": 1.3})
        answer = needed(found, found.without("b").U, "b")
        assert answer.reachable
        assert 0 <= answer.u < 1e-6


def test_needed_that_cannot_be():
    found = made()
    answer = needed(found, 0.5 * found.without("scale").U, "scale")
    assert (answer.reachable, answer.u, answer.factor) == (False, None, None)
    assert answer.reason.startswith("not reachable: U is")
    idle = budget("y", "", 0.0, [Input("a", 0, 1), Input("b", 0, 1)], {"a": 1.0, "b": 0.0})
    assert needed(idle, 3.0, "b").reason == "b does not change U, which is 1.96"
    with pytest.raises(InvalidInput, match="U_wanted must be a finite number greater than 0, got 0"):
        needed(found, 0, "scale")
    with pytest.raises(InvalidInput, match="source must be one of repeats, scale, camera, got focus"):
        needed(found, 1.0, "focus")


def test_numbers_keep_their_correlation():
    """c' V d between two budgets of shared sources; independent of each other they would have none."""
    other = {"repeats": 0.0, "scale": -100.0, "fx": 1.0, "k1": 3000.0}
    numbers = as_ufloats([made(), budget("depth", "um", 90.0, INPUTS, other)])
    assert (numbers["width"].n, numbers["depth"].n) == (200.0, 90.0)
    assert numbers["width"].s == pytest.approx(made().u, rel=1e-9)
    camera = np.array([1.5, 2000.0]) @ CALIBRATION.covariance @ np.array([1.0, 3000.0])
    shared = 200.0 * 100.0 * INPUTS[1].u ** 2 + camera
    whole = (numbers["width"] + numbers["depth"]).s ** 2
    assert whole == pytest.approx(numbers["width"].s ** 2 + numbers["depth"].s ** 2 + 2 * shared, rel=1e-9)
    assert 2 * shared > 0.1 * whole  # margin: the order is said: the shared part is a third of the whole


def test_numbers_of_different_sources_are_refused():
    one = budget("a", "", 0.0, [Input("x", 0, 1)], {"x": 1.0})
    two = budget("b", "", 0.0, [Input("x", 0, 2)], {"x": 1.0})
    with pytest.raises(InvalidInput, match="x must be the same input in every budget, got two different ones"):
        as_ufloats([one, two])
    with pytest.raises(InvalidInput, match="budgets must be of different names, got a, a"):
        as_ufloats([one, one])
    group = Group((Input("x", 0, 1),), ((1,),), "group")
    with pytest.raises(InvalidInput, match="x must be in the same group in every budget, got two different ones"):
        as_ufloats([one, budget("b", "", 0.0, [group], {"x": 1.0})])
