"""The bound from an image, and of a polygon's corners, against the information in exact images."""

import numpy as np
import pytest

import measure
import planner
import scenes
from measure.bounds import corner_bound
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from scenes import InvalidInput, Noise
from tests.oracle import block_image, polygon_image

SENSOR, LIGHT = (30.0, 135.0), (15.0, 315.0)
CORNERS = np.array([[12.3, 10.6], [40.1, 14.2], [36.7, 38.4], [9.2, 33.9]])


@pytest.fixture(scope="module")
def image():
    return block_image(scenes.load("task1"), SENSOR, LIGHT)


def test_from_an_exact_image_it_is_the_planners(task1, image):
    """Places and levels are those of the description; twice the noise is four times the variance."""
    told = measure.bound(task1, SENSOR, LIGHT)
    assert measure.image_bound(image, task1, SENSOR, LIGHT) == pytest.approx(told, rel=2e-3)
    noisier = task1.model_copy(update={"noise": Noise(sigma=2 * np.sqrt(task1.noise.variance))})
    assert measure.image_bound(image, noisier, SENSOR, LIGHT) == pytest.approx(4 * told, rel=5e-3)


def test_no_bound(task1, image):
    assert measure.image_bound(np.full(image.shape, 9.0), task1, SENSOR, LIGHT) == float("inf")
    with pytest.raises(InvalidInput, match="scene must be a convex body before darkness for a bound"):
        measure.image_bound(image, scenes.load("grey_floor"), SENSOR, LIGHT)


def test_corners_of_a_polygon():
    """Fisher information by central differences; the background, and the level and its slopes, are unknown."""
    shape, blur, contrast, variance = (50, 52), 0.7, 80.0, 9.0
    found = corner_bound(polygon_layout(CORNERS, Optics(shape, blur, 1.0, 1.0, 3.0)), contrast, variance)
    columns = []
    for i in range(8):
        step = 1e-3 * (np.arange(8) == i).reshape(4, 2)
        ahead, behind = (polygon_image(CORNERS + s * step, shape, blur, contrast) for s in (1, -1))
        columns.append((ahead - behind).ravel() / 2e-3)
    inside, (y, x) = polygon_image(CORNERS, shape, blur, 1.0), np.mgrid[: shape[0], : shape[1]]
    columns += [part.ravel() for part in (inside, inside * x, inside * y, np.ones(shape))]
    jacobian = np.stack(columns, 1)
    expected = variance * np.linalg.inv(jacobian.T @ jacobian)[:8, :8]
    assert found.shape == (8, 8)
    assert np.diag(found) == pytest.approx(np.diag(expected), rel=0.012)
    assert found == pytest.approx(expected, abs=0.012 * np.diag(expected).max())


def test_what_cannot_be_measured_takes_no_bound_from_the_others():
    """Seen from above the front is too short: the top has the bound that it has alone."""
    scene, sensor, light = scenes.load("two_lights"), (0.05, 277), ((40, 190), (30, 100))
    told = planner.predict(scene, sensor, light, "bound").measurands
    alone = scene.model_copy(update={"measurands": scene.measurands[:1]})
    (top,) = planner.predict(alone, sensor, light, "bound").measurands
    assert [np.isfinite(each.variance_object) for each in told] == [True, False]
    assert told[0].variance_object == pytest.approx(top.variance_object, rel=0.1)  # margin: edges that lie beside


def test_a_hidden_edge_takes_no_bound_from_what_is_seen():
    """The front faces away: the top, whose edges are seen, is told as well as it is alone."""
    scene, sensor, light = scenes.load("two_lights"), (40, 7), ((40, 190), (30, 100))
    told = planner.predict(scene, sensor, light, "bound").measurands
    alone = scene.model_copy(update={"measurands": scene.measurands[:1]})
    (top,) = planner.predict(alone, sensor, light, "bound").measurands
    assert [each.status for each in told] == ["ok", "not_visible"]
    assert np.isinf(told[1].variance_object)
    assert told[0].variance_object == pytest.approx(top.variance_object, rel=0.1)  # margin: edges that lie beside
