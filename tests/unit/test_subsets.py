"""Sets of pictures from a table of what each tells: greedy with exchange against all sets, and against a bound."""

import math
from itertools import pairwise

import numpy as np
import pytest

from planner.search.candidates import DEAREST
from planner.search.sets import (
    PictureInformation,
    _relaxed,
    better,
    every_set,
    front,
    greedy,
    least_value,
    sets_of,
)


def random_table(seed: int, pictures: int = 14, over: str = "minimax") -> PictureInformation:
    """Some quantities are not seen, some are clutter."""
    rng = np.random.default_rng(seed)
    told = rng.uniform(0.1, 1, (pictures, 4)) ** 3 * (rng.uniform(size=(pictures, 4)) < 0.8)
    fine = rng.uniform(size=told.shape) < 0.7
    return PictureInformation(np.where(fine, told, 0.0), np.where(fine, 0.0, told), over)


def score(table: PictureInformation, members) -> tuple[int, float, float]:
    return table.of_sets(np.array(members)).at(0)


@pytest.mark.parametrize("over", ["minimax", "sum"])
def test_gap_to_all_sets(over):
    """Of 30 tables x 3 pictures: never better than the best of all 560 sets, which it mostly is."""
    gaps = []
    for seed in range(30):
        table = random_table(seed, over=over)
        found, best = score(table, greedy(table, 3)[-1]), score(table, every_set(table, 3))
        assert found[0] == best[0] == 0
        gaps.append(found[1] / best[1] - 1)
    assert min(gaps) > -1e-9
    assert np.mean(np.array(gaps) < 1e-9) >= 0.9  # margin: a share, which is 1 at most
    assert max(gaps) < 0.1


@pytest.mark.parametrize("over", ["minimax", "sum"])
def test_more_pictures_are_never_worse(over):
    for seed in range(10):
        table = random_table(seed, over=over)
        scores = [score(table, members) for members in greedy(table, 5)]
        assert all(not better(one, two) for one, two in pairwise(scores))


def test_what_is_left_out_is_not_missed():
    """The best of all sets of the front is the best of all sets, clutter and hidden quantities or not."""
    dropped = 0
    for seed in range(12):
        table = random_table(seed, 30)
        kept = front(table)
        dropped += len(table) - len(kept)
        whole = score(table, every_set(table, 2))
        assert score(table.only(kept), every_set(table.only(kept), 2))[:2] == pytest.approx(whole[:2])
    assert dropped > 0


@pytest.mark.parametrize("over", ["minimax", "sum"])
def test_nothing_stays_below_the_bound(over):
    close = []
    for seed in range(10):
        told = np.random.default_rng(seed).uniform(0.1, 1, (12, 4)) ** 3
        table = PictureInformation(told, np.zeros_like(told), over)
        bound, best = least_value(table, 3), score(table, every_set(table, 3))[1]
        assert bound <= best * (1 + 1e-9)  # margin: a bound, by its kind
        close.append(best / bound)
        if seed < 2:  # of many pictures the parts are nearly free
            assert score(table, greedy(table, 40)[-1])[1] * 40 == pytest.approx(bound * 3, rel=0.1)
    # margin: 2 % so that it is no rounding
    assert max(close) > 1.02  # so that a bound that is the best set itself would be noticed


def test_bound_where_something_is_never_measured():
    table = PictureInformation(np.array([[1.0, 0.0], [2.0, 0.0]]), np.zeros((2, 2)), "minimax")
    assert least_value(table, 2) == math.inf
    assert score(table, greedy(table, 1)[0])[:2] == (1, 0.5)


def test_clutter_counts_only_where_nothing_is_ok():
    table = PictureInformation(np.array([[1.0], [0.0]]), np.array([[0.0], [100.0]]), "minimax")
    assert score(table, [1])[1] == pytest.approx(DEAREST / 100)
    assert score(table, [0, 1])[1] == 1.0  # the trusted value alone
    assert greedy(table, 2) == ((1,), (1, 1))


def test_first_of_all_everything_is_measured():
    """A picture that sees both badly is taken before one that sees one of them well."""
    table = PictureInformation(np.array([[100.0, 0.0], [1.0, 1.0]]), np.zeros((2, 2)), "minimax")
    assert greedy(table, 1) == ((1,),)
    assert greedy(table, 2)[1] == (1, 1)  # the same worst ratio as beside the other one would be twice as large


def test_how_many_sets():
    assert [sets_of(4, count) for count in (1, 2, 3)] == [4, 10, 20]


def test_parts_of_two_pictures_in_closed_form():
    """Minimax: w (4, 1) + (1 - w) (1, 2) is alike for w = 1/4, of 1.75 each; the sum of 1 / (a w) and 1 / (b (1 - w)).

    The third picture is worth nothing beside the two.
    """
    bound, parts = _relaxed(np.array([[4.0, 1.0], [1.0, 2.0], [0.5, 0.5]]), "minimax")
    assert bound == pytest.approx(1 / 1.75, rel=1e-9)
    assert parts == pytest.approx([0.25, 0.75, 0], abs=1e-9)
    bound, parts = _relaxed(np.array([[9.0, 0.0], [0.0, 4.0]]), "sum")
    assert bound == pytest.approx((1 / 3 + 1 / 2) ** 2, rel=1e-9)
    assert parts == pytest.approx([0.4, 0.6], rel=1e-6)


@pytest.mark.parametrize(
    ("one", "other", "is_better"),
    [
        ((1, 9.0, 9.0), (2, 5.0, 1.0), True), ((2, 5.0, 1.0), (1, 9.0, 9.0), False),
        ((2, 3.0, 9.0), (2, 5.0, 1.0), True), ((2, 5.0, 1.0), (2, 3.0, 9.0), False),
        ((0, 5.0, 1.0), (0, 3.0, 9.0), False), ((0, 3.0, 9.0), (0, 5.0, 1.0), True),
        ((1, 4.0, 6.0), (1, 4.0 * (1 + 1e-10), 7.0), True), ((1, 4.0 * (1 + 1e-10), 6.0), (1, 4.0, 7.0), True),
        ((1, 4.0, 7.0), (1, 4.0 * (1 + 1e-10), 6.0), False), ((1, 4.0, 6.0), (1, 4.0, 6.0), False),
        ((1, 4.0, 6.0), (1, 4.0, 6.0 * (1 + 1e-10)), False),
    ],
)  # fmt: skip
def test_a_better_set_loses_less_then_is_less_then_less_in_all(one, other, is_better):
    """What differs by a part in 1e10 is the same."""
    assert better(one, other) == is_better
