"""Distances from segments, and the pixels beside them."""

import numpy as np
import pytest

from imaging.geometry.segments import distance_to_segment, pixels_along


@pytest.mark.parametrize(("point", "away"), [((5, 3), 3.0), ((-3, -4), 5.0), ((13, 4), 5.0), ((0, 0), 0.0)])
def test_distance_to_a_segment(point, away):
    assert distance_to_segment(np.array([point], float), np.zeros(2), np.array([10.0, 0])) == pytest.approx([away])
    assert distance_to_segment(np.array([[3.0, 4.0]]), np.zeros(2), np.zeros(2)) == pytest.approx([5.0])


def test_no_pixel_near_a_segment_is_missed(rng):
    """Any direction, also along rows and columns, of no length, and beyond the image; each once, row by row."""
    shape = (50, 70)
    y, x = np.mgrid[:50, :70]
    everywhere = np.stack([x, y], -1).astype(float)
    for _ in range(300):
        start, stop = rng.uniform(-30, 100, (2, 2))
        stop = np.where(rng.uniform(size=2) < 0.25, start, stop)
        reach = rng.uniform(0.3, 12)
        rows, columns = pixels_along(start, stop, reach, shape)
        found = np.zeros(shape, int)
        np.add.at(found, (rows, columns), 1)
        wanted = distance_to_segment(everywhere, start, stop) <= reach
        assert found[wanted].all()
        assert found.max(initial=0) <= 1
        assert (np.diff(rows * 70 + columns) > 0).all()


def test_a_slanting_segment_costs_what_an_upright_one_does():
    across = pixels_along(np.array([100.0, 100]), np.array([900.0, 900]), 5.0, (1000, 1000))[0].size
    upright = pixels_along(np.array([100.0, 100]), np.array([100.0, 1231.4]), 5.0, (1300, 300))[0].size
    assert across < 1.2 * upright  # margin: counts of pixels


@pytest.mark.parametrize("far", [1e6, 1e12, 1e25, 1e300])
def test_ends_however_far_away(far):
    """A segment far from the image has no pixel; one through it has those of its line."""
    assert pixels_along(np.array([far, far]), np.array([2 * far, 1.5 * far]), 3.0, (50, 70))[0].size == 0
    assert pixels_along(np.array([-far, -far]), np.array([-2 * far, -3.0]), 2.0, (50, 70))[0].size == 0
    rows, columns = pixels_along(np.array([20.0, 10.0]), np.array([20.0, far]), 1.0, (50, 70))
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (9, 49, 19, 21)
