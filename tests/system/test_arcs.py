"""Arcs of circles predicted, rendered, exposed, measured: reduced `python -m tests.proofs arcs`."""

import numpy as np
import pytest

import render
from scenes import Picture
from tests.proofs.arcs import PARTS, POSES, limits, rows, scene_of

pytestmark = pytest.mark.render
COUNT = 300
QUICK = render.Quality(supersample=2, edge_samples=64)  # 0.1 sigma off of this noise, as with 4 each way


@pytest.mark.parametrize(("part", "wide"), [("corner 60", 210), ("corner 90", 210), ("slot", 330)])
def test_arcs_are_as_predicted(part, wide, tmp_path):
    """Variance within its interval and mean within 0.3 sigma; 1.7 x the variance and a whole circle's are refused."""
    picture = Picture.of(scene_of(PARTS[part](), tmp_path, 5.0, (wide, 180)), *POSES[2])
    low, high = limits(COUNT - 1, 5)
    for row in rows(part, picture, QUICK, COUNT, np.random.default_rng(5)):
        assert row.holds(low, high), str(row)
        assert row.measured == 1.0
        assert row.ratio / 1.7 < low
        assert not (low < row.control < high)
