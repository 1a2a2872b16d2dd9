"""By which estimator is measured where none is named."""

import numpy as np
import pytest

import measure
import render
import scenes
from measure import best
from scenes import Picture
from validation import simulation
from validation.remeasured import Method

NEAR, FAR = (30, 135), (15, 315)


def test_an_arrangement_that_tells_too_little_is_measured_by_edge_points(task1, monkeypatch):
    """Decided of the picture and its lights; of a scene, or without a light, nothing is known."""
    picture = Picture.of(task1, NEAR, FAR)
    assert measure.best_estimator(picture) == "arrangement"
    monkeypatch.setattr(best, "is_told", lambda *given: False)
    assert measure.best_estimator(picture) == "gradient"
    assert measure.best_estimator(picture.unlit()) == "arrangement"
    assert measure.best_estimator(task1) == "arrangement"


def test_what_is_no_plain_scene_is_measured_by_edge_points():
    bracket = scenes.load("bracket")
    assert measure.best_estimator(bracket) == "gradient"
    assert measure.best_estimator(Picture.of(bracket, NEAR, FAR)) == "gradient"


@pytest.mark.render
def test_where_an_arrangement_is_ill_conditioned_the_default_measures():
    """A pose of the ring light at which slivers make an arrangement's errors no linear ones: edge points are `ok`, and
    scatter as told over 200 images, within 4.5 standard errors."""
    scene = scenes.load("ring_light")
    picture = Picture.of(scene, (15.5, 283.7))
    assert measure.best_estimator(picture) == "gradient"
    image = render.image(picture, quality=render.Quality(supersample=2))
    assert measure.propagate(image, picture, estimator="arrangement").status == "ill_conditioned"
    off = simulation.simulated(picture, Method("gradient"))
    assert off.status == ("ok",)
    noisy = render.expose(image, scene.noise, np.random.default_rng(1), 200)
    found = measure.measure(noisy, picture, correction=off)
    assert (found.status == "ok").all()
    ratio = found.value[:, 0].var(ddof=1) / off.covariance[0, 0]
    assert ratio == pytest.approx(1.0, abs=4.5 * np.sqrt(2 / 199))
    assert abs(found.value[:, 0].mean() - np.hypot(12.5, 7.5)) < 3 * found.u[:, 0].mean()
