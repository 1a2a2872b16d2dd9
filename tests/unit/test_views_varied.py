"""Polarisers, lamp and filter of each of several pictures: against every band tried at held poses, and without."""

import json
from dataclasses import replace

import numpy as np
import pytest

import planner
import scenes
from planner.design import bands_of, own_choice, with_choice
from planner.view_sets import View
from scenes import InvalidInput
from tests.commands import ice

SENSOR, LIGHT = (45.0, 280.0), (50.0, 90.0)


@pytest.fixture(scope="module")
def copper():
    return scenes.load("copper")


@pytest.fixture(scope="module")
def held(copper):
    return planner.plan_views(copper, 2, sensor=SENSOR, light=LIGHT, vary=("band",))


def test_the_best_band_of_held_poses_is_that_of_all_tried_one_by_one(copper, held):
    """Negative control: the scene's own lamp is not it."""
    own = own_choice(copper)
    variances = {
        (lamp, filter_): planner.predict(
            with_choice(copper, replace(own, lamp=lamp, filter=filter_)), SENSOR, LIGHT
        ).variance_object
        for lamp, filter_ in bands_of(copper)
    }
    one, two = held.sets
    chosen = one.views[0].choice
    best = min(variances, key=lambda band: variances[band])
    assert (chosen.lamp, chosen.filter) == best != (None, None)
    assert one.minimised == pytest.approx(variances[best], rel=1e-9)
    assert two.minimised == pytest.approx(variances[best] / 2, rel=1e-9)
    assert held.over_own(0) == pytest.approx(variances[None, None] / variances[best], rel=1e-9)
    assert held.own[0].minimised == pytest.approx(planner.predict(copper, SENSOR, LIGHT).variance_object, rel=1e-9)


def test_a_picture_is_of_the_scene_with_its_choice(copper, held):
    (view,) = held.sets[0].views
    assert view.picture.scene == with_choice(copper, view.choice, "time")
    assert planner.predict(view.picture).variance_object == view.prediction.variance_object
    assert held.own[0].views[0].picture.scene == copper
    assert View(view.sensor, view.light, view.prediction).place != view.place


def test_polarisers_are_turned_beyond_those_first_tried(copper):
    """Tried every 30 degrees, then by 15 and 7.5: what is found is no worse than any of those tried here, every 15."""
    found = planner.plan_views(copper, 1, sensor=SENSOR, light=LIGHT, vary=("polarisation",), hold="white")
    own = own_choice(copper)
    angles = [None, *np.arange(0.0, 180.0, 15.0)]
    worlds = (with_choice(copper, replace(own, polarisation_deg=angle), "white") for angle in angles)
    least = min(planner.predict(world, SENSOR, LIGHT).variance_object for world in worlds)
    assert found.sets[0].minimised <= least * (1 + 1e-9)
    assert found.sets[0].minimised < 0.99 * found.own[0].minimised


def test_what_cannot_be_varied_is_told_in_a_line(copper):
    with pytest.raises(InvalidInput, match="vary must be left out with share, got band"):
        planner.plan_views(copper, 2, vary=("band",), share="light")
    with pytest.raises(InvalidInput, match=r"vary must be left out but for one light that is free, got 2 light\(s\)"):
        planner.plan_views(scenes.load("two_lights"), 2, vary=("analyser",))


def test_command():
    poses = "--sensor", "45,280", "--light", "50,90"
    told = json.loads(ice("plan", "copper", "--views", 1, *poses, "--vary", "band", "--no-check", "--json").stdout)
    assert (told["vary"], told["hold"]) == (["band"], "time")
    (one,) = told["views"]
    assert one["over_own"] > 1.2
    assert one["poses"][0]["choice"]["lamp"] == "red LED"
    assert one["poses"][0]["exposure_time"] == 1.0
