"""The sensor's noise: its statistics, its digits, and its independence of what is drawn."""

import numpy as np
import pytest
from scipy import stats

import render
from imaging.sensor import full_scale, recorded, shot_noise, squared_errors
from scenes import InvalidInput, Noise


def test_noise_is_gaussian_of_the_given_sigma():
    image = np.linspace(10, 200, 40 * 50).reshape(40, 50)
    noise = render.expose(image, Noise(sigma=2.4), np.random.default_rng(3), 50) - image
    assert stats.kstest(noise.ravel() / 2.4, "norm").pvalue > 1e-3
    assert stats.kstest(noise.ravel() / (1.3 * 2.4), "norm").pvalue < 1e-6  # negative control
    pixels = noise.reshape(50, -1)
    assert abs(np.corrcoef(pixels[:, :-1].ravel(), pixels[:, 1:].ravel())[0, 1]) < 4 / np.sqrt(pixels.size)
    assert abs(np.corrcoef(pixels[:-1].ravel(), pixels[1:].ravel())[0, 1]) < 4 / np.sqrt(pixels.size)


def test_digits_are_whole_clipped_and_add_a_twelfth():
    image = np.full((64, 64), 100.3)
    pictures = render.expose(image, Noise(sigma=1.0, bits=8), np.random.default_rng(3), 100)
    assert (pictures == np.rint(pictures)).all()
    assert pictures.var() == pytest.approx(1 + 1 / 12, rel=4 * np.sqrt(2 / pictures.size))
    bright = render.expose(np.full((8, 8), 300.0), Noise(sigma=1.0, bits=8), np.random.default_rng(3), 2)
    assert (bright == 255).all()


def test_part_of_the_image_gets_the_numbers_of_the_whole():
    image, where = np.zeros((50, 70)), np.zeros((50, 70), bool)
    where[20:23, 5:60] = True
    whole = render.expose(image, Noise(sigma=1.0), np.random.default_rng(7), 3)
    part = render.expose(image, Noise(sigma=1.0), np.random.default_rng(7), 3, where)
    assert (part[:, where] == whole[:, where]).all()
    assert (part == 0).any()


def test_same_seed_same_numbers_and_another_seed_others():
    image = np.zeros((5, 5))
    first, again, other = (render.expose(image, Noise(sigma=1.0), np.random.default_rng(s), 2) for s in (1, 1, 2))
    assert (first == again).all()
    assert (first != other).any()


def test_no_noise():
    assert (render.expose(np.ones((3, 3)), Noise(sigma=0.0), np.random.default_rng(1), 2) == 1).all()


def test_bad_count():
    with pytest.raises(InvalidInput, match="count must be at least 1, got 0"):
        render.expose(np.zeros((2, 2)), Noise(sigma=1.0), np.random.default_rng(1), 0)


def test_shot_noise_grows_with_light_and_dark_noise_does_not():
    """EMVA 1288: variance sigma^2 + gain (level - dark level); 3 levels, 4 standard errors; 1.3 x is rejected."""
    noise = Noise(sigma=1.5, gain=0.25, dark_level=20.0)
    image = np.repeat([[20.0], [60.0], [220.0]], 2000, axis=1)
    pictures = render.expose(image, noise, np.random.default_rng(5), 20)
    ratio = pictures.var(axis=0, ddof=1).mean(1) / render.variance(image, noise)[:, 0]
    error = np.sqrt(2 / (2000 * 19))
    assert np.abs(ratio - 1).max() < 4 * error
    assert np.abs(ratio / 1.3 - 1).min() > 4 * error
    assert render.variance(image, noise)[:, 0] == pytest.approx([2.25, 12.25, 52.25])


def test_fixed_pattern_is_the_same_in_every_picture_and_scales_as_said():
    noise = Noise(sigma=0.0, prnu=0.01, dsnu=0.3, dark_level=10.0)
    image = np.full((2, 64, 64), 10.0)
    image[1] = 210.0
    pictures = [render.expose(level, noise, np.random.default_rng(s), 2) for level in image for s in (1, 2)]
    assert (pictures[0] == pictures[1][::-1]).all()
    for level, picture, sigma in ((image[0], pictures[0], 0.3), (image[1], pictures[2], np.hypot(0.3, 2.0))):
        assert (picture[0] - level).std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * 64 * 64))
    other = render.expose(image[0], noise.model_copy(update={"pattern_seed": 1}), np.random.default_rng(1), 1)
    assert (other != pictures[0][:1]).any()


def test_mean_and_variance_at_the_end_of_the_scale():
    """What a clipped sensor records, against 200 000 exposures at levels around it."""
    noise = Noise(sigma=3.0, bits=8)
    image = np.array([[128.0, 245.0, 250.0, 255.0, 258.0, 270.0]])
    pictures = render.expose(np.repeat(image, 200, 0), noise, np.random.default_rng(3), 1000).reshape(-1, 6)
    sigma = np.sqrt(noise.variance)
    mean = recorded(noise, image).level[0]
    # margin: 5 standard errors of 200,000, and a hundredth of a level
    assert mean == pytest.approx(pictures.mean(0), abs=5 * sigma / np.sqrt(len(pictures)) + 0.01)
    assert render.variance(image, noise)[0] == pytest.approx(pictures.var(0), rel=0.05, abs=1e-3)
    assert mean[0] == 128.0


@pytest.mark.parametrize("noise", [Noise(sigma=2.4, bits=8, dark_level=20), Noise(sigma=40.0, bits=10, gain=0.5)])
def test_squared_errors_are_those_of_drawn_pictures(noise):
    """Mean and variance of squared errors near the end of the scale; those of normal noise are far off there."""
    level = full_scale(noise) + np.array([-3.0, -1.0, 0.0, 1.0]) * np.sqrt(noise.variance)
    sigma = np.sqrt(noise.variance - 1 / 12 + shot_noise(noise, level - noise.dark_level))
    drawn = np.clip(
        np.rint(level + sigma * np.random.default_rng(1).standard_normal((200_000, 4))), None, full_scale(noise)
    )
    like = recorded(noise, level)
    squares = (drawn - like.level) ** 2 / like.noise_variance
    mean, variance = squared_errors(noise, level, like)
    error = squares.std(0) / np.sqrt(len(squares))
    assert np.all(np.abs(squares.mean(0) - mean) < 5 * error)
    fourth = np.sqrt(np.var((squares - squares.mean(0)) ** 2, axis=0) / len(squares))
    assert np.all(np.abs(squares.var(0) - variance) < 5 * fourth)
    # margin: 20 times is said; fourth powers tell of 2 where noise is normal
    assert np.abs(squares.var(0) - 2)[-1] > 20 * fourth[-1]
    far = np.array([full_scale(noise) / 2])
    assert np.concatenate(squared_errors(noise, far, recorded(noise, far))).tolist() == [1.0, 2.0]


def test_noise_is_drawn_by_tiles_of_16():
    """Only the tiles that hold a wanted pixel are noisy; the others keep the noise-free value."""
    where = np.zeros((40, 50), bool)
    where[[15, 20], [16, 49]] = True
    found = render.expose(np.full((40, 50), 9.0), Noise(sigma=1.0), np.random.default_rng(2), 1, where)[0]
    expected = np.zeros((40, 50), bool)
    expected[:16, 16:32] = expected[16:32, 48:] = True
    assert ((found != 9.0) == expected).all()


@pytest.mark.parametrize("said", [{}, {"gain": 0.1, "row_sigma": 0.5}, {"prnu": 0.01, "dsnu": 0.5}])
def test_pictures_taken_again_are_those_of_new_memory(said):
    """Fewer, as many and more than before; only what is wanted has noise."""
    rng = np.random.default_rng(5)
    image = rng.uniform(20, 200, (40, 50))
    noise = Noise(sigma=2.0, bits=8, dark_level=10.0, **said)
    where = np.zeros(image.shape, bool)
    where[3:9, 20:40] = True
    exposer = render.Exposer(image, noise, where)
    for k, count in enumerate((3, 2, 3, 5)):
        new = render.expose(image, noise, np.random.default_rng(k), count, where)
        assert np.array_equal(exposer.take(np.random.default_rng(k), count, again=True), new)
        assert np.array_equal(exposer.take(np.random.default_rng(k), count), new)
    assert (new[:, 20:, :] == new[:1, 20:, :]).all()
