"""Several lights that share a given total: searches against every combination evaluated one by one."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

import planner
import scenes
from planner.constraints import Constraints
from planner.search.grid import ViewingSpace
from planner.search.lights import Mixture, _Turns, search_shared, shares_of, shares_of_two, with_shares
from planner.search.objective import Aim, SearchProblem
from scenes import InvalidInput

STEP = 30


def quiet(*_):
    """No progress."""


@pytest.fixture(scope="module")
def scene():
    return scenes.load("two_lights")


def test_no_combination_of_the_grid_is_better(scene):
    """Every sensor, both lights anywhere, shares in tenths, by `planner.variances`."""
    places = ViewingSpace(STEP, (0, 75)).poses
    aim = Aim.of(scene.quantities, "object")
    found = search_shared(
        SearchProblem(scene, "calibrated", aim, Constraints()), places, places, shares_of_two(scene), quiet
    )
    each = np.array(list(product(range(len(places)), repeat=3)))
    allowed = Constraints().pairs(scene, places[each[:, 0]], np.hstack([places[each[:, 1]], places[each[:, 2]]]))
    each, best = each[allowed], np.inf
    for share in shares_of_two(scene):
        lights = tuple(places[each[:, k]] for k in (1, 2))
        values = planner.variances(with_shares(scene, share), places[each[:, 0]], lights)
        best = min(best, values.min())
    assert found.found.variance == pytest.approx(best, rel=0.02)
    assert found.found.variance >= best * (1 - 1e-9)  # margin: a minimum, by its kind: equality but for rounding
    # margin: 2 % so that it is no rounding
    assert found.alone.value > 1.02 * best  # one light is not enough here, so the test can tell


def test_two_lights_do_not_help_where_all_edges_want_the_same(task1):
    """Task1's four edges lie around one face: the best pair is the best light alone."""
    two = task1.light, task1.light
    both = task1.model_copy(update={"light": None, "several_lights": two, "settings": ()})
    found = planner.plan(with_shares(both, (0.5, 0.5)), step_deg=STEP, refined=False)
    assert max(found.shares) == 1
    assert found.variance == pytest.approx(found.alone)
    single = planner.plan(task1.model_copy(update={"light": with_shares(both, (0, 1)).lights[1]}), step_deg=STEP)
    assert found.variance == pytest.approx(single.grid_variance, rel=1e-6)


def test_shares_that_are_given_stay(scene):
    found = planner.plan(scene, step_deg=STEP, shares="given", refined=False)
    assert found.shares == pytest.approx((0.6, 0.4))
    assert found.alone is None
    assert shares_of(found.scene) == pytest.approx(found.shares)
    better = planner.plan(scene, step_deg=STEP, refined=False)
    assert better.variance <= found.variance * (1 + 1e-9)  # margin: a minimum over more, by its kind
    assert len(better.light) == 2


def test_the_only_light_at_the_camera():
    """Nothing but the sensor is searched; the candidates' lights are none."""
    found = planner.plan(scenes.load("ring_light"), step_deg=STEP)
    assert found.light == ()
    assert found.prediction.status == "ok"
    assert found.sensor.polar_deg < 5


def test_lights_by_turns_with_a_circle():
    """Where no formula tells of mixtures: no single move to another place of the grid is better."""
    plate = scenes.load("plate")
    both = plate.model_copy(update={"light": None, "several_lights": (plate.light, plate.light), "settings": ()})
    limits = Constraints(sensor_polar_deg=(0, 30), light_polar_deg=(0, 45))
    found = planner.plan(with_shares(both, (0.5, 0.5)), step_deg=STEP, constraints=limits, refined=False)
    assert found.guarantee.startswith("none")
    tried = planner.variances(
        found.scene, list(found.sensor), (list(found.light[0]), ViewingSpace(STEP, (0, 45)).poses)
    )
    assert tried.min() >= found.grid_variance * (1 - 1e-6)  # margin: a minimum, by its kind


@pytest.mark.parametrize("shares", ["best", "given"])
def test_a_sensor_that_is_held_keeps_its_place_and_gets_the_best_lights(scene, shares):
    """Held where the free plan puts it, and elsewhere, with and without a descent below the grid."""
    free = planner.plan(scene, step_deg=60, shares=shares, refined=False)
    held = planner.plan(scene, step_deg=60, shares=shares, sensor=free.sensor, refined=False)
    assert (held.sensor, held.light, held.shares) == (free.sensor, free.light, free.shares)
    assert held.variance == pytest.approx(free.variance, rel=1e-9)
    other = planner.plan(scene, step_deg=60, shares=shares, sensor=(58.3, 275.1))
    assert tuple(other.sensor) == (58.3, 275.1)
    assert np.isfinite(other.variance)


def test_what_cannot_be_planned(scene):
    with pytest.raises(InvalidInput, match=r"light must be 2 pose\(s\), one for each free light, got 1"):
        planner.plan(scene, light=(10, 10), sensor=(40, 280))
    with pytest.raises(InvalidInput, match="shares must be one of best, given"):
        planner.plan(scene, shares="some")


def test_a_backlight_falls_out_for_a_hole():
    """A bore's lower rim under a lamp from above or before a backlight: the latter gets all of their total."""
    plate = scenes.load("backlight_plate")
    both = (scenes.Light(distance=200.0, intensity=0.5), plate.lights[0].model_copy(update={"intensity": 0.5}))
    bore = plate.model_copy(
        update={"several_lights": both, "settings": (), "measurands": plate.measurands[:1]},
    )
    limits = Constraints(sensor_polar_deg=(0, 1), light_polar_deg=(20, 60))
    found = planner.plan(bore, step_deg=40, constraints=limits, refined=False)
    assert found.shares == (0.0, 1.0)


@pytest.mark.parametrize("role", [0, 1, 2])
def test_a_turn_moves_the_sensor_among_its_places_or_one_light_among_theirs(role):
    sensors, places = np.array([[1.0, 2], [3, 4], [5, 6]]), np.array([[10.0, 20], [30, 40]])
    asked = []
    turns = SimpleNamespace(sensors=sensors, places=places, _best=lambda *given: asked.append(given))
    here = Mixture(1.0, (0.4, 0.6), np.array([7.0, 8.0]), np.array([50.0, 60, 70, 80]))
    _Turns._moved(turns, here, role)
    ((shares, at, lit),) = asked
    assert shares == (0.4, 0.6)
    expected = np.tile(np.concatenate([here.sensor, here.lights]), (3 if role == 0 else 2, 1))
    expected[:, 2 * role : 2 * role + 2] = sensors if role == 0 else places
    assert np.hstack([at, lit]).tolist() == expected.tolist()
