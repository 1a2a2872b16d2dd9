"""Which directions of a viewing space are neighbours."""

import numpy as np
import pytest

from planner.search.grid import ViewingSpace


@pytest.mark.parametrize("step", [90.0, 50.0, 10.0])
def test_neighbours_are_within_1_6_steps(step):
    """Never the direction itself, nor the one opposite, however wide the step."""
    space = ViewingSpace(step)
    for index in (0, len(space) // 2, len(space) - 1):
        apart = np.degrees(np.arccos(np.clip(space.directions @ space.directions[index], -1, 1)))
        near = sorted(np.flatnonzero((apart < 1.6 * step) & (np.arange(len(space)) != index)))
        assert sorted(space.neighbours(index)) == near
        assert near
    pairs = space.neighbour_pairs
    assert {tuple(sorted(pair)) for pair in pairs.tolist()} == {
        (i, int(j)) for i in range(len(space)) for j in space.neighbours(i) if i < j
    }  # fmt: skip
