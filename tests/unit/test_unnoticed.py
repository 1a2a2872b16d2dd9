"""What no test had noticed when it was changed: lengths of quotations, folders in folders, arguments, last elements."""

import json
import math
import string
from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
import typer
from scipy.special import ndtr

from imaging.features.locator import CLEARANCE, edge_blur
from measure.boards.parameters import read_model
from measure.estimators import ellipse
from measure.estimators.canny import CannyLocator
from measure.features import rims
from measure.fitting import fit, sides
from measure.known_bias import Correction
from planner.search import lights
from render import Quality, bsdf, testing, variant
from scenes import InvalidInput, Material, status
from scenes.materials.brdf import Index
from scenes.parts import mesh, step
from validation import kept
from validation.batch import result
from validation.batch.store import RunFile
from validation.cli import budget, compare, cost, predict
from validation.cli import render as render_command
from validation.cli import report as report_command
from validation.cost import effects, goal, rays, sweep, table
from validation.cost.watch import Watch
from validation.explore import gate
from validation.explore.messages import Message
from validation.explore.state import State
from validation.report import (
    budget_figure,
    cost_figures,
    export,
    figures,
    gallery,
    page,
    plan_figures,
    plan_table,
    station,
    station_table,
    views_figure,
)

LONG = string.ascii_letters + string.digits + string.ascii_uppercase + string.ascii_lowercase  # 114, no two alike near


def request(**how):
    """One that nobody has let in yet."""
    given = {"host": "127.0.0.1", "query": {}, "cookies": {}, "headers": {}, "url": SimpleNamespace(host="127.0.0.1")}
    return SimpleNamespace(**given | how)


class Unreadable:
    """An address whose host cannot be told."""

    @property
    def host(self):
        raise ValueError


def test_what_is_refused_is_quoted_to_eighty_letters(task1):
    """Of messages, states, hosts and models: long texts come from outside, and are the middle of a line."""
    told = State.first(task1).to_message()
    many = [LONG] * 100
    doors = [
        (lambda: Message.of(LONG), repr(LONG[:80])),
        (lambda: Message.of(json.dumps(LONG)), repr(json.dumps(LONG)[:80])),
        (lambda: State.of_message(task1, told | {"views": [LONG]}), LONG[:80]),
        (lambda: State.of_message(task1, told | {"views": many}), str(many)[:80]),
        (lambda: State.of_message(task1, told | {"lights": LONG}), LONG[:80]),
        (lambda: read_model(LONG), repr(LONG[:80])),
    ]
    for door, quoted in doors:
        with pytest.raises(InvalidInput) as refused:
            door()
        assert str(refused.value).endswith(f", got {quoted}")
    spoken = [
        gate.refusal(request(url=Unreadable(), host=LONG), None),
        gate.refusal(request(headers={"Origin": LONG}), None),
        gate.refusal(request(url=SimpleNamespace(host=LONG)), None),
    ]
    assert [each.split("got ")[1] for each in spoken] == [repr(LONG[:80])] * 3


@pytest.mark.parametrize(
    ("zones", "shown"),
    [([1, 0, 0], ["worst", "sigma", "sigma"]), ([0, 1, 1], ["worst", "ratio", "ratio"]), ([0, 0], ["sigma", "sigma"])],
)
def test_the_worst_ratio_is_shown_where_any_measurand_has_a_tolerance(zones, shown, task1):
    """And a measurand's own ratio where it has one."""
    scene = SimpleNamespace(quantities=[SimpleNamespace(tolerance=zone or None) for zone in zones])
    first = State.first(task1)
    worst = State(first.sensor, first.lights, measurand=0, shown="worst").tolerable(scene)
    assert worst.shown == shown[0]
    ratios = [State(first.sensor, first.lights, measurand=m, shown="ratio") for m in range(len(zones))]
    assert [each.tolerable(scene).shown for each in ratios] == ["ratio" if zone else "sigma" for zone in zones]


def given(**attributes):
    """A call that gives an object of these attributes."""
    return lambda *_, **__: SimpleNamespace(**attributes)


def test_outputs_may_lie_in_folders_that_do_not_exist_yet_and_in_those_that_do(tmp_path, monkeypatch):
    """Whatever writes a folder makes those above it, and writes into one that is there."""
    for module, *names in (
        (budget, "write_csv"), (budget_figure, "draw"), (page, "write_station"), (station, "of_budget", "of_run"),
        (plan_figures, "_seen", "_charts"), (views_figure, "draw_seen", "save"), (figures, "_agreement", "_panels"),
        (kept, "_plain"), (export, "write_csv", "write_json"), (cost_figures, "draw"), (table, "write_csv", "tables"),
        (result, "collect"), (report_command, "say"),
    ):  # fmt: skip
        for name in names:
            monkeypatch.setattr(module, name, lambda *_, **__: {})
    monkeypatch.setattr(page, "write", lambda *_: [])
    monkeypatch.setattr(gallery, "page", lambda: "")
    monkeypatch.setattr(gallery, "image", lambda scene, folder: folder)
    monkeypatch.setattr(result, "collect", given(verdict=SimpleNamespace(text="")))
    monkeypatch.setattr(RunFile, "reopen", given(campaign=lambda: None, close=lambda: None))
    monkeypatch.setattr(sweep, "sweep", given(to_json=dict))
    found = SimpleNamespace(picture=SimpleNamespace(scene=SimpleNamespace(name="a", title="")))
    shown = SimpleNamespace(sensor=None, light=None, picture=SimpleNamespace(scene=None))
    view = SimpleNamespace(views=[shown], combination=SimpleNamespace(used=[[]]))
    several = SimpleNamespace(scene=SimpleNamespace(quantities=[]), sets=[view])
    correction = given(
        **dict.fromkeys(each.name for each in fields(Correction)) | {"simulated": ()},
    )
    black = np.zeros((2, 2))
    doors = {
        "budget": lambda folder: budget._write(found, {}, folder),
        "plan": lambda folder: plan_figures.draw(None, folder),
        "views": lambda folder: views_figure.draw(several, folder),
        "run": lambda folder: figures.draw(None, None, None, folder),
        "corrections": lambda folder: kept._write(folder / f"{folder.is_dir()}.json", correction()),
        "gallery": lambda folder: gallery.write(folder, ["task1"]),
        "differences": lambda folder: testing._write(folder, "a", black, black, black),
        "report": lambda folder: report_command.report_command(tmp_path, folder),
        "cost": lambda folder: cost.cost_command("task1", folder, "60s", 1, True),
    }
    for name, door in doors.items():
        folder = tmp_path / name / "below" / "it"
        for _ in range(2):
            door(folder)
            assert folder.is_dir(), name
    assert len([*(tmp_path / "corrections" / "below" / "it").iterdir()]) == 2


class Stop(Exception):
    """Enough is known."""


def test_a_tone_curve_is_looked_for_in_residuals_and_derivatives_in_levels(monkeypatch):
    """Not over their standard deviations: those are its weights; one parameter more is each of the fit's."""
    told = []

    def stop(*given):
        told.extend(given)
        raise Stop

    monkeypatch.setattr(fit, "tone_curve", stop)
    observed, expected, variance = np.array([3.0, 5, 9]), np.array([2.5, 5.5, 7]), np.array([4.0, 0.25, 9])
    derivatives = np.array([[1.0, 2], [3, 5], [7, 11]])
    problem = SimpleNamespace(observed=lambda: observed, expected=lambda values, noise: expected)
    white = derivatives / np.sqrt(variance)[:, None]
    with pytest.raises(Stop):
        fit._result(None, (), None, None, None, ((), None, ()), (problem, white, variance), 0.5, False)
    for found, right in zip(told, (derivatives, expected, observed - expected, [0.5, 2, 1 / 3], 2), strict=True):
        assert found == pytest.approx(right)


@pytest.mark.parametrize("counts", [(1, 1, 3), (2, 1), (1, 1), (3,)])
def test_photographs_are_repeated_where_any_pose_has_several(counts):
    assert fit._are_repeated(tuple(SimpleNamespace(count=count) for count in counts)) is (max(counts) > 1)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("growth", "is_flat"), [(8.9, True), (9.1, False), (3.1, True), (2.9, True)])
def test_a_side_is_flat_where_squared_residuals_grow_by_less_than_nine(growth, is_flat, side, monkeypatch):
    """Six standard errors away, where 36 is what a normal likelihood has."""
    monkeypatch.setattr(sides, "most_likely", lambda problem, there, *_, **__: there)
    monkeypatch.setattr(sides, "covariance_of", lambda white: np.diag(white[0] ** 2))
    free = SimpleNamespace(low=-1e9, high=1e9, known=4.0)
    problem = SimpleNamespace(
        parameters=SimpleNamespace(free=[None, free]),
        observed=lambda: np.zeros(2),
        expected=lambda there, noise: np.array([np.sqrt(growth) * abs(there[1] - 3.0) / 12, 0.0]),
        jacobian=lambda there, noise, which: np.array([[1.0, 5.0]]),
    )
    white = np.array([[1.0, 2.0]])  # an error of 2: six of them are 12
    at, ratio = sides._followed(problem, np.array([7.0, 3.0]), None, np.array([0, 1]), white, np.ones(1), (1, side, ()))
    assert ratio == (2.5 if is_flat else 1.0)
    assert at.tolist() == [7.0, 3.0 + side * 12 * is_flat]


def test_a_circle_that_is_elsewhere_every_time_is_not_looked_for_without_end(monkeypatch):
    """After so many passes it is not found; what is near enough in its second is."""
    tried, near = [], []  # moves after which it is near enough

    def tool(picture, name, moved):
        return SimpleNamespace(moved=moved, is_far=lambda errors: np.full(len(errors), moved not in near))

    def measured(images, tool):
        tried.append((len(images), tool.moved))
        count = len(images)
        return rims.Circles(
            np.full((count, 1), 3.0), np.ones((count, 1, 1)), np.full(count, status.OK), np.ones(count, bool)
        )

    monkeypatch.setattr(rims, "rim_tool", tool)
    monkeypatch.setattr(rims, "_rounded", lambda tool, row: (float(row[0]),))
    monkeypatch.setattr(rims, "_measured", measured)
    found = rims._find(np.zeros((2, 1, 1)), None, "c1", (0.0,), 4)
    assert found.state.tolist() == [status.LOW_CONTRAST] * 2
    assert tried == [(2, (3.0 * k,)) for k in range(5)]
    near.append((3.0,))
    found = rims._find(np.zeros((2, 1, 1)), None, "c1", (0.0,), 4)
    assert found.state.tolist() == [status.OK] * 2
    assert found.errors.ravel().tolist() == [6.0] * 2


@pytest.mark.parametrize("last", [0, 1, 2])
def test_a_sliver_in_a_crease_is_part_of_the_larger_face_whichever_group_is_the_last(last):
    """Two faces at right angles, and a sliver between them that lies in both planes."""
    corners = np.array([[0, 0, 0], [10, 0, 0], [4, 9, 0], [5, 0, -3], [6, 1e-9, 1e-9]], float)
    faces = np.array([[0, 4, 2], [1, 0, 3], [0, 1, 4]])  # the larger, the smaller, the sliver
    order = np.roll(np.arange(3), 2 - last)
    made = trimesh.Trimesh(corners, faces[order], process=False)
    group = np.arange(3)
    large, small, thin = (int(np.flatnonzero(order == k)[0]) for k in range(3))
    pairs = np.array([[thin, small], [large, thin]])
    kept = mesh._in_plane(made, group, pairs)
    assert kept.tolist() == [[large, thin]]


def test_a_cone_of_a_file_has_its_radius_in_the_middle_of_its_face():
    axis, slope = np.array([0.0, 0.6, 0.8]), math.radians(20.0)
    cone = step._cone(np.array([1.0, 2.0, 3.0]), axis, 3.0, slope, [1.0, 6.0], True)
    assert cone.point == pytest.approx([1, 2 + 3.5 * 0.6, 3 + 3.5 * 0.8])
    assert cone.radius == pytest.approx(3 + 3.5 * math.tan(slope))
    assert cone.ends == pytest.approx((-2.5, 2.5))
    assert (cone.hollow, cone.half_angle_deg) == (True, pytest.approx(20.0))


@pytest.mark.parametrize(("light", "sensor"), [(0.8, -0.3), (-0.6, 0.9), (-0.6, -0.3), (0.8, 0.9)])
def test_a_texture_adds_nothing_below_its_surface(light, sensor):
    """Whichever of light and sensor is there."""
    mitsuba = variant.use(variant.SCALAR)
    glossy = Material(specular_fraction=0.3, diffuse_reflectance=0.8, refractive_index=1.6, extinction=0.7)
    made = mitsuba.load_dict(
        bsdf.describe(mitsuba, bsdf.Interaction(glossy, (Index(1.6, 0.7),), (0.0, 0.0, 100.0), 0.01))
    )
    material = SimpleNamespace(brightness=lambda *_: mitsuba.Float(0.25), diffuse=lambda analysed: 0.7)
    made.surface = SimpleNamespace(index=None, material=material)
    wo, wi = mitsuba.Vector3f(0.0, 0.6, light), mitsuba.Vector3f(0.3, 0.0, sensor)
    values = []
    for made.texture in (None, SimpleNamespace()):
        values.append(float(made._value(wo, wi, None, None, 1.4)))
    assert values[0] == pytest.approx(0.25)
    assert values[1] - values[0] == pytest.approx(0.4 * 0.7 * light if light > 0 and sensor > 0 else 0, abs=1e-6)


@pytest.mark.parametrize("trend", [0.3, -0.4, 0.0])
def test_an_edge_s_dimmer_half_is_told_by_its_ends(trend):
    """From the gradient at the dimmer end to that in the middle, five places; a tenth of their points may be lost."""
    positions, threshold, noise = np.array([-2.0, 0.5, 1.0, 7.0]), 5.0, 1.7
    kernel = np.column_stack([[0.3, -0.4, 0.5], np.ones(3)])
    optics = SimpleNamespace(noise_variance=noise**2)
    given = SimpleNamespace(caliper=SimpleNamespace(positions=positions), optics=optics, kernel=kernel)
    given.threshold = threshold
    starts = np.linspace(2.0, 13.0, 60)
    dimmest = starts + trend * (-2.0 if trend > 0 else 7.0)
    middle = starts + trend * 2.5
    places = [dimmest + k / 4 * (middle - dimmest) for k in range(5)]
    lost = np.mean([ndtr((threshold - each) / (noise * math.sqrt(0.5))) for each in places], axis=0)
    sure = CannyLocator._sure(given, starts, np.full(60, trend))
    assert sure.tolist() == (lost < 0.1).tolist()
    assert 5 < sure.sum() < 55


@pytest.mark.parametrize("role", [0, 1, 2])
def test_a_turn_tries_the_candidates_of_what_it_moves(role):
    """The sensor's at role 0, those of lights at the others; all else stays."""
    asked = []
    turns = lights._Turns(None, np.array([[1.0, 2], [3, 4], [5, 6]]), np.array([[7.0, 8], [9, 10]]), ())
    turns._best = lambda share, sensors, places: asked.append((share, sensors.tolist(), places.tolist()))
    here = lights.Mixture(1.0, (0.3, 0.7), np.array([50.0, 60]), np.array([11.0, 12, 13, 14]))
    turns._moved(here, role)
    stays, kept = [50.0, 60], [11.0, 12, 13, 14]
    right = {
        0: ([[1.0, 2], [3, 4], [5, 6]], [kept] * 3),
        1: ([stays] * 2, [[7.0, 8, 13, 14], [9, 10, 13, 14]]),
        2: ([stays] * 2, [[11.0, 12, 7, 8], [11, 12, 9, 10]]),
    }[role]
    assert asked == [((0.3, 0.7), *right)]


def test_pieces_in_a_straight_line_between_the_same_faces_are_joined():
    """Three of them, turned any way; not around a corner, where a third piece meets, nor between other faces."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0], [4, 0, 0], [4, 2, 0], [4, 5, 0], [9, 5, 0], [3, 0, 7.0]])
    one, other = ((0, 1), True), ((0, 2), False)
    pieces = {(0, 1): one, (2, 1): one, (3, 2): one, (3, 4): one, (4, 5): other, (5, 6): other}
    joined = mesh._straight_chains(vertices, pieces)
    told = {(frozenset(ends), faces, convex) for ends, faces, convex in joined}
    line = {(frozenset(ends), *one) for ends in ((0, 3), (3, 4))}
    assert told == line | {(frozenset(ends), *other) for ends in ((4, 5), (5, 6))}
    assert len(joined) == 4
    met = mesh._straight_chains(vertices, {(0, 1): one, (1, 2): one, (2, 3): one, (2, 7): one})
    assert {frozenset(ends) for ends, *_ in met} == {frozenset(ends) for ends in ((0, 2), (2, 3), (2, 7))}


@pytest.mark.parametrize(
    ("variances", "statuses", "rank", "words"),
    [
        ((2.0, 1.5), ("ok", "ok"), 1, "-25.0 % variance"),
        ((2.0, 1.99), ("ok", "ok"), 1, "-0.5 % variance, less than effects that are left out may matter (2 %)"),
        ((2.0, 3.0), ("clutter", "ok"), 2, "+50.0 % variance, but the plan's picture is clutter"),
        ((2.0, 1.5), ("short", "ok"), None, "the plan's picture cannot be measured (short)"),
    ],
)
def test_what_a_proposal_gains_over_its_plan_is_told_by_variances(variances, statuses, rank, words):
    plan, best = (
        SimpleNamespace(minimised=variance, status=state, rank_after=rank)
        for variance, state in zip(variances, statuses, strict=True)
    )
    assert plan_table._gain(best, plan) == words


@pytest.mark.parametrize(
    ("bias", "u_bias", "words"),
    [
        (None, 0.1, "not known"), (0.0123, None, "+0.012 mm"), (-0.0004, None, "0 mm"),
        (0.0123, 0.0009, "+0.0123 ± 0.0009 mm"),
        (0.0123, 0.00004, "+0.0123, ± less than 0.0001 mm"), (0.0123, math.inf, "+0.012 mm ± not known"),
    ],
)  # fmt: skip
def test_a_bias_is_told_to_the_places_of_its_value(bias, u_bias, words):
    told = station_table._bias(SimpleNamespace(bias=bias, u_bias=u_bias), 3, "mm")
    assert told == words


def test_half_of_the_time_for_rays_is_that_of_single_renders(monkeypatch):
    """What they leave is for averages."""
    told = []
    rows = [(kind, n, 0.1, 3.0 / n, 1.0, 1.0) for kind in ("stratified", "renders averaged") for n in (2.0, 4.0)]
    monkeypatch.setattr(rays, "_stratified", lambda cases, variant, watch: told.append(watch.left) or rows[:2])
    monkeypatch.setattr(rays, "_averages", lambda cases, variant, watch: told.append(watch.left) or rows[2:])
    rays.rays_parameter((), "scalar_rgb", Watch(1000.0))
    assert told == pytest.approx([500, 1000], rel=1e-3)


def test_each_effect_is_switched_on_alone(monkeypatch):
    asked = []
    monkeypatch.setattr(effects, "check", lambda scene, settings, only: asked.append(tuple(only)) or [])
    effects.effects_parameter(SimpleNamespace(scene=None, setting=None), "llvm_ad_rgb", Watch(1000.0))
    assert asked == [(name,) for name in effects.RENDERED]


@pytest.mark.parametrize(("fresh", "begun"), [(True, False), (False, False), (False, True)])
def test_a_run_that_was_begun_goes_on_with_its_images_and_quality(fresh, begun, tmp_path, monkeypatch):
    identity = {"renders": 71, "quality": {"supersample": 3, "edge_samples": 9}}
    monkeypatch.setattr(goal.RunFile, "reopen", given(identity=lambda: identity, close=lambda: None))
    if begun:
        (tmp_path / "run.sqlite").touch()
    found = goal._begun(SimpleNamespace(fresh=fresh, out=tmp_path))
    assert found == ((71, Quality(supersample=3, edge_samples=9)) if begun and not fresh else None)
    assert goal._begun(SimpleNamespace(fresh=False, out=None)) is None


@pytest.mark.parametrize(
    ("statuses", "variances", "says", "code"),
    [
        (["ok", "clutter"], [1.0, 2.0], True, 0), (["ok", "ok"], [1.0, 2.0], False, 0),
        (["ok", "not_visible"], [1.0, None], False, 1), (["clutter", "clutter"], [None, None], True, 1),
    ],
)  # fmt: skip
@pytest.mark.parametrize("rendered", [False, True])
def test_where_any_value_is_in_doubt_a_simulation_is_named(
    statuses, variances, says, code, rendered, monkeypatch, capsys
):
    """Not where one was made; and the exit status is 1 where any value cannot be measured."""
    facts = [
        {"name": state, "status": state, "variance": variance, "reason": ""}
        for state, variance in zip(statuses, variances, strict=True)
    ]
    rows = [{"measurands": facts[:1]}, {"measurands": facts[1:]}]
    monkeypatch.setattr(predict, "scene_of", given(name="a"))
    monkeypatch.setattr("planner.predict", lambda picture, model: picture)
    for name, told in (
        ("_pictures", [0, 1]), ("_simulated", rows), ("_table", "the table"), ("doubtful_edges", ["doubtful"]),
    ):  # fmt: skip
        monkeypatch.setattr(predict, name, lambda *_, told=told: told)
    monkeypatch.setattr(predict, "_facts", lambda picture, found: rows[found])
    with pytest.raises(typer.Exit) as ended:
        predict.predict_command("a", render=rendered)
    said = capsys.readouterr().out
    assert ended.value.exit_code == code
    assert (predict._RENDER[:20] in said) is (says and not rendered)
    assert ("doubtful" in said) is not rendered


@pytest.mark.parametrize("changed", [(), (SimpleNamespace(
    setting="3", method="canny", what="mean", before=1.23456, after=2.34567, p_value=0.0123),)])  # fmt: skip
def test_what_changed_between_two_runs_is_told_and_is_the_exit_status(changed, monkeypatch, capsys):
    found = SimpleNamespace(
        text="compared", changed=changed, only_before=["one", "two", "three"], only_after=(), to_json=dict
    )
    monkeypatch.setattr("validation.comparison.compare", lambda *_: found)
    monkeypatch.setattr("validation.comparison.read", lambda path: path)
    with pytest.raises(typer.Exit) as ended:
        compare.compare_command("a", "b", 0.01)
    assert ended.value.exit_code == len(changed)
    line = ["  3 canny: mean 1.235 -> 2.346, p = 0.012"] * len(changed)
    assert capsys.readouterr().out.splitlines() == [
        "compared", *line, "  only before, not compared: 3, as one"
    ]  # fmt: skip
    for level in (0.0, 1.0):
        with pytest.raises(InvalidInput, match="--level must be between 0 and 1"):
            compare.compare_command("a", "b", level)


def test_a_rendered_image_is_told_by_its_width_and_height_and_its_levels(monkeypatch, tmp_path, capsys):
    """With noise the first of as many pictures as were asked for: one."""
    image, asked = np.arange(15.0).reshape(3, 5) + 2.25, []
    monkeypatch.setattr("render.image", lambda *_, **__: image)
    monkeypatch.setattr("render.expose", lambda image, noise, rng, count: asked.append(count) or image[None] + 1)
    monkeypatch.setattr("validation.picture_file.write", lambda *_: None)
    file = tmp_path / "a.png"
    for seed, levels in ((None, "2.2 to 16.2"), (3, "3.2 to 17.2")):
        render_command.render_command("task1", "15,135", file, noise_seed=seed)
        assert capsys.readouterr().out.replace("\n", "").endswith(f"a.png: 5 x 3 px, grey levels {levels}")
    assert asked == [1]


@pytest.mark.parametrize("middle", [(31.3, 27.8), (4.2, 44.1), (58.3, 2.9)])
def test_an_ellipse_is_fitted_in_the_smallest_window_that_holds_its_band(middle):
    """Turned and of unequal axes, within the image: as far as its outline reaches, and the band beside that."""
    matrix, (width, height) = np.array([[14.0, 3.0], [3.0, 8.0]]), (61, 47)
    shape = np.array([*middle, 14.0, 8.0, 3.0])
    optics = SimpleNamespace(shape=(height, width), blur_px=0.5, most_blur_px=0.5)
    seen = SimpleNamespace(near=lambda angle: np.ones(angle.shape, bool))
    columns, rows, near = ellipse._near(shape, optics, seen)
    turn = np.linspace(0, 2 * np.pi, 20001)
    outline = middle + np.column_stack([np.cos(turn), np.sin(turn)]) @ matrix
    band = ellipse._BAND * CLEARANCE * edge_blur(0.5)
    for places, k, most in ((columns, 0, width), (rows, 1, height)):
        assert places[0] == max(0, math.floor(outline[:, k].min() - band))
        assert places[-1] == min(most - 1, math.ceil(outline[:, k].max() + band))
    points = np.stack(np.meshgrid(columns, rows), -1).astype(float)
    size, *beside = (
        np.linalg.norm((points + step - middle) @ np.linalg.inv(matrix), axis=-1)
        for step in np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * 1e-6
    )
    slope = np.hypot(beside[0] - beside[1], beside[2] - beside[3]) / 2e-6
    away = np.abs(size - 1) / slope  # to first order
    assert (near == (away < band))[np.abs(away - band) > 1e-6].all()
    assert 0.2 < near.mean() < 0.95
