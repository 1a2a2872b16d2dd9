"""What is seen of a floor has light from the part above it, as rays tell it."""

import numpy as np
import pytest

import render
import scenes
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import project
from imaging.light.behind import seen_at
from imaging.pictures import Pictures
from scenes import Picture


@pytest.mark.render
@pytest.mark.parametrize(("sensor", "light"), [((16.5, 352.8), (17.9, 77.4)), ((20, 100), (25, 230))])
def test_through_a_hole_a_floor_has_the_light_of_the_part_above_it(sensor, light):
    """Of its spot and of its shadow; without that light it is tens of standard deviations of the noise too dark."""
    plate = scenes.load("plate")
    scene = plate.with_(floor={"reflectance": 0.6, "height": float(plate.solid.vertices[:, 2].min()) - 1.7})
    picture = Picture.of(scene, sensor, light)
    pictures, hole = Pictures.of(picture), scene.solid.circles[0]
    middle = np.rint(project(hole.centre[None], np.array(list(picture.sensor)), scene.camera)[0])
    around = np.stack(np.meshgrid(*[np.arange(-9, 10, 3)] * 2), -1).reshape(-1, 2) + middle
    rendered = np.mean([render.image(picture, quality=render.Quality(seed=k, supersample=2)) for k in range(2)], 0)
    x, y = around.astype(int).T
    even = np.array([np.ptp(rendered[j - 2 : j + 3, i - 2 : i + 3]) < 8 for i, j in zip(x, y, strict=True)])
    assert even.sum() > 10
    levels = rendered[y, x] - scene.noise.dark_level
    whole, direct = (seen_at(each, around - image_centre(scene.camera)) for each in (pictures, pictures.glanced))
    assert np.abs(whole - levels)[even].mean() < 4.0
    assert np.abs(direct - levels)[even].mean() > 9.0
