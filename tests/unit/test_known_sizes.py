"""Dots of a made pattern are where the others say; of one that is printed wrong they are not."""

from dataclasses import replace

import numpy as np
import pytest

import measure
from tests.boards import SMALL, poses
from tests.proofs.known_sizes import judged

RIG = replace(SMALL, board=(11, 8), square=9.0)


@pytest.fixture(scope="module")
def grid():
    pose, rng = poses(RIG, 1, np.random.default_rng(2), 260.0)[0], np.random.default_rng(3)
    return measure.dot_grid(RIG.dots(pose, 0.3, 4) + rng.standard_normal(RIG.size[::-1]), noise=1.0)


def test_dots_are_where_the_others_say(grid):
    row = judged(grid, "made", RIG.size[::-1], "k1,k2,p1,p2,k3,f")
    assert (row.used, row.held_out) == (44, 44)
    assert 0.5 < row.dispersion < 1.7  # margin: 3 standard deviations of a chi-square of some 70
    assert row.interval[0] < 0.95 < row.interval[1]
    assert row.off_px < 2 * row.told_px
    assert row.inside_enlarged >= row.inside


def test_a_lens_that_is_left_out_shows(grid):
    row = judged(grid, "made", RIG.size[::-1], "none")
    assert row.dispersion > 5
    assert row.inside < 0.8


def test_a_column_that_is_printed_wrong_shows(grid):
    """By a twentieth of a step: the other dots know better."""
    shifted = grid.corners.copy().reshape(*grid.shape[::-1], 2)
    shifted[:, 4] += (shifted[:, 5] - shifted[:, 4]) / 20
    row = judged(replace(grid, corners=shifted.reshape(-1, 2)), "made", RIG.size[::-1], "k1,k2,p1,p2,k3,f")
    assert row.dispersion > 5
    assert row.inside < 0.9
