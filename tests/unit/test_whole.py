"""The analytic picture against an exact one that shares nothing with it, and against the renderer."""

import numpy as np
import pytest

import planner
import render
import scenes
from scenes import InvalidInput, Picture
from tests.oracle import block_image

POSES = [((30, 135), (15, 315)), ((52, 300), (48, 40)), ((20, 10), (60, 200))]


@pytest.mark.parametrize(("sensor", "light"), POSES)
def test_against_the_exact_image(task1, sensor, light):
    """Everywhere within 0.01 grey levels of up to 200: what a polynomial of degree 4 leaves of the shading."""
    exact = block_image(task1, sensor, light)
    found = planner.image(task1, sensor, light)
    assert np.abs(found - exact).max() < 0.01
    assert np.ptp(found) > 80  # margin: that there is a picture


def test_against_the_renderer_with_a_rolled_camera(task1):
    """Within 2 grey levels, rms 0.17 on the object: the renderer's own error at edges."""
    scene = task1.model_copy(update={"camera": task1.camera.model_copy(update={"roll_deg": 17.0})})
    rendered, found = render.image(scene, (40, 160), (20, 280)), planner.image(scene, (40, 160), (20, 280))
    inside = rendered > scene.noise.dark_level + 1
    assert np.abs(rendered - found).max() < 2
    assert np.sqrt(np.mean((rendered - found)[inside] ** 2)) < 0.17
    # margin: the order is said
    assert np.abs(planner.image(task1, (40, 160), (20, 280)) - rendered).max() > 50  # without the roll


def test_some_of_the_pixels(task1, rng):
    """They are what they are in the whole picture, by whatever pixels are drawn beside them."""
    whole, where = planner.image(task1, *POSES[0]), rng.random((240, 256)) < 0.2
    found = planner.image(task1, *POSES[0], where)
    assert found[where] == pytest.approx(whole[where], rel=1e-12)
    assert (found[~where] == task1.noise.dark_level).all()


def test_refusals(task1):
    with pytest.raises(InvalidInput, match="scene must be one convex body before darkness, got one in which"):
        planner.image(scenes.load("bracket"), (30, 135), (15, 315))
    with pytest.raises(InvalidInput, match="scene must be without textures, got some"):
        planner.image(scenes.load("printed_label"), (30, 135), (15, 315))
    with pytest.raises(InvalidInput, match="light must be given, got none"):
        planner.image(Picture.of(task1, (30, 135)))
