"""Noise that rows and columns share: how it is drawn, what it does to edges, and what is told of it."""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.features.locator import kappa2, reach
from imaging.row_noise import of_lines, of_points, shared
from measure.calibration import _covered
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from scenes import InvalidInput, Noise, Picture

ROWS = Noise(sigma=1.0, row_sigma=0.6, column_sigma=0.2, dark_level=20.0)
_SIZE, _SIDE, _BLUR, _COUNT = 96, 60.0, 0.6, 400


def test_pictures_have_it():
    shots = render.expose(np.full((40, 50), 100.0), ROWS, np.random.default_rng(1), 500)
    assert shots.var() == pytest.approx(1.0 + 0.36 + 0.04, rel=0.05)  # margin: 6 standard errors, of rows' number
    assert render.variance(np.full((4, 5), 100.0), ROWS) == pytest.approx(1.4)
    rows, columns = shots.mean(2), shots.mean(1)
    assert rows.var() == pytest.approx(0.36 + 1 / 50 + 0.04 / 50, rel=0.08)
    assert columns.var() == pytest.approx(0.04 + 1 / 40 + 0.36 / 40, rel=0.08)
    apart = shots - shots.mean((1, 2), keepdims=True)
    assert np.mean(apart[:, :, 1:] * apart[:, :, :-1]) == pytest.approx(0.35, rel=0.1)
    assert np.mean(apart[:, 1:] * apart[:, :-1]) == pytest.approx(0.03, abs=0.01)


def test_a_part_of_the_picture_has_the_numbers_of_the_whole():
    image, some = np.full((40, 50), 100.0), np.zeros((40, 50), bool)
    some[18:22, 33:40] = True
    whole, part = (render.expose(image, ROWS, np.random.default_rng(2), 3, where) for where in (None, some))
    assert (whole[:, some] == part[:, some]).all()


def _edges(degrees, noise):
    """A turned square that is far larger than its blur: its image, 100 grey levels above darkness, and layout."""
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * _SIDE / 2 @ turn.T + _SIZE / 2 + np.array([0.3, 0.7])
    optics = Optics((_SIZE, _SIZE), _BLUR, noise.variance, noise=noise, dark_level=noise.dark_level)
    return noise.dark_level + 100 * _covered(corners.tobytes(), _BLUR), polygon_layout(corners, optics)


@pytest.mark.parametrize("degrees", [0.0, 1.0, 4.0, 30.0])
def test_lines_scatter_as_told(degrees):
    """Of each side of a square the variance of its middle: measured, as reported, and by the closed form."""
    noise = Noise(sigma=0.3, row_sigma=1.2, dark_level=20.0)
    clean, layout = _edges(degrees, noise)
    shots = render.expose(clean, noise, np.random.default_rng(3), _COUNT)
    found = find_shape(shots, layout, "gradient", judged=False)
    away = layout.ends.mean(1) - found.points
    measured = np.einsum("nei,nei->ne", found.normals, away).var(0, ddof=1)
    turned = np.stack([found.normals[..., 1], -found.normals[..., 0]], -1)
    weights = np.stack([np.ones(away.shape[:2]), np.einsum("nei,nei->ne", turned, away)], -1)
    lines = found.lines.reshape(_COUNT, 4, 2, 4, 2)[:, range(4), :, range(4)].swapaxes(0, 1)
    reported = np.einsum("nei,neij,nej->e", weights, lines, weights) / _COUNT
    assert measured == pytest.approx(reported, rel=0.3)  # margin: 4 standard errors
    along = layout.ends[:, 1] - layout.ends[:, 0]
    normals = np.stack([-along[:, 1], along[:, 0]], -1) / _SIDE
    used, one = np.full(4, _SIDE - 2 * reach(1.0, _BLUR)), np.ones(4)
    white = kappa2(1.0, _BLUR) * 2 * np.sqrt(np.pi) * noise.variance / used
    closed = (white + of_lines(noise, one / used, 0 * one, used, normals, _BLUR, 1.0)) / 100**2
    assert measured == pytest.approx(closed, rel=0.35)  # margin: 4 standard errors
    if degrees == 0:
        assert (measured[[0, 2]] > 20 * white[[0, 2]] / 100**2).all()  # or nothing was tested
        assert (measured[[1, 3]] < 1.5 * white[[1, 3]] / 100**2).all()


def test_points_of_an_edge_are_its_line():
    """The closed form over frequencies is the double sum over points."""
    noise, t = Noise(sigma=1.0, row_sigma=0.7, column_sigma=0.4), np.linspace(-20, 20, 801)
    for degrees in (0.0, 3.0, 20.0, 90.0):
        a = np.radians(degrees)
        along, normal = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
        weight = (0.025 + 0.002 * t) * (t[1] - t[0])
        weight[[0, -1]] /= 2
        points = of_points(
            noise, t[:, None] * along, np.broadcast_to(normal, (t.size, 2)), np.full(t.size, 0.05), 0.6, 1.3
        )
        line = of_lines(noise, np.array(0.025), np.array(0.002), np.array(40.0), normal, 0.6, 1.3)
        assert weight @ points @ weight == pytest.approx(float(line), rel=2e-3)


@pytest.mark.render
def test_prediction_and_propagation_of_a_scene_tell_it(rendered_plate):
    """Rows of 3, columns of 2 grey levels beside noise of 2.4: a width and a bore, measured, propagated, predicted."""
    picture, clean = rendered_plate
    striped = {**picture.scene.noise.model_dump(exclude_none=True), "row_sigma": 3.0, "column_sigma": 2.0}
    scene = picture.scene.with_(noise=striped)
    loud = Picture.of(scene, picture.sensor, picture.lights)
    told = np.diag(measure.propagate(clean, loud, estimator="gradient").measurands.covariance)
    quiet = np.diag(measure.propagate(clean, picture, estimator="gradient").measurands.covariance)
    predicted = np.array([each.variance_object for each in planner.predict(loud).measurands])
    assert predicted == pytest.approx(told, rel=0.2)
    assert (told > 1.01 * quiet).all()
    assert told.max() > 2 * quiet[told.argmax()]
    shots = render.expose(clean, scene.noise, np.random.default_rng(4), 150)
    found = measure.measure(shots, loud, estimator="gradient")
    assert found.value.var(0, ddof=1) == pytest.approx(told, rel=0.5)  # margin: 4 standard errors
    assert np.diagonal(found.covariance, axis1=1, axis2=2).mean(0) == pytest.approx(told, rel=0.1)


@pytest.fixture(scope="module")
def rendered_plate():
    plate = scenes.load("plate")
    asked = [each.model_dump(exclude_none=True) for each in plate.measurands if each.name in ("bore", "length")]
    picture = Picture.of(plate.with_(measurands=asked), (10, 270), plate.settings[0].lights)
    return picture, render.image(picture, quality=render.Quality(everywhere=False))


def test_which_pixels_share_what():
    parts, variance = shared(ROWS, np.array([0, 1, 5]), 5)
    assert parts.toarray().tolist() == [[1, 0, 1, 0], [1, 0, 0, 1], [0, 1, 1, 0]]
    assert variance == pytest.approx([0.36, 0.36, 0.04, 0.04])


def test_what_cannot_be_told_is_refused():
    task1 = scenes.load("task1")
    striped = {**task1.noise.model_dump(exclude_none=True), "row_sigma": 0.5}
    with pytest.raises(InvalidInput, match=r"row_sigma and column_sigma must be 0 with colour filters, got 0.5 and 0"):
        task1.with_(noise={**striped, "colour": {"pattern": "RGGB"}})
    forms = [{"name": "front", "kind": "straightness", "features": [{"edge": "e7"}]}]
    with pytest.raises(InvalidInput, match="row_sigma and column_sigma must be 0 for forms, got some with front"):
        task1.with_(noise=striped, task=None, measurands=forms)
    scene = task1.with_(noise=striped)
    assert measure.best_estimator(scene) == "gradient"
    with pytest.raises(InvalidInput, match=r"with noise.row_sigma or column_sigma, which pixels share, got"):
        measure.measure(np.zeros((240, 256)), scene, (30, 135), (15, 315), estimator="strip")
