"""How the recorded level follows the light near the end of the scale: the part of the pictures that is not cut off."""

import numpy as np
import pytest
from scipy.stats import norm

from imaging.models.bound import response
from scenes import Noise


def test_response_near_the_end_of_the_scale():
    """Without shot noise the derivative of min(x, 255)'s mean is the probability of x below 255."""
    noise = Noise(sigma=2.0, dark_level=20.0, bits=8)
    image = np.array([100.0, 225.0, 232.0, 235.0, 237.0, 241.0])
    levels, gain = response(noise, image)
    assert gain == pytest.approx(norm.cdf((255 - 20 - image) / np.sqrt(noise.variance)), abs=1e-6)
    assert levels.noise_variance[0] == pytest.approx(noise.variance)
    drawn = np.minimum(
        20 + image + np.sqrt(noise.variance) * norm.ppf((np.arange(200_000) + 0.5) / 200_000)[:, None], 255
    )
    assert levels.level == pytest.approx(drawn.mean(0), abs=1e-3)
    assert levels.noise_variance == pytest.approx(drawn.var(0), rel=2e-3, abs=1e-3)


def test_response_without_an_end():
    levels, gain = response(Noise(sigma=2.0, gain=0.5), np.array([-3.0, 0.0, 1e4]))
    assert gain.tolist() == [1, 1, 1]
    assert levels.noise_variance == pytest.approx(Noise(sigma=2.0).variance + np.array([0, 0, 0.5e4]), rel=1e-9)
