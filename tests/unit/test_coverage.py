"""Who can see what: the fewest pictures that measure all, against brute force, and the reason of what none measures."""

from itertools import combinations

import numpy as np
import pytest

import planner
import scenes
from planner import covering
from planner.covering import fewest
from tests.sides import sides
from validation.report import coverage_table


@pytest.mark.parametrize("seed", range(20))
def test_no_fewer_sets_cover_everything(seed):
    rng = np.random.default_rng(seed)
    sets = rng.random((8, 6)) < 0.35
    sets[rng.integers(0, 8, 6), np.arange(6)] = True  # everything is in some set
    chosen = fewest(sets)
    assert sets[chosen].any(0).all()
    fewer = combinations(range(8), len(chosen) - 1)
    assert not any(sets[list(some)].any(0).all() for some in fewer)


def test_rows_that_another_contains_are_left_out():
    tells = np.array([[1, 1, 0], [1, 0, 0], [0, 0, 1], [1, 1, 0], [0, 0, 0]], bool)
    assert sorted(covering._kinds(tells).tolist()) == [[False, False, True], [True, True, False]]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Widths of front, back and top of a block: no one picture sees front and back."""
    return planner.coverage(sides(tmp_path_factory.mktemp("sides"), "front", "back", "top"), step_deg=30)


def test_two_pictures_see_front_and_back(found):
    assert len(found.shots) == found.bound == 2
    assert found.lost == ()
    seen = [set(shot.measures) for shot in found.shots]
    assert set.union(*seen) == {"front", "back", "top"}
    assert not any({"front", "back"} <= some for some in seen)
    for m, place in enumerate(found.places):
        told = [shot.prediction.measurands[m] for shot in found.shots]
        best = told[place.picture - 1]
        rivals = [each for each in told if each.status == best.status]
        assert best.variance_object == min(each.variance_object for each in rivals)
        assert (place.is_usable, place.status) == (best.ratio <= 0.5, best.status)


def test_what_is_predicted_there_is_what_a_prediction_says(found):
    for shot in found.shots:
        told = planner.predict(found.scene, shot.sensor, shot.light).measurands
        measured = tuple(each.name for each in told if np.isfinite(each.variance_object))
        assert measured == shot.measures
        assert [each.variance_object for each in told] == [each.variance_object for each in shot.prediction.measurands]


def test_parts_of_the_grid_are_counted(found):
    """By predictions at a glance of every pair of a coarse grid, one by one."""
    scene = found.scene
    limits = planner.Constraints().on_side_of(scene)
    some = planner.coverage(scene, step_deg=60)
    from planner.search.grid import Grid

    grid = Grid.of(scene, limits, 60, None, None)
    count = np.zeros(3)
    for sensor in grid.sensors:
        for light in grid.lights:
            if not limits.pairs(scene, sensor, light):
                continue
            told = planner.predict(scene, tuple(sensor), tuple(light), closely=False).measurands
            count += [np.isfinite(each.variance_object) for each in told]
    assert some.pairs == len(grid.sensors) * len(grid.lights)
    assert [place.part for place in some.places] == pytest.approx((count / some.pairs).tolist())


def test_one_picture_does_where_one_sees_all():
    assert [len(shot.measures) for shot in planner.coverage(scenes.load("plate"), step_deg=30).shots] == [5]


def test_what_is_seen_from_nowhere_is_named_with_its_reason(tmp_path):
    """The camera held above sees no front."""
    scene = sides(tmp_path, "front", "top")
    some = planner.coverage(scene, step_deg=30, sensor=(0, 0))
    assert [place.name for place in some.lost] == ["front"]
    (lost,) = some.lost
    assert (lost.part, lost.picture, lost.is_usable, lost.status) == (0.0, None, False, "not_visible")
    assert lost.reason
    (shot,) = some.shots
    assert tuple(shot.sensor) == (0, 0)
    assert shot.measures == ("top",)
    assert "Without the others, `ice plan SCENE` finds" in coverage_table.sentence(some)


def test_what_is_too_uncertain_everywhere_is_measured_all_the_same(tmp_path):
    scene = sides(tmp_path, "front", "top")
    tight = [one.model_copy(update={"tolerance": scenes.Tolerance(plus=1e-6, minus=1e-6)} if one.name == "top" else {})
             for one in scene.measurands]  # fmt: skip
    some = planner.coverage(scene.model_copy(update={"measurands": tuple(tight)}), step_deg=30)
    assert {place.name: place.is_usable for place in some.places} == {"front": True, "top": False}
    assert some.lost == ()


def test_a_tolerance_that_one_picture_cannot_keep_takes_a_second(tmp_path):
    """Both widths are seen by one picture, but not both well."""
    scene = sides(tmp_path, "front", "top")
    (shot,) = planner.coverage(scene, step_deg=30).shots
    ratios = [each.ratio for each in shot.prediction.measurands]
    best = []
    for name in ("front", "top"):
        alone = planner.coverage(sides(tmp_path, name), step_deg=30).places[0]
        assert alone.picture == 1
        best.append(planner.coverage(sides(tmp_path, name), step_deg=30).shots[0].prediction.measurands[0].ratio)
    assert max(np.array(ratios) / best) > 1.2  # margin: one picture sees one of them from aside
    tight = [one.model_copy(update={"tolerance": scenes.Tolerance(plus=half, minus=half)})
             for one, half in zip(scene.measurands, 0.02 * np.array(best) * 2.05, strict=True)]  # fmt: skip
    two = planner.coverage(scene.model_copy(update={"measurands": tuple(tight)}), step_deg=30)
    assert len(two.shots) == 2
    assert all(place.is_usable for place in two.places)


def test_it_is_the_tolerance_where_there_is_one():
    told = np.array([[[4.0, 1.0, 0.5]], [[3.9, 0.0, 0.0]]])
    usable = covering.usable_where(told, np.array([True, True, False]))
    assert usable.tolist() == [[[True, True, True]], [[False, False, False]]]


def test_several_free_lights_are_refused():
    scene = scenes.load("two_lights")
    with pytest.raises(scenes.InvalidInput, match="lights must be at most one that is free"):
        planner.coverage(scene)


def test_the_table_and_the_document_say_the_same(found):
    document = coverage_table.facts(found, 1.5)
    assert document["scene"] == found.scene.name
    told = document["coverage"]
    assert (told["bound"], told["lost"], told["step"], told["pairs"]) == (2, [], 30, found.pairs)
    assert [row["name"] for row in told["measurands"]] == ["front", "back", "top"]
    for row, place, record in zip(told["measurands"], found.places, found.as_rows(), strict=True):
        assert (row["places"], row["picture"], row["status"]) == (place.part, place.picture, place.status)
        assert (row["sigma"], row["ratio"]) == (record["sigma"], record["ratio"])
        assert row["sigma"] / 0.02 == pytest.approx(row["ratio"])
    for picture, shot in zip(told["pictures"], found.shots, strict=True):
        assert (picture["sensor"], picture["light"]) == (list(shot.sensor), list(shot.light))
    assert coverage_table.sentence(found) == (
        "2 pictures measure all 3 measurands; no one picture of the grid does. `ice plan SCENE --views 2` finds where "
        "they are most precise together."
    )
    assert repr(found) == "Coverage(front_back_top: 3 of 3 measurands, in 2 pictures)"
