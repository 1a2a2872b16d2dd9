"""Parts of the classic locator."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from measure.estimators.canny import CannyLocator


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("dim", "sure"), [(13.0, True), (10.5, False)])
def test_an_edge_is_sure_where_noise_leaves_little_of_its_dimmer_half(turned, dim, sure):
    """Gradients from ``dim`` at an end to 40 at the other, of noise 1; against the part of the half that is lost."""
    positions = np.linspace(2.0, 22.0, 41)
    trend = (40.0 - dim) / 20.0 * (-1 if turned else 1)
    start = (dim if not turned else 40.0) - trend * 2.0
    told = SimpleNamespace(
        caliper=SimpleNamespace(positions=positions), optics=SimpleNamespace(noise_variance=4.0), threshold=12.0,
        kernel=np.array([[0.3, 9.0], [0.4, 9.0]]),
    )  # fmt: skip
    lost = quad(lambda t: norm.cdf(12.0 - (dim + (40.0 - dim) * t)), 0, 0.5, points=[0.05])[0] / 0.5
    assert (lost < 0.1) == sure
    assert CannyLocator._sure(told, np.array([start]), np.array([trend])).tolist() == [sure]
