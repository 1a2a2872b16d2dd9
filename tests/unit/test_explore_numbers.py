"""The numbers on the page of `ice explore`, of a scene with two lights and uneven tolerances, beside the planner's."""

import math
import statistics
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import planner
import scenes
from planner.search import local
from scenes import InvalidInput, Pose, Tolerance
from validation.batch.work import Chunk, Clean, Packed, TaskResult
from validation.explore import answers, best, preview, prove, sphere
from validation.explore.messages import Message
from validation.explore.state import SENSOR, State


@pytest.fixture(scope="module")
def scene():
    two = scenes.load("two_lights")
    zones = Tolerance(plus=0.03, minus=0.01), Tolerance(plus=0.002, minus=0.05)
    told = (m.model_copy(update={"tolerance": zone}) for m, zone in zip(two.measurands, zones, strict=True))
    one, other = two.lights
    return two.lit_by(one, other.model_copy(update={"distance": 80.0})).model_copy(update={"measurands": tuple(told)})


@pytest.mark.parametrize("moving", [SENSOR, 0, 1])
def test_the_sphere_is_the_prediction_with_that_thing_moved(scene, moving):
    """Two unlike lights and the sensor, one of them at other places; standard deviations in the object."""
    state = replace(State.first(scene), moving=moving)
    places = np.array([[50.0, 270.0], [62.0, 285.0], [70.0, 200.0]])
    found = np.concatenate(list(sphere.values(scene, state, places)))
    for place, row in zip(places, found, strict=True):
        at = Pose(*place)
        sensor = at if moving == SENSOR else state.sensor
        lights = tuple(list(at if i == moving else pose) for i, pose in enumerate(state.lights))
        wanted = [math.sqrt(planner.variances(one, list(sensor), lights, objective="object")) for one in _alone(scene)]
        assert row == pytest.approx(wanted, rel=1e-9)
    assert np.isfinite(found).any()


def _alone(scene):
    return [scene.model_copy(update={"measurands": (each,)}) for each in scene.measurands]


def test_the_sphere_is_found_anew_when_anything_else_moves(scene):
    first = replace(State.first(scene), moving=0)
    one, two = first.lights
    away = Pose(one.polar_deg + 5, one.azimuth_deg)
    assert sphere.key(replace(first, lights=(away, two))) == sphere.key(first)
    assert sphere.key(replace(first, measurand=1, shown="ratio")) == sphere.key(first)
    others = (
        replace(first, lights=(one, away)), replace(first, sensor=away), replace(first, moving=1),
        replace(first, moving=SENSOR),
    )  # fmt: skip
    assert len({sphere.key(each) for each in (first, *others)}) == 5


@pytest.mark.parametrize("measurand", [0, 1])
def test_what_is_said_of_a_place_is_the_planner_s(scene, measurand):
    """Sigma in the object and px, 2 sigma over half of the zone, colours of the sphere alike."""
    state = replace(State.first(scene), measurand=measurand, shown="ratio")
    told = answers.to_message(answers.answer(scene, state))["measurands"][measurand]
    each = planner.predict(scene, state.sensor, state.lights).measurands[measurand]
    half = (0.02, 0.026)[measurand]
    sigma = math.sqrt(each.variance_object)
    assert (told["sigma"], told["sigma_px"]) == pytest.approx((sigma, math.sqrt(each.variance_image)))
    assert (told["ratio"], told["tolerance"]) == pytest.approx((2 * sigma / half, half))
    assert (told["value"], told["nominal"]) == pytest.approx((each.value_object, each.nominal))
    sigmas = np.array([[sigma, 2 * sigma], [np.inf, np.nan]])
    shown = sphere.to_message(scene, state, sigmas)
    assert shown["values"] == [pytest.approx(2 * sigma * (1 + measurand) / half, rel=1e-3), None]
    plain = sphere.to_message(scene, replace(state, shown="sigma"), sigmas)
    assert plain["values"][0] == pytest.approx(sigma * (1 + measurand), rel=1e-3)


def test_the_worst_of_all_colours_the_sphere_unless_another_is_asked_for(scene):
    """The largest 2 sigma over its own half zone: of the first here, of the second where that is not to be had."""
    first = State.first(scene)
    assert first.shown == "worst"
    assert first.tolerable(scene) == first
    shown = sphere.to_message(scene, first, np.array([[0.010, 0.011], [0.002, 0.013], [np.inf, 0.013], [0.01, np.nan]]))
    assert shown["values"][:2] == [pytest.approx(2 * 0.010 / 0.02), pytest.approx(2 * 0.013 / 0.026)]
    assert shown["values"][2:] == [None, None]
    what = "2 sigma in per cent of half the tolerance zone"
    assert (shown["what"], shown["unit"], shown["shown"]) == (what, "", "worst")
    bare = scene.model_copy(
        update={"measurands": tuple(m.model_copy(update={"tolerance": None}) for m in scene.measurands)}
    )
    assert State.first(bare).shown == first.tolerable(bare).shown == "sigma"


def test_shares_of_a_variance_are_those_of_its_edges(scene):
    """They add to 1; each is what is left out when only that edge is without error."""
    state = State.first(scene)
    told = answers.answer(scene, state)
    assert sum(told.shares.values()) == pytest.approx(1.0)
    assert list(told.shares.values()) == sorted(told.shares.values(), reverse=True)
    assert told.limiting == max(told.shares, key=told.shares.get)


def test_a_proof_is_in_standard_deviations(scene):
    """Two measurands, some values lost: by `statistics`, the interval of what is left by SciPy."""
    rng, about, propagated, columns = np.random.default_rng(4), [], {}, {}
    for k, sigma in enumerate((0.002, 0.005)):
        values = 7.0 + k + sigma * rng.normal(size=60)
        values[5 : 9 + k] = np.nan
        columns[f"gradient:{k}"] = values
        propagated[f"gradient:{k}"] = (sigma**2, 7.0 + k, "ok")
        about.append({"name": f"m{k}", "unit": "cm", "value": 7.0 + k, "calibrated": (1.1 * sigma) ** 2,
                      "predicted_bias": 1e-4 * (k + 1)})  # fmt: skip
    clean = Clean(Packed.of(np.zeros((2, 2))), propagated, {"measurands": about}, {})
    pieces = [
        TaskResult(None, {0: Chunk({n: v[s] for n, v in columns.items()}, {}, {})}) for s in (np.s_[:25], np.s_[25:])
    ]
    for k, (proof, sigma) in enumerate(zip(prove.proofs(scene, clean, pieces), (0.002, 0.005), strict=True)):
        good = [float(v) for v in columns[f"gradient:{k}"] if math.isfinite(v)]
        measured = statistics.stdev(good)
        message = prove.to_message(proof)
        wanted = {
            "calibrated": 1.1 * sigma, "propagated": sigma, "measured": measured, "ratio": (measured / sigma) ** 2,
            "bias": statistics.fmean(good) - 7.0 - k, "predicted_bias": 1e-4 * (k + 1), "mean": statistics.fmean(good),
        }  # fmt: skip
        assert {name: message[name] for name in wanted} == pytest.approx(wanted)
        freedom = len(good) - 1
        ends = [(measured / sigma) ** 2 * freedom / stats.chi2.ppf(q, freedom) for q in (0.975, 0.025)]
        assert message["interval"] == pytest.approx(ends)
        assert (message["n"], message["failed"], message["name"]) == (60, 4 + k, f"m{k}")
        assert sum(message["counts"]) == len(good)


def test_together_each_measurand_has_its_own_number_of_views(scene):
    """Of three pictures one tells of the first and two of the second."""
    told = planner.predict(scene, State.first(scene).sensor, State.first(scene).lights).measurands
    used = np.array([[False, True], [True, False], [False, True]])
    together = SimpleNamespace(variances=np.array([4e-4, 9e-6]), status=("ok", "clutter"), used=used)
    found = [answers._forecast(each, together, m)["together"] for m, each in enumerate(told)]
    assert found == [
        {"sigma": pytest.approx(0.02), "status": "ok", "views": 1},
        {"sigma": pytest.approx(0.003), "status": "clutter", "views": 2},
    ]


@pytest.mark.parametrize(
    ("low", "high", "window"),
    [
        ((100, 50), (200, 90), (84, 34, 132, 72)), ((-90, -50), (-70, -45), (0, 0, 8, 8)),
        ((9e3, 8e3), (9.1e3, 8.1e3), (-8, -8, 8, 8)), ((-50, 20.5), (50, 40.5), (0, 4, 66, 53)),
    ],
)  # fmt: skip
def test_the_window_holds_the_object_and_12_percent_around_it_within_the_picture(scene, low, high, window, monkeypatch):
    """And 4 px; of what lies beside the picture eight pixels of its border, each way."""
    points = np.array([low, high, (np.nan, np.inf), low], float)
    monkeypatch.setattr(preview, "project", lambda *given: points)
    found = preview.window(scene, State.first(scene).picture(scene))
    size = scene.camera.width, scene.camera.height
    left, top = (start % full if start < 0 else start for start, full in zip(window[:2], size, strict=True))
    assert (found.left, found.top, found.width, found.height) == (left, top, *window[2:])


@pytest.mark.parametrize("measurand", [0, 1])
def test_the_way_down_is_by_the_measurand_that_is_looked_at_each_thing_on_its_side(scene, measurand, monkeypatch):
    """Of camera above and lights below; where a light would be above, nothing is to be found."""
    above, below = Pose(40.0, 300.0), (Pose(100.0, 290.0), Pose(110.0, 280.0))
    state = replace(State.first(scene), sensor=above, lights=below, measurand=measurand)
    kept = []

    def descend(start, value, **_):
        kept.append(lambda *poses: value(*poses, start.angles))
        return local.Refined(np.array([41.237, 301.0]), np.array([99.0, 291.111, 111.0, 279.0]), start.angles, 1.0)

    told = SimpleNamespace(variances_object=np.array([[3.0, 8.0]]))
    monkeypatch.setattr(best.SearchProblem, "errors", lambda *_: told)
    monkeypatch.setattr(local, "descend", descend)
    found = best.best_from(scene, state)
    assert found == replace(state, sensor=Pose(41.24, 301.0), lights=(Pose(99.0, 291.11), Pose(111.0, 279.0)))
    (value,) = kept
    lights = np.array([100.0, 290, 110, 280])
    assert value(np.array([40.0, 300]), lights) == (3.0, 8.0)[measurand]
    assert value(np.array([100.0, 300]), lights) == np.inf
    assert value(np.array([40.0, 300]), np.array([80.0, 200, 110, 280])) == np.inf


@pytest.mark.parametrize(("number", "good"), [(2**53, True), (2**53 + 1, False), (-1, False)])
def test_numbers_of_messages_are_such_that_javascript_has_them_exactly(number, good):
    text = f'{{"type": "state", "number": {number}}}'
    if good:
        assert Message.of(text).number == number
        return
    with pytest.raises(InvalidInput, match="number must be"):
        Message.of(text)
