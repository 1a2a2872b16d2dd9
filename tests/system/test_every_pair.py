"""Every bundled scene with every estimator: measured, or refused in one line; never an error of this program."""

import functools

import numpy as np
import pytest

import measure
import scenes
from scenes import InvalidInput

NO_ARRANGEMENT = "estimator must be one of canny, gradient, isophote, strip for what is no convex body"
HIDING = {"backlight_plate", "bracket", "bracket_mm", "bracket_station", "grey_floor", "plate"}
QUICK = ("ball", "bracket", "grey_floor", "plate", "shaft")  # one of each kind that was an error


@functools.cache
def picture(name):
    scene = scenes.load(name)
    return scenes.Picture.of(scene, scene.settings[0].sensor, scene.settings[0].lights)


@functools.cache
def image(name):
    """Of one level, which costs no rendering; what is measured in it is nothing."""
    camera = picture(name).scene.camera
    return np.full((camera.height, camera.width), 60.0)


@pytest.mark.parametrize("estimator", measure.ESTIMATORS)
@pytest.mark.parametrize("name", QUICK)
def test_no_pair_of_scene_and_estimator_is_an_internal_error(name, estimator):
    """Straight edges by the estimator, circles always by their rims: only an arrangement needs its kind of scene."""
    check(name, estimator)


def test_nor_is_any_pair_of_the_other_scenes():
    for name in set(scenes.names()) - set(QUICK):
        for estimator in measure.ESTIMATORS:
            check(name, estimator)


def check(name, estimator):
    there = picture(name)
    if estimator == "arrangement" and name in HIDING:
        for asked in (measure.measure, measure.propagate):
            with pytest.raises(InvalidInput, match=NO_ARRANGEMENT):
                asked(image(name), there, estimator=estimator)
        return
    found = measure.measure(image(name), there, estimator=estimator)
    assert found.status.shape == (len(there.scene.quantities),)
    assert len(measure.propagate(image(name), there, estimator=estimator).measurands.status) == found.status.size
    assert measure.region_of_interest(there, estimators=(estimator,)).any()


@pytest.mark.parametrize("name", QUICK)
def test_each_scene_has_a_bound_or_a_line_that_says_why_not(name):
    there = picture(name)
    if there.scene.quantities[0].kind == "distance":
        assert measure.bound(there) > 0
    else:
        with pytest.raises(InvalidInput, match=r"task\.kind must be distance for a bound in px\^2, got"):
            measure.bound(there)


@pytest.mark.parametrize("estimator", ["no such", 3, None])
def test_an_estimator_that_is_none_is_refused_also_where_there_are_no_straight_edges(estimator):
    with pytest.raises(InvalidInput, match="estimator must be"):
        measure.propagate(image("ball"), picture("ball"), estimator=estimator)
