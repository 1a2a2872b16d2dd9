"""The cut at the end of the scale against quadrature: blur the edge, cut it off, smooth it, differentiate."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from imaging.blurred.clipped_step import clipped
from scenes import Noise

NOISE = Noise(sigma=2.0, dark_level=20.0, bits=8)
FULL = 255.0


def lost(u, sides, kinks, blur):
    """Mean grey level that the end of the scale takes away u px beyond the edge."""

    def step(x):
        return sides[0] + kinks[0] * x if x < 0 else sides[1] + kinks[1] * x

    parts = [
        quad(lambda x: step(x) * norm.pdf(x, u, blur), *ends)[0] for ends in ((u - 9 * blur, 0), (0, u + 9 * blur))
    ]
    level, sigma = sum(parts) + NOISE.dark_level, np.sqrt(NOISE.variance)
    return (
        -quad(lambda x: (x - FULL) * norm.pdf(x, level, sigma), FULL, FULL + 12 * sigma)[0]
        if level < 290
        else (FULL - level)
    )


@pytest.mark.parametrize("kinks", [(0.0, 0.0), (0.4, -0.7)])
def test_derivatives_of_what_is_lost(kinks):
    sides, blur, scale, moved = (60.0, 231.0), 0.8, 1.1, 0.25
    near = SimpleNamespace(
        own=np.array([False, True]), place=np.array([0, 1]), sides=np.array([[0.0, 300.0], sides]),
        kinks=np.array([(0.0, 0.0), kinks]),
    )  # fmt: skip
    u = np.arange(-8, 8.001, 0.1)
    values = np.array([lost(x, sides, kinks, blur) for x in u])

    def smoothed(x):
        return (values * norm.pdf(x - u, 0, scale)).sum() * 0.1

    step = 0.05
    around = np.array([smoothed(moved + k * step) for k in range(-2, 3)])
    second = (around[1] - 2 * around[2] + around[3]) / step**2
    third = (around[4] - 2 * around[3] + 2 * around[1] - around[0]) / (2 * step**3)
    found = clipped(NOISE, near, np.array([0.5, blur]), scale)(np.array([0.0, moved]))
    assert found[0] == pytest.approx([0.0, second], rel=5e-3)
    assert found[1] == pytest.approx([0.0, third], rel=2e-2)


def test_nothing_is_lost_below_the_end_of_the_scale():
    """Dark sides, or edges of others only."""
    for own, level in ((True, 200.0), (False, 300.0)):
        near = SimpleNamespace(
            own=np.array([own]), place=np.array([0]), sides=np.array([[0.0, level]]), kinks=np.zeros((1, 2))
        )
        assert clipped(NOISE, near, np.array([0.5]), 1.0) is None
