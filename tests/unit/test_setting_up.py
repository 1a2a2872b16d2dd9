"""Plans that can be set up: poses of a tenth of a degree, and no cliff around them; poses written into a scene."""

import json
import shutil
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

import planner
import scenes
from imaging.geometry.projection import direction
from planner.search import candidates
from planner.search.candidates import SettingUp, how_far
from planner.search.objective import SearchProblem
from scenes import InvalidInput, Pose
from scenes.status import MEASURED
from tests.commands import ice


@pytest.mark.parametrize("name", ["task1", "wedge"])
def test_a_plan_is_measurable_as_printed_and_around(name):
    """By a close look at the pose and at ten within 0.2 degrees, drawn at random."""
    scene = scenes.load(name)
    found = planner.plan(scene, step_deg=45)
    assert found.steady
    poses = found.sensor, found.light
    assert all(round(angle, 1) == angle for pose in poses for angle in pose)
    assert planner.predict(scene, *poses).variance_object == found.prediction.variance_object
    rng = np.random.default_rng(7)
    for _ in range(10):
        near = [Pose(*_beside(pose, rng)) for pose in poses]
        seen = planner.predict(scene, *near)
        assert {each.status for each in seen.measurands} <= set(MEASURED)
        worst = max(
            each.variance_object / here.variance_object
            for each, here in zip(seen.measurands, found.prediction.measurands, strict=True)
        )
        # margin: the limit that a plan is asked for
        assert worst < 4


def _beside(pose, rng):
    """A pose less than 0.2 degrees away, by rejection."""
    while True:
        polar, azimuth = np.array(list(pose)) + rng.uniform(-1, 1, 2) * [0.2, 180 if pose.polar_deg < 0.5 else 5]
        if polar >= 0 and direction(np.array([polar, azimuth])) @ direction(np.array(list(pose))) > np.cos(
            np.radians(0.2)
        ):
            return float(polar), float(azimuth % 360)


class Cliff:
    """Less variance the nearer the sensor's polar angle is to 30, below which nothing can be measured."""

    scene, constraints = scenes.load("task1"), SimpleNamespace(allows=lambda *_: True, same_mount=False)

    def values(self, sensors, lights):
        return 1 + (sensors[:, 0] - 30) ** 2 + 0 * lights[:, 0]

    feasible_values = values

    def errors(self, sensors, lights):
        view = SimpleNamespace(names=("e1",))
        told = self.values(sensors, lights)[:, None] * [1.0, 2.0]
        return SimpleNamespace(
            measurands=SimpleNamespace(view=view), polar=sensors[:, 0], variances=told, variances_object=told
        )


def test_what_cannot_be_set_up_is_not_proposed(monkeypatch):
    """The first offer is clear of the cliff by what the pose may be off, and no farther than the first shell."""
    monkeypatch.setattr(candidates, "quantity_ranks", lambda errors, _: np.where(errors.polar < 30, 0, 11)[:, None])
    sensor, light = np.array([30.001, 40.0]), np.array([20.0, 300.0])
    ways = SettingUp(Cliff(), (False, False))
    assert not ways.is_steady(np.array([30.1, 40.0]), light)
    assert ways.is_steady(np.array([30.2001, 40.0]), light)
    first = next(ways.offers(sensor, light))
    assert 30.1 < first[0][0] <= 30.4  # margin: the first shell's radius
    assert np.array_equal(np.concatenate(first), np.round(np.concatenate(first), 1))
    assert next(SettingUp(Cliff(), (True, False)).offers(sensor, light), None) is None  # what is held stays


def test_a_steep_place_is_a_cliff(monkeypatch):
    """Where 0.2 degrees off the variance is more than four times as large."""
    monkeypatch.setattr(candidates, "quantity_ranks", lambda errors, _: np.full((len(errors.polar), 1), 11))
    steep, light = Cliff(), np.array([20.0, 300.0])
    for factor, steady in ((70, True), (80, False)):  # 1 + factor * 0.04: 3.8 and 4.2
        steep.values = lambda sensors, lights, factor=factor: 1 + factor * (sensors[:, 0] - 30) ** 2
        assert SettingUp(steep, (False, False)).is_steady(np.array([30.0, 40.0]), light) == steady


@pytest.mark.parametrize("side", [1, -1])
def test_a_cliff_is_seen_on_either_side_and_by_any_quantity(side, monkeypatch):
    """0.15 degrees before it nothing is steady, for one of two quantities is lost there; 0.21 before it all is."""

    def ranks(errors, _):
        return np.stack([np.full(len(errors.polar), 11), np.where(side * (errors.polar - 30) < 0, 0, 11)], -1)

    monkeypatch.setattr(candidates, "quantity_ranks", ranks)
    ways, light = SettingUp(Cliff(), (False, False)), np.array([20.0, 300.0])
    assert not ways.is_steady(np.array([30 + 0.15 * side, 40.0]), light)
    assert ways.is_steady(np.array([30 + 0.21 * side, 40.0]), light)


def test_a_picture_of_several_is_steady_for_some_quantities(monkeypatch):
    """The second is lost beyond the cliff; of steep variances neither is steady."""

    def ranks(errors, _):
        return np.stack([np.full(len(errors.polar), 11), np.where(errors.polar < 30, 0, 11)], -1)

    monkeypatch.setattr(candidates, "quantity_ranks", ranks)
    cliff, light = Cliff(), np.array([20.0, 300.0])
    ways = SettingUp(cliff, (False, False))
    assert ways.steady(np.array([30.15, 40.0]), light).tolist() == [True, False]
    assert ways.steady(np.array([30.21, 40.0]), light).tolist() == [True, True]
    cliff.values = lambda sensors, lights: 1 + 80 * (sensors[:, 0] - 31) ** 2
    assert ways.steady(np.array([31.0, 40.0]), light).tolist() == [False, False]


@pytest.mark.parametrize("held", [(False, False), (True, False), (False, True)])
def test_settings_to_their_digits(held):
    """What is held stays, and what would leave the allowed polar angles, or come too near to the other, by rounding."""
    limits = planner.Constraints((20.03, 60.0), (0.0, 180.0), camera_body=0, light_body=0, min_separation_deg=10.03)
    problem = SearchProblem.of(scenes.load("task1"), "calibrated", "object", limits)
    sensors = np.array([[31.26, 40.04], [20.04, 359.97], [30.06, 50.0], [45.0, 12.0]])
    lights = np.array([[17.11, 200.06], [50.0, 100.0], [40.12, 50.0], [60.06, 300.0]])
    found = SettingUp(problem, held).to_digits(sensors, lights)
    rounded = ([31.3, 40.0], [45.0, 12.0]), ([17.1, 200.1], [60.1, 300.0])
    for each, given, near, stays in zip(found, (sensors, lights), rounded, held, strict=True):
        assert each[[0, 3]] == pytest.approx(given[[0, 3]] if stays else np.array(near), abs=1e-9)
    if not any(held):
        assert found[0][1].tolist() == [20.04, 359.97]  # 20.0 is not allowed
        assert (found[0][2].tolist(), found[1][2].tolist()) == ([30.06, 50.0], [40.12, 50.0])


def test_sensor_and_lights_are_moved_by_what_each_may_be_off():
    """Sensor 0.6 and lights 0.5 degrees, both ways along each coordinate alone; all together by half of the square."""
    cliff = Cliff()
    cliff.scene = scenes.load("two_lights").with_(uncertainty={"sensor_deg": 0.3, "light_deg": 0.25})
    places = np.array([40.0, 10.0, 60.0, 200.0])
    sensors, lights = SettingUp(cliff, (False, False)).around(np.array([50.0, 100.0]), places)
    there = (sensors, [50, 100]), (lights[:, :2], [40, 10]), (lights[:, 2:], [60, 200])
    off = np.degrees([_apart(each, here) for each, here in there]).T
    assert off[0] == pytest.approx(0)
    single = [row for row in off[1:].round(3).tolist() if row.count(0.0) == 2]
    assert sorted(single) == sorted([[0.6, 0, 0]] * 4 + [[0, 0.5, 0]] * 4 + [[0, 0, 0.5]] * 4)
    ways = sensors[1:13] - [50.0, 100.0]
    # margin: to one side as far as to the other, but for the sphere's bend: 0.6^2 / 2 tan(50)
    assert ways.sum(0) == pytest.approx(0, abs=0.02)
    assert off[13:] == pytest.approx(np.broadcast_to([0.6, 0.5, 0.5], (16, 3)), rel=0.01)


def _apart(poses, here):
    """Angles between the directions of poses (n, 2) and one, rad."""
    return np.linalg.norm(direction(np.asarray(poses)) - direction(np.array(here, float)), axis=-1)


def test_poses_are_rounded_in_each_of_their_angles():
    """Azimuths of all lights stay below 360 degrees."""
    assert candidates.rounded(np.array([30.04, 359.96, 20.06, 359.97])).tolist() == [30.0, 0.0, 20.1, 0.0]


@pytest.mark.parametrize("held", [(False, True), (True, False)])
def test_what_is_held_keeps_the_digits_of_every_light(held):
    cliff = Cliff()
    cliff.scene = scenes.load("two_lights")
    sensor, lights = np.array([35.04, 40.03]), np.array([20.04, 300.02, 31.03, 11.04])
    for sensors, places in (
        SettingUp(cliff, held)._nearest(sensor, lights),
        SettingUp(cliff, held)._shell(sensor, lights, 0.4),
    ):
        for kept, given, stays in ((sensors, sensor, held[0]), (places, lights, held[1])):
            whole = np.broadcast_to(given, kept.shape)
            assert np.array_equal(kept, whole if stays else np.round(kept, 1))


def test_the_nearest_offer_is_the_best_of_all_roundings():
    """Against each written out; what is held keeps its digits."""
    problem = SearchProblem.of(scenes.load("task1"), "calibrated", "object")
    sensor, light = np.array([20.04, 123.46]), np.array([11.97, 359.98])
    offer = next(SettingUp(problem, (False, False)).offers(sensor, light))
    rounded = [(p, a, q, b) for p in (20.0, 20.1) for a in (123.4, 123.5) for q in (11.9, 12.0) for b in (359.9, 0.0)]
    best = min(rounded, key=lambda r: planner.predict(problem.scene, r[:2], r[2:]).variance_object)
    assert np.concatenate(offer) == pytest.approx(best, abs=1e-9)
    held = next(SettingUp(problem, (True, False)).offers(sensor, light))
    assert held[0].tolist() == [20.04, 123.46]


def test_uncertain_poses_are_asked_for_twice_their_uncertainty():
    scene = scenes.load("task1")
    assert how_far(scene.with_(uncertainty={"sensor_deg": 0.3}), "sensor") == 0.6
    assert how_far(scene.with_(jitter={"light_deg": 0.25}), "light") == 0.5
    assert how_far(scene.with_(uncertainty={"sensor_deg": 0.3}), "light") == 0.2


def test_the_poses_of_a_plan_are_written_into_its_scene(tmp_path):
    path = tmp_path / "own.toml"
    shutil.copy(scenes.find("task1"), path)
    before = path.read_text("utf-8")
    done = ice("plan", path, "--step", 30, "--no-check", "--write", "--json")
    assert done.returncode == 0
    document, after = json.loads(done.stdout), path.read_text("utf-8")
    assert document["written"] == str(path)
    told, known = tomllib.loads(after), tomllib.loads(before)
    assert told["settings"][0] == {"sensor": document["sensor"], "light": document["light"]}
    assert told["settings"][1:] == known["settings"]
    assert {**told, "settings": 0} == {**known, "settings": 0}
    assert [line for line in before.splitlines() if line.startswith("#")] == [
        line for line in after.splitlines() if line.startswith("#")
    ]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("task1",), "--write must be given with a scene file of your own, got the bundled scene task1"),
        (("task1", "--edges", "best"), "--write must be left out with --edges best"),
        (("task1", "--views", "2"), "--write must be left out with --views"),
    ],
)
def test_where_nothing_can_be_written_nothing_is_searched(arguments, told):
    done = ice("plan", *arguments, "--write")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert told in done.stderr


def test_only_setting_is_replaced(tmp_path):
    from validation.planned_scene import check_writable, write

    path = tmp_path / "own.toml"
    text = scenes.find("two_lights").read_text("utf-8").split("[[settings]]")[0]
    path.write_text(text + "[[settings]] # here\nsensor = [30.0, 90.0]\nlight = [[1.0, 2.0], [3.0, 4.0]]\n", "utf-8")
    scene = scenes.load(path)
    found = SimpleNamespace(shares=(0.25, 0.75), scene=scene.with_(**{"lights[0].intensity": 0.25}))
    write(check_writable(str(path)), found, Pose(10, 20), (Pose(1, 2), Pose(5, 6)))
    again = scenes.load(path)
    assert [tuple(each.sensor) for each in again.settings] == [(10, 20)]
    assert [list(pose) for pose in again.settings[0].light] == [[1, 2], [5, 6]]
    assert [light.intensity for light in again.lights] == [0.25, scene.lights[1].intensity]
    assert "# here" in path.read_text("utf-8")
    with pytest.raises(InvalidInput, match="--write must be given with a scene file of your own"):
        check_writable("plate")
