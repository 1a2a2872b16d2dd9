"""Parts of the search for the most likely arrangement, each with stand-ins for the rest."""

from types import SimpleNamespace

import numpy as np
import pytest

from measure.features.arranged import _is_beyond
from measure.features.contrasts import _contrast
from measure.features.locating import _rivals
from scenes import Noise

USED = np.s_[2:5, 3:6]


@pytest.mark.parametrize(("value", "beyond"), [(256.0, True), (255.0, False), (-0.5, True), (0.0, False)])
@pytest.mark.parametrize("used", [True, False])
def test_beyond(value, beyond, used):
    """Images that the sensor cannot have recorded are known by the pixels that are used, not by others."""
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


@pytest.mark.parametrize(
    ("apart", "settled", "worse", "ambiguous"),
    [
        (0.6, True, 8.9, True), (0.4, True, 0.0, False), (0.0, True, 0.0, False), (-0.6, True, 1.0, True),
        (0.6, False, 1.0, False), (0.6, True, 9.1, False),
    ],
)  # fmt: skip
def test_two_maxima(apart, settled, worse, ambiguous):
    """Half a pixel apart and within 3 sigma of each other; what else differs does not matter."""
    tool = SimpleNamespace(model=SimpleNamespace(free=np.arange(2)), parameters=lambda state: np.array(state))
    best = SimpleNamespace(state=[1.0, 2, 3, 4, 50], cost=100.0, settled=True)
    rest = SimpleNamespace(state=[1.0, 2, 3, 4 + apart, 90], cost=100.0 + worse, settled=settled)
    assert _rivals(tool, best, rest) is ambiguous


def test_contrast_along_a_piece(rng):
    """A polynomial of the second degree in the levels, at its start, its middle and its end; sigma by drawn levels."""
    contrast = rng.normal(size=(4, 3, 2 * 2 + 5 + 1))  # of two free vertices, five levels and the blur
    root = rng.normal(size=(5, 5))
    covariance = np.zeros((10, 10))
    covariance[4:9, 4:9] = root @ root.T
    tool = SimpleNamespace(model=SimpleNamespace(free=np.arange(2)))
    pieces = SimpleNamespace(contrast=contrast)
    centre = SimpleNamespace(expansion=SimpleNamespace(pieces=pieces), covariance=covariance)
    found, sigma = _contrast(tool, centre)
    for k, t in enumerate((0.0, 0.5, 1.0)):
        expected = np.array([[np.polyval(piece[::-1, level], t) for level in range(4, 9)] for piece in contrast])
        assert found[:, k] == pytest.approx(expected)
        drawn = expected @ root @ rng.standard_normal((5, 40_000))
        assert sigma[:, k] == pytest.approx(drawn.std(1), rel=0.02)
