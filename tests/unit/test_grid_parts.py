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


def test_a_range_between_two_rings_is_its_middle():
    """Rings stand at 20 and 25 degrees: of 21 to 24 there is the one at 22.5, of 20 to 24 that at 20."""
    assert set(ViewingSpace(5.0, (21, 24)).poses[:, 0]) == {22.5}
    assert set(ViewingSpace(5.0, (20, 24)).poses[:, 0]) == {20.0}
    assert set(ViewingSpace(5.0, (16, 20)).poses[:, 0]) == {20.0}
