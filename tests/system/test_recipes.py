"""Recipes of bundled scenes answer as the program does: edges, circles, limbs, telecentric cameras, several lights."""

import numpy as np
import pytest

import scenes
from scenes import Picture
from tests.recipes import loaded, noisy, same
from validation.recipe.export import export
from validation.remeasured import GRADIENT
from validation.simulation import How

pytestmark = pytest.mark.render


@pytest.mark.parametrize("name", ["wedge", "plate", "telecentric_plate", "shaft", "two_lights", "low_light"])
def test_as_the_program_answers(name, tmp_path):
    """As measured, in good, dim and saturated pictures of the first setting."""
    scene = scenes.load(name)
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].lights)
    recipe, clean = loaded(export(picture, as_measured=True), tmp_path), How().by(GRADIENT).rough.image(picture)
    for light in (1.0, 0.5, 1.6):
        states = same(recipe, noisy(clean, picture, np.random.default_rng(3), light), picture, None)
    assert set(states) - {"not_visible", "displaced"}
