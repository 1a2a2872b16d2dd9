"""Which fine pixels of a large image are rendered with how many rays, with stand-ins for the renders."""

import numpy as np
import pytest

from render import large
from render.large import Renders, fine_pixels, is_large

K, SIZE, RAYS = 2, (40, 50), (4, 16, 256)


@pytest.mark.parametrize(("pixels", "random", "expected"), [(0, True, True), (0, False, True), (-1, True, False)])
def test_limits(pixels, random, expected):
    """One pixel more than the limit is large; fine pixels do not count."""
    most = (large.LARGE_RANDOM if random else large.LARGE) + 1 + pixels
    assert is_large((slice(0, 3), slice(3, 3 + 3 * most)), 3, random) is expected


@pytest.mark.parametrize("random", [False, True])
def test_rays_where_they_are_needed(random, monkeypatch):
    """Edges near required ones get all rays, other edges fewer, smooth places and far ones the least."""
    truth = np.zeros((SIZE[0] * K, SIZE[1] * K))
    truth[:, 31:] = 50.0  # an edge within pixel column 15, and another, far from what is required
    truth[:, 80:] = 90.0
    near = np.zeros(SIZE, bool)
    near[:, 8:24] = True
    monkeypatch.setattr(large, "near_required", lambda picture, crop, supersample: near)
    asked = []

    def whole(is_random, rays):
        asked.append(("whole", is_random, rays))
        return truth.reshape(SIZE[0], K, SIZE[1], K).mean((1, 3))

    def again(is_random, fine, marked, rays):
        asked.append(("again", is_random, rays))
        counts[marked] = rays
        return np.where(marked, truth, fine)

    counts = np.zeros(truth.shape, int)
    found = fine_pixels(None, None, Renders(whole, again, K, random), 0, RAYS)
    assert found == pytest.approx(truth)
    assert found.shape == truth.shape
    assert (counts[:, 30:32] == 256).all()
    assert (counts[:, 79:81] == min(256, large._BESIDE)).all()
    assert (counts[:, 18:28] == (16 if random else 4)).all()
    assert set(counts[:, 90:].ravel()) <= {0, 4}
    assert [each for each in asked if each[0] == "whole"] == [("whole", False, 4)] + [("whole", True, 16)] * random
    assert {each[1] for each in asked[3:]} == {random}
