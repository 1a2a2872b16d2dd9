"""Which fine pixels of a large image are rendered with how many rays, with stand-ins for the renders."""

import numpy as np
import pytest

from render import large
from render.even import Even, fine_of
from render.large import Counts, Renders, fine_pixels, is_large

K, SIZE, RAYS = 2, (40, 50), Counts(4, 16, 16, 256)


@pytest.mark.parametrize(("pixels", "random", "expected"), [(0, True, True), (0, False, True), (-1, True, False)])
def test_limits(pixels, random, expected):
    """One pixel more than the limit is large; fine pixels do not count."""
    most = (large.LARGE_RANDOM if random else large.LARGE) + 1 + pixels
    assert is_large((slice(0, 3), slice(3, 3 + 3 * most)), 3, random) is expected


@pytest.mark.parametrize(("random", "many"), [(False, True), (True, True), (True, False)])
def test_rays_where_they_are_needed(random, many, monkeypatch):
    """Edges near required ones get all rays, other edges fewer, smooth places and far ones the least."""
    truth = np.zeros((SIZE[0] * K, SIZE[1] * K))
    truth[:, 31:] = 50.0  # an edge within pixel column 15, and another, far from what is required
    truth[:, 80:] = 90.0
    near = np.zeros(SIZE, bool)
    near[:, 8:24] = True
    moving = np.zeros(SIZE, bool)
    moving[:, 12:24] = True
    monkeypatch.setattr(large, "near_required", lambda *_: near if len(_) == 3 else moving)
    monkeypatch.setattr(large, "LARGE_RANDOM", 1000 if many else 10_000)
    crop, asked = tuple(slice(0, size * K) for size in SIZE), []

    def whole(is_random, rays):
        asked.append(("whole", is_random, rays))
        return truth.reshape(SIZE[0], K, SIZE[1], K).mean((1, 3))

    def again(is_random, fine, marked, rays):
        asked.append(("again", is_random, rays))
        counts[marked] = rays
        return np.where(marked, truth, fine)

    counts = np.zeros(truth.shape, int)
    found = fine_pixels(None, crop, Renders(whole, again, K, random), 0, RAYS)
    assert found == pytest.approx(truth)
    assert found.shape == truth.shape
    assert (counts[:, 30:32] == 256).all()
    assert (counts[:, 79:81] == min(256, large._BESIDE)).all()
    assert (counts[:, 24:28] == (16 if random else 4)).all()
    half = 4 if many or not random else 16
    assert (counts[:, 18:24] == half).all(), "of 16 a half, each way, where noise moves no edge and there are many"
    assert set(counts[:, 90:].ravel()) <= {0, 4}
    assert [each for each in asked if each[0] == "whole"] == [("whole", False, 4)] + [("whole", True, 16)] * random
    assert {each[1] for each in asked[3:]} == {random}


def test_bounced_light_is_added_to_direct_light_in_whole_pixels(monkeypatch):
    """To few rays everywhere that is measured, to many where they find some and its noise moves an edge."""
    direct, sent = np.full((SIZE[0] * K, SIZE[1] * K), 7.0), np.zeros(SIZE)
    sent[10:14, 20] = 3.0
    near, moving = np.zeros(SIZE, bool), np.zeros(SIZE, bool)
    near[5:30, 10:30], moving[:12] = True, True
    monkeypatch.setattr(large, "near_required", lambda *_: near if len(_) == 3 else moving)
    counts, asked = np.zeros(SIZE, int), []

    def bounced(marked, rays):
        counts[marked] = rays
        asked.append(rays)
        return np.where(marked, sent, 0.0)

    def in_fine_pixels(*asked):
        return fine_of(large.bounced(bounced, *asked), K)

    def again(is_random, fine, marked, rays):
        assert not is_random, "direct light alone"
        return np.where(marked, direct, fine)

    whole = direct.reshape(SIZE[0], K, SIZE[1], K).mean((1, 3))
    renders = Renders(lambda is_random, rays: whole, again, K, True, False, in_fine_pixels)
    found = fine_pixels(None, None, renders, 0, RAYS)
    seen = near.repeat(K, 0).repeat(K, 1)
    assert found == pytest.approx(np.where(seen, direct, 0.0) + sent.repeat(K, 0).repeat(K, 1))
    assert asked == [4, 16]
    assert (counts[8:12, 18:23] == 16).all()
    assert (counts[12:, :] <= 4).all()
    assert not counts[~near].any()


def test_what_nothing_is_measured_by_stays_dark_and_has_no_edge_at_its_border(monkeypatch):
    """Few rays up to the border, all at an edge within, random ones only where others' light may be seen."""
    truth = np.full((SIZE[0] * K, SIZE[1] * K), 20.0)
    truth[:, 31:] = 50.0
    near, lent = np.zeros(SIZE, bool), np.zeros(SIZE, bool)
    near[:, 8:24], lent[:, 18:] = True, True
    monkeypatch.setattr(large, "near_required", lambda *_: near)
    counts = {kind: np.zeros(truth.shape, int) for kind in (False, True)}

    def again(is_random, fine, marked, rays):
        counts[is_random][marked] = rays
        return np.where(marked, truth, fine)

    def whole(is_random, rays, where):
        assert is_random
        counts[True][where.repeat(K, 0).repeat(K, 1)] = rays
        return np.where(where, truth.reshape(SIZE[0], K, SIZE[1], K).mean((1, 3)), 0.0)

    crossed = np.zeros(SIZE, bool)
    crossed[:, 20] = True
    even = Even(lambda marked: marked & lent, lambda: crossed)
    renders = Renders(whole, again, K, True, False, even=even)
    found = fine_pixels(None, tuple(slice(0, size * K) for size in SIZE), renders, 0, RAYS)
    assert found == pytest.approx(np.where(near.repeat(K, 0).repeat(K, 1), truth, 0.0))
    assert (counts[False][:, 30:32] == 256).all(), "an edge of direct light alone"
    assert (counts[False][:, [*range(16, 30), *range(32, 48)]] == 4).all()
    assert (counts[True][:, [*range(36, 40), *range(42, 48)]] == 36).all(), "whole pixels: 0.75 of 4 x 16, each way"
    assert (counts[True][:, 40:42] == 16).all(), "fine pixels where an edge may cross"
    assert not counts[True][:, :36].any()


def test_where_nothing_is_measured_light_between_faces_is_told_from_some_pixels(monkeypatch):
    """A light that grows along rows: told by every eighth pixel where no edge crosses, by each pixel where one does."""
    near, crossed = np.zeros(SIZE, bool), np.zeros(SIZE, bool)
    near[:, :9], crossed[:, 30] = True, True
    monkeypatch.setattr(large, "near_required", lambda *_: near)
    sent = np.tile(np.arange(SIZE[1], dtype=float), (SIZE[0], 1))
    asked = {}

    def whole(is_random, rays, where=None):
        if not is_random:
            return np.full(SIZE, 7.0)
        asked[rays] = where
        return np.where(where, 7.0 + sent, 0.0)

    def again(is_random, fine, marked, rays):
        return np.where(marked, 7.0 + is_random * sent.repeat(K, 0).repeat(K, 1), fine)

    renders = Renders(whole, again, K, True, even=Even(lambda marked: marked, lambda: crossed))
    found = fine_pixels(None, tuple(slice(0, size * K) for size in SIZE), renders, 0, RAYS)
    assert found == pytest.approx(7.0 + sent.repeat(K, 0).repeat(K, 1), abs=1e-4)
    some = asked[64]
    assert set(np.unique(np.nonzero(some)[0])) == set(range(0, 39, 8))
    assert set(np.unique(np.nonzero(some)[1])) == {*range(8, 25, 8), *range(32, 49, 8)}
    assert asked[16][:, 24:32].all()
    assert not asked[16][:32, 9:24].any()
