"""A colour sensor: the mosaic and the picture made of it, its noise, and what demosaicing does to edges."""

import cv2
import numpy as np
import pytest
from scipy.optimize import brentq

import measure
import planner
import render
import scenes
from imaging.colour import by_raw, picture_of, raw_variance, rows_by_raw
from imaging.features.demosaiced import line_shift
from scenes import InvalidInput, Noise, Picture
from scenes.cameras.colour import Colour
from tests.oracle import polygon_image

CODES = {
    "RGGB": cv2.COLOR_BayerBG2GRAY, "BGGR": cv2.COLOR_BayerRG2GRAY,
    "GRBG": cv2.COLOR_BayerGB2GRAY, "GBRG": cv2.COLOR_BayerGR2GRAY,
}  # fmt: skip
UNEVEN = {"pattern": "GRBG", "response": (0.6, 1.0, 0.4)}
BILINEAR = UNEVEN | {"demosaicing": "bilinear"}
BLUR, SCALE = 0.6, 1.6  # px, of the lens and the locator
RED = {"pattern": "GBRG", "response": (1.0, 0.2, 0.1), "demosaicing": "bilinear", "reads": "red"}


def noise(colour, **others):
    return Noise(sigma=2.0, gain=0.1, bits=12, dark_level=20.0, colour=colour, **others)


@pytest.mark.parametrize("pattern", CODES)
def test_grey_of_bilinear_demosaicing_is_that_of_opencv(pattern, rng):
    mosaic = rng.integers(0, 60000, (21, 30)).astype(np.uint16)
    ours = picture_of(Noise(sigma=1.0, colour=Colour(pattern=pattern, demosaicing="bilinear")), mosaic.astype(float))
    theirs = cv2.cvtColor(mosaic, CODES[pattern])
    inner = np.s_[1:-1, 1:-1]
    assert np.abs(ours - theirs)[inner].max() < 2  # its weights are whole numbers of 2^-14
    other = cv2.cvtColor(mosaic, CODES["RGGB" if pattern == "BGGR" else "BGGR"])
    assert np.abs(ours - other)[inner].max() > 1000


@pytest.mark.parametrize("one", ["red", "green", "blue"])
def test_one_colour_alone_is_a_channel_of_opencv(one, rng):
    mosaic = rng.integers(0, 60000, (20, 31)).astype(np.uint16)
    colour = Colour(pattern="RGGB", demosaicing="bilinear", reads=one)
    channel = cv2.cvtColor(mosaic, cv2.COLOR_BayerBG2RGB)[..., ["red", "green", "blue"].index(one)]
    ours = picture_of(Noise(sigma=1.0, colour=colour), mosaic.astype(float))
    assert np.abs(ours - channel)[1:-1, 1:-1].max() <= 0.5


@pytest.mark.parametrize("colour", [UNEVEN, BILINEAR, RED])
def test_a_grey_field_stays_and_its_noise_is_as_told(colour):
    count, clean, told = 2000, np.full((12, 14), 300.0), noise(colour)
    pictures = render.expose(clean, told, np.random.default_rng(5), count)
    variance = render.variance(clean, told)
    assert np.abs(pictures.mean() - 300) < 4 * np.sqrt(variance.mean() / count / 12)
    ratio, wide = (pictures.var(0, ddof=1) / variance).mean(), 8 * np.sqrt(2 / count / clean.size)
    assert abs(ratio - 1) < wide
    assert abs(1.1 * ratio - 1) > wide
    assert variance.max() > 1.2 * variance.min()


def test_noise_of_neighbours_goes_together_as_the_linear_filter_says():
    count, clean, told = 3000, np.full((10, 10), 300.0), noise(BILINEAR)
    pictures = render.expose(clean, told, np.random.default_rng(6), count).reshape(count, -1)
    taken, raw = by_raw(told.colour, np.arange(100), (10, 10))
    covariance = (taken.multiply(raw_variance(told, clean.ravel()[raw], raw, 10)) @ taken.T).toarray()
    found, scale = np.cov(pictures.T), np.sqrt(np.diag(covariance))
    away = (found - covariance) / np.outer(scale, scale)
    assert np.abs(away).max() < 6 / np.sqrt(count)
    assert np.abs(found / np.outer(scale, scale) - np.eye(100)).max() > 0.3  # it is not white


def test_a_part_of_a_picture_gets_the_numbers_of_the_whole():
    clean, where = np.linspace(50, 300, 40 * 50).reshape(40, 50), np.zeros((40, 50), bool)
    where[16, 20:34] = True  # beside the border of a tile
    whole, part = (render.expose(clean, noise(BILINEAR), np.random.default_rng(7), 2, w) for w in (None, where))
    assert (part[:, where] == whole[:, where]).all()


def test_derivatives_by_raw_pixels_are_differences_of_pictures(rng):
    told, levels, rows = noise(BILINEAR), rng.uniform(50, 300, (9, 8)), rng.standard_normal((2, 72))
    from scipy import sparse

    found = rows_by_raw(told, sparse.csr_array(rows), (9, 8)).toarray()
    shares = np.tile(told.colour.shares, (5, 4))[:9, :8]
    for place in ((0, 0), (3, 4), (8, 7)):
        step = np.zeros((9, 8))
        step[place] = shares[place]  # one level of the balanced raw pixel
        moved = (picture_of(told, levels + step) - picture_of(told, levels)).ravel()
        assert found[:, 8 * place[0] + place[1]] == pytest.approx(rows @ moved, abs=1e-9)


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7, 1.4])
@pytest.mark.parametrize("pattern", ["RGGB", "GBRG"])
@pytest.mark.parametrize("reads", ["grey", "red"])
def test_an_edge_along_a_column_is_moved_by_demosaicing_as_derived(phase, pattern, reads):
    """The crossing of the second derivative of a demosaiced image of an edge, to second order."""
    colour = Colour(pattern=pattern, demosaicing="bilinear", reads=reads)
    image = polygon_image(np.array([[20.0 + phase, -30], [90, -30], [90, 90], [20.0 + phase, 90]]), (40, 42), BLUR)
    profile = picture_of(Noise(sigma=1.0, colour=colour), image)[10:30].mean(0)  # whole periods

    def second(x):
        away = np.arange(42) - x
        return profile @ ((away**2 - SCALE**2) * np.exp(-(away**2) / SCALE**2 / 2))

    shift = brentq(second, 19 + phase, 21 + phase) - 20 - phase
    blur, middle = np.hypot(BLUR, colour.blur_px), np.array([20 + phase, 19.5])
    down, slope = line_shift(colour, middle, np.array([0.0, 1.0]), np.array(20.0), blur, SCALE)  # its normal is -x
    most = 0.036 if reads == "grey" else 0.21
    assert -down == pytest.approx(shift, abs=most**2)
    assert abs(slope) < 1e-6
    assert abs(shift) < most


def scene_of(colour):
    scale = 1.5 if colour is RED else 1.0
    return scenes.load("task1").with_(
        camera={"blur_px": 0.8},
        locator={"scale_px": scale, "window_px": 3 * scale},
        noise={"gain": 0.02, "dark_level": 16.0, "bits": None, "colour": colour},
    )


@pytest.mark.parametrize("colour", [UNEVEN, BILINEAR, RED])
def test_predicted_propagated_and_measured_variance_agree(colour):
    scene, count = scene_of(colour), 300
    picture = Picture.of(scene, scene.settings[5].sensor, scene.settings[5].lights)
    predicted = planner.predict(picture)
    clean = planner.image(scene_of(None) if colour is UNEVEN else sharper(scene), picture.sensor, picture.lights)
    told = measure.propagate(clean, picture)
    where = measure.region_of_interest(picture)
    pictures = render.expose(clean, scene.noise, np.random.default_rng(9), count, where)
    found = measure.measure(pictures, picture, estimator="gradient")
    ratio = np.var(found.value_image[:, 0], ddof=1) / told.variance_px2
    assert abs(ratio - 1) < 3 * np.sqrt(2 / (count - 1))
    assert found.covariance_image[:, 0, 0].mean() == pytest.approx(told.variance_px2, rel=0.1)
    assert predicted.variance_px2 == pytest.approx(told.variance_px2, rel=0.12)
    assert predicted.bias_px == pytest.approx(
        told.bias_px, abs=0.1 * np.sqrt(told.variance_px2) + 0.1 * abs(told.bias_px)
    )


def sharper(scene):
    """The scene as the lens alone shows it."""
    blur = np.sqrt(scene.camera.blur_px**2 - scene.noise.colour.blur_px**2)
    return scene.with_(camera={"blur_px": blur}, noise={"colour": None})


def test_the_bound_is_below_what_a_colour_sensor_tells():
    for colour in (UNEVEN, BILINEAR, RED):
        scene = scene_of(colour)
        setting = scene.settings[5]
        low, high = (
            planner.predict(scene, setting.sensor, setting.lights, m).variance_px2 for m in ("bound", "calibrated")
        )
        assert 0 < low < high


def test_two_of_a_thousand_times_noisier_channels_are_no_signal():
    """The price of a red lamp: one of four pixels sees it."""
    raw = Colour(pattern="RGGB", response=(1.0, 0.1, 0.1))
    one = Colour(pattern="RGGB", response=(1.0, 0.1, 0.1), demosaicing="bilinear", reads="red", scale_px=100.0)
    assert raw.noise_factor(2) == pytest.approx(75.25)  # in darkness, were all pixels taken
    assert one.noise_factor(2) == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize(("changed", "text"), [
    ({"demosaicing": "edge-aware"}, "noise.colour.demosaicing must be"),
    ({"pattern": "RGBW"}, "noise.colour.pattern must be"),
    ({"reads": "red"}, "demosaicing must be bilinear where only red is read, got 'none'"),
    ({"response": (0.5, 0.9, 0.4)}, "response must be 1 of the strongest colour that is read, got 0.9"),
    ({"response": (0.0, 1.0, 0.4)}, "response must be at least 0.001 of the colours that are read, got 0"),
])  # fmt: skip
def test_bad_filters_are_told_in_one_line(changed, text):
    with pytest.raises(InvalidInput, match=text) as error:
        scenes.load("task1").with_(noise={"colour": UNEVEN | changed})
    assert "\n" not in str(error.value)


def test_a_picture_is_no_sharper_than_demosaicing_leaves_it():
    with pytest.raises(InvalidInput, match=r"camera.blur_px must be at least 0.5943, by which bilinear .* got 0.5"):
        scenes.load("task1").with_(camera={"blur_px": 0.5}, noise={"colour": BILINEAR})


def test_a_demosaiced_picture_has_one_blur_all_over():
    """Shifts by demosaicing are told of one."""
    field = {"blur_px": 0.8, "blur_field": {"table": [[0, 1], [1, 1.3]]}}
    with pytest.raises(InvalidInput, match=r"camera.blur_field must be left out with noise.colour.demosaicing = bil"):
        scenes.load("task1").with_(camera=field, noise={"colour": BILINEAR})


def test_one_colour_needs_a_locator_that_smooths_enough():
    with pytest.raises(InvalidInput, match=r"locator.scale_px must be at least 1.5 where only red is read, .*, got 1$"):
        scenes.load("task1").with_(camera={"blur_px": 0.8}, noise={"colour": RED})
    told = scene_of(RED)
    assert told.noise.colour.scale_px == 1.5
    assert told.with_(locator={"scale_px": 2.0}).noise.colour.scale_px == 2.0


@pytest.mark.parametrize("name", ["strip", "arrangement"])
def test_estimators_that_take_pixels_for_alike_are_refused(name):
    scene = scene_of(UNEVEN)
    dark = np.zeros((scene.camera.height, scene.camera.width))
    with pytest.raises(InvalidInput, match=r"estimator must be one of canny, gradient, isophote with noise.colour"):
        measure.measure(dark, scene, scene.settings[0].sensor, scene.settings[0].lights, estimator=name)
    with pytest.raises(InvalidInput, match=r"noise.colour must be left out to fit a scene"):
        measure.fit(scene, [dark])
