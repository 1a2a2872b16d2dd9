"""What `ice new` proposes to measure of a part, and from where it looks."""

import numpy as np
import pytest
import trimesh

import planner
import scenes
from scenes import Pose
from scenes.measurands.proposed import _tolerance, proposed
from scenes.parts import mesh
from scenes.parts.part_file import with_walls
from scenes.parts.walls import recognised_walls
from tests.parts import Hole, bracket, prism, unevenly
from validation import first_look
from validation.first_look import FirstLook
from validation.new_scene import written


def plate(rng):
    """A plate of 90 x 60 x 8 mm with two holes of 12 and 8 mm, 40 mm and 10 mm apart."""
    holes = [Hole(x, y, r, unevenly(rng, 40), 0.0, 8.0) for x, y, r in ((25, 20, 6), (65, 30, 4))]
    return prism([(0, 0), (90, 0), (90, 8), (0, 8)], 60, holes, seed=int(rng.integers(100)))


def true_value(solid, measurand):
    """Of a proposed measurand, from the places of its features alone."""
    ends = []
    for feature in measurand.features:
        kind = type(feature).__name__
        if kind == "Centre":
            circle = solid.circle(feature.circle)
            if measurand.kind == "diameter":
                return 2 * circle.radius
            ends.append(circle.centre)
        elif kind == "Corner":
            ends.append(solid.vertex(feature.vertex))
        elif kind == "Wall":
            return 2 * solid.round(feature.surface).radius
        else:
            ends.append(solid.vertices[list(solid.edge(feature.edge).ends)])
    if measurand.kind == "width":
        (a, b), (c, d) = ends
        along = (d - c) / np.linalg.norm(d - c)
        away = (a + b) / 2 - c
        return float(np.linalg.norm(away - away @ along * along))
    return float(np.linalg.norm(np.subtract(*ends)))


def test_a_plates_sizes_bores_and_their_distance_are_proposed():
    solid = mesh.solid(plate(np.random.default_rng(4)))
    found = proposed(solid, "mm")
    values = {each.name: true_value(solid, each) for each in found}
    sorts = {name: sorted({round(v, 4) for n, v in values.items() if n.startswith(name)}) for name in (
        "diameter", "distance", "width", "length")}  # fmt: skip
    assert sorts == {
        "diameter": [8, 12],
        "distance": [round(float(np.hypot(40, 10)), 4)],
        "width": [8, 60, 90],
        "length": [60, 90],
    }
    names = [each.name for each in found]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("unit", "size", "tolerance"),
    [
        ("mm", 0.3, 0.06), ("mm", 5.9, 0.1), ("mm", 6.1, 0.2), ("mm", 31, 0.3), ("mm", 121, 0.5), ("mm", 401, 0.8),
        ("mm", 1001, 1.2), ("mm", 2001, 2.0), ("cm", 3.1, 0.03), ("inch", 1.0, 0.0079),
    ],
)  # fmt: skip
def test_tolerances_are_those_of_iso_2768_m_in_the_parts_unit(unit, size, tolerance):
    solid = mesh.solid(trimesh.creation.box((size, size, size)))
    assert {each.tolerance.plus for each in proposed(solid, unit)} == {tolerance}


def test_a_shaft_is_proposed_by_its_wall_and_its_ends():
    solid = mesh.solid(trimesh.creation.cylinder(4.0, 30.0, sections=48))
    solid = with_walls(solid, recognised_walls(solid))
    assert sorted(each.name for each in proposed(solid, "mm")) == ["diameter c1", "diameter c2", "diameter k1"]


def test_circles_on_one_axis_have_no_distance():
    """Rims of a step around one another lie in one plane; so do the ends of different bores."""
    ring = trimesh.creation.annulus(5.0, 9.0, 4.0, sections=48)
    assert not [m for m in proposed(mesh.solid(ring), "mm") if m.kind == "distance"]


def test_nothing_to_measure_is_a_scene_all_the_same(tmp_path):
    trimesh.creation.icosphere(2, 10.0).export(tmp_path / "ball.stl")
    new = written(tmp_path / "ball.stl", tmp_path / "ball.toml", "mm")
    scene, look = new.scene, new.look
    again = scenes.load(tmp_path / "ball.toml")
    assert (look is None) == (again.measurands == ()) == (scene.measurands == ())


RISER = [(0, 0), (20, 0), (20, 6), (18, 6), (18, 14), (0, 14)]  # its light on the step of 2 mm below is much of it


@pytest.mark.parametrize(
    ("part", "said", "closely"),
    [
        (trimesh.creation.box((30, 20, 8)), {"ok"}, {"ok"}),
        (bracket(24), {"glanced"}, {"ok"}),
        (prism(RISER, 12), {"glanced"}, {"ok", "clutter"}),
    ],
    ids=["box", "bracket", "riser"],
)
def test_what_is_written_is_what_was_predicted(tmp_path, part, said, closely):
    """The scene of the file has the measurands, poses and statuses that were told; every value is the part's own.

    Where faces send light to each other nothing is called ``ok`` that a close look may call ``clutter``.
    """
    part.export(tmp_path / "part.stl")
    look = written(tmp_path / "part.stl", tmp_path / "part.toml", "mm").look
    scene = scenes.load(tmp_path / "part.toml")
    assert scene.measurands == look.measurands
    assert (scene.settings[0].sensor, scene.settings[0].light) == (look.sensor, look.light)
    predicted = first_look.planner.predict(scene, look.sensor, look.light)
    assert (set(look.statuses), {each.status for each in predicted.measurands}) == (said, closely)
    for each, measurand in zip(predicted.measurands, scene.measurands, strict=True):
        assert each.value_object == pytest.approx(true_value(scene.all_walls, measurand), rel=1e-9)


def test_setting_where_most_can_be_relied_on_is_taken(monkeypatch):
    """Of those looked at the one with most `ok`; the first, whatever it shows, where none has any."""
    scene = scenes.load("task1").with_(settings=[])
    scene = scenes.Scene.model_validate({**scene.model_dump(), "task": None})
    candidates = proposed(scene.solid, "cm")
    for goods in ([0, 1, 2, 1], [0, 0, 0, 0], [1, 5, 6, 2]):
        asked = []

        def predict(told, sensor, light, *, roughly, goods=goods, asked=asked):
            assert roughly
            good = goods[len(asked)] if len(asked) < len(goods) else 0
            asked.append((sensor, light))
            return _Told([_Forecast("ok" if i < good else "clutter") for i in range(len(told.measurands))])

        monkeypatch.setattr(first_look.planner, "predict", predict)
        found = first_look.first_look(scene, candidates, lambda *_: None)
        assert isinstance(found, FirstLook)
        best = next((i for i, good in enumerate(goods) if good >= 3), int(np.argmax(goods)))
        assert (found.sensor, found.light) == asked[best]
        assert len({sensor for sensor, _ in asked}) == len(asked)
        wanted = {"ok"} if goods[best] else {"clutter"}
        assert set(found.statuses) == wanted
        assert len(found.measurands) == (goods[best] or 6)


class _Told:
    def __init__(self, measurands):
        self.measurands = measurands


class _Forecast:
    def __init__(self, status):
        self.status, self.reason = status, ""


def test_a_first_look_is_worth_what_is_predicted_there():
    """Half the zone over eight sigma, at most 1, and half of that from below: 192 pictures, as one by one."""
    scene = scenes.load("calibrated_rig").with_(**{"measurands[0].tolerance": {"plus": 0.02, "minus": 0.0}})
    both = [first_look._from(scene, polar) for polar in (first_look._BELOW, first_look._ABOVE)]
    sensors, lights, worth = map(np.concatenate, zip(*both, strict=True))
    assert len(sensors) == len(lights) == len(worth) == 192
    seen = np.flatnonzero(worth[:, 0])
    assert (worth[seen] < 1).any()
    assert (sensors[seen, 0] < 90).any()
    for i in [*seen[::9], *np.setdiff1d(np.arange(192), seen)[::20]]:
        told = planner.predict(scene, Pose.of(sensors[i]), Pose.of(lights[i])).measurands[0]
        expected = min(0.01 / 8 / told.variance_object**0.5, 1) * (0.5 if sensors[i, 0] > 90 else 1)
        assert worth[i, 0] == pytest.approx(expected, abs=1e-6)  # margin: rounded to six places


@pytest.mark.parametrize(("shown", "most", "count"), [(6, 6, 96), (6, 7, 192), (8, 20, 96), (7, 20, 192)])
def test_from_below_is_looked_only_where_more_could_be_seen_there(monkeypatch, shown, most, count):
    """16 measurands: what is seen from below is worth half, so 8 from above are not exceeded."""

    def seen(scene, polar):
        worth = np.zeros((96, 16))
        worth[:, :shown] = 1.0
        return np.full((96, 2), polar[0]), np.zeros((96, 2)), worth

    monkeypatch.setattr(first_look, "_from", seen)
    sensors, _, worth = first_look._from_everywhere(None, most)
    assert len(sensors) == len(worth) == count
    assert set(sensors[:, 0]) == ({60} if count == 96 else {60, 160})


def test_of_each_sensor_the_best_light_is_looked_at_closely():
    """Four lights of each of three sensors: the sensors by their best."""
    worth = np.array([[1, 2, 0, 0], [5, 0, 7, 0], [0, 0, 0, 6]], float).ravel()
    assert first_look._apart(worth, 2) == [1 * 4 + 2, 2 * 4 + 3]
    assert first_look._apart(worth, 5) == [1 * 4 + 2, 2 * 4 + 3, 0 * 4 + 1]


def test_lengths_and_what_they_may_be_off_are_the_standards():
    """ISO 2768-1, class m: the last length of each range, and just beyond it; of small ones a fifth."""
    table = {6: 0.1, 30: 0.2, 120: 0.3, 400: 0.5, 1000: 0.8, 2000: 1.2}
    beyond = [*list(table.values())[1:], 2.0]
    assert {length: _tolerance(length, "mm") for length in table} == table
    assert [_tolerance(length + 0.01, "mm") for length in table] == beyond
    assert (_tolerance(0.3, "mm"), _tolerance(40.0, "cm"), _tolerance(0.4001, "m")) == (0.06, 0.05, 0.0008)
