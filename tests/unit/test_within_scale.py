"""A search leaves out what the end of the sensor's scale cuts off, if anything else measures."""

import numpy as np
import pytest

import scenes
from planner.search.exhaustive import best_pair
from planner.search.objective import SearchProblem, cut_off
from tests.bounded import all_values, drawn_poses, values_within


def too_bright(name, gain, times):
    scene = scenes.load(name)
    return SearchProblem.of(
        scene.with_(noise={"gain": gain}, camera={"exposure": times * scene.camera.exposure}), "calibrated", "object"
    )


@pytest.mark.parametrize("gain", [0.0, 0.1])
@pytest.mark.parametrize(("name", "times"), [("task1", 1.6), ("bracket", 2.0), ("anodised", 3.0)])
def test_the_best_pair_of_a_scene_that_is_too_bright_is_within_the_scale(name, times, gain):
    """By any of the searches, with shot noise and without; what is cut off would be better."""
    problem, rng = too_bright(name, gain, times), np.random.default_rng(4)
    poses = drawn_poses(rng, 15), drawn_poses(rng, 25)
    found = best_pair(problem, *poses, lambda *_: None)
    assert found.within_scale
    assert not problem.cuts_off(poses[0][found.sensor], poses[1][found.light])
    assert all_values(problem, *poses).min() < 0.9 * found.variance
    # where nothing at all is cut off; a little may be, or a level be near the end beside what is used of an edge
    assert found.variance == pytest.approx(np.nanmin(values_within(problem, *poses)), rel=0.5)


@pytest.mark.parametrize("gain", [0.0, 0.1, 1.0])
def test_shot_noise_does_not_hide_what_is_cut_off(gain):
    """Of pairs in which nothing is cut off none counts so, of the others most."""
    problem, rng = too_bright("task1", gain, 1.6), np.random.default_rng(5)
    poses = drawn_poses(rng, 20), drawn_poses(rng, 30)
    values, uncut = all_values(problem, *poses), values_within(problem, *poses)
    cut = cut_off(problem.errors(poses[0][:, None], poses[1][None]))
    measured = np.isfinite(values)
    assert not cut[measured & np.isfinite(uncut)].any()
    assert cut[measured & np.isnan(uncut)].mean() > 0.5
