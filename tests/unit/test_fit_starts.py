"""What a fit begins with, and where it looks beside the maximum."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import planner
from measure.fitting import fit, sides, start
from measure.fitting.noise import by_repetition
from measure.fitting.parameters import Parameters
from measure.fitting.photograph import Pixels, Shots
from scenes import Picture


@pytest.fixture(scope="module")
def two(task1):
    camera = task1.camera.model_copy(update={"width": 112, "height": 104, "focal_px": 350.0})
    scene = task1.model_copy(update={"camera": camera})
    return tuple(Picture.of(scene, sensor, (25, 300)) for sensor in ((35, 120), (20, 60)))


def moved(picture, down, right, factor, dark):
    """A photograph of it, moved and made brighter."""
    return Shots(np.roll(planner.image(picture), (down, right), (0, 1)) * factor + dark, 1, None, (0,))


def test_the_first_photograph_tells_place_and_brightness(two):
    """Moved by pixels, which are so much of the object at its distance; the second, elsewhere, tells nothing."""
    parameters = Parameters.of(two)
    values, names, noise = parameters.start(), parameters.names, parameters.scene.noise
    camera = parameters.scene.camera
    shots = moved(two[0], -4, 7, 1.3, 9.0), moved(two[1], 10, -12, 2.5, 40.0)
    found = dict(zip(names, start._aligned(parameters, shots, values, noise) - values, strict=True))
    given = dict(zip(names, values, strict=True))
    pixel = camera.distance / camera.focal_px
    # margin: a start, from a search to some tenths of a pixel
    assert found["aim.right"] / pixel == pytest.approx(-7, abs=0.2)
    # margin: a start, from a search to some tenths of a pixel
    assert found["aim.down"] / pixel == pytest.approx(4, abs=0.2)
    assert found["camera.distance"] / given["camera.distance"] == pytest.approx(0, abs=0.01)
    # margin: a start, within some per cent
    assert found["camera.exposure"] / given["camera.exposure"] == pytest.approx(0.3, rel=0.05)
    dark = np.median(planner.image(two[0])[:3]) * 1.3 + 9.0
    assert found["noise.dark_level"] + given["noise.dark_level"] == pytest.approx(dark, abs=0.5)


def test_images_get_ever_sharper(two, monkeypatch):
    """From a quarter of the object on, each time half as smooth or less so; what is left is told of the sharpest."""
    parameters, asked, left = Parameters.of(two), [], []
    monkeypatch.setattr(start, "_problem", lambda parameters, shots, values, share: asked.append(share))
    monkeypatch.setattr(start, "most_likely", lambda problem, values, *rest: values + 1)
    monkeypatch.setattr(start, "_left", lambda parameters, shots, values, noise, share: left.append(share) or 0.7)
    values, rest = start._followed(parameters, (), np.zeros(4), parameters.scene.noise)
    assert asked[0] == 0.25
    assert len(asked) > 2
    # margin: about half each time
    assert all(0.4 < after / before < 0.6 for before, after in pairwise(asked))
    assert (values.tolist(), rest, left) == ([len(asked)] * 4, 0.7, [asked[-1]])


@pytest.mark.parametrize(("edge", "turns"), [(11.9, True), (12.1, False), (-11.9, True), (-12.1, False)])
def test_faces_come_into_sight_within_six_standard_errors(edge, turns, monkeypatch):
    """On either side: of a sensor's angle of standard error 2 that another parameter goes along with."""
    root = np.array([[2.0, 0.0], [3.0, 1.0]])
    white = np.linalg.inv(root)  # of a covariance root root.T: 4, 6; 6, 10
    which, values = np.array([1, 3]), np.array([7.0, 50.0, 8.0, 60.0])
    free = [None, SimpleNamespace(where=(2, 0)), None, None]
    parameters = SimpleNamespace(
        free=free,
        scene_at=lambda there: SimpleNamespace(solid=there, camera=None),
        poses_at=lambda there, k: ((there, k), None),
    )

    def facing(there, sensor):
        assert sensor[1] == 2
        assert (there[[0, 2]] == values[[0, 2]]).all()
        away = there[[1, 3]] - values[[1, 3]]
        assert away[1] == pytest.approx(away[0] * 6 / 4)
        return np.array([True, away[0] > edge])

    monkeypatch.setattr(sides, "facing", facing)
    monkeypatch.setattr(sides, "sensor_position", lambda camera, sensor: sensor)
    assert sides._turns_away(SimpleNamespace(parameters=parameters), values, 1, which, white) is turns


@pytest.mark.parametrize("chosen", [0, 5, 8])
def test_the_setting_whose_picture_is_most_alike_is_begun_with(task1, chosen):
    """A photograph of any, moved, brighter and noisy, tells from where it was taken; a pose that is given is taken."""
    camera = task1.camera.model_copy(update={"width": 112, "height": 104, "focal_px": 350.0})
    scene = task1.model_copy(update={"camera": camera, "settings": task1.settings[:12]})
    setting = scene.settings[chosen]
    shots = moved(Picture.of(scene, setting.sensor, setting.lights), 3, -2, 1.2, 5.0)
    noisy = Shots(shots.mean + np.random.default_rng(chosen).normal(0, 1, shots.mean.shape), 1, None, (0,))
    found = fit._nearest(scene, noisy, None, None, scene.noise)
    assert found.sensor == setting.sensor
    told = fit._nearest(scene, noisy, (20, 60), (25, 300), scene.noise)
    assert (tuple(told.sensor), tuple(told.lights[0])) == ((20, 60), (25, 300))


def test_repeated_photographs_tell_each_pixels_noise():
    """Of the pixels that are looked at the variance over the repetitions, of one less than so many squares."""
    rng = np.random.default_rng(3)
    images = [rng.normal(100, 3, (9, 11)) for _ in range(5)]
    pixels = Pixels(np.array([4, 7]), np.array([2, 8]), (1, 1, 2))
    signal, variance, freedom = by_repetition(Shots.of(images, (0, 1, 2, 3, 4)), pixels, np.array([50.0, 60.0]))
    assert signal.tolist() == [50.0, 60.0]
    expected = [np.var([image[y, x] for image in images], ddof=1) for x, y in ((4, 2), (7, 8))]
    assert variance == pytest.approx(expected, rel=1e-9)
    assert freedom == 4


def test_what_is_left_is_told_in_noise_and_in_a_percent_of_the_range(monkeypatch):
    """The mean square over noise's and 0.01 of the range's, both squared, of levels that were made up."""
    observed, expected = np.array([10.0, 30.0, 50.0, 90.0]), np.array([11.0, 27.0, 50.0, 95.0])
    problem = SimpleNamespace(observed=lambda: observed, expected=lambda values, noise: expected)
    monkeypatch.setattr(start, "_problem", lambda parameters, shots, values, share: problem)
    left = start._left(None, (), np.zeros(2), SimpleNamespace(variance=3.0), 0.1)
    assert left == pytest.approx((1 + 9 + 25) / 4 / (3.0 + 0.8**2), rel=1e-9)


@pytest.mark.parametrize("lefts", [[0.4], [9.0, 0.3], [9.0, 7.0, 8.0, 6.0]], ids=["at once", "second", "never"])
def test_poses_around_are_tried_where_much_is_left(lefts, monkeypatch):
    """The nominal pose alone where it explains the photograph; else the most alike of 26 around it, until one does."""
    turned, followed = [], []

    def turn(parameters, values, by):
        turned.append(by)
        return np.array([float(len(turned))])

    def follow(parameters, shots, values, noise):
        followed.append(float(values[0]))
        return values, lefts[min(len(followed), len(lefts)) - 1]

    monkeypatch.setattr(start, "_aligned", lambda parameters, shots, values, noise: values)
    monkeypatch.setattr(start, "_turned", turn)
    monkeypatch.setattr(start, "_followed", follow)
    monkeypatch.setattr(start, "_left", lambda parameters, shots, values, noise, share: abs(float(values[0]) - 17.2))
    best = start.near(SimpleNamespace(start=lambda: np.zeros(1)), (), None)
    assert len(set(turned)) == (0 if len(lefts) == 1 else 26)
    assert followed == [0.0, 17.0, 18.0, 16.0, 19.0][: len(lefts) if lefts[-1] < 1 else 1 + start._KEPT]
    assert best[0] == followed[int(np.argmin([lefts[min(i, len(lefts) - 1)] for i in range(len(followed))]))]
