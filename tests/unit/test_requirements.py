"""Lists of measurands: what a scene accepts, what a plan makes of several, and when a value keeps its tolerance."""

import numpy as np
import pytest
from scipy import stats

import planner
import render
import scenes
from imaging.models.calibrated import calibrated
from imaging.pictures import Pictures
from imaging.pose_scatter import pose_scatter
from planner.search.exhaustive import exhaustive, separable
from planner.search.grid import ViewingSpace
from planner.search.objective import Aim
from planner.uncertainty.conformity import decide
from scenes import InvalidInput, Tolerance
from tests.pairs import evaluate_pairs
from validation import statistics

V3, V6 = {"vertex": "v3", "edges": ["e4", "e9"]}, {"vertex": "v6", "edges": ["e7", "e11"]}
DIAGONAL = {"name": "diagonal", "kind": "distance", "features": [V3, V6], "tolerance": 0.02}
DEPTH = {"name": "depth", "kind": "width", "features": [{"edge": "e4"}, {"edge": "e7"}], "tolerance": 0.01}
ANGLE = {"name": "corner", "kind": "angle", "features": [{"edge": "e4"}, {"edge": "e9"}], "tolerance": 0.2}


def block(*measurands):
    data = scenes.load("task1").model_dump(exclude={"task", "settings", "same_scale"})
    return scenes.Scene.model_validate({**data, "measurands": list(measurands)})


@pytest.mark.parametrize(
    ("measurand", "line"),
    [
        ({"kind": "width", "features": [V3, {"edge": "e4"}]}, "features must be an edge, then an edge for kind width"),
        (
            {"kind": "diameter", "features": [{"edge": "e4"}]},
            "features must be a circle or a curved surface for kind diameter, got e4",
        ),
        ({"kind": "offset", "features": [V3]}, "features must be a corner or a circle, then an edge for kind offset"),
        ({"kind": "depth", "features": [V3]}, "kind must be one of 'distance', 'width'"),
        ({"kind": "angle", "features": [{"edge": "e4"}, {"edge": "e7"}]}, "must be edges that are not parallel"),
        ({"kind": "angle", "features": [{"edge": "e4"}, {"edge": "e6"}]}, "must be features in one plane, got e4, e6"),
        ({"kind": "width", "features": [{"edge": "e4"}, {"edge": "e9"}]}, "must be edges within 30 degrees of"),
        ({"kind": "width", "features": [{"edge": "e4"}, {"edge": "e99"}]}, r"features\[1\].edge must be one of e1, e2"),
        ({"kind": "distance", "features": [V3, V3]}, "must be different features, got 'v3' twice"),
        ({**DEPTH, "tolerance": -1}, "tolerance.plus must be at least 0, got -1"),
        ({**DEPTH, "tolerance": {"plus": 0, "minus": 0}}, "tolerance must be greater than 0 above or below"),
        ({**DEPTH, "nominal": [1, 2]}, "nominal must be one number for kind width"),
        ({**DEPTH, "colour": "red"}, "colour must be a known key"),
    ],
)  # fmt: skip
def test_bad_measurands(tmp_path, measurand, line):
    """One line that names file and key."""
    text = (scenes.load.__globals__["BUNDLED"] / "task1.toml").read_text().split("[task]")[0]
    shown = {"name": "it", **measurand}
    rows = "\n".join(f"{key} = {_toml(value)}" for key, value in shown.items())
    (tmp_path / "bad.toml").write_text(f"{text}\n[[measurands]]\n{rows}\n")
    with pytest.raises(InvalidInput, match=line) as told:
        scenes.load(tmp_path / "bad.toml")
    assert str(told.value).startswith(str(tmp_path / "bad.toml"))


def _toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return repr(value).replace("'", '"')


def test_either_a_task_or_a_list():
    data = scenes.load("task1").model_dump()
    with pytest.raises(ValueError, match="task or measurands must be given, not both, got both"):
        scenes.Scene.model_validate({**data, "measurands": [DEPTH]})
    with pytest.raises(ValueError, match="measurands must have different names, got 'depth' twice"):
        block(DEPTH, DEPTH)


def test_a_scene_that_asks_for_nothing_is_pictured_and_no_more():
    """The same image as with a task; who needs a quantity says so in one line."""
    asking = scenes.load("task1")
    pose = asking.settings[0]
    silent = scenes.Scene.model_validate({**asking.model_dump(), "task": None})
    assert (silent.features, silent.required) == ((), ())
    assert (
        np.abs(render.image(silent, pose.sensor, pose.light) - render.image(asking, pose.sensor, pose.light)).max()
        < 1e-9
    )
    for ask in (
        planner.plan,
        lambda scene: planner.predict(scene, pose.sensor, pose.light),
        lambda scene: scene.quantities,
    ):
        with pytest.raises(
            InvalidInput, match="task or measurands must be given to plan, predict or measure, got none"
        ):
            ask(silent)


def test_a_task_is_the_short_form_of_one():
    """The same values, variances and biases, by both ways."""
    listed = planner.predict(block(DIAGONAL), (30, 135), (15, 315))
    short = planner.predict(scenes.load("task1"), (30, 135), (15, 315))
    for name in ("value_px", "variance_px2", "variance_cm2", "bias_px", "status"):
        assert getattr(listed, name) == getattr(short, name)
    assert listed.measurands[0].ratio == pytest.approx(np.sqrt(short.variance_cm2) / 0.02)
    assert short.measurands[0].ratio is None


def test_joint_covariance_against_single_variances(rng):
    """Of sums with random weights: their gradients are the weighted sums of gradients."""
    errors = calibrated(Pictures.of(block(DIAGONAL, DEPTH, ANGLE), (30, 135), (15, 315)))
    gradient = errors.measurands.gradient_object
    whole = errors.covariance(gradient)
    assert np.diag(whole) == pytest.approx(errors.variances_object)
    for weights in rng.standard_normal((5, 3)):
        mixed = errors.covariance((weights @ gradient)[None])[0, 0]
        assert weights @ whole @ weights == pytest.approx(mixed, rel=1e-9)
    correlation = whole[0, 1] / np.sqrt(whole[0, 0] * whole[1, 1])
    assert 0.1 < abs(correlation) < 1  # they share edges  # margin: they share edges: neither 0 nor 1


@pytest.mark.parametrize("over", ["minimax", "sum"])
@pytest.mark.parametrize("model", ["calibrated", "paper"])
def test_exhaustive_search_for_several(model, over):
    """The bound exceeds nothing, excludes nearly all pairs, and the optimum is that of all pairs one by one."""
    scene, poses = block(DIAGONAL, DEPTH, ANGLE), ViewingSpace(12, (0, 90)).poses
    aim = Aim.of(scene.quantities, "object", over)
    found = exhaustive(scene, poses, poses, model, aim)
    pairs = np.stack(np.meshgrid(np.arange(len(poses)), np.arange(len(poses)), indexing="ij"), -1).reshape(-1, 2)
    exact = evaluate_pairs(scene, poses[pairs[:, 0]], poses[pairs[:, 1]], model, aim).reshape(len(poses), -1)
    assert found.variance == pytest.approx(exact.min(), rel=1e-12)
    assert found.evaluated < 0.1 * exact.size
    table = separable(scene, poses, poses, model, aim)
    for which in range(len(table.strength)):
        rows, columns, matrix = table.of_class(which)
        bound = table.rows(rows, matrix)
        there = exact[np.ix_(table.sensors[rows], columns)]
        assert (bound <= there).all()  # margin: a bound, by its kind: equality is allowed
        close = np.isfinite(there)
        # margin: no empty bound: half of what is there, in the median
        assert np.median((bound / there)[close]) > 0.5  # and it is no empty one


def test_what_is_minimised():
    """The worst ratio by hand, the limiting measurand, and other weights in the sum."""
    scene = block(DIAGONAL, DEPTH, ANGLE)
    p = planner.predict(scene, (30, 135), (15, 315))
    ratios = np.sqrt(np.diag(p.covariance_object)) / [0.02, 0.01, 0.2]
    assert planner.variances(scene, (30, 135), (15, 315)) == pytest.approx(ratios.max() ** 2)
    assert p.limiting == ("diagonal", "depth", "corner")[int(ratios.argmax())]
    assert p.worst_ratio == pytest.approx(ratios.max())
    heavy = block(DIAGONAL, {**DEPTH, "weight": 5.0}, ANGLE)
    aim = Aim.of(heavy.quantities, "object", "sum")
    assert aim(np.diag(p.covariance_object)) == pytest.approx((ratios**2 * [1, 5, 1]).sum())
    found = planner.plan(scene, step_deg=15)
    assert found.limiting in ("diagonal", "depth", "corner")
    assert found.variance == pytest.approx(found.prediction.worst_ratio**2)
    assert found.variance <= p.worst_ratio**2  # margin: the least of all is no more than one of them
    tight = planner.plan(block(DIAGONAL, {**DEPTH, "tolerance": 1e-4}, ANGLE), step_deg=15, refined=False)
    assert tight.limiting == "depth"


@pytest.mark.parametrize(
    ("how", "line"),
    [
        ({"objective": "image"}, "objective must be object for 2 measurands, got 'image'"),
        ({"over": "mean"}, "over must be one of minimax, sum, got 'mean'"),
    ],
)
def test_bad_aims(how, line):
    with pytest.raises(InvalidInput, match=line):
        planner.plan(block(DIAGONAL, DEPTH), **how)


def test_several_need_tolerances():
    bare = {key: value for key, value in DEPTH.items() if key != "tolerance"}
    with pytest.raises(InvalidInput, match=r"tolerance must be given for each of 2 measurands .* got none for depth"):
        planner.plan(block(DIAGONAL, bare))
    assert planner.plan(block(bare), step_deg=20).limiting == "depth"


def test_pose_scatter_by_monte_carlo(rng):
    """Values in the image and, back-projected by who trusts the pose, in the object; 1.3 x and 0 are rejected."""
    scene = block(DIAGONAL, DEPTH, ANGLE).model_copy(update={"jitter": scenes.Jitter(sensor_deg=0.05)})
    at, count = np.array([[40.0, 100.0]]), 3000
    found = pose_scatter(scene, at)
    off = rng.standard_normal((count, 2)) * 0.05 / [1, np.sin(np.radians(40.0))]
    from dataclasses import replace

    from imaging.features.kinds import in_image, on_plane
    from imaging.features.measurand import measurands

    there = measurands(Pictures.of(scene, at + off)).seen
    trusted = replace(there, sensors=np.broadcast_to(at, (count, 2)).copy(), expected=False)
    for kind, seen, covariance in ((in_image, there, found.covariance), (on_plane, trusted, found.covariance_object)):
        for k, quantity in enumerate(scene.quantities):
            ratio = kind(seen, quantity).value.var(ddof=1) / covariance[0, k, k]
            assert ratio == pytest.approx(1, abs=5 * np.sqrt(2 / count))
            assert ratio / 1.3 < 1 - 5 * np.sqrt(2 / count)  # margin: 30 % are beyond 5 standard errors


def test_guard_band():
    """ISO 14253-1: proved inside, proved outside, and neither; both limits and both sides."""
    zone = Tolerance(plus=0.03, minus=0.01)
    inside, outside = (9.9981, 10.0219), (9.9819, 10.0381)
    between = (9.9979, 10.0221, 10.0379, float("nan"))
    cases = dict.fromkeys(inside, "pass") | dict.fromkeys(outside, "fail") | dict.fromkeys(between, "undecided")
    for value, wanted in cases.items():
        assert decide(value, 0.004, 10.0, zone) == wanted
    assert decide(10.0299, 0.0, 10.0, zone) == "pass"
    with pytest.raises(InvalidInput, match="k must be at least 0, got -1"):
        decide(10.0, 0.1, 10.0, zone, k=-1)


def test_guard_band_keeps_its_promise(rng):
    """A part just beyond its limit passes in at most 2.3 % of measurements, not in half of them."""
    zone, count = Tolerance(plus=0.02, minus=0.02), 20_000
    values = 10.02 + 0.004 * rng.standard_normal(count)
    passed = np.mean([decide(value, 0.004, 10.0, zone) == "pass" for value in values])
    assert passed == pytest.approx(stats.norm.sf(2), abs=4 * np.sqrt(0.023 / count))


def test_pooling_of_correlated_rows(rng):
    """Five values of correlation 0.8 in each image: the pooled test rejects as often as it claims, not three times."""
    count, trials, rho = 100, 400, 0.8
    root = np.linalg.cholesky(np.full((5, 5), rho) + (1 - rho) * np.eye(5))
    share = 5 / ((np.full((5, 5), rho) + (1 - rho) * np.eye(5)) ** 2).sum()
    rejected = np.zeros(2)
    for _ in range(trials):
        ratios = (root @ rng.standard_normal((5, count))).var(1, ddof=1)
        for i, independent in enumerate((share, 1.0)):
            pooled = statistics.verdict(ratios, [count] * 5, 0.1, independent=independent).pooled
            rejected[i] += pooled.p_value < 0.05
    assert rejected[0] / trials < 0.05 + 4 * np.sqrt(0.05 * 0.95 / trials)  # margin: 4 standard errors
    assert rejected[1] / trials > 0.12  # margin: 10 standard errors above the twentieth that is claimed
