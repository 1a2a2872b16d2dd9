"""Random numbers of the rays, and how many are traced at once, without a compiled variant."""

import numpy as np
import pytest
from scipy.stats import kstest

from render.rays import SURFACES, Rays


class Counted(Rays):
    """Whose parts say which fine pixels they were asked for."""

    def _part(self, scene, rows, columns, shape, samples, start):
        assert rows.size * samples <= max(self.at_once, samples)
        assert (rows == np.arange(start, start + rows.size)).all()
        return 1000.0 * rows + columns


@pytest.mark.parametrize("at_once", [1, 16, 36, 64, 10**6])
@pytest.mark.parametrize("count", [0, 1, 4, 9, 10])
def test_parts(at_once, count):
    """Every fine pixel once, in its place, whatever there is room for at once."""
    rows, columns = np.arange(count), np.arange(count)[::-1]
    found = Counted(None, 2, 16, 0, 1, at_once).radiance(None, rows, columns, (50, 50), 16)
    assert found.tolist() == (1000.0 * rows + columns).tolist()


def test_table():
    """Two numbers for the ray and four for each surface, even on the unit interval and below 1 in single precision."""
    table = Rays(None, 2, 12, 3, 7)._table
    assert table.shape == (2 + 4 * SURFACES, 4 * 16)
    assert table.dtype == np.float32
    assert 0 <= table.min() <= table.max() < 1  # margin: random numbers of the unit interval
    assert (np.sort((table * 64).astype(int), 1) == np.arange(64)).all()  # each 64th once: Sobol points
    assert (table == Rays(None, 2, 12, 0, 7)._table).all()
    assert (table != Rays(None, 2, 12, 0, 8)._table).any()


def test_strata():
    """Each fine pixel's rays cross each of its strata once, in an order of its own, evenly mixed."""
    found = Rays(None, 8, 16, 0, 3)._strata(16).reshape(64, 16)
    assert (np.sort(found, 1) == np.arange(16)).all()
    assert len({tuple(row) for row in found.tolist()}) == 64
    assert kstest((found[:, 0] + 0.5) / 16, "uniform").pvalue > 1e-3
