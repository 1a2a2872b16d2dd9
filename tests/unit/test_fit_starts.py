"""What a fit begins with, and where it looks beside the maximum."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import planner
from measure.fitting import fit, sides, start
from measure.fitting.noise import by_repetition
from measure.fitting.parameters import Parameters
from measure.fitting.photograph import Pixels, Shots, grouped
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
    monkeypatch.setattr(sides, "viewpoint", lambda camera, sensor: sensor)
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


@pytest.mark.parametrize(
    ("area", "brighter", "distance", "exposure"),
    [(1.21, 1.5, 1.1**-2, 1.5**2), (9.0, 7.0, 0.5, 10.0), (1 / 9, 0.1, 1.4**2, 0.1), (1 / 1.5, 0.5, 1.5, 0.25)],
)
def test_size_and_brightness_are_followed_by_so_much_in_each_of_two_steps(
    two, area, brighter, distance, exposure, monkeypatch
):
    """The distance by 0.7 to 1.4, the exposure by 0.2 to 5, and both within the bounds that a fit has."""
    parameters, seen = Parameters.of(two), []

    def outline(image):
        seen.append(image)
        photographed = len(seen) % 2 == 1
        return np.zeros(2), (area if photographed else 1.0), (brighter if photographed else 1.0)

    monkeypatch.setattr(start, "_outline", outline)
    begin, names = parameters.start(), parameters.names
    found = start._aligned(parameters, (moved(two[0], 0, 0, 1.0, 0.0),), begin, parameters.scene.noise)
    for name, factor in (("camera.distance", distance), ("camera.exposure", exposure)):
        assert found[names.index(name)] / begin[names.index(name)] == pytest.approx(factor, rel=1e-6)
    assert len(seen) == 4


@pytest.mark.parametrize(
    ("ratios", "chosen"),
    [([0.9, 1.0, 0.2, 1.0, 0.5, 0.5], None), ([0.9, 1.2, 3.0, 1.1, 2.0, 2.5], 2), ([9.0, 1, 1, 1, 1, 9.5], 5)],
)
def test_the_flattest_of_all_sides_tells_the_errors(ratios, chosen, monkeypatch):
    """Of two angles of a light, and of the one of a sensor by which faces come into sight; beside one, all others."""
    kinds = {"light.a": "light", "camera.exposure": "number", "sensor.p": "sensor", "x": "number", "light.b": "light",
             "sensor.a": "sensor"}  # fmt: skip
    free = [SimpleNamespace(name=name, kind=kind) for name, kind in kinds.items()]
    problem = SimpleNamespace(parameters=SimpleNamespace(free=free))
    ways = []

    def followed(problem, values, noise, which, white, variance, way):
        ways.append((way[0], way[1], way[2].tolist()))
        return f"there {len(ways) - 1}", ratios[len(ways) - 1]

    monkeypatch.setattr(sides, "_followed", followed)
    monkeypatch.setattr(sides, "_turns_away", lambda problem, values, i, which, white: i == 5)
    found = sides.flatter_side(problem, "here", None, np.array([0, 1, 2, 3, 4, 5]), None, None)
    assert found == ("here" if chosen is None else f"there {chosen}")
    assert ways == [
        (i, side, others)
        for i, others in ((0, [1, 4]), (4, [0, 1]), (5, [0, 1, 2, 3, 4]))
        for side in (-1.0, 1.0)
    ]  # fmt: skip


@pytest.mark.parametrize(("slow", "groups"), [(0.315, [(0, 1)]), (0.318, [(0,), (1,)])])
def test_photographs_differ_by_white_noise_up_to_one_and_a_half_times_its_variance(slow, groups):
    """Blocks of 4 x 4 differ by a sum that is 0 in each, of variance 16/15, and all of them by a level of their own."""
    y, x = np.indices((16, 24))
    fast = np.where((x + y) % 2, 1.0, -1.0)
    blocks = np.where((x // 4 + y // 4) % 2, slow, -slow)
    image = 100.0 + 3 * x
    assert [each.members for each in grouped([image, image + fast + blocks])] == groups


@pytest.mark.parametrize(("first", "second"), [(1e-6, 1e-5), (1e-5, 1e-6)])
def test_of_what_is_held_at_its_start_or_where_it_is_likeliest_the_likelier_fit_is_taken(first, second, monkeypatch):
    """Where what is held leaves a misfit."""
    at_start = "where the scene has it"

    def held(parameters, shots, begin, noise, estimated, known, at):
        p = first if at is at_start else second
        assert at in (at_start, None)
        return SimpleNamespace(status="misfit", statuses=("ok", fit.HELD), p_value=p)

    monkeypatch.setattr(fit, "shows_something", lambda *_: True)
    monkeypatch.setattr(fit, "near", lambda *_: None)
    monkeypatch.setattr(fit, "_with_held", held)
    parameters = SimpleNamespace(start=lambda: at_start)
    assert fit._fitted(parameters, (), None, True, True).p_value == max(first, second)
