"""What is said of all poses of a cell holds for poses drawn from it, and a bound that is too high is caught."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import planner
import scenes
from planner.certifying.cells import Boxes, LightCells, SensorCells, bounds
from planner.certifying.certificate import Certificate
from planner.certifying.enclosed import cosine, sine, variables
from planner.certifying.light_terms import LightTerms
from planner.certifying.sensor_terms import SensorTerms
from planner.search.grid import Grid
from planner.search.objective import SearchProblem
from scenes import InvalidInput
from tests.bounded import all_values
from validation.cli.main import app

NEAR = planner.Constraints(sensor_polar_deg=(25, 28), sensor_azimuth_deg=(10, 14), light_polar_deg=(10, 20))


def cells(name, count, half, seed):
    """Lower bounds of ``count`` random cells, and the least of values drawn in each; cells within the scale alone."""
    scene = scenes.load(name)
    problem, draws = SearchProblem.of(scene, "calibrated", "object"), np.random.default_rng(seed)
    places = [np.column_stack([draws.uniform(4, 60, count), draws.uniform(4, 356, count)]) for _ in range(2)]
    boxes = [Boxes(*(np.radians(each[:, k : k + 1] + [-half, half]) for k in (0, 1))) for each in places]
    terms = SensorTerms(scene, problem.objective)
    sensors, lights = SensorCells(terms, boxes[0]), LightCells(LightTerms(scene, terms.names), boxes[1])
    which = sensors._possible(boxes[0])[0]  # a cell may see several sets of faces
    told = bounds(sensors, lights, np.column_stack([np.arange(len(which)), which]))[0]
    bound = np.full(count, np.inf)
    np.minimum.at(bound, which, told)
    least = np.full(count, np.inf)
    for _ in range(24):
        moved = (each + draws.uniform(-half, half, each.shape) for each in places)
        least = np.minimum(least, problem.values(*moved))
    some = np.isfinite(least) & ~lights.hot
    return bound[some], least[some]


@pytest.mark.parametrize("name", ["task1", "wedge", "macro", "low_light"])
@pytest.mark.parametrize("half", [0.0, 0.3])
def test_no_drawn_pose_is_below_the_bound_of_its_cell(name, half):
    """Of a part, a wedge, a lens with a depth of field, shot noise; of single poses the bound is the value."""
    bound, least = cells(name, 60, half, 7)
    assert len(least) > 2
    # margin: a bound that holds by its kind
    assert (bound <= least).all()
    if half == 0:
        assert bound == pytest.approx(least, rel=2e-6)
        assert (1.02 * bound > least).any()  # one that is 2 % too high is caught
    else:
        assert np.median(bound / least) > 0.9


def test_a_cell_may_have_no_part_that_sees_its_faces(monkeypatch):
    """What is divided then has no parts, and what is not keeps its own."""
    scene = scenes.load("task1")
    boxes = Boxes(*np.radians([[[20.0, 24.0], [30.0, 34.0]], [[10.0, 14.0], [20.0, 24.0]]]))
    cells = SensorCells(SensorTerms(scene, SearchProblem.of(scene, "calibrated", "object").objective), boxes)
    monkeypatch.setattr(cells, "_is_possible", lambda boxes, seen: np.zeros(len(boxes.polar), bool))
    assert cells.quarters(np.array([0]))[0].size == 0
    monkeypatch.undo()
    first = len(cells.lost)
    parts = cells.quarters(np.array([0, 1]))
    assert (parts[0].size, parts[1].tolist()) == (0, list(range(first, len(cells.lost))))
    assert len(cells.lost) > first


def test_random_cells_of_any_size():
    """1000 cells, of which the widest tell little; a bound that is 2 % too high is caught."""
    caught = 0
    for half, seed in ((0.02, 1), (0.1, 2), (1.0, 3), (3.0, 4)):
        bound, least = cells("task1", 250, half, seed)
        # margin: a bound that holds by its kind
        assert (bound <= least).all()
        caught += int((1.02 * bound > least).sum())
    assert caught > 20


def test_enclosures_hold_values_and_slopes():
    """Of a function with all operations, against values and differences at drawn places."""
    draws = np.random.default_rng(3)
    first, second = np.array([[0.4, 0.6]]), np.array([[1.0, 1.3]])
    x, y = variables(first, second)
    found = ((sine(x) * cosine(y) + 0.3).square() / (x + y)).sqrt() - (x * y).at_least(0.55)

    def value(a, b):
        return np.sqrt((np.sin(a) * np.cos(b) + 0.3) ** 2 / (a + b)) - np.maximum(a * b, 0.55)

    a, b = draws.uniform(*first[0], 500), draws.uniform(*second[0], 500)
    assert (value(a, b) >= found.low).all()
    assert (value(a, b) <= found.high).all()
    assert found.high - found.low < 3 * np.ptp(value(a, b))
    step = 1e-6
    slopes = (
        (value(a + step, b) - value(a - step, b)) / (2 * step),
        (value(a, b + step) - value(a, b - step)) / (2 * step),
    )
    for k, each in enumerate(slopes):
        assert (np.abs(each - found.slope[k]) <= found.spread[k] + 1e-6).all()


def test_a_certificate_of_a_small_range_and_a_better_place():
    """A plan of a coarse grid that is not refined gets better on the way, and then no drawn pose is 1 % better."""
    task1 = scenes.load("task1")
    poor = planner.plan(task1, constraints=NEAR, step_deg=3, refined=False)
    found = planner.certified(poor, NEAR)
    assert found.certificate.proved
    assert found.certificate.better_by <= 0.01
    assert found.variance < poor.variance
    draws = np.random.default_rng(5)
    sensors = np.column_stack([draws.uniform(25, 28, 4000), draws.uniform(10, 14, 4000)])
    lights = np.column_stack([draws.uniform(10, 20, 4000), draws.uniform(0, 360, 4000)])
    assert planner.variances(task1, sensors, lights).min() >= found.certificate.least
    short = planner.certified(poor, NEAR, most=10)
    assert not short.certificate.proved


@pytest.mark.parametrize("name", ["printed_label", "ring_light", "two_lights"])
def test_other_scenes_are_refused(name):
    """Printed, under a light of some size, of two free lights: there are no bounds."""
    plan = planner.plan(scenes.load("task1"), constraints=NEAR, step_deg=3, refined=False)
    with pytest.raises(InvalidInput, match="scene must be of plane faces without print"):
        planner.certified(replace(plan, scene=scenes.load(name)), NEAR)


BESIDE = planner.Constraints(sensor_polar_deg=(30, 50), sensor_azimuth_deg=(90, 140), light_polar_deg=(5, 25))


@pytest.mark.parametrize("most", [50_000, 40])
def test_a_certificate_of_a_grid(most, monkeypatch):
    """Of a hollow part: no pair of the grid is below what is said; how near it is hangs on how many are evaluated."""
    monkeypatch.setattr("planner.certifying.certificate._MOST_EVALUATED", most)
    bracket = scenes.load("bracket")
    poor = planner.plan(bracket, constraints=BESIDE, step_deg=15, refined=False)
    found = planner.certified(poor, BESIDE, step_deg=5)
    told = found.certificate
    grid = Grid.of(bracket, BESIDE.on_side_of(bracket), 5.0)
    values = all_values(SearchProblem.of(bracket, "calibrated", "object"), grid.sensors, grid.lights)
    assert told.pairs == values.size
    assert told.least <= values.min()  # margin: a bound, by its kind
    assert told.proved == (most > 40)
    assert (found.variance < poor.variance) == told.proved
    assert told.better_by < (0.01 if told.proved else 0.9)
    assert told.told.startswith("at a glance, no pair of the 5 degree grid has less than")
    if told.proved:
        assert 1.02 * told.least > values.min()


def test_where_nothing_is_known_of_a_pair_that_is_said():
    """In place of a part of the variance that is none."""
    told = Certificate(False, 0.01, 1.0, 0.0, 400, False, grid_deg=2.0).told
    assert told == "at a glance, of some pairs of the 2 degree grid nothing is known"


def test_the_command():
    """Its JSON, and what it does not go with."""
    narrow = ["--sensor-polar", "25,28", "--sensor-azimuth", "10,14", "--light-polar", "10,20"]
    narrow += ["--light-azimuth", "30,60", "--no-check", "--json"]
    told = CliRunner().invoke(app, ["plan", "task1", "--certify", "--step", "3", *narrow])
    assert told.exit_code == 0, told.output
    facts = json.loads(told.stdout)["certificate"]
    assert set(facts) == {"proved", "within", "better_by", "least", "pairs", "within_scale", "grid_deg"}
    assert facts["grid_deg"] is None
    assert facts["proved"], told.output
    refused = CliRunner().invoke(app, ["plan", "task1", "--certify", "--views", "2"])
    assert refused.exit_code != 0
