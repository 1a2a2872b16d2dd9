"""Where rounding is taken off as a twelfth, and where the likelihood is asked; how far the thinning of edges sees."""

import numpy as np
import pytest

from measure.estimators.thinning import TRUNCATE, Thinning
from measure.photo import rounding


@pytest.mark.parametrize("step", [0.5, 1.0, 16.0])
def test_noise_that_spreads_over_steps_is_less_by_a_twelfth_of_a_squared_step(step, monkeypatch):
    """Of less the likelihood tells; nothing is told of no patches."""
    monkeypatch.setattr(rounding, "_likeliest", lambda some, surface, start: -7.0)
    limit = (rounding._WELL_SPREAD * step) ** 2
    pixels, surface = np.zeros((3, 49)), np.ones((49, 1)) / 7
    for factor, told in ((1.01, 1.01 * limit), (0.99, -7.0 * step**2)):
        found = rounding.before_rounding(pixels, surface, factor * limit + step**2 / 12, step)
        assert found == pytest.approx(told, rel=1e-9)
    assert rounding.before_rounding(pixels[:0], surface, 0.5 * limit + step**2 / 12, step) == 0.0


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.7])
def test_a_pixel_s_choice_depends_on_the_kernel_and_on_its_neighbours(scale):
    """A change beyond the reach leaves it, one within it may not."""
    tool = Thinning.of((slice(0, 60), slice(0, 60)), scale, 1.0)
    assert tool.reach == int(np.ceil(TRUNCATE * scale)) + 1
