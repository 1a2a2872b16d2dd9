"""Which settings a search names beside its best one."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner.search import candidates
from scenes import Pose

POLES = [(20.0 * k, 7.0) for k in range(1, 9)]  # further apart than candidates have to be


@pytest.fixture
def told(monkeypatch):
    """What a setting is worth when it is looked at closely: the further down the search's list, the less."""
    monkeypatch.setattr(
        candidates, "_candidate", lambda _, sensor, light: SimpleNamespace(variance=1 / sensor[0], sensor=sensor)
    )


def searched(*poles):
    """A search that gives its settings in the order of its own, faster evaluation."""
    rows = [(1 + 0.1 * k, None, np.array(pose), np.array([50.0, 300.0])) for k, pose in enumerate(poles)]
    made = SimpleNamespace(problem=None)
    made.rows = lambda count: [(value, made, *pair) for value, _, *pair in rows]
    return made


@pytest.mark.usefixtures("told")
def test_twice_as_many_are_looked_at_as_are_named():
    """Of eight the first four, of which the last two are the best."""
    found = candidates.candidates([searched(*POLES)], 2)
    assert [tuple(each.sensor) for each in found] == [POLES[3], POLES[2]]


@pytest.mark.usefixtures("told")
def test_what_is_four_times_as_dear_is_not_looked_at():
    """Nor would it be taken: here the last, which would be the best."""
    rows = [(value, None, np.array(pose), np.zeros(2)) for value, pose in zip((1.0, 3.9, 4.1), POLES, strict=False)]
    made = SimpleNamespace(problem=None)
    made.rows = lambda count: [(value, made, *pair) for value, _, *pair in rows]
    assert [tuple(each.sensor) for each in candidates.candidates([made], 3)] == [POLES[1], POLES[0]]


def test_where_a_close_look_refuses_the_best_the_others_are_looked_at(monkeypatch):
    def seen(_, sensor, light):
        return SimpleNamespace(variance=np.inf if sensor[0] != POLES[2][0] else 1.0, sensor=sensor)

    monkeypatch.setattr(candidates, "_candidate", seen)
    rows = [(value, None, np.array(pose), np.zeros(2)) for value, pose in zip((1.0, 3.9, 4.1), POLES, strict=False)]
    made = SimpleNamespace(problem=None)
    made.rows = lambda count: [(value, made, *pair) for value, _, *pair in rows]
    assert [tuple(each.sensor) for each in candidates.candidates([made], 3)] == [POLES[2]]


def test_what_does_not_measure_when_it_is_looked_at_closely_is_not_named(monkeypatch):
    def seen(_, sensor, light):
        return SimpleNamespace(variance=np.inf if sensor[0] == POLES[0][0] else 1.0, sensor=sensor)

    monkeypatch.setattr(candidates, "_candidate", seen)
    assert [tuple(each.sensor) for each in candidates.candidates([searched(*POLES[:2])], 2)] == [POLES[1]]


@pytest.mark.parametrize(
    ("values", "untrusted", "taken", "aside"),
    [((1.0, 0.8, 1.2), (0, 0, 0), 1, []), ((1.0, 0.8, 1.2), (0, 1, 0), 0, [1]), ((1.0, 1.1, 1.2), (1, 1, 0), 2, [1]),
     ((1.0, 1.1, 4.1), (1, 1, 0), 0, [])],
)  # fmt: skip
def test_the_best_that_can_be_trusted_is_taken_by_a_close_look(monkeypatch, values, untrusted, taken, aside):
    """Values of the search's best setting and of two others, and how many of their measurands are not ok."""
    looks = [
        candidates.RayTraced(np.array(pose), np.array([50.0, 300.0]), None, *known)
        for pose, *known in zip(POLES, values, untrusted, strict=False)
    ]
    by_pose = {each.sensor[0]: each for each in looks}
    monkeypatch.setattr(candidates.RayTraced, "of", lambda problem, sensor, light: by_pose[sensor[0]])
    problem = SimpleNamespace(scene=SimpleNamespace(required=("e1",)))
    choice = [
        SimpleNamespace(sensor=POLES[k], light=Pose(50, 300), edges=("e1",), variance=values[k]) for k in (1, 2)
    ]  # fmt: skip
    choice.sort(key=lambda each: each.variance)
    found, passed = candidates.trusted(problem, looks[0], choice, values[0])
    assert found is looks[taken]
    assert [POLES.index(each.sensor) for each in passed] == aside


@pytest.mark.usefixtures("told")
def test_settings_that_are_near_count_once():
    near = [(20.0, 7.0), (33.0, 7.0), (20.0, 40.0), (60.0, 7.0)]  # 13 degrees from the first, 11, and 40
    found = candidates.candidates([searched(*near)], 4)
    assert [tuple(each.sensor) for each in found] == [(60.0, 7.0), (20.0, 7.0)]


@pytest.mark.usefixtures("told")
def test_the_least_of_several_searches_are_first():
    """Those that two searches both list first: the rank within a search decides, not the search."""
    found = candidates.candidates([searched(*POLES[:4]), searched(*POLES[4:])], 1)
    assert [tuple(each.sensor) for each in found] == [POLES[4]]


@pytest.mark.parametrize("moved", [0, 1])
def test_a_setting_differs_where_sensor_or_light_does(moved):
    row = (1.0, None, np.array([30.0, 60.0]), np.array([40.0, 200.0]))
    for by, differs in ((14.0, False), (16.0, True)):
        other = [row[2].copy(), row[3].copy()]
        other[moved][0] += by
        assert candidates._differ(row, (2.0, None, *other)) == differs


def test_directions_are_taken_that_are_far_from_all_before():
    """Every 10 degrees along a meridian: 15 degrees are left between any two, so that each second one is taken."""
    angles = np.radians(10.0 * np.arange(9))
    directions = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], -1)
    assert candidates._spread(directions, 9) == [0, 2, 4, 6, 8]
    assert candidates._spread(directions, 3) == [0, 2, 4]
    assert candidates._spread(directions[[4, 3, 0, 1, 8]], 9) == [0, 2, 4]
