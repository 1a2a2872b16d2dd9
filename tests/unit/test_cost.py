"""Stopping rules, the cost model and the slopes of the parameters."""

import math

import numpy as np
import pytest

import scenes
from render import Quality
from scenes import InvalidInput
from tests.sequential import simulate
from validation.batch.campaign import Campaign
from validation.batch.stages import Stages
from validation.cost import goal, interval, rays
from validation.cost.model import CostModel, Rendered, combined, qualities
from validation.cost.parameter import slope
from validation.cost.points import points_parameter
from validation.statistics import ratio_interval

REPETITIONS = 2000


def covered(rule, truth=1.0, width=0.1, first=300):
    """Part of the repetitions whose 95 % interval holds the truth, and the images each took."""
    rng = np.random.default_rng(6)
    found = [rule(truth, width, first, rng) for _ in range(REPETITIONS)]
    inside = [low <= truth <= high for low, high in (ratio_interval(*pair) for pair in found)]
    return float(np.mean(inside)), np.array([n for _, n in found])


@pytest.mark.parametrize(("width", "truth"), [(0.2, 1.0), (0.1, 1.0), (0.1, 1.2), (0.1, 0.8)])
def test_stopping_when_narrow_enough_keeps_the_coverage(width, truth):
    """92-98 % of 200 repetitions is asked for; 2000 have a standard error of 0.5 %."""
    first = max(interval.LEAST, int(0.8 * interval.images(width)))
    inside, counts = covered(simulate, truth, width, first)
    assert 0.93 < inside < 0.97  # margin: 4 standard errors
    assert np.ptp(counts) > 0  # it did stop at different numbers


def test_looking_until_the_prediction_is_contradicted_would_spoil_it():
    """Negative control: ten looks, stopping as soon as 1 lies outside the interval."""

    def until_contradicted(truth, _width, first, rng):
        values = np.sqrt(truth) * rng.standard_normal(10 * first)
        looks = [(float(values[:n].var(ddof=1)), n) for n in range(first, 10 * first + 1, first)]
        outside = (pair for pair in looks if not ratio_interval(*pair)[0] <= 1 <= ratio_interval(*pair)[1])
        return next(outside, looks[-1])

    assert covered(until_contradicted, first=100)[0] < 0.9  # margin: 9 standard errors of 2000 repetitions below


@pytest.mark.parametrize("width", [0.2, 0.1, 0.05])
def test_the_half_width_reached_is_the_one_asked_for(width):
    rng = np.random.default_rng(3)
    first = int(0.8 * interval.images(width))
    for truth in (0.9, 1.0, 1.15):
        ratio, n = simulate(truth, width, first, rng)
        low, high = ratio_interval(ratio, n)
        # a setting whose first look is narrow enough has all it will get
        # margin: what the last images change the ratio by
        assert (high - low) / 2 == pytest.approx(width, rel=0.1) or n == first
        # margin: what is asked for, and 2 % for the last images: met by its kind
        assert (high - low) / 2 <= 1.021 * width


def test_images_is_the_inverse_of_half_width():
    for width in (0.5, 0.2, 0.1, 0.02):
        n = interval.images(width)
        # margin: the least whole number: met by its kind
        assert interval.half_width(n) <= width < interval.half_width(n - 1)
    with pytest.raises(InvalidInput, match="accuracy must be greater than 0, got -1"):
        interval.images(-1)
    with pytest.raises(InvalidInput, match=r"accuracy must be at least 0\.00028, got 0\.0001"):
        interval.images(1e-4)


def model(**changes):
    four, sixteen = qualities(4, 16)
    constants = {
        "settings": 16, "workers": 2, "variant": "scalar_rgb",
        "rendered": (Rendered(four, 0.2, 0.02), Rendered(sixteen, 0.8, 0.005)), "phase": 0.004, "model": 0.001,
        "start": 2.0, "setting": 0.1, "image": 0.002, "finish": 3.0, "seconds": 5.0,
    }  # fmt: skip
    return CostModel(**constants | changes)


def test_all_sources_are_added():
    errors = model().errors(model().rendered[0], 1000)
    assert set(errors) == {"sampling", "render", "phase", "model"}
    assert combined(errors) == pytest.approx(
        math.sqrt(interval.half_width(1000) ** 2 + 1.96**2 * (0.02**2 + 0.004**2)) + 0.001
    )
    for name in errors:  # none is ignored
        assert combined(errors | {name: errors[name] + 0.1}) > combined(errors) + 0.01  # margin: the order is said


def test_a_small_accuracy_buys_rays_and_a_large_one_does_not():
    coarse, fine = model().for_accuracy(0.2), model().for_accuracy(0.045)
    assert coarse.rendered.quality == qualities(4)[0]
    assert fine.rendered.quality == qualities(16)[0]
    for choice, accuracy in ((coarse, 0.2), (fine, 0.045)):
        assert choice.total == pytest.approx(accuracy, rel=0.01)
    with pytest.raises(InvalidInput, match=r"--accuracy must be larger than 0\.01.*, got 0\.01"):
        model().for_accuracy(0.01)


def test_a_budget_is_spent_and_the_larger_gives_more():
    small, large = model().for_budget(20), model().for_budget(180)
    assert small.seconds == pytest.approx(20, abs=0.1)
    assert large.seconds == pytest.approx(180, abs=0.1)
    assert large.total < small.total  # margin: the order is said
    with pytest.raises(InvalidInput, match="--budget must be at least 13 s here, got 7 s"):
        model().for_budget(2)


def test_budget_in_words():
    assert [goal.seconds(text) for text in ("60", "60s", "1.5min", "1h")] == [60, 60, 90, 3600]
    for text in ("", "0s", "-3", "soon"):
        with pytest.raises(InvalidInput, match="--budget must be a duration as 60s, 2min or 1h, got"):
            goal.seconds(text)


def test_accuracy_is_a_fraction():
    assert goal.check_accuracy(0.05) == 0.05
    with pytest.raises(InvalidInput, match="--accuracy must be between 0 and 1, got 2"):
        goal.check_accuracy(2.0)


def test_stages_add_chunks_and_change_none():
    stages = Stages([[300, 100]])
    before = stages.sizes(0)
    assert not stages.extend([200, 100])
    assert stages.extend([700, 0])
    assert stages.sizes(0) == before | {2: 250, 3: 150}
    assert stages.sizes(1) == {0: 100}
    assert stages.total == 800


def test_slope_of_points_agrees_with_theory_and_gauss_beats_them():
    """On Task1: the trapezoid's error falls as points^-2, the paper's equal weights' as points^-1."""
    parameter = points_parameter(Campaign.of(scenes.load("task1")).case(5))
    for fit in parameter.fits:
        assert fit.slope == pytest.approx(fit.theory, abs=0.5)
    errors = {(row[0], row[1]): row[3] for row in parameter.rows}
    assert errors["Gauss-Legendre", 4] < 1e-3 * errors["trapezoid", 100]
    assert slope([1, 2, 4], [1, 4, 16]) == pytest.approx(2)


def test_quality_names():
    assert {quality.supersample for quality in qualities(1, 4)} == {Quality().supersample}


def test_scatter_over_images_is_of_samples_that_have_their_own_mean():
    """Two settings of three images: sums of squares over two, corners' mean over both coordinates, noise beside."""
    corners = [np.array([[10.0, 20.0], [30.0, 41.0]]) + step * np.array([[1, 0], [0, 2]]) for step in (-1, 0, 1)]
    first = [(place, value, 0.5) for place, value in zip(corners, (7.0, 9.0, 11.0), strict=True)]
    second = [(corners[0], value, 0.25) for value in (3.0, 3.0, 6.0)]
    found = rays._scatter(list(zip(first, second, strict=True)))
    corner2 = np.mean([(1 + 4) / 4, 0.0])
    distance2, relative2 = np.mean([4.0, 3.0]), np.mean([4.0 / 0.5, 3.0 / 0.25])
    assert found == pytest.approx([corner2**0.5, distance2**0.5, relative2**0.5], rel=1e-12)
