"""Images that the sensor cannot have recorded are known by the pixels that are used, not by others."""

from types import SimpleNamespace

import numpy as np
import pytest

from measure.features.arranged import _is_beyond
from scenes import Noise

USED = np.s_[2:5, 3:6]


@pytest.mark.parametrize(("value", "beyond"), [(256.0, True), (255.0, False), (-0.5, True), (0.0, False)])
@pytest.mark.parametrize("used", [True, False])
def test_beyond(value, beyond, used):
    images = np.full((3, 8, 9), 100.0)
    images[1][(3, 4) if used else (0, 0)] = value
    images[2, 7, 8] = 1000.0  # so that it is looked at closely
    tool = SimpleNamespace(
        noise=Noise(sigma=1.0, bits=8), taken=lambda stack: stack[:, USED[0], USED[1]].reshape(3, -1)
    )
    assert _is_beyond(images, tool).tolist() == [False, beyond and used, False]


def test_without_digits_nothing_is_beyond():
    tool = SimpleNamespace(noise=Noise(sigma=1.0, bits=None), taken=None)
    assert not _is_beyond(np.full((2, 4, 4), -1e9), tool).any()
