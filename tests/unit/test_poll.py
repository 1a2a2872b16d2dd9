"""The local search that asks many settings at a time: functions whose minima are known."""

import numpy as np
import pytest

from planner.search.local import Start, poll
from scenes import InvalidInput

BEGIN = np.array([40.0, 50.0]), np.array([30.0, 200.0])
BEST = np.array([43.0, 57.0]), np.array([27.0, 204.0])
WEIGHTS = np.array([1.0, 0.04, 9.0, 0.5])


def start(**said):
    return Start(*BEGIN, unit_deg=10.0, **said)


def away(sensors, lights):
    return np.concatenate([sensors - BEST[0], lights - BEST[1]], 1)


def bowl(sensors, lights):
    """1 at its bottom."""
    return 1 + (WEIGHTS * away(sensors, lights) ** 2).sum(1) / 100


def ridge(sensors, lights):
    """The largest of four, as of several measurands: no slope at its bottom but kinks, which simplices stall at."""
    return 1 + (np.sqrt(WEIGHTS) * np.abs(away(sensors, lights))).max(1) / 10


@pytest.mark.parametrize("values", [bowl, ridge])
def test_it_ends_near_the_minimum(values):
    """Setting up rounds to a tenth of a degree."""
    found = poll(start(), values)
    assert found.value == pytest.approx(values(found.sensor[None], found.lights[None])[0], rel=1e-12)
    assert 1 <= found.value < 1.02  # margin: begins at 2.0 and 1.9


def test_it_asks_many_at_a_time():
    sizes = []
    poll(start(), lambda sensors, lights: sizes.append(len(sensors)) or bowl(sensors, lights))
    assert sizes[0] == 1
    assert set(sizes[1:]) == {48}  # margin: both ways along three bases of four directions, on two shells
    assert 5 < len(sizes) < 40


def test_it_keeps_to_what_is_feasible_and_begins_where_it_was_told_to():
    def walled(sensors, lights):
        return np.where(sensors[:, 0] > 41, np.inf, bowl(sensors, lights))

    found = poll(start(), walled)
    assert 40.9 < found.sensor[0] <= 41
    nowhere = poll(start(), lambda sensors, _: np.full(len(sensors), np.nan), known=5.0)
    assert (nowhere.value, nowhere.sensor.tolist()) == (5.0, BEGIN[0].tolist())
    with pytest.raises(InvalidInput, match="must begin at a pose that is allowed"):
        poll(start(), lambda sensors, _: np.full(len(sensors), np.inf))


def test_what_is_held_stays():
    found = poll(start(held=(True, False)), bowl)
    assert found.sensor.tolist() == BEGIN[0].tolist()
    assert found.lights == pytest.approx(BEST[1], abs=0.5)
    held = poll(start(held=(True, True)), bowl)
    assert held.value == bowl(*(part[None] for part in BEGIN))[0]
