"""A plan's best settings, rendered: what the pictures say of their order, and whether noisy pictures bear it out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import measure
import planner
import render
import scenes
from render import Quality
from scenes import Pose
from validation import plan_check
from validation.plan_check import CheckedSetting, PlanCheck, _judged, check_plan
from validation.statistics import p_value

QUICK = Quality(samples=1, edge_samples=16, random_samples=4)
ROUGH = Quality(supersample=2, samples=1, edge_samples=64, random_samples=4)  # compared among themselves
IMAGES = 400


@pytest.fixture(scope="module")
def bracket():
    """The bracket's plan with the light held: its surfaces light each other, which its close look knows."""
    plan = planner.plan(scenes.load("bracket"), light=(30, 0), step_deg=20)
    return plan, check_plan(plan, 5, ROUGH)


@pytest.mark.render
def test_the_order_is_the_plans_where_surfaces_light_each_other(bracket):
    plan, found = bracket
    assert (found.settings[0].sensor, found.settings[0].light) == plan.poses
    assert len({row.sensor for row in found.settings}) == len(found.settings) == 5
    assert [row.rank_before for row in found.settings] == [1, 2, 3, 4, 5]
    assert not found.order_changed
    assert [row.rank_after for row in found.settings] == [1, 2, 3, 4, 5]
    assert {row.status for row in found.settings} == {"ok"}  # what light between the surfaces does is taken off
    assert all(row.propagated < row.with_bias < 2 * row.propagated for row in found.settings)
    assert found.without_formula == ("interreflection",)
    assert found.seconds > 0


def scattered(plan, row) -> np.ndarray:
    """Distances measured in noisy pictures of a setting, in the object: cm by the scale of the two predictions."""
    image = render.image(plan.scene, row.sensor, row.light, ROUGH)
    pictures = render.expose(image, plan.scene.noise, np.random.default_rng(5), IMAGES)
    values = measure.distance(pictures, plan.scene, row.sensor).value_px
    predicted = planner.predict(plan.scene, row.sensor, row.light)
    return values[np.isfinite(values)] * np.sqrt(predicted.variance_object / predicted.variance_image)


@pytest.mark.render
def test_noisy_pictures_bear_the_order_out(bracket):
    """Of the best and the worst, 400 noisy pictures each: the F-test refuses the other order at 0.1 %."""
    plan, found = bracket
    best, *_, worst = found.settings
    first, second = scattered(plan, worst), scattered(plan, best)
    assert stats.f.sf(first.var(ddof=1) / second.var(ddof=1), first.size - 1, second.size - 1) < 1e-3


@pytest.mark.render
def test_light_between_faces_is_known(bracket):
    """The proposed setting's 400 noisy pictures scatter as propagated and calibrated say (0.1 %); not as a glance does.

    A glance, as of the search, leaves out the light that the bracket's faces send to each other.
    """
    plan, found = bracket
    scatter = scattered(plan, found.proposed).var(ddof=1)
    assert p_value(scatter / found.proposed.propagated, IMAGES) > 1e-3
    assert p_value(scatter / found.proposed.calibrated, IMAGES) > 1e-3
    poses = (np.array([list(pose)]) for pose in (found.proposed.sensor, found.proposed.light))
    glanced = planner.variances(plan.scene, *poses, "calibrated", plan.objective)[0]
    assert p_value(scatter / glanced, IMAGES) < 1e-3


@pytest.mark.render
@pytest.mark.parametrize("objective", ["object", "image"])
def test_the_same_order_where_the_formulas_know_all(task1, objective):
    """Task1's candidates are further apart than a render's 2 %: nothing changes, and prediction and picture agree.

    With three times the noise, beside which the bias of edges along the pixels' rows is small.
    """
    noisy = task1.model_copy(update={"noise": task1.noise.model_copy(update={"sigma": 7.2})})
    plan = planner.plan(noisy, objective, light=(12, 32), step_deg=20)
    found = check_plan(plan, 3, QUICK)
    variances = [row.calibrated for row in found.settings]
    # margin: candidates are chosen so
    assert (np.diff(variances) > 0.03 * np.array(variances[:-1])).all(), "choose another step: candidates too near"
    assert found.order_changed is False
    assert found.proposed == found.settings[0]
    assert found.without_formula == ()
    assert variances[0] == pytest.approx(plan.variance)
    # margin: the renders' 2 %, and 1 %
    assert [row.ratio for row in found.settings] == pytest.approx([1, 1, 1], abs=0.03)


def test_several_measurands_are_checked_together():
    """The plate's worst ratio of sigma to tolerance, with and without a picture, circles and all."""
    found = check_plan(planner.plan(scenes.load("plate"), sensor=(30, 80), light=(35, 335)))
    (row,) = found.settings
    assert found.proposed == row
    assert row.status == "ok"
    assert row.calibrated == pytest.approx(planner.predict(scenes.load("plate"), (30, 80), (35, 335)).worst_ratio ** 2)
    assert row.ratio == pytest.approx(1, abs=0.1)


def test_best_of_other_edges_is_measured_with_those(task1):
    """With ``edges="best"`` a candidate is measured by its own required edges."""
    plan = planner.plan(task1, edges="best", sensor=(30, 135), light=(15, 315))
    other = next(task for task in planner.required_edges(task1) if task.edges != plan.scene.task.edges)
    candidate = replace(plan.candidates[0], sensor=Pose(45, 135), edges=other.edges)
    found = check_plan(replace(plan, candidates=(candidate,)), 2, QUICK)
    assert found.settings[1].edges == other.edges
    scene = task1.model_copy(update={"task": other})
    assert found.settings[1].calibrated == planner.predict(scene, (45, 135), (15, 315)).variance_object


def test_what_no_picture_would_put_first_is_not_rendered(monkeypatch):
    """Beyond so many times the least that a picture told; but one that is no `ok` picture leaves nothing out."""
    poses = [Pose(30, k) for k in (0, 20, 40, 60)]
    variances = dict(zip(poses, (1.0, 1.1, 1.4, 1.5), strict=True))

    def checked(found, sensor, light, edges, rank, quality):
        variance, state = variances[sensor], "clutter" if sensor in found.cluttered else "ok"
        return CheckedSetting(sensor, light, edges, variance, variance, state, (), rank)

    def plan(cluttered):
        others = [SimpleNamespace(sensor=p, light=p, edges=("e1",), variance=variances[p]) for p in poses[1:]]
        return SimpleNamespace(sensor=poses[0], light=poses[0], variance=1.0, scene=SimpleNamespace(required=("e1",)),
                               candidates=others, cluttered=cluttered)  # fmt: skip

    monkeypatch.setattr(plan_check, "_checked", checked)
    monkeypatch.setattr(measure, "region_of_interest", lambda *_, **__: None)
    found = check_plan(plan([]), farthest=1.25)
    assert ([row.sensor for row in found.settings], found.left_out) == (poses[:2], 2)
    found = check_plan(plan(poses[:1]), farthest=1.25)  # 1.1 is the least that is ok
    assert ([row.sensor for row in found.settings], found.left_out) == (poses[:2], 2)
    assert found.proposed is found.settings[1]
    assert check_plan(plan(poses), farthest=1.25).left_out == 0
    assert check_plan(plan([])).left_out == 0


def rows(*settings: tuple[float, float, str]) -> list[CheckedSetting]:
    pose = Pose(30, 40)
    return [
        CheckedSetting(pose, pose, ("e1",), before, after, state, (), rank)
        for rank, (before, after, state) in enumerate(settings, 1)
    ]


def ranks(found: PlanCheck) -> list[int | None]:
    return [row.rank_after for row in found.settings]


INF = float("inf")


def test_ok_comes_before_clutter():
    found = _judged(rows((1, 1, "clutter"), (2, 3, "ok"), (3, 2, "ok"), (4, INF, "low_contrast")), "", 1.0)
    assert ranks(found) == [3, 2, 1, None]
    assert found.proposed is found.settings[2]
    assert found.order_changed


def test_clutter_is_proposed_where_there_is_nothing_else():
    found = _judged(rows((1, INF, "not_visible"), (2, 2, "clutter")), "", 1.0)
    assert ranks(found) == [None, 1]
    assert found.proposed is found.settings[1]
    assert found.settings[0].ratio is None
    assert found.order_changed


def test_an_unmeasurable_last_one_changes_no_order():
    found = _judged(rows((1, 1.1, "ok"), (2, 2.2, "ok"), (3, INF, "short")), "", 1.0)
    assert ranks(found) == [1, 2, None]
    assert found.order_changed is False


def test_nothing_measurable_proposes_nothing():
    found = _judged(rows((1, INF, "short"), (2, INF, "low_contrast")), "", 1.0)
    assert (found.proposed, found.order_changed) == (None, None)
    assert found.reason == "none of the 2 pictures can be measured (low_contrast, short)"
