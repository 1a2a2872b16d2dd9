"""The sensor's noise: its statistics, its digits, and its independence of what is drawn."""

import numpy as np
import pytest
from scipy import stats

import render
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
