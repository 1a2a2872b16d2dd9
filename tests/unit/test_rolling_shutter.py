"""A rolling shutter before a part that moves: what it records, and what is measured in it."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.geometry.lens import image_centre, recorded, undistorted
from imaging.geometry.projection import project_ideal
from planner.budgeting.budgets import budget
from scenes import InvalidInput, Picture
from scenes.cameras.lens import Lens
from scenes.numbers import with_number

LINE_US = 20.0


@pytest.fixture(scope="module")
def moving():
    """task1 as a sensor of 20 us a line sees it when it moves by 1,000 px a second to the right, 600 up."""
    scene = scenes.load("task1")
    length = scene.camera.distance / scene.camera.focal_px
    return scene.with_(camera={"line_time_us": LINE_US, "motion": (1000 * length, -600 * length)})


@pytest.fixture(scope="module")
def image(moving):
    return render.image(moving, moving.settings[5].sensor, moving.settings[5].lights)


def test_a_point_is_where_it_was_when_its_row_was_read(moving, rng):
    camera, still = moving.camera, rng.uniform(0, 240, (50, 2))
    seen, centre, u = recorded(still, camera), image_centre(camera), np.array([1000.0, -600.0])
    time = 1e-6 * LINE_US * (seen[:, 1] - centre[1])
    assert seen == pytest.approx(still + time[:, None] * u, abs=1e-9)
    assert undistorted(seen, camera) == pytest.approx(still, abs=1e-9)
    assert np.abs(seen - still).max() > 1


@pytest.mark.parametrize("distortion", [0.0, (0.1, -0.05, 0.01, 0.02, 0.0)])
def test_slope_of_a_sheared_lens_is_its_difference(distortion, rng):
    lens, points, step = Lens(distortion=distortion, shear=(0.02, -0.01)), rng.uniform(-0.3, 0.3, (20, 2)), 1e-6
    for axis in range(2):
        away = step * np.eye(2)[axis]
        difference = (lens.bent(points + away) - lens.bent(points - away)) / (2 * step)
        assert lens.slope(points)[..., axis] == pytest.approx(difference, rel=1e-6, abs=1e-8)


def test_known_motion_is_taken_off_and_unknown_motion_is_a_bias(moving, image):
    """Rendered and measured: with the motion known, the part's value; without, what the shear makes of it."""
    still = scenes.load("task1")
    setting = still.settings[5]
    picture = Picture.of(moving, setting.sensor, setting.lights)
    known, told = measure.propagate(image, picture).measurands, planner.predict(picture)
    sigma = np.sqrt(known.covariance_image[0, 0])
    assert known.status == ("ok",)
    assert abs(known.bias_image[0]) < 0.1 * sigma
    assert told.variance_px2 == pytest.approx(sigma**2, rel=0.1)
    ignored = measure.propagate(image, Picture.of(still, setting.sensor, setting.lights)).measurands
    vertices = [still.solid.vertices[still.solid.vertex_names.index(end.vertex)] for end in still.task.corners]
    ends = recorded(project_ideal(np.array(vertices), np.array(list(setting.sensor)), still.camera), moving.camera)
    expected = np.linalg.norm(ends[1] - ends[0]) - told.value_px
    assert abs(expected) > 5 * sigma
    assert ignored.bias_image[0] == pytest.approx(expected, abs=0.2 * sigma)


def test_what_follows_follows_anew_and_contradictions_are_told(moving):
    assert moving.with_(camera={"line_time_us": 0.0}).camera.lens.shear == (0.0, 0.0)
    twice = moving.with_(camera={"line_time_us": 2 * LINE_US}).camera.lens.shear
    assert twice[0] == pytest.approx(0.04 / 1.024)
    with pytest.raises(InvalidInput, match=r"camera.motion must be less than half a row in line_time_us, got 0.6"):
        moving.with_(camera={"motion": (0.0, 30_000 * moving.camera.distance / moving.camera.focal_px)})


def test_what_is_not_known_of_the_speed_is_a_row_of_the_budget(moving, image):
    """It is what measuring with a speed that is 5 % wrong makes of the value."""
    setting, speed = moving.settings[5], moving.camera.motion[0]
    scene = moving.with_(uncertain=[{"key": "camera.motion[0]", "sd": 0.05 * speed}])
    found = budget(Picture.of(scene, setting.sensor, setting.lights)).measurands[0]
    (row,) = [each for each in found.contributions if each.source == "camera.motion[0]"]
    wrong = [
        measure.propagate(
            image, Picture.of(with_number(scene, "camera.motion[0]", f * speed), setting.sensor, setting.lights)
        )
        for f in (1.05, 0.95)
    ]
    step = (wrong[0].measurands.value[0] - wrong[1].measurands.value[0]) / 2
    assert row.contribution == pytest.approx(abs(step), rel=0.02)
