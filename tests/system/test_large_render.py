"""Large images: many rays only where something is measured from, and there the image is the same."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

import measure
import render
import scenes
from render import large

pytestmark = pytest.mark.render
SETTINGS = {"task1": ((30, 135), (15, 315)), "plate": ((35, 200), (20, 40)), "bracket": ((45, 135), (15, 0))}


@pytest.mark.parametrize("name", SETTINGS)
def test_only_what_nothing_is_measured_by_gets_fewer_rays(name, monkeypatch):
    """Beside required edges pixels differ by less than the rays' own noise, and so does what is measured there."""
    scene, poses = scenes.load(name), SETTINGS[name]
    picture = scenes.Picture.of(scene, *poses)
    whole = render.image(scene, *poses)
    monkeypatch.setattr(large, "LARGE", 0)
    monkeypatch.setattr(large, "LARGE_RANDOM", 0)
    sparse = render.image(scene, *poses)
    assert not np.array_equal(whole, sparse)
    off = np.abs(whole - sparse)
    near = large.near_required(picture, (slice(0, 240), slice(0, 256)), 1)
    assert 0.005 < near.mean() < 0.5  # margin: some pixels, not all
    contrast = np.ptp(whole)
    # margin: chance of few rays: half a percent of the contrast, rms
    assert np.sqrt((off[near] ** 2).mean()) < 0.005 * contrast
    assert off.max() < 0.12 * contrast  # margin: chance of one ray at an edge that nothing is measured by
    if name != "plate":
        found = [measure.distance(image, scene, *poses, "gradient") for image in (whole, sparse)]
        # margin: half a standard deviation, chance of few rays
        assert abs(found[0].value_px - found[1].value_px) < 0.5 * np.sqrt(found[0].variance_px2)


def test_measured_only_is_the_same_where_something_is_measured(monkeypatch):
    """Well inside the surroundings of required edges, means of renders differ by their rays' noise; elsewhere is
    darkness."""
    scene, poses = scenes.load("bracket"), SETTINGS["bracket"]
    picture = scenes.Picture.of(scene, *poses)
    monkeypatch.setattr(large, "LARGE_RANDOM", 0)
    few = render.Quality(edge_samples=16, random_samples=4)
    whole, only = (
        np.stack([render.image(picture, quality=replace(few, everywhere=e, seed=s + 10 * e)) for s in range(4)])
        for e in (True, False)
    )
    near = large.near_required(picture, (slice(0, 240), slice(0, 256)), 1)
    inside = binary_erosion(near, iterations=math.ceil(4 * scene.camera.blur_px) + 1, border_value=1)
    assert inside.mean() > 0.01  # margin: some pixels
    noise = np.sqrt((whole.var(0, ddof=1) + only.var(0, ddof=1))[inside].mean() / 4)
    off = (whole.mean(0) - only.mean(0))[inside]
    assert np.sqrt((off**2).mean()) < 1.1 * noise  # margin: chance of thousands of pixels: 2 %
    assert np.sqrt((off**2).mean()) > 0.9 * noise
    reach = math.ceil(6 * scene.camera.blur_px) + 5  # of blur, and of tiles of 16 fine pixels
    far = ~binary_dilation(near, np.ones((3, 3), bool), iterations=reach)
    lit = far & (whole[0] > scene.noise.dark_level + 20)
    assert lit.sum() > 20  # margin: some pixels
    assert only[:, lit] == pytest.approx(scene.noise.dark_level, abs=1e-6)
