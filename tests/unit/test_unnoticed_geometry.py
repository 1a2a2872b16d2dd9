"""More that no test had noticed when it was changed: angles, areas, sides, limits and orders of what is drawn."""

from importlib import import_module
from types import SimpleNamespace
from unittest import mock

import matplotlib.pyplot as plt
import numpy as np
import pytest

import planner
import scenes
from measure.boards import approximate
from measure.estimators import canny
from measure.features import contrasts
from planner import constraints
from planner.design import Choice
from planner.search.grid import APART
from planner.search.varying import Place, Variation
from planner.uncertainty import risks
from render import Quality, fine
from render.parts import Part
from scenes import Picture
from scenes.parts import arcs
from validation import vary_check
from validation.cli import measurands
from validation.hard import precise, precise_models
from validation.report import budget_figure, plan_figures

renderer = import_module("render.renderer")


def test_places_differ_by_degrees():
    """Of one choice: from 15 degrees on between two sensors, or two lights."""
    choice = Choice(None, None)

    def place(sensor, light):
        return Place(choice, np.array(sensor, float), np.array(light, float), 1.0)

    here = place((40, 10), (70, 200))
    assert not here.differs(place((40 + 0.9 * APART, 10), (70 - 0.9 * APART, 200)))
    assert here.differs(place((40 + 1.1 * APART, 10), (70, 200)))
    assert here.differs(place((40, 10), (70 - 1.1 * APART, 200)))


@pytest.mark.parametrize(("held", "asked"), [((True, False), True), ((False, True), True), ((True, True), False)])
def test_a_pose_that_is_free_has_to_be_allowed_where_the_other_is_held(held, asked):
    """Of what begins where constraints forbid it nothing is minimised."""
    forbidden = mock.Mock(return_value=False)
    problem = SimpleNamespace(scene=None, constraints=SimpleNamespace(allows=forbidden, same_mount=False))
    variation, begin = Variation(problem, ("analyser",), None, held), Place(Choice(None, None), *np.ones((2, 2)), 1.0)
    values = mock.patch.object(Variation, "_values", return_value=(np.array([2.0]), np.array([False])))
    kept = mock.patch.object(Variation, "_place", lambda self, *which: Place(*which, 3.0))
    down = mock.patch("planner.search.varying.descend", return_value=(*np.ones((2, 2)), np.array([]), 0))
    with values, kept, down:
        found = variation._descended(begin, 0)
    assert forbidden.called == asked
    assert found.value == 3.0


def test_the_area_of_a_window():
    assert canny._area((slice(3, 10), slice(20, 25))) == 35


def test_an_edge_must_be_seen_from_twice_four_standard_deviations_on(monkeypatch):
    """Of its contrast, which have other values along it; one edge of two is too faint at one of its places."""
    rows = np.zeros((4, 3, 1))
    rows[:, 1, 0] = [4.1, 4.1, 3.9, 4.1]
    sigma = np.full((4, 3), 0.5)
    monkeypatch.setattr(contrasts, "_contrast", lambda *_: (rows, sigma))
    tool = mock.Mock(is_lit=True)
    tool.arrangement = SimpleNamespace(edges=np.array([0, 0, 1, 1]), required=(0, 1))
    tool.model = SimpleNamespace(moving=slice(None))
    tool.reference = SimpleNamespace(state=SimpleNamespace(levels=np.ones(1)))
    assert contrasts.asked.__wrapped__(tool).tolist() == [True, False]


@pytest.mark.parametrize(("pieces", "end"), [(arcs.MIN_PIECES - 1, None), (arcs.MIN_PIECES, arcs.MIN_PIECES + 1)])
def test_an_arc_of_too_few_pieces_is_none(pieces, end):
    """Points on a circle, and then straight on, along its tangent."""
    angle = 0.2 * np.arange(pieces + 1)
    on = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    tangent = np.array([-np.sin(angle[-1]), np.cos(angle[-1]), 0])
    beyond = on[-1] + 0.2 * np.arange(1, 6)[:, None] * tangent
    found = arcs._farthest(np.concatenate([on, beyond]), np.array([0.0, 0, 1]), 1e-9, 0, len(on) + 5)
    assert found == end


@pytest.mark.parametrize(("edge", "elsewhere"), [(64, 16), (16, 64)])
def test_the_table_of_random_numbers_is_of_the_most_rays(edge, elsewhere):
    """That an edge's fine pixels get, or others."""
    scene = scenes.load("bracket")
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    quality = Quality(edge_samples=edge, random_samples=elsewhere)
    part, crop = Part(picture, frozenset({"interreflection"})), (slice(0, 16), slice(0, 16))
    tracer = fine._Tracer(part, crop, quality, None, False)
    with_light_between, direct = tracer.rays(part.active), tracer.rays(frozenset())
    assert (with_light_between.most, with_light_between.bounces) == (64, fine.SURFACES - 1)
    assert (direct.most, direct.bounces) == (64, 0)  # else direct light would have its noise


def test_the_object_of_a_plan_is_drawn_whole_and_from_behind():
    """Every triangle that faces the sensor, the farthest first."""
    scene = scenes.load("bracket")
    setting, drawn = scene.settings[0], []
    axis = mock.Mock(fill=lambda x, y, **_: drawn.append(np.stack([x, y], 1)))
    plan_figures.draw_seen(axis, scene, setting.sensor, setting.light, np.zeros((0, 2)))
    pictures = planner.Pictures.of(Picture.of(scene, setting.sensor, setting.light))
    solid, position = scene.solid, pictures.sensor_at
    away = np.linalg.norm(solid.triangles.mean(1) - position, axis=1)
    shown = plan_figures.facing(solid, position)[solid.triangle_faces]
    order = [k for k in np.argsort(-away) if shown[k]]
    corners = plan_figures.project(solid.triangles, pictures.sensors, scene.camera)
    assert len(drawn) == len(order) == 10
    np.testing.assert_allclose(drawn, corners[order])


def test_an_undecided_value_says_its_bias_only_where_there_is_a_value():
    row = {"decision": "undecided", "status": "clutter", "value": 3.0, "tolerance": 0.1, "u_bias": None}
    assert measurands._decision(row) == "undecided (bias unknown)"
    assert measurands._decision(row | {"tolerance": None}) == "undecided (bias unknown)"
    assert measurands._decision(row | {"value": None}) == "undecided"


def test_fresnel_of_the_reference():
    """At normal incidence ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2), whatever n."""
    for n, k in ((1, 0), (2, 0), (1.5, 0.3), (1, 2)):
        expected = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
        assert float(precise.fresnel(precise.mpf(1), n, k)) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("scale", [1.0, 1.7])
def test_the_reference_of_the_calibrated_model_at_other_scales(scale):
    scene = scenes.load("task1").with_(locator={"scale_px": scale})
    setting = scene.settings[0]
    inputs = precise.Inputs.of(scene, setting.sensor, setting.light)
    exact = precise_models.calibrated(scene, inputs, adaptive=False)
    told = planner.predict(scene, setting.sensor, setting.light).variance_px2
    assert told == pytest.approx(float(exact), rel=1e-3)


@pytest.mark.parametrize(("at", "seen"), [(0.0, True), (-0.4, True), (-0.6, False), (639.4, True), (639.6, False)])
def test_a_light_is_in_view_up_to_the_outer_sides_of_pixels(monkeypatch, at, seen):
    scene = SimpleNamespace(camera=SimpleNamespace(width=640, height=480), lights=[None])
    monkeypatch.setattr(constraints, "light_position", lambda camera, light, poses: np.zeros((len(poses), 3)))
    monkeypatch.setattr(constraints, "project", lambda places, *_: np.full((len(places), 1, 2), [at, 240.0]))
    assert constraints._in_view(scene, np.zeros((1, 2)), np.zeros((1, 2)), 0).tolist() == [seen]


def test_a_density_is_integrated_in_steps_of_one():
    """And in steps of the noise beside the ends of what is accepted."""
    assert risks._pieces(-2.5, 1.5, [], 0.1).tolist() == [-2.5, -2, -1, 0, 1, 1.5]
    assert risks._pieces(0.25, 0.75, [0.5], 0.125) == pytest.approx([0.25, 0.375, 0.5, 0.625, 0.75])


def test_a_board_is_sought_in_a_smaller_picture_of_the_same_shape(monkeypatch):
    """Where it is found is told in pixels of the whole one, middle to middle."""
    asked = []
    found = np.array([[[10.0, 20.0], [30.0, 40.0]]])
    monkeypatch.setattr(approximate, "_counted", lambda small: asked.append(small.shape) or found)
    longest = approximate._LONGEST
    made = approximate.approximate_corners(np.random.default_rng(1).uniform(0, 255, (3 * longest, 2 * longest)), None)
    assert asked == [(longest, round(2 * longest / 3))]
    np.testing.assert_allclose(made, (found + 0.5) * 3 - 0.5, rtol=1e-3)


def test_a_check_of_what_varies_reports_two_plans(monkeypatch):
    told = []
    monkeypatch.setattr(vary_check, "_scatter", lambda *_: None)
    monkeypatch.setattr(vary_check, "judged", lambda *rows, same: (rows, same))
    one = SimpleNamespace(choice=1, sensor=2, light=3)
    found = SimpleNamespace(varied=SimpleNamespace(fixed=one, best=one))
    assert vary_check.check_varied(found, report=lambda *what: told.append(what)) == ((None, None), True)
    assert told == [("plans", 0, 2), ("plans", 1, 2), ("plans", 2, 2)]


def test_a_backlight_is_dark_beside_its_cone(monkeypatch):
    """Whatever its render says there."""
    scene = scenes.load("backlight_plate")
    setting = scene.settings[0]

    def shining(part, crop, quality, which, **how):
        return np.full([each.stop - each.start for each in crop], 50.0 if part.silhouette else 0.0)

    monkeypatch.setattr(renderer, "fine_image", shining)
    for within, level in ((False, 0.0), (True, 50.0)):
        monkeypatch.setattr(renderer, "within_cone", lambda picture, crop, k, within=within: np.array(within))
        seen = renderer.image(scene, setting.sensor, setting.light, Quality(supersample=1), "scalar_rgb")
        assert seen[100, 100] - scene.noise.dark_level == pytest.approx(level, abs=1e-9)


def test_bars_of_small_budgets_fill_their_frame():
    axis = plt.figure().subplots()
    budget_figure._finished(axis, ["one", "two"], np.array([0.1, 0.2]), False)
    assert axis.get_xlim() == pytest.approx((0, 0.29))
    plt.close(axis.figure)
