"""Noise of a sensor that is not linear: `noise.excess` beside gain x signal."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging import sensor
from measure import FramePair, photon_transfer
from planner.search.exhaustive import has_bound
from render import expose
from scenes import InvalidInput, Noise, Picture
from scenes.cameras.binning import binned
from validation.recipe.export import check

STRAIGHT = {"sigma": 2.0, "gain": 0.09, "bits": 8, "dark_level": 16.0}
IN_PARTS = STRAIGHT | {"gain": 0.05, "excess": [[0, 0], [60, 2.4], [1000, 40]]}  # the same line
BENT = Noise(sigma=2.0, gain=0.1, bits=8, dark_level=10.0, excess=[(0, 0), (40, 4.0), (120, -3.0)])


def test_an_excess_that_is_a_line_is_gain():
    """Levels over the whole scale and its end: mean, variance, slope, and what a goodness of fit expects."""
    one, parts = Noise(**STRAIGHT), Noise(**IN_PARTS)
    levels = np.linspace(0, 300, 301)
    for told in (sensor.recorded, lambda n, x: (sensor.sensitivity(n, x),)):
        for a, b in zip(told(one, levels), told(parts, levels), strict=True):
            assert a == pytest.approx(b, rel=1e-12)
    like = sensor.recorded(one, levels)
    for a, b in zip(*(sensor.squared_errors(n, levels, like) for n in (one, parts)), strict=True):
        assert a == pytest.approx(b, rel=1e-9)


def test_a_slope_is_that_of_the_variance():
    signals = np.array([-5.0, 1.0, 39.0, 41.0, 119.0, 130.0])
    up, down = (sensor.shot_noise(BENT, signals + step) for step in (1e-4, -1e-4))
    assert sensor._shot_slope(BENT, signals) == pytest.approx((up - down) / 2e-4, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("estimator", ["gradient", "strip"])
def test_predicted_and_propagated_as_the_same_line(estimator):
    scene = scenes.load("task1")
    pictures = [Picture.of(scene.with_(noise=noise), (35, 60), (20, 200)) for noise in (STRAIGHT, IN_PARTS)]
    variances = [
        (
            planner.predict(each).measurands[0].variance_object,
            measure.propagate(render.image(each), each, estimator=estimator).measurands.covariance[0, 0],
        )
        for each in pictures
    ]
    assert variances[0] == pytest.approx(variances[1], rel=1e-9)
    lone = Picture.of(scene.with_(noise=STRAIGHT | {"gain": 0.05}), (35, 60), (20, 200))
    assert planner.predict(lone).measurands[0].variance_object < 0.95 * variances[0][0]  # so the excess counts


def test_exposures_have_it():
    """20,000 pixels a level: 1 % of the variance."""
    for level in (10.0, 50.0, 90.0, 130.0, 200.0):
        drawn = expose(np.full((100, 200), level), BENT, np.random.default_rng(4), 1)
        wanted = sensor.recorded(BENT, np.array([level])).noise_variance[0]
        assert drawn.var() == pytest.approx(wanted, rel=0.05)  # margin: 5 standard errors
    assert sensor.recorded(BENT, np.array([50.0])).noise_variance[0] == pytest.approx(4 + 1 / 12 + 4 + 4)


def test_photon_transfer_follows_it():
    """The line misses the variance at a step by a fifth; between steps the excess tells it."""
    rng, steps = np.random.default_rng(6), np.arange(10.0, 170.0, 10)
    lit, dark = (
        [FramePair.of(*expose(np.full((250, 300), 10.0 + part * step), BENT, rng, 2)) for step in steps]
        for part in (1, 0)
    )
    found = photon_transfer(lit, dark, 8)
    assert (found.status, found.noise.excess) == ("misfit", ())
    levels = 10 + np.array([15.0, 40.0, 75.0, 110.0])
    wanted = sensor.recorded(BENT, levels).noise_variance
    assert sensor.recorded(found.followed, levels).noise_variance == pytest.approx(wanted, rel=0.03)  # margin: 5 errors
    off = sensor.recorded(found.noise, levels).noise_variance / wanted - 1
    assert np.abs(off).max() > 0.1


def test_steps_of_one_signal_are_one_and_none_takes_the_noise_away():
    """Two exposures of one level, and one whose light seems to take more noise away than there is in the dark."""
    signals, variances = [0.0, 20.0, 40.0, 40.0, 80.0, 160.0], [4.0, 0.0, 8.0, 9.0, 12.0, 20.0]
    lit = [FramePair(10.0 + s, v, 0.0, 0.0, 1000) for s, v in zip(signals, variances, strict=True)]
    found = photon_transfer(lit, [FramePair(10.0, 4.0, 0.0, 0.0, 1000)] * 6).followed
    assert [signal for signal, _ in found.excess] == [0.0, 20.0, 40.0, 80.0]
    assert Noise.model_validate(found.model_dump()) == found  # as a scene's file would be checked
    assert found.excess[2][1] == pytest.approx(8.5 - 4.0 - 40 * found.gain)


def test_what_does_not_know_it_says_so():
    scene = scenes.load("task1")
    assert has_bound(scene.with_(noise=STRAIGHT), "calibrated")
    assert not has_bound(scene.with_(noise=IN_PARTS), "calibrated")
    for said, message in (
        ({"excess": [[0, 0], [5, 1], [5, 2]]}, "excess must be rows of rising signal from 0 on"),
        ({"excess": [[1, 0], [5, 1]]}, "excess must be rows of rising signal from 0 on"),
        ({"excess": [[0, 0], [10, -5.5]]}, "excess must leave a variance above 0, got -5.5 at signal 10"),
        ({"gain": 0.0, "excess": [[0, 1]]}, "excess must stand beside a gain above 0 and without colour filters"),
    ):
        with pytest.raises(InvalidInput, match=message):
            scene.with_(noise=STRAIGHT | {"gain": 0.1} | said)


def test_recipes_and_binning_refuse_it():
    scene = scenes.load("task1").with_(noise=IN_PARTS)
    with pytest.raises(InvalidInput, match=r"a linear sensor's for a recipe, got noise\.excess of 3 rows"):
        check(Picture.of(scene, (35, 60), (20, 200)), "gradient")
    camera = {"binning": {"factor": 2, "kind": "charge"}, "pixel_pitch_um": 3.45}
    with pytest.raises(ValueError, match=r"camera\.binning must be left out with noise\.excess, got charge"):
        binned({"camera": camera, "noise": IN_PARTS})
