"""Which fine pixels are rendered again, by distances of pixels from edges and circles that a pinhole shows."""

import numpy as np
import pytest

import scenes
from imaging.features.projected_edges import circles
from render.adaptive import crossed
from render.surroundings import near_required
from scenes import Picture, Pose
from tests.oracle import pinhole


def segments(scene, sensor):
    """Ends (k, 2, 2) of required edges' images, and of the pieces of required circles', px."""
    solid, task = scene.solid, scene.task
    names = dict.fromkeys(name for corner in (task.start, task.end) for name in getattr(corner, "edges", ()))
    rows = [solid.vertices[list(solid.edge(name).ends)] for name in names]
    return [pinhole(row - np.array(scene.camera.look_at), sensor, scene.camera) for row in rows]


def test_near_circles():
    """The upper rim of a plate's bore: no pixel within the reach of it is left out."""
    plate = scenes.load("plate")
    sensor, camera, locator = (30.0, 135.0), plate.camera, plate.locator
    picture = Picture.of(plate, Pose(*sensor), Pose(15, 200))
    found = near_required(picture, (slice(0, camera.height), slice(0, camera.width)), 1)
    reach = locator.window_px + 4 * locator.scale_px + 1
    t = np.linspace(0, 2 * np.pi, 4000)
    taken = 0
    for name in circles(plate):
        circle = plate.solid.circle(name)
        ring = circle.centre + circle.radius * np.column_stack([np.cos(t), np.sin(t), 0 * t])
        places = pinhole(ring - np.array(camera.look_at), sensor, camera)
        low, high = np.floor(places.min(0) - reach - 2).astype(int), np.ceil(places.max(0) + reach + 2).astype(int)
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
        away = np.min([np.hypot(x - px, y - py) for px, py in places[::20]], axis=0)
        inside = found[low[1] : high[1], low[0] : high[0]]
        assert inside[away < reach - 0.2].all()
        taken += 1
    assert taken


def test_crossed_with_surroundings():
    """A step between two columns marks both, and within a reach of 2 two more on each side; not a faint step."""
    fine = np.zeros((9, 12))
    fine[:, 6:] = 10.0
    assert np.flatnonzero(crossed(fine)[4]).tolist() == [5, 6]
    assert np.flatnonzero(crossed(fine, 2)[4]).tolist() == [3, 4, 5, 6, 7, 8]
    assert not crossed(fine, step=1.0).any()
    assert crossed(fine, step=0.99).any()
    assert not crossed(np.zeros((3, 3))).any()


@pytest.mark.parametrize(("top", "left", "height", "width", "k"), [(0, 0, 240, 256, 1), (30, 90, 110, 70, 3)])
def test_pixels_near_required_edges_of_a_large_image(top, left, height, width, k, task1):
    """With four standard deviations of scale and blur together, a square each way, around edges that are shown."""
    sensor, camera, locator = (30.0, 135.0), task1.camera, task1.locator
    crop = slice(k * top, k * (top + height)), slice(k * left, k * (left + width))
    found = near_required(Picture.of(task1, Pose(*sensor), Pose(15, 315)), crop, k)
    reach = int(np.ceil(locator.window_px + 4 * (locator.scale_px**2 + camera.blur_px**2) ** 0.5 + 1))
    expected = np.zeros((height, width), bool)
    for start, stop in segments(task1, sensor):
        for x, y in np.rint(start - [left, top] + np.linspace(0, 1, 4000)[:, None] * (stop - start)).astype(int):
            if 0 <= x < width and 0 <= y < height:
                expected[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1] = True
    # margin: counted pixels, at corners of the line of pixels
    assert (found != expected).mean() < 4e-3  # at corners of the line of pixels
    assert 0.1 < found.mean() < 0.9  # margin: some pixels, not all


def test_only_pixels_that_are_asked_for_are_crossed(rng):
    """The same of them as of the whole image, also at its border."""
    fine, asked = rng.random((9, 12)).round(1), rng.random((9, 12)) < 0.5
    for step in (0.6, 0.7, 0.8):
        expected = crossed(fine, step=step) & asked
        assert 0 < expected.sum() < asked.sum()
        assert (crossed(fine, step=step, where=asked) == expected).all()


def test_pixels_near_required_edges_are_sought_once_for_all_lights(task1):
    """Another light's picture has the same mask, which nobody can change; another sensor's has another."""
    crop, dark = (slice(0, 480), slice(0, 512)), Picture.of(task1, Pose(30, 135))
    first = near_required(Picture.of(task1, Pose(30, 135), Pose(15, 315)), crop, 2)
    assert near_required(Picture.of(task1, Pose(30, 135), Pose(20, 300)), crop, 2) is first
    assert near_required(dark, crop, 2) is first
    with pytest.raises(ValueError, match="read-only"):
        first[0, 0] = True
    assert (near_required(Picture.of(task1, Pose(31, 135), Pose(15, 315)), crop, 2) != first).any()
    assert (near_required(dark, crop, 2, 1.0) != first).any()
