"""What is proved of a box of poses holds for poses drawn in it, and a pose beside it breaks it."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import planner
import scenes
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.budgeting.features import Features
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import sources
from planner.certifying.cells import Boxes, LightCells, SensorCells
from planner.certifying.inputs import InputTerms
from planner.certifying.light_terms import LightTerms
from planner.certifying.pose_box import PoseBox
from planner.certifying.sensor_terms import SensorTerms
from planner.certifying.upper import upper_bounds
from planner.search.objective import SearchProblem
from scenes import InvalidInput, Picture
from tests.boxes import drawn_part, expanded, toleranced
from validation.cli.main import app

POSES = (30, 135), (15, 315)
INPUTS = {
    "sensor_deg": 0.1, "sensor_roll_deg": 0.2, "sensor_distance": 0.1, "part_shift": [0.1, 0.2, 0.3],
    "part_tilt_deg": [0.3, 0.1, 0.2], "principal_point_px": 1.0,
}  # fmt: skip
COVARIANCE = {"names": ["fx", "fy", "cx", "cy"],
              "matrix": [[1, 0.9, 0.2, 0], [0.9, 1.2, 0, 0.1], [0.2, 0, 4, 0.5], [0, 0.1, 0.5, 4]]}  # fmt: skip


def cells(name, count, half, seed):
    """Upper bounds of ``count`` random cells, and the largest of values drawn in each."""
    scene = scenes.load(name)
    problem, draws = SearchProblem.of(scene, "calibrated", "object"), np.random.default_rng(seed)
    places = [np.column_stack([draws.uniform(4, 60, count), draws.uniform(4, 356, count)]) for _ in range(2)]
    boxes = [Boxes(*(np.radians(each[:, k : k + 1] + [-half, half]) for k in (0, 1))) for each in places]
    terms = SensorTerms(scene, problem.objective)
    sensors, lights = SensorCells(terms, boxes[0]), LightCells(LightTerms(scene, terms.names), boxes[1])
    which = sensors._possible(boxes[0])[0]  # a cell may see several sets of faces
    told = upper_bounds(sensors, lights, np.column_stack([np.arange(len(which)), which]))[0].max(-1)
    bound, most = np.full((2, count), -np.inf)
    np.maximum.at(bound, which, told)
    for _ in range(24):
        most = np.maximum(most, problem.values(*(each + draws.uniform(-half, half, each.shape) for each in places)))
    return bound, most


@pytest.mark.parametrize("name", ["task1", "wedge", "macro", "low_light"])
@pytest.mark.parametrize("half", [0.0, 0.3])
def test_no_drawn_pose_is_above_the_bound_of_its_cell(name, half):
    """Of a part, a wedge, a lens with a depth of field, shot noise; of single poses the bound is the value."""
    bound, most = cells(name, 40, half, 7)
    known = np.isfinite(bound)
    assert known.sum() > 20
    # margin: a bound that holds by its kind
    assert (most <= bound).all()
    if half == 0:
        assert bound[known] == pytest.approx(most[known], rel=2e-6)
        assert (known == np.isfinite(most)).mean() > 0.7  # few that can measure are not known to
    else:
        assert np.median(most[known] / bound[known]) > 0.95
    assert (most > 0.98 * bound)[known].sum() > 5  # one that is 2 % too low is caught


@pytest.mark.parametrize("name", ["task1", "wedge", "macro"])
def test_inputs_are_those_of_the_budget(name):
    """Each source by itself, and a calibration's covariance, against central differences of projections."""
    for said in [{key: value} for key, value in INPUTS.items()] + [{"covariance": COVARIANCE}]:
        scene = scenes.load(name).with_(uncertainty=said)
        given = tuple(each for each in sources(scene) if each.kind == "geometry")
        slopes = sensitivities(Features(Pictures.of(Picture.of(scene, (37, 140), (20, 300)))), given, biased=False)[0]
        u = np.array([each.told.u for each in given])
        v = np.array(COVARIANCE["matrix"]) if "covariance" in said else np.diag(u**2)
        found = InputTerms.of_scene(scene).of(np.radians([[37, 37]]), np.radians([[140, 140]]))[0][0, 0]
        assert found == pytest.approx(slopes @ v @ slopes, rel=2e-7), said


def test_inputs_in_cells():
    """No drawn pose has more than the bound of its cell."""
    scene = scenes.load("calibrated_rig")
    terms, draws = InputTerms.of_scene(scene), np.random.default_rng(3)
    middles = np.column_stack([draws.uniform(4, 60, 50), draws.uniform(0, 360, 50)])
    polar, azimuth = (np.radians(middles[:, k : k + 1] + [-0.5, 0.5]) for k in (0, 1))
    bound = terms.of(polar, azimuth)[0][:, 0]
    inside = np.array([draws.uniform(*part.T) for part in (polar, azimuth)])
    value = terms.of(*(np.repeat(part[:, None], 2, 1) for part in inside))[0][:, 0]
    # margin: a bound that holds by its kind
    assert (value <= bound).all()
    assert np.median(value / bound) > 0.7


def test_ranges_hold_what_they_should():
    """Factors of poses in a box are at most 1, outside more; one that reaches a pole holds all azimuths."""
    box = PoseBox(np.array([30.0, 90.0, 5.0, 0.0]), np.array([2.0, 6.0]))
    assert box.ranges == (((28.0, 32.0), (86.0, 94.0)), ((0.0, 11.0), (-180.0, 180.0)))
    draws = np.random.default_rng(1).uniform(-1, 1, (500, 4))
    assert (box.factors(*box.at(draws)) <= 1 + 1e-12).all()
    outside = box.times(1.3).at(np.sign(draws))
    assert box.factors(*outside) == pytest.approx(np.full(500, 1.3))


@pytest.mark.parametrize(
    ("scene", "poses", "k", "count"),
    [
        (toleranced("task1", 0.016), POSES, 4.0, 2000),
        (toleranced("wedge", 0.028), ((45, 5), (15, 60)), 4.0, 2000),
        (scenes.load("calibrated_rig"), ((10, 60), (10, 25)), 7.5, 40),
    ],
)
def test_a_box(scene, poses, k, count):
    """Of noise alone, of a wedge whose faces come into view, of inputs: U at drawn poses, in corners and beside it."""
    box = planner.installation_box(scene, *poses, k=k)
    draws, limit = np.random.default_rng(2).uniform(-1, 1, (count, 4)), box.limits[0]
    draws[: count // 2] = np.sign(draws[: count // 2])
    inside = expanded(scene, *box.poses.at(draws))
    # margin: a box that holds by its kind
    assert inside.max() <= box.U[0] <= limit
    assert box.share == pytest.approx(0.99)
    beside = expanded(scene, *(np.array([list(pose)], float) for pose in (box.limited_by.sensor, box.limited_by.light)))
    # margin: it is known to be too far off
    assert beside[0] > limit
    further = expanded(scene, *box.poses.times(1.1).at(np.sign(draws)))
    assert np.nan_to_num(further, nan=np.inf).max() > limit


def test_a_drawn_part_and_whole_budgets(tmp_path):
    """Whole budgets in the corners of a drawn part's box, at the variance meant and of the estimator that measures."""
    scene = drawn_part(tmp_path, 3, 0.03)
    box = planner.installation_box(scene, (35, 20), (15, 250), k=5.3)
    assert box.sensor_deg > 0
    signs = np.sign(np.random.default_rng(4).uniform(-1, 1, (8, 4)))
    for sensor, light in zip(*box.poses.at(signs), strict=True):
        picture = Picture.of(scene, sensor, light)
        noise = variance_model("calibrated")(Pictures.of(picture)).variances_object
        own, other = planner.budget(picture, variances=noise, biased=False), planner.budget(picture)
        assert other.statuses == ("ok",)
        assert other.measurands[0].U <= own.measurands[0].U <= box.U[0]


def test_a_bound_that_is_too_low_is_caught(monkeypatch):
    """Negative control: variances bounded 2 % too low make a box in which a pose has too large a U."""
    scene = toleranced("task1", 0.016)
    monkeypatch.setattr("planner.certifying.within.upper_bounds", lambda *given: _lower(*upper_bounds(*given)))
    monkeypatch.setattr("planner.certifying.installation._SHARES", (1.005,))
    monkeypatch.setattr("planner.certifying.within.Within._against", lambda *_: None)
    box = planner.installation_box(scene, *POSES, k=4)
    assert box.sensor_deg > 0
    corners = np.sign(np.random.default_rng(2).uniform(-1, 1, (500, 4)))
    assert expanded(scene, *box.poses.at(corners)).max() > box.limits[0]


def _lower(bound, parts):
    return 0.98 * bound, parts


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"scene": toleranced("task1", 0.01), "k": 0}, "k must be above 0, got 0"),
        ({"scene": toleranced("task1", 0.01), "k": 100}, "poses must keep what is asked .* got U of length .* % above"),
        ({"scene": scenes.load("task1")}, "tolerance must be given for each measurand for a box, got none"),
        ({"scene": scenes.load("bracket_mm")}, "scene must be of one matt convex part"),
        ({"scene": toleranced("task1", 0.01, noise={"prnu": 0.01})}, "uncertainty.fixed_pattern must be false"),
        (
            {"scene": toleranced("task1", 0.01, uncertainty={"stage": {"positioning": 0.1}})},
            "inputs must be of",
        ),
    ],
)
def test_what_is_refused(given, message):
    """One line each."""
    with pytest.raises(InvalidInput, match=message):
        planner.installation_box(given.pop("scene"), *POSES, **given)


def test_the_command():
    """Its JSON, its words, and what it refuses."""
    told = CliRunner().invoke(app, ["budget", "calibrated_rig", "--box", "7.5", "--json"])
    assert told.exit_code == 0, told.output
    box = json.loads(told.stdout)["box"]
    assert box["measurands"][0]["U"] <= box["measurands"][0]["limit"] == pytest.approx(0.05 / 7.5)
    assert box["held"] == ["distance of the sensor", "distance of the light"]
    told = CliRunner().invoke(app, ["budget", "calibrated_rig", "--box", "-1"])
    assert told.exit_code != 0
