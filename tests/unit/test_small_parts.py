"""Small steps of commands and pages, each by itself: by a closed form or with stand-ins for what it asks."""

from types import SimpleNamespace

import numpy as np
import pytest

import measure
import planner
from imaging.features.seen import Seen
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import project_ideal
from imaging.pictures import Pictures
from planner.budgeting import plans
from planner.search import lights
from scenes import InvalidInput, Jitter, Picture, Pose
from scenes.measurands import position
from validation import plan_check
from validation.batch import work
from validation.batch.repeated import RepeatedValues, row_status
from validation.cli import plan as plan_command
from validation.cli import recorded
from validation.cli.common import first_picture
from validation.explore import preview
from validation.report import sharpness


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("pose", [(25.0, 130.0), (70.0, 300.0)])
def test_a_unit_length_at_a_ball_is_as_long_as_its_ends_images_are_apart(task1, pose, axis):
    """Well off the camera's axis, by differences of the projection."""
    centre, pose, step = np.array([4.0, -7.0, 3.0]), np.array(pose), 1e-5 * np.eye(3)[axis]
    ball = SimpleNamespace(round=lambda name: SimpleNamespace(centre=centre))
    seen = Seen(ball, task1.camera, pose, (), np.empty((0, 2)), np.empty((0, 2)), {}, (), np.empty((0, 3)),
                np.empty(0), np.empty(0), expected=True)  # fmt: skip
    quantity = SimpleNamespace(axis=axis, features=[SimpleNamespace(surface="ball")])
    ends = project_ideal(np.array([centre + step, centre - step]), pose, task1.camera)
    assert position._scale(seen, quantity) == pytest.approx(np.linalg.norm(ends[0] - ends[1]) / 2e-5, rel=1e-6)


def test_what_lies_beside_an_object_is_seen_at_the_images_first_corner(task1, monkeypatch):
    """The outer corner of the first pixel."""
    pictures, asked = Pictures.of(Picture.of(task1, (35, 130), (20, 40))), []
    monkeypatch.setattr(preview, "seen_at", lambda pictures, image: asked.append(image) or np.array([7.5, 1.0]))
    assert preview._beside(pictures, task1) == 7.5
    (image,) = asked
    assert image.shape == (1, 2)
    assert image[0] + image_centre(task1.camera) == pytest.approx([-0.5, -0.5], abs=1e-12)


@pytest.mark.parametrize(("size", "count"), [((1024, 1024), 10), ((1025, 1024), 0), ((64, 48), 10), ((1, 1 << 21), 0)])
def test_small_pictures_are_rendered_unasked(size, count):
    scene = SimpleNamespace(camera=SimpleNamespace(width=size[0], height=size[1]))
    assert plan_command._renders(scene) == count


def test_sides_without_a_transfer_function_are_told_by_their_number(monkeypatch, tmp_path):
    """After those that have one; of the first quadrilateral that was measured."""
    asked, drawn = [], []

    def mtf(photo, corners, side):
        asked.append((photo, corners, side))
        if side in (0, 2):
            raise InvalidInput(f"too short: {side}")
        return SimpleNamespace(direction_deg=10.0 * side, mtf50=0.1 * side, mtf50_error=0.01 if side == 1 else np.inf)

    monkeypatch.setattr(measure, "mtf", mtf)
    monkeypatch.setattr(sharpness, "write", lambda path, sides: drawn.append((path, [side for side, _ in sides])))
    shapes = [
        SimpleNamespace(quadrilateral=None, measured=True, corners="of none"),
        SimpleNamespace(quadrilateral=1, measured=False, corners="not measured"),
        SimpleNamespace(quadrilateral=1, measured=True, corners="first"),
        SimpleNamespace(quadrilateral=1, measured=True, corners="second"),
    ]
    told = recorded.sharpness("photo", SimpleNamespace(found=shapes), tmp_path / "a.png")
    assert asked == [("photo", "first", side) for side in range(4)]
    assert drawn == [(tmp_path / "a.png", [2, 4])]
    assert told["mtf"] == [
        {"side": 2, "direction_deg": 10.0, "mtf50": 0.1, "error": 0.01},
        {"side": 4, "direction_deg": 30.0, "mtf50": pytest.approx(0.3), "error": None},
        {"side": 1, "refused": "too short: 0"}, {"side": 3, "refused": "too short: 2"},
    ]  # fmt: skip
    assert recorded.sharpness("photo", SimpleNamespace(found=shapes[:2]), tmp_path / "b.png") == {"mtf": []}
    assert len(drawn) == 1


def test_a_calibrations_correlations_stand_where_its_inputs_do():
    """By name, in any order; all else is independent."""
    given = [SimpleNamespace(name=name) for name in ("tilt", "cx", "shift", "fx", "k1")]
    correlation = np.array([[1.0, 0.3, -0.2], [0.3, 1.0, 0.5], [-0.2, 0.5, 1.0]])
    told = SimpleNamespace(names=("k1", "fx", "cx"), correlation=correlation)
    whole = plans._correlation(SimpleNamespace(uncertainty=SimpleNamespace(covariance=told)), given)
    wanted = np.eye(5)
    wanted[4, 3] = wanted[3, 4] = 0.3
    wanted[4, 1] = wanted[1, 4] = -0.2
    wanted[3, 1] = wanted[1, 3] = 0.5
    assert whole.tolist() == wanted.tolist()
    bare = SimpleNamespace(uncertainty=SimpleNamespace(covariance=None))
    assert plans._correlation(bare, given).tolist() == np.eye(5).tolist()


@pytest.mark.parametrize("first", [(30.0, 350.0), (0.0, 20.0)])
def test_settings_in_nearly_the_same_place_are_rendered_once(first):
    """Sensor and each light, across azimuth 0, too; the plan's own comes first."""
    here = Pose(*first), (Pose(20, 40), Pose(60, 359.9)), ("e1",)
    near, far = plan_check._SAME * 0.9, plan_check._SAME * 1.1
    moved = [
        (Pose(first[0] + near, first[1]), here[1]), (Pose(first[0] + far, first[1]), here[1]),
        (here[0], (Pose(20 + near, 40), Pose(60, 359.9))), (here[0], (Pose(20, 40), Pose(60 + far, 359.9))),
    ]  # fmt: skip
    candidates = [SimpleNamespace(sensor=s, light=k, edges=("e2",), variance=2.0) for s, k in moved]
    found = SimpleNamespace(
        sensor=here[0], light=here[1], variance=1.0, scene=SimpleNamespace(required=here[2]), candidates=candidates
    )
    assert plan_check._best(found) == [(1.0, *here), (2.0, *moved[1], ("e2",)), (2.0, *moved[3], ("e2",))]
    assert plan_check._angle(Pose(60, 359), Pose(60, 1)) == pytest.approx(
        2 * np.degrees(np.arcsin(np.sin(np.radians(1)) * np.sin(np.radians(60))))
    )
    assert plan_check._angle(Pose(30, 20), Pose(75, 200)) == pytest.approx(105)


def test_poses_scatter_as_far_as_that_is_simulated(monkeypatch):
    """What a scene says of them counts where the effect is on; of exact poses nothing is asked."""
    said, asked = Jitter(sensor_deg=0.2), []

    def choose(scene, effects, tolerance, picture):
        asked.append((effects, tolerance, picture))
        return SimpleNamespace(scene=SimpleNamespace(jitter=said if effects == "all" else Jitter()))

    monkeypatch.setattr(work.render, "choose", choose)
    case = SimpleNamespace(scene=SimpleNamespace(jitter=said), picture="picture")
    assert work._jitter(case, work.Rendering(effects="all")) == said
    assert work._jitter(case, work.Rendering(effects="floor")) == Jitter()
    assert [(effects, picture) for effects, _, picture in asked] == [("all", "picture"), ("floor", "picture")]
    exact = SimpleNamespace(scene=SimpleNamespace(jitter=Jitter()), picture="picture")
    assert work._jitter(exact, work.Rendering(effects="all")) == Jitter()
    assert len(asked) == 2


@pytest.mark.parametrize("free", [1, 2, 3])
def test_a_sensor_that_sees_nothing_has_no_lights(free):
    """As many poses as lights are free, all the same."""
    told = SimpleNamespace(scene=SimpleNamespace(free=tuple(range(free))))
    value, poses = lights._Contrasts.best(told, None, (0.5, 0.5))
    assert value == np.inf
    assert poses.tolist() == [0.0] * (2 * free)


def test_a_plan_is_checked_where_it_can_be_measured(monkeypatch):
    """Asked of its sensor before anything is rendered; then each setting with its place, as many as are wanted."""
    asked, said = [], []
    monkeypatch.setattr(plan_check, "_judged", lambda rows, reason, seconds: (rows, reason))
    monkeypatch.setattr(plan_check, "_checked", lambda found, *setting, rank, quality: (*setting, rank, quality))
    monkeypatch.setattr(
        measure, "region_of_interest", lambda scene, sensor, estimators: asked.append((sensor, estimators))
    )
    candidates = [SimpleNamespace(sensor=Pose(30, k), light=Pose(70, k), edges=("e2",), variance=k) for k in (100, 200)]
    found = SimpleNamespace(
        sensor=Pose(10, 20), light=Pose(50, 60), variance=1.0, scene=SimpleNamespace(required=("e1",)),
        candidates=candidates,
    )  # fmt: skip
    rows, reason = plan_check.check_plan(found, 2, "quick", lambda *told: said.append(told))
    assert asked == [(Pose(10, 20), (plan_check.ESTIMATOR,))]
    assert rows == [
        (Pose(10, 20), Pose(50, 60), ("e1",), 1, "quick"), (Pose(30, 100), Pose(70, 100), ("e2",), 2, "quick")
    ]  # fmt: skip
    assert reason == ""
    assert said == [("settings", done, 2) for done in range(3)]

    def refuse(*_, **__):
        raise InvalidInput("nothing is seen")

    monkeypatch.setattr(measure, "region_of_interest", refuse)
    assert plan_check.check_plan(found, 2, "quick") == ([], "nothing is seen")
    with pytest.raises(InvalidInput, match="check must be at least 1, got 0"):
        plan_check.check_plan(found, 0)


@pytest.mark.parametrize(("objective", "noise", "doubt"), [("object", 0.04, 0.3), ("image", 9.0, 2.0)])
def test_a_setting_is_checked_by_its_noise_and_what_its_bias_may_be_off(objective, noise, doubt, task1, monkeypatch):
    """Variances add, of the object or of the image; the status is the worst once the bias is off."""
    measured = SimpleNamespace(covariance=np.array([[0.04]]), covariance_image=np.array([[9.0]]))
    off = SimpleNamespace(u_bias=np.array([0.3]), u_bias_image=np.array([2.0]), status=("clutter",))
    monkeypatch.setattr(plan_check, "propagated", lambda *_: (None, measured))
    monkeypatch.setattr(plan_check.simulation, "of_render", lambda *_: off)
    monkeypatch.setattr(plan_check, "without_formula", lambda *_: ("floor",))
    found = SimpleNamespace(scene=task1, objective=objective, over="minimax")
    row = plan_check._checked(found, Pose(30, 135), Pose(15, 315), task1.required, 3, None)
    told = planner.predict(task1, (30, 135), (15, 315), "calibrated").measurands[0]
    assert row.calibrated == pytest.approx(told.variance_object if objective == "object" else told.variance_image)
    assert row.propagated == pytest.approx(noise)
    assert row.with_bias == row.minimised == pytest.approx(noise + doubt**2)
    assert row.ratio == pytest.approx(noise / row.calibrated)
    assert (row.status, row.rank_before, row.without_formula) == ("clutter", 3, ("floor",))


def test_poses_that_are_given_take_the_place_of_the_first_settings(task1):
    """Each by itself; without any it is the first setting."""
    first = task1.settings[0]
    given = Pose(33, 44), Pose(11, 22)
    for sensor, light in ((None, None), (given[0], None), (None, given[1]), given):
        found = first_picture(task1, sensor, light)
        assert found.sensor == (sensor or first.sensor)
        assert found.lights == ((light or first.light),)
    bare = task1.model_copy(update={"settings": ()})
    assert first_picture(bare, *given).lights == (given[1],)
    for some in ((None, None), (given[0], None), (None, given[1])):
        with pytest.raises(InvalidInput, match="--sensor and --light must be given for a scene without settings"):
            first_picture(bare, *some)


@pytest.mark.parametrize(
    ("lost", "expected"),
    [
        ({}, "ok"),
        ({"short": 1}, "ok"),
        ({"short": 2}, "short"),
        ({"short": 1, "low_contrast": 1}, "short"),
        ({"short": 1, "low_contrast": 2}, "low_contrast"),
    ],
)
def test_too_many_lost_images_of_a_setting_are_its_status(lost, expected):
    """More than one of a hundred in all, whatever became of each; of a doubtful setting the doubt stays."""
    assert row_status("ok", lost, 100) == expected
    assert row_status("clutter", lost, 100) == "clutter"


def test_what_was_measured_is_off_by_its_mean_less_what_is_taken_off_and_what_is_there():
    values = np.array([3.0, 5.0, np.nan, 7.0])
    told = RepeatedValues(4.0, values, {"short": 1}, "ok", correction=0.5, u_bias=0.1).scatter(2.0)
    assert told == {"empirical": pytest.approx(4.0), "bias": pytest.approx(5 - 0.5 - 2), "n": 4, "failed": 1}
