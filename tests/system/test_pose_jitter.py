"""Sensor and light set with a ruler, anew for each picture: the distance scatters as predicted."""

import numpy as np
import pytest
from scipy import stats

import planner
import scenes
from render import Quality
from validation import run

pytestmark = pytest.mark.render
RENDERS = 50


def test_measured_variance_is_that_of_noise_and_poses_together(task1, tmp_path):
    """50 pictures, each rendered from its own pose: within the sampling of a variance (0.1 %)."""
    jitter = scenes.Jitter(sensor_deg=0.4, light_deg=0.4)
    scene = task1.model_copy(update={"jitter": jitter, "settings": task1.settings[:1]})
    found = run(scene, RENDERS, out=tmp_path, workers=1, quality=Quality(2, 1, 16))
    measured, predicted = found.rows[0].main.empirical, found.rows[0].main.propagated
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], RENDERS - 1) / (RENDERS - 1)
    assert low < measured / predicted < high  # margin: chance: a chi-square interval of 99.9 %
    spread = float(planner.pose_scatter(scene, np.array([list(task1.settings[0].sensor)])).covariance[0, 0, 0])
    assert not measured / (predicted - spread) < high  # negative control: the noise alone


def test_exact_poses_add_nothing(task1):
    spread = planner.pose_scatter(task1, np.array([[30.0, 135.0], [0.0, 0.0]]))
    assert spread.covariance.tolist() == [[[0.0]], [[0.0]]]
    assert spread.bias.tolist() == [[0.0], [0.0]]


def test_spread_is_that_of_sampled_poses(task1, rng):
    """Against distances projected from 4000 shaken poses: their variance within 10 % (4.5 sigma)."""
    from imaging.geometry.projection import project
    from render import shaken

    scene = task1.model_copy(update={"jitter": scenes.Jitter(sensor_deg=0.2)})
    sensor = task1.settings[0].sensor
    ends = np.array([scene.solid.vertex(corner.vertex) for corner in scene.task.corners])
    poses = np.array([list(shaken(scene, "sensor", sensor, rng)) for _ in range(4000)])
    image = project(ends, poses, scene.camera)
    sampled = np.linalg.norm(image[:, 1] - image[:, 0], axis=-1).var(ddof=1)
    spread = planner.pose_scatter(scene, np.array([list(sensor)]))
    assert sampled == pytest.approx(float(spread.covariance[0, 0, 0]), rel=0.1)
