"""A change of the model in its one place moves planner, rendered image and measurement alike."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging import pictures, sensor
from scenes import Lens, Picture
from scenes.materials import torrance_sparrow

pytestmark = pytest.mark.render
SENSOR, LIGHT = (30, 135), (15, 315)


@pytest.fixture(autouse=True)
def forget():
    """Nothing of what is kept of a picture may outlive a change of the model."""
    _forget()
    yield
    _forget()


def _forget():
    pictures._of_picture.cache_clear()


def contrasts(scene):
    """Of the required edges: as planned, and as measured in the rendered image; grey levels."""
    picture = Picture.of(scene, SENSOR, LIGHT)
    planned = [edge.contrast for edge in planner.predict(picture).edges]
    return np.array(planned), measure.distance(render.image(picture), picture).edge_contrast


def replaced(monkeypatch, function, other):
    """Another body for a function, wherever it was imported to."""
    monkeypatch.setattr(function, "__code__", other.__code__)
    _forget()


def test_fresnel(monkeypatch):
    """Half the Fresnel reflectance: the specular part of every contrast falls alike."""
    metal = scenes.load("glossy_metal")
    noise = metal.noise.model_copy(update={"bits": None})
    metal = metal.model_copy(update={"noise": noise})
    before = contrasts(metal)
    monkeypatch.setattr(torrance_sparrow, "_mirrored", _halved(torrance_sparrow._mirrored))
    _forget()
    after = contrasts(metal)
    planned, measured = (now / then for now, then in zip(after, before, strict=True))
    assert (planned < 0.97).any()  # margin: some of the places are grazing enough
    assert measured == pytest.approx(planned, rel=0.01)


def _halved(function):
    return lambda *arguments: function(*arguments) / 2


def test_shot_noise(monkeypatch):
    """Four times the gain in the one formula: predicted, propagated, exposed and reported noise follow."""
    scene = scenes.load("low_light")
    picture = Picture.of(scene, SENSOR, LIGHT)
    image = render.image(picture)

    def found():
        shots = render.expose(image, scene.noise, np.random.default_rng(2), 100)
        return np.array([
            planner.predict(picture).variance_px2,
            measure.propagate(image, picture).variance_px2,
            measure.distance(shots, picture).variance_px2.mean(),
            shots[:, image > image.max() - 5].var(0).mean(),
        ])  # fmt: skip

    before = found()
    replaced(monkeypatch, sensor.shot_noise, lambda noise, signal: 4 * noise.gain * np.maximum(signal, 0.0))
    ratio = found() / before
    dark, bright = scene.noise.variance, scene.noise.gain * (image.max() - scene.noise.dark_level)
    assert ratio[0] > 3  # margin: the order is said: of 4 times the shot noise
    assert ratio[1:3] == pytest.approx(ratio[0], rel=0.05)
    assert ratio[3] == pytest.approx((dark + 4 * bright) / (dark + bright), rel=0.02)


def test_distortion(monkeypatch):
    """Twice the coefficients: corners are recorded elsewhere, and the distance stays what it is."""
    task1 = scenes.load("task1")
    camera = task1.camera.model_copy(update={"lens": Lens(distortion=-0.1)})
    scene = task1.model_copy(update={"camera": camera})
    picture = Picture.of(scene, SENSOR, LIGHT)
    before = render.image(picture), planner.projected_edges(planner.Pictures.of(picture)).recorded
    monkeypatch.setattr(Lens, "coefficients", property(lambda lens: tuple(2 * k for k in lens.distortion)))
    _forget()
    after = render.image(picture), planner.projected_edges(planner.Pictures.of(picture)).recorded
    assert 0.05 < np.abs(after[1] - before[1]).max() < 0.5
    exact, value = planner.predict(picture).value_px, measure.distance(after[0], picture).value_px
    assert value == pytest.approx(exact, abs=0.006)
    # margin: five times what the right image is allowed
    assert abs(measure.distance(before[0], picture).value_px - exact) > 0.03  # the old image through the new lens
