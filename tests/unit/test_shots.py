"""One shot against the mean of many, of made pictures: white noise is `ok` and as told, a camera's is as told."""

import cv2
import numpy as np

from scenes.photograph import Photograph
from tests.oracle import polygon_image
from tests.proofs.shots import pairs, pulls, spread

SHAPE = (220, 280)
CORNERS = np.array([[61.3, 52.2], [211.6, 63.9], [200.4, 160.7], [50.8, 149.1]])


def _found(noise, count):
    clean = polygon_image(CORNERS, SHAPE, 0.9, 120.0, 60.0)
    mean = Photograph(clean + noise() / 20)
    return [pull for _ in range(count) for pull in pulls(mean, Photograph(clean + noise()))]


def test_white_noise_is_as_told():
    rng = np.random.default_rng(1)
    found = _found(lambda: 3 * rng.standard_normal(SHAPE), 10)
    assert [pull.status for pull in found] == ["ok"] * 10
    _, low, high = spread(found)
    assert low / 1.1 < 1 < high * 1.1  # margin: 95 % of 80 numbers, widened
    assert not low < 1.5 < high


def test_noise_that_a_camera_smoothed_is_as_told():
    """`correlated`, and not 2.5 times as far off as told, as under a covariance of white noise."""
    rng = np.random.default_rng(2)

    def noise():
        fine, coarse = (cv2.GaussianBlur(rng.standard_normal(SHAPE), (0, 0), width) for width in (0.8, 3.0))
        return 3 * (np.sqrt(0.93) * fine / fine.std() + np.sqrt(0.07) * coarse / coarse.std())

    found = _found(noise, 10)
    assert {pull.status for pull in found} <= {"correlated", "misfit", "clutter"}
    whole, _, _ = spread(found)
    assert 0.75 < whole < 1.35  # margin: 80 numbers that share a noise curve each


def test_pairs_are_found_by_name(tmp_path):
    for name in ("a_mean.png", "a_real.png", "b_mean.JPG", "c_real.JPG"):
        (tmp_path / name).write_bytes(b"")
    assert [(mean.name, shot.name) for mean, shot in pairs(tmp_path)] == [("a_mean.png", "a_real.png")]
