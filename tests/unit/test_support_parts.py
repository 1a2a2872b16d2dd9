"""What counts as an edge along an outline, and which patches of a photograph are louder than others of their level."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from measure.find.coarse import Coarse
from measure.find.support import Steepest, contrast, sign_of, steepest, texture
from measure.photo.patches import _loud

BLOCK = 12


def along(slopes, reach, at=1.0):
    """Of places in blocks of one slope each, a rise at one distance beyond the outline."""
    offsets = np.arange(-reach, reach + 0.25, 0.5)
    rises = np.repeat(slopes, BLOCK)[:, None] * (np.abs(offsets - at) < 0.1)
    return SimpleNamespace(across=lambda places, normals, asked: rises, gradient_noise=0.5)


def middles(values):
    """Of each block what stands in the middle: neighbours are averaged."""
    return np.asarray(values).reshape(-1, BLOCK)[:, BLOCK // 2].tolist()


@pytest.mark.parametrize("sign", [1, -1])
def test_an_edge_is_above_four_noises_and_a_quarter_of_what_is_usual(sign):
    """Noise 0.5: 2 is too little; the median is 16: 4 is too little."""
    slopes = np.array([16.0, 16.0, 16.0, 16.0, 3.9, 4.1, 1.9])
    places = np.zeros((slopes.size * BLOCK, 2))
    found = steepest(along(sign * slopes, 2.0), places, places, sign, 2.0)
    assert middles(found.counts) == [True, True, True, True, False, True, False]
    assert middles(found.slopes) == pytest.approx(slopes.tolist())
    assert set(middles(found.offsets)) == {1.0}
    faint = steepest(along(sign * np.array([3.0, 3.0, 2.1, 1.9]), 2.0), places[: 4 * BLOCK], places, sign, 2.0)
    assert middles(faint.counts) == [True, True, True, False]


def test_what_is_usual_is_told_of_each_piece_by_itself():
    """A faint side beside a bright one."""
    slopes = np.array([40.0, 40.0, 9.0, 9.0, 9.0])
    places, piece = np.zeros((5 * BLOCK, 2)), np.repeat([0, 0, 1, 1, 1], BLOCK)
    together, apart = (steepest(along(slopes, 2.0), places, places, 1, 2.0, each) for each in (piece * 0, piece))
    assert middles(together.counts) == [True] * 5  # a quarter of 9
    assert middles(apart.counts) == [True] * 5
    dim = np.array([40.0, 40.0, 40.0, 9.0, 9.0])
    piece = np.repeat([0, 0, 0, 1, 1], BLOCK)
    together, apart = (steepest(along(dim, 2.0), places, places, 1, 2.0, each) for each in (piece * 0, piece))
    assert middles(together.counts) == [True, True, True, False, False]
    assert middles(apart.counts) == [True] * 5


def test_of_an_outline_the_longest_gap_and_how_far_off_it_is():
    counts = np.array([1, 1, 0, 0, 0, 1, 0, 1, 0, 0], bool)
    found = Steepest(np.arange(10.0), np.ones(10), counts)
    assert (found.support, found.longest_gap) == (0.4, 3)
    assert found.straightness == pytest.approx(np.sqrt((0 + 1 + 25 + 49) / 4))
    assert Steepest(np.arange(3.0), np.ones(3), np.zeros(3, bool)).straightness == np.inf


def test_contrast_is_inside_less_outside_over_the_noise():
    """The median of places three pixels to either side; the sign of what most of them do."""
    places, normals = np.array([[5.0, 5.0], [9.0, 5.0], [30.0, 5.0]]), np.tile([1.0, 0.0], (3, 1))
    coarse = SimpleNamespace(levels=lambda at: 7.0 * at[:, 0] ** 2, noise=2.0)
    expected = np.median(7 * ((places[:, 0] - 3) ** 2 - (places[:, 0] + 3) ** 2)) / 2
    assert contrast(coarse, places, normals) == pytest.approx(expected)
    for outside, sign in ((0.6, 1), (0.5, 1), (0.4, -1)):  # the rise a pixel inside, at the outline, and outside
        rises = {-1.0: -2.0, 0.0: 1.5, 1.0: outside}
        told = SimpleNamespace(across=lambda at, along, asked, rises=rises: np.array([[rises[each] for each in asked]]))
        assert sign_of(told, places, normals) == sign


@pytest.mark.parametrize(("beside", "area", "is_one_of_many"), [
    (0.0, 400.0, False), (0.6, 400.0, True), (0.4, 400.0, False), (0.6, 24.1**2, False), (0.6, 23.9**2, True),
])  # fmt: skip
def test_a_small_shape_among_others_is_texture(beside, area, is_one_of_many):
    """With slopes above half of its own beside it; not a large one."""
    gx = np.zeros((60, 60), np.float32)
    gx[:, 34:40] = beside
    coarse = SimpleNamespace(gx=gx, gy=np.zeros_like(gx), across=lambda *given: np.array([[1.0], [-1.0], [1.0]]))
    coarse.slopes = partial(Coarse.slopes, coarse)
    places = np.array([[30.0, 20.0], [30.0, 30.0], [30.0, 40.0]])
    assert texture(coarse, places, np.tile([1.0, 0.0], (3, 1)), area) == is_one_of_many


@pytest.mark.parametrize(("count", "told"), [(19, False), (20, True), (200, True)])
def test_patches_louder_than_others_of_their_level_do_not_count(count, told, rng):
    """By the chi-square that one in many exceeds; the noise grows with the level, and of few nobody knows."""
    level = np.linspace(10, 200, count)
    variance = 1.0 + (0.0 if count < 60 else 0.05) * level
    variance[count // 2] *= 9.0
    found = _loud(variance * rng.uniform(0.95, 1.05, count), level, 0.0, 46)
    assert np.flatnonzero(found).tolist() == ([count // 2] if told else [])
    quiet = _loud(variance, level, 1e6, 46)
    assert not quiet.any()
