"""Rays with shared random numbers behind the first surface, against Mitsuba's own integrators."""

import numpy as np
import pytest

import render
import scenes
from render import variant
from render.build import description
from render.optics import blur_and_bin
from render.renderer import Quality, window
from render.testing import assert_images_agree
from scenes import Picture

pytestmark = [
    pytest.mark.render,
    pytest.mark.skipif(variant.choose().startswith("scalar"), reason="a scalar variant follows Mitsuba's own rays"),
]
CASES = {
    "interreflection": ("grey_floor", {}, {"floor", "cast_shadow"}),
    "depth_of_field": ("macro", {}, set()),
    "light_size": ("grey_floor", {"light": {"radius": 4.0}}, {"floor", "cast_shadow"}),
}


def small(name, updates):
    """A quarter of the pixels each way."""
    scene = scenes.load(name)
    camera = scene.camera
    updates = {"camera": {"width": 64, "height": 60, "focal_px": camera.focal_px / 4}, **updates}
    parts = {part: getattr(scene, part).model_copy(update=values) for part, values in updates.items()}
    return scene.model_copy(update=parts)


def theirs(scene, setting, active, quality):
    """Mitsuba's integrator, the same many rays in every fine pixel."""
    mitsuba, k = variant.use(variant.choose()), quality.supersample
    picture = Picture.of(scene, setting.sensor, setting.light)
    rows, columns = window(picture)
    crop = tuple(slice(part.start * k, part.stop * k) for part in (rows, columns))
    size = scene.camera.width * k, scene.camera.height * k
    made = description(mitsuba, picture, active, size, crop, quality.random_samples)
    fine = np.array(mitsuba.render(mitsuba.load_dict(made), seed=quality.seed), float)[:, :, 0]
    image = np.full((scene.camera.height, scene.camera.width), scene.noise.dark_level)
    image[rows, columns] += blur_and_bin(fine, scene.camera, k, (crop[1].start, crop[0].start))
    return image


@pytest.mark.parametrize("effect", CASES)
def test_the_image_is_that_of_mitsubas_integrator(effect, tmp_path):
    name, updates, others = CASES[effect]
    scene, plain = small(name, updates), frozenset({"attached_shadow", "fall_off", "lens_blur", *others})
    active = plain | {effect}
    setting = scene.settings[0]
    ours = [render.image(scene, *poses(setting), Quality(seed=seed), effects=active) for seed in range(4)]
    many = [theirs(scene, setting, active, Quality(seed=seed, random_samples=256)) for seed in range(4)]
    assert_images_agree(np.array(ours), np.array(many), folder=tmp_path)
    away = np.abs(np.mean(ours, 0) - np.mean(many, 0)).max() / np.max(many)
    assert away < 0.004
    without = [render.image(scene, *poses(setting), effects=plain) for _ in range(2)]
    with pytest.raises(AssertionError):  # negative control: without the effect
        assert_images_agree(np.array(without), np.array(many), folder=tmp_path)


def poses(setting):
    return setting.sensor, setting.light
