"""Borders of shadows beside an edge: where they are found, and what they do to the crossings there."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.geometry.projection import from_axis
from imaging.light.behind import seen_at, shadow_steps
from imaging.pictures import Pictures
from tests.system.test_offsets_across_heights import stepped

SENSOR, LIGHT = (20.0, 140.0), (40.0, 310.0)


def floored():
    """A block on a bright floor, its picture, and places on the border of its shadow: of a point light, a straight
    line from corner to corner."""
    scene = scenes.load("grey_floor").model_copy(update={"obstacles": ()})
    pictures = Pictures.of(scene, np.array(SENSOR), np.array(LIGHT))
    top = scene.solid.vertices[:, 2].max()
    corners = scene.solid.vertices[np.abs(scene.solid.vertices[:, 2] - top) < 1e-9]
    light, ground = pictures.lights_at[0], scene.floor.height
    shadows = corners + (corners - light) * ((corners[:, 2] - ground) / (light[2] - corners[:, 2]))[:, None]
    return scene, pictures, corners, shadows, light


def test_where_a_shadow_ends_light_steps():
    """Across the border, from 2 px within the shadow to 2 px beyond: the one step is between the middle two."""
    scene, pictures, _, shadows, light = floored()
    far = np.argsort(-np.linalg.norm(shadows[:, :2] - light[:2], axis=1))[:3]  # the farthest, and its neighbours
    away = np.array([-2, -1, -0.5, -0.1, 0.1, 0.5, 1, 2.0])
    for other in far[1:]:
        border = shadows[far[0]] + np.linspace(0.3, 0.7, 5)[:, None] * (shadows[other] - shadows[far[0]])
        ends = from_axis(shadows[[far[0], other]], np.array(SENSOR), scene.camera)
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        out = np.array([-along[1], along[0]])
        middle = from_axis(shadows.mean(0)[None], np.array(SENSOR), scene.camera)[0]
        out *= np.sign(out @ (ends[0] - middle))
        at = from_axis(border, np.array(SENSOR), scene.camera)[:, None] + away[:, None] * out
        steps = shadow_steps(pictures, at)
        assert (steps[:, :3] == 0).all()
        assert (steps[:, 4:] == 0).all()
        lit = seen_at(pictures.glanced, at[:, 4])
        assert (lit > 0).all()
        np.testing.assert_allclose(steps[:, 3], lit - seen_at(pictures.glanced, at[:, 3]), rtol=1e-12)


def test_between_surfaces_and_in_one_light_nothing_steps():
    """Across the block's own upper edges, whose faces differ, and on its lit top."""
    scene, pictures, corners, _, _ = floored()
    middle = corners.mean(0)
    line = middle + np.linspace(-0.3, 0.3, 9)[:, None] * (corners[0] - middle)
    assert not shadow_steps(pictures, from_axis(line, np.array(SENSOR), scene.camera)[None]).any()


@pytest.fixture(scope="module")
def step(tmp_path_factory):
    return stepped(tmp_path_factory.mktemp("part"), 600.0)


@pytest.mark.render
def test_a_border_beside_an_edge_moves_its_crossings_as_told(step):
    """2 px beside: the step's upper edge is 0.4 px off, 18 standard deviations; without its shadow it would be `ok`."""
    sensor, light = (31.0, 194.0), (41.0, 159.0)
    told = planner.predict(step, sensor, light).measurands
    clean = render.image(step, sensor, light)
    found = measure.propagate(clean, step, sensor, light, estimator="gradient").measurands
    off = found.value[0] - told[0].value_object
    assert off > 10 * np.sqrt(told[0].variance_object)
    assert told[0].bias_object == pytest.approx(off, rel=0.12)
    assert [each.status for each in told[:2]] == ["clutter", "ok"]
    assert found.status[0] == "clutter"
    assert abs(found.value[1] - told[1].value_object) < np.sqrt(told[1].variance_object)  # six renders: up to 0.51
