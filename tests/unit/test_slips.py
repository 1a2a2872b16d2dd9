"""Slips of one word that no test had noticed: each against a small computation of its own, without symmetry."""

import asyncio
import math
import statistics
import sys
import threading
import time
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import trimesh
from scipy import stats

import measure
import planner
import scenes
from imaging.boards.fitting import fit_crossings
from imaging.boards.saddle import response
from imaging.boards.windows import Windows
from imaging.contours import contour, limb
from imaging.features.circles import RimImage, calibrated_circle
from imaging.features.projected_edges import projected_edges
from imaging.geometry.projection import direction, edge_points
from imaging.light.edge_sides import edge_contrast, side_signals
from imaging.light.emitters import emitters
from imaging.light.exchanged import _arriving, exchanged
from imaging.pictures import Pictures
from measure.features.layout import BACKGROUND, polygon_layout
from measure.features.optics import Optics
from measure.fitting.likelihood import Problem
from measure.fitting.parameters import Parameters
from measure.fitting.photograph import Pixels, Shots
from measure.photo import mtf as mtfs
from measure.photo import recording
from planner import robustness
from planner.search.lights import _Contrasts, with_shares
from planner.search.local import Refined, shifted
from planner.search.objective import Aim, SearchProblem, cut_off
from planner.uncertainty import Input, monte_carlo
from scenes import Camera, Noise, Picture, Pose
from scenes.cameras.data_sheet import completed
from scenes.lights import GLANCE
from scenes.measurands.measurands import Tolerance
from scenes.parts import mesh, step, step_kernel
from scenes.parts.surfaces import Torus
from scenes.photograph import Photograph
from tests.boards import SMALL, poses, told
from validation import remeasured, vary_check
from validation.batch import work
from validation.explore import session
from validation.explore.state import State
from validation.vary_check import Scatter, judged


def changed(scene, **parts):
    """A scene with fields of its parts changed: ``changed(scene, noise={"gain": 0.1})``."""
    update = {k: getattr(scene, k).model_copy(update=v) if isinstance(v, dict) else v for k, v in parts.items()}
    return scene.model_copy(update=update)


# --- what is seen


def clipped(level, sigma, full):
    """Mean and variance of a normal level cut off at ``full``, by the trapezium rule."""
    z = np.linspace(-9, 9, 20_001)
    weight = stats.norm.pdf(z)
    values = np.minimum(level[..., None] + sigma * z, full)
    mean = (values * weight).sum(-1) / weight.sum()
    return mean, ((values - mean[..., None]) ** 2 * weight).sum(-1) / weight.sum()


@pytest.mark.parametrize("reverse", [False, True], ids=["brighter at the first end", "brighter at the last end"])
def test_the_end_of_the_scale_is_felt_where_only_one_end_of_an_edge_is_that_bright(task1, reverse):
    """A near light and a long edge: one end cut off, the other far from it; by numbers of a clipped normal."""
    near = task1.light.model_copy(update={"distance": 30.0})
    scene = changed(task1, light=near, camera={"exposure": 255.0})
    light, fractions = (40.0, 190.0 if reverse else 260.0), np.array([0.02, 0.3, 0.6, 0.98])
    names = tuple(edge.name for edge in scene.solid.edges)
    pictures = Pictures.of(scene, (35.0, 215.0), light)
    sides = side_signals(pictures, names, edge_points(scene.solid, names, fractions))
    bright = sides.max(1)
    for name, ends in zip(names, bright[:, [0, -1]], strict=True):
        if ends.max() == 0:
            continue
        factor = 250.0 / ends.max()
        here = changed(scene, camera={"exposure": 255.0 * factor})
        found = edge_contrast(Pictures.of(here, (35.0, 215.0), light), (name,), fractions)
        level = here.noise.dark_level + sides[names.index(name)] * factor
        mean, variance = clipped(level, math.sqrt(here.noise.variance), 255)
        assert found.squared[0] == pytest.approx((mean[0] - mean[1]) ** 2, rel=1e-5)
        noise = np.broadcast_to(found.noise_variance, found.squared.shape)[0]
        assert noise == pytest.approx(variance.mean(0), rel=1e-5)
        if ends.min() < 0.85 * ends.max():
            # margin: an inequality: the end that is cut off has 2.0 times the noise
            assert noise.max() > 1.5 * noise.min()  # one end alone is cut off


def test_each_face_lends_light_by_its_own_reflectance():
    """A patch sends its reflectance times what comes from the light and from the others, whatever is painted."""
    bracket = scenes.load("bracket")
    picture = Pictures.of(bracket, (40.0, 30.0), (30.0, 80.0))
    shining = tuple(e._replace(at=tuple(e.at.tolist())) for e in emitters(bracket, picture.lights, GLANCE))
    inner = [bracket.solid.face_names[face] for face in np.flatnonzero(~bracket.solid.outer)]
    dull = scenes.FaceMaterial(name="dull", faces=tuple(inner[:1]), diffuse_reflectance=0.2)

    def found_in(scene):
        found = exchanged(scene, shining)
        seen, exchange = found.exchange.seen, found.exchange
        white = np.array([material.diffuse() for material in scene.surfaces.materials])[scene.surfaces.kinds]
        direct = _arriving(scene, *shining, seen.points, exchange.solid.normals[seen.faces])
        once = np.bincount(seen.starts, white[seen.faces] * direct, len(exchange.patches)) / exchange.rays
        places = exchange.places.faces
        again = exchange.between.dot(exchange.of_patches(white[places]) * found.arriving)
        return found.arriving - exchange.of_patches(once) - again, found.arriving

    (left, plain), (rest, painted) = map(found_in, (bracket, changed(bracket, materials=(dull,))))
    assert np.abs([left, rest]).max() < 1e-8 * plain.max()  # bounces are summed until 1e-9 is left
    assert np.abs(painted - plain).max() > 1e-2 * plain.max()  # the paint matters


@pytest.mark.parametrize("eye", [(1.0, 0.5, 0.3), (-2.5, 1.0, 0.1), (1.5, -2.0, 3.0), (20.0, 3.0, 1.0)])
def test_a_torus_hides_its_limb_only_where_it_stands_before_it(eye):
    """From within its ring, too, where more of the tube is behind the eye: lines of sight followed step by step."""
    torus, eye = Torus((0, 0, 0), (0.1, 0.2, 1.0), 5.0, 1.0), np.array(eye)
    polar, azimuth = np.degrees(np.arccos(eye[2] / np.linalg.norm(eye))), np.degrees(np.arctan2(eye[1], eye[0]))
    camera = Camera(width=640, height=480, focal_px=100.0, distance=float(np.linalg.norm(eye)))
    u = (np.arange(60) + 0.5) / 60
    found = {tuple(p) for strand in limb(torus, (polar, azimuth), camera, u).strands for p in strand.points.round(6)}
    steps, expected, ahead = np.linspace(0, 0.98, 400)[:, None, None], set(), 0
    for branch in contour(torus, eye).branches:
        points = branch.points(u)
        way = points - eye
        front = (way @ -eye) > 1e-6 * np.linalg.norm(way, axis=1) * np.linalg.norm(eye)
        free = torus.values(eye + steps * way).min(0) > 0
        unit = way / np.linalg.norm(way, axis=1)[:, None]
        beyond = torus.values(points + 1e-3 * unit) > 0  # it touches from outside
        expected |= {tuple(p) for p in points[front & free & beyond].round(6)}
        ahead += int(front.sum())
    assert found == expected
    assert expected
    assert (len(expected) < ahead) == (eye[0] == 20)  # from outside some are hidden


# --- searches


@pytest.mark.parametrize("larger", [0.9, 1.5])
def test_no_mixture_of_lights_is_below_the_bound_of_its_sensor(larger):
    """Short edges, whose ends take most, under a single place of both lights: below the best, and not far below."""
    scene = scenes.load("two_lights")
    scene, aim = changed(scene, camera={"focal_px": larger * scene.camera.focal_px}), Aim.of(scene.quantities, "object")
    place, ratios, lengths = np.array([[40.0, 300.0]]), [], []
    looks = _Contrasts(SearchProblem(scene, "calibrated", aim, planner.Constraints()), place)
    for sensor in np.array([[p, a] for p in (30.0, 60.0) for a in range(195, 360, 15)], float):
        known = looks.of_sensor(sensor)
        for share in ((0.0, 1.0), (0.3, 0.7)) if known else ():
            exact = planner.variances(with_shares(scene, share), sensor, (place[0], place[0]))
            ratios.append(looks.bound(sensor) / min(looks.best(known, share)[0], float(exact)))
            lengths.append(projected_edges(Pictures.of(scene, sensor)).usable.min())
    assert min(lengths) < 6
    assert max(ratios) <= 1  # margin: a bound that holds by its kind
    assert max(ratios) > 0.5  # margin: an inequality: the bound is near what it bounds


@pytest.mark.parametrize(("bright", "contrast", "noise"), [(150, 50, 1.0), (300, 135, 0.5)])
def test_a_mixture_of_lights_that_is_too_bright_is_cut_off(bright, contrast, noise):
    """At 255 levels, 20 of them darkness: what is beyond is 235 and has no noise."""
    scene = scenes.load("two_lights")
    mixed = np.array([[[[bright] * 3, [100.0] * 3]]])
    squared, variance = _Contrasts._contrast(SimpleNamespace(scene=scene), mixed)
    assert squared == pytest.approx(np.full((1, 1, 3), contrast**2), rel=1e-3)
    assert variance == pytest.approx(noise * scene.noise.variance, rel=0.02)


def test_levels_of_a_single_edge_that_are_cut_off_are_enough(task1):
    part = np.array([[False, False, True], [False, False, False], [True, False, False]])
    assert cut_off(SimpleNamespace(cut_off=part)).tolist() == [True, False, True]


def test_the_moves_of_a_robust_plan_are_degrees_of_sensor_and_light(task1, monkeypatch):
    """The better place is told to the search: 3 degrees from the sensor, 8 from the light."""
    found = planner.plan(task1, step_deg=30, refined=False)
    away = {}

    def refine(problem, pair, step_deg, value=None):
        sensor, light = pair
        if value is not None:
            return Refined(sensor, light, np.zeros(0), value(sensor, light))
        away["pair"] = shifted(sensor, np.array([3.0, 0.0])), shifted(light, np.array([0.0, 8.0]))
        return Refined(*away["pair"], np.zeros(0), 0.5 * found.variance)

    monkeypatch.setattr(robustness, "refine", refine)
    told = planner.robust(found, planner.Tolerances(noise=0.3, sensor_deg=1.0, light_deg=4.0))
    assert [move.factor for move in told.moves] == pytest.approx([0.7, 1.3])
    for move in told.moves:
        assert (move.sensor_deg, move.light_deg) == pytest.approx((3.0, 8.0), rel=1e-6)
        assert move.best == pytest.approx(0.5, rel=1e-9)
        # margin: rounding to levels, which does not grow with the factor
        assert move.variance == pytest.approx(move.factor**2, rel=0.05)  # rounding is no part of the factor
    sensor, light = (np.array(list(pose)) for pose in found.poses)
    every = [
        planner.variances(
            changed(task1, noise={"sigma": factor * task1.noise.sigma}), shifted(sensor, a), shifted(light, b)
        )
        for factor in (0.7, 1.3)
        for a in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
        for b in ((0, 0), (4, 0), (-4, 0), (0, 4), (0, -4))
    ]
    assert told.cases == len(every) == 50
    assert told.plan_worst == pytest.approx(float(np.max(every)), rel=1e-9)


@pytest.mark.parametrize(("by", "other"), [(3.0, 0.0), (0.0, 8.0), (-5.0, 0.0)])
def test_a_pose_is_shifted_by_degrees(by, other):
    pose = np.array([35.0, 200.0])
    moved = shifted(pose, np.array([by, other]))
    assert np.degrees(np.arccos(direction(pose) @ direction(moved))) == pytest.approx(abs(by + other), rel=1e-9)


def test_limits_of_the_light_are_the_light_s():
    """Of poses that only one of the two may have."""
    limits = planner.Constraints(
        sensor_polar_deg=(10, 30), light_polar_deg=(40, 60), sensor_azimuth_deg=(0, 90), light_azimuth_deg=(180, 270),
        forbidden_sensor=((20, 10, 5),), forbidden_light=((50, 200, 5),),
    )  # fmt: skip
    poses_ = np.array([[20.0, 45], [50, 45], [20, 225], [50, 225], [20, 10], [50, 200], [10, 90], [60, 180], [61, 225]])
    assert limits.sensors(scenes.load("task1"), poses_).tolist() == [1, 0, 0, 0, 0, 0, 1, 0, 0]
    assert limits.lights(poses_).tolist() == [0, 0, 0, 1, 0, 0, 0, 1, 0]


# --- numbers


def test_monte_carlo_counts_its_degrees_of_freedom():
    """Blocks of 40 draws, some of which fail: all that is told, from the draws themselves by `statistics`."""
    stable = []
    for seed in range(40):
        seen = []

        def model(drawn, seen=seen):
            values = np.where(drawn["a"] > 1.5, np.nan, drawn["a"] ** 2)
            seen.append(values)
            return values

        found = monte_carlo(model, [Input("a", 0.0, 1.0)], seed, digits=1, block=40, most=80 + 40 * (seed % 3))
        blocks = [[float(v) for v in values if math.isfinite(v)] for values in seen]
        whole = [value for block in blocks for value in block]
        assert (found.draws, found.failed) == (len(whole), sum(map(len, seen)) - len(whole))
        assert (found.y, found.u) == pytest.approx((statistics.mean(whole), statistics.stdev(whole)), rel=1e-12)
        each = [(statistics.mean(b), statistics.stdev(b), *np.quantile(b, (0.025, 0.975))) for b in blocks]
        spread = [statistics.stdev(column) / math.sqrt(len(blocks)) for column in zip(*each, strict=True)]
        assert found.spread == pytest.approx(spread, rel=1e-9)
        exponent = math.floor(math.log10(float(f"{statistics.stdev(whole):.0e}")))
        assert found.tolerance == pytest.approx(0.5 * 10.0**exponent)
        factor = {2: 12.7062, 3: 4.3027, 4: 3.1824}[len(blocks)]  # Student's 97.5 %, from a book
        assert found.converged == (factor * max(spread) <= found.tolerance)
        stable.append(max(spread) / found.tolerance)
    assert len({round(s, 6) for s in stable}) == 40


@pytest.mark.parametrize(("blocks", "factor"), [(2, 12.7062), (3, 4.3027), (5, 2.7764), (200, 2.0)])
def test_few_blocks_know_their_scatter_but_roughly(blocks, factor):
    from planner.uncertainty.monte_carlo import _factor

    assert _factor(blocks) == pytest.approx(factor, rel=1e-4)


def test_the_variance_of_a_modulation_transfer_is_that_of_its_derivatives():
    """Noise that differs from sample to sample of a blurred step: differences of the transfer by each of them."""
    place = np.arange(-11.9, 11.9, 0.125) + 0.02 * np.sin(np.arange(191))
    seen = 0.8 * stats.norm.cdf(place - 0.3, scale=0.9)  # its whole rise is not 1
    variance = 1e-5 * (1 + np.arange(place.size) % 7) * np.where(place > 0, 4.0, 1.0)
    told = mtfs._response(10.0, place, seen, variance)

    def moved(i, by):
        values = seen.copy()
        values[i] += by
        return mtfs._response(10.0, place, values, variance)

    pairs = [(moved(i, 1e-5), moved(i, -1e-5)) for i in range(place.size)]
    slope = np.array([(a.mtf - b.mtf) / 2e-5 for a, b in pairs])
    part = told.mtf > 0.2
    assert told.mtf_variance[part] == pytest.approx((variance @ slope**2)[part], rel=0.02, abs=1e-12)
    at_half = np.array([(a.mtf50 - b.mtf50) / 2e-5 for a, b in pairs])
    # margin: differences of 1e-5 of a step, whose own error is 0.5 %
    assert told.mtf50_error == pytest.approx(math.sqrt(variance @ at_half**2), rel=0.05)
    assert told.mtf_variance[0] == pytest.approx(0.0, abs=1e-15)  # it is 1 by definition
    assert part.sum() > 20


def test_a_fixed_pattern_is_in_the_mean_of_many_photographs_too(task1):
    """What scatters from picture to picture over their number, the pattern as it is; two groups of 1 and 4."""
    noise = Noise(sigma=2.0, bits=8, gain=0.05, dark_level=30.0, prnu=0.02, dsnu=1.5)
    scene = changed(task1, camera={"width": 112, "height": 96, "focal_px": 350.0}, noise=noise)
    pictures = [Picture.of(scene, (35, 120), (25, 300)), Picture.of(scene, (30, 200), (25, 300))]
    parameters = Parameters.of(tuple(pictures))
    pixels = tuple(Pixels.around(parameters.pictures_at(parameters.start(), k)) for k in (0, 1))
    blank = np.zeros((96, 112))
    problem = Problem(parameters, (Shots(blank, 1, None, (0,)), Shots(blank, 4, None, (1, 2, 3, 4))), pixels)
    values = parameters.start()
    expected = []
    for k, count in enumerate((1, 4)):
        signal = problem.signal(values, k)
        assert 40 < signal.max() < 230  # away from both ends of the scale  # margin: the picture's own brightest level

        expected.append((2.0**2 + 1 / 12 + 0.05 * signal) / count + 1.5**2 + (0.02 * signal) ** 2)
    assert problem.variance(values, noise) == pytest.approx(np.concatenate(expected), rel=1e-9)


def test_a_board_s_pose_takes_six_degrees_of_freedom():
    """Boards of different numbers of measured corners; the p-value is that of the same chi-square by SciPy."""
    rng, boards = np.random.default_rng(5), []
    for i, pose in enumerate(poses(SMALL, 4, np.random.default_rng(4), 420.0)):
        truth = SMALL.corners(pose)
        covariance = np.tile(np.diag([0.01, 0.02]) ** 2, (len(truth), 1, 1))
        board = told(truth + rng.normal(size=truth.shape) * [0.01, 0.02], covariance, SMALL.board)
        lost = 3 * i
        boards.append(replace(board, status=("outside",) * lost + board.status[lost:]))
    counts = [int(board.measured.sum()) for board in boards]
    assert len(set(counts)) == 4
    found = measure.calibrate_camera(boards, SMALL.square, SMALL.size[::-1], "k1,k2")
    assert found.freedom == 2 * sum(counts) - 6 - 6 * 4
    left = np.concatenate([r[np.isfinite(r).all(1)] for r in found.residuals]) / [0.01, 0.02]
    assert found.chi_square == pytest.approx((left**2).sum(), rel=1e-9)
    assert found.p_value == pytest.approx(stats.chi2.sf((left**2).sum(), found.freedom), rel=1e-6)
    away = np.concatenate([r[np.isfinite(r).all(1)] for r in found.residuals])
    assert found.rms_px == pytest.approx(math.sqrt((away**2).sum(1).mean()), rel=1e-9)


def test_what_a_fitted_crossing_leaves_is_its_degrees_of_freedom(rng):
    """120 crossings in unit noise, of windows of 120 and of 80 px: the mean square, and its number, 17 less."""
    offset = np.stack(np.meshgrid(np.arange(-7, 8), np.arange(-7, 8)), -1).reshape(-1, 2).astype(float)[40:160]
    truth = np.column_stack([
        rng.uniform(-0.4, 0.4, (120, 2)), rng.uniform(-0.1, 0.1, 120), rng.uniform(1.45, 1.75, 120), np.full(120, -0.2),
    ])  # fmt: skip
    places, bend = np.tile(offset, (120, 1, 1)), np.zeros((120, 2))
    there = np.ones(places.shape[:2], bool)
    there[::2, 80:] = False
    levels = 100 + 60 * response(places, truth, bend).signs[..., 2] + rng.normal(size=there.shape)
    windows = Windows(places, np.where(there, levels, 0.0), there, np.ones(120, bool))
    found = fit_crossings(windows, truth, bend, 1e-4)
    assert found.freedom.tolist() == [63, 103] * 60
    for some, freedom in ((np.s_[::2], 63), (np.s_[1::2], 103)):
        # margin: chance: 4 standard errors of 60 windows
        assert found.square[some].mean() == pytest.approx(freedom, abs=4 * math.sqrt(2 * freedom / 60))
        # margin: chance: 12 more are 7 standard errors
        assert abs(found.square[some].mean() - freedom - 12) > 4 * math.sqrt(2 * freedom / 60)


def scatter(measured, predicted, n, failed, share=1.0):
    return Scatter("width", predicted, predicted, measured, share, n, failed, (0.0, 9.0), "ok")


def test_lost_pictures_count_for_no_degree_of_freedom():
    """Student's and Fisher's tables: 60 pictures of 1,000 and of 500, 9 and 4 of them lost."""
    one, two = scatter(2.0, 1.9, 1000, 9, share=3.0), scatter(1.1, 1.0, 500, 4, share=2.0)
    found = judged(one, two)
    assert found.gain == pytest.approx(2.0 * 3.0 / (1.1 * 2.0))
    assert found.predicted_gain == pytest.approx(1.9 * 3.0 / (1.0 * 2.0))
    law = stats.f(990, 495)
    assert found.interval == pytest.approx(tuple(found.gain / law.ppf(p) for p in (0.975, 0.025)), rel=1e-12)
    ratio = found.gain / found.predicted_gain
    assert found.p_value == pytest.approx(2 * min(law.cdf(ratio), law.sf(ratio)), rel=1e-9)


def test_lost_pictures_are_not_in_the_interval_of_a_plan_s_scatter(task1, monkeypatch):
    """7 of 40 pictures lost: the chi-square interval is that of 33 values, the variance theirs, in the object."""
    rng, states = np.random.default_rng(3), np.array([["ok"]])
    values = 12.5 + 0.01 * rng.normal(size=(40, 1))
    values[4:11] = np.nan
    known = SimpleNamespace(status=("ok",), covariance=np.array([[2e-4]]), covariance_image=np.array([[3e-2]]))
    seen = SimpleNamespace(value=values, value_image=80 * values + 1, status=states)
    monkeypatch.setattr(vary_check.render, "expose", lambda *_: None)
    monkeypatch.setattr(vary_check, "propagated", lambda *_: (None, known))
    monkeypatch.setattr(remeasured, "exposures_by", lambda *_: (seen,))
    for objective, scale, propagated in (("object", 1.0, 2e-4), ("image", 6400.0, 3e-2)):
        plan = SimpleNamespace(scene=task1, objective=objective, over="minimax", model="calibrated")
        chosen = SimpleNamespace(scene=task1, sensor=(30, 135), light=(15, 315))
        found = vary_check._scatter(plan, chosen, 40, None, None)
        good = values[np.isfinite(values)]
        variance = scale * statistics.variance(good.tolist())
        ends = [variance * 32 / stats.chi2.ppf(q, 32) for q in (0.975, 0.025)]
        assert (found.n, found.failed, found.propagated) == (40, 7, propagated)
        assert (found.measured, *found.interval) == pytest.approx((variance, *ends), rel=1e-9)


def test_a_circle_s_pieces_have_two_ends_each():
    """Two pieces of a rim, the contrast unlike at each of their four ends: correlated errors, added up by hand."""
    n, scale = 960, 1.3
    angle = (np.arange(n) + 0.5) * 2 * np.pi / n
    arc = np.full(n, 80 * 2 * np.pi / n)
    design = np.stack([np.cos(angle), np.sin(angle), np.ones(n)], -1) * 7.0
    squared = np.linspace(400, 40_000, n)
    clear = np.ones(n, bool)
    clear[120:200] = clear[600:840] = False
    rim = RimImage(design, arc, squared, 4.0, clear)
    found = calibrated_circle(rim, 0.9, scale, 25.0)
    pull = np.where(clear, np.sqrt(squared / 4.0), 0.0)[:, None] * design * arc[:, None]
    away = np.abs(np.arange(n)[:, None] - np.arange(n))
    apart = arc[0] * np.minimum(away, n - away)
    information = (pull.T / arc) @ pull
    scatter, alone = pull.T @ np.exp(-((apart / (2 * scale)) ** 2)) @ pull, 2 * math.sqrt(math.pi) * scale * information
    inverse = np.linalg.inv(information)
    expected, endless = (0.9 * inverse @ each @ inverse for each in (scatter, alone))
    assert found == pytest.approx(expected, rel=2e-3)
    assert np.abs(expected / endless - 1).max() > 0.01


def test_a_face_is_a_sliver_by_its_reach_beyond_the_edge_not_by_its_length():
    """A rectangle of 40 x 3 px: thin beyond its long sides, long beyond its short ones."""
    layout = polygon_layout(np.array([[10.0, 10], [50, 20], [49.27, 22.91], [9.27, 12.91]]), Optics((64, 64)))
    assert layout.without_slivers(2.9) is layout
    thin = layout.without_slivers(3.1)
    assert (thin.sides == BACKGROUND).all()
    assert thin.faces[0].max() < -1e6


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize(("apex", "planes"), [(1e-7, 1), (0.5, 2)])
def test_a_sliver_of_a_mesh_is_told_by_its_height_over_the_other_triangle(order, apex, planes):
    """Its own normal means nothing: an apex a hair off its long side and off the plane, whichever comes first."""
    corners = [[0, 0, 0], [10, 0, 0], [3, 10, 0], [5, -apex, apex]]
    faces = [[[0, 1, 2], [1, 0, 3]][k] for k in order]
    made = trimesh.Trimesh(np.array(corners, float), faces, process=False)
    assert made.face_adjacency_angles[0] > 0.7  # margin: pi / 4 by construction
    assert len(set(mesh._planes(made).tolist())) == planes


def test_half_of_an_uneven_tolerance_is_half_of_its_zone():
    """What every ratio is over: of +0.03 -0.01 it is 0.02, in predictions, aims and what a plan minimises."""
    zone = Tolerance(plus=0.03, minus=0.01)
    assert zone.half == pytest.approx(0.02)
    plate = scenes.load("plate")
    uneven = tuple(
        m.model_copy(update={"tolerance": Tolerance(plus=0.03 * k, minus=0.01 / k)})
        for k, m in enumerate(plate.measurands, 1)
    )
    scene = plate.model_copy(update={"measurands": uneven})
    found = planner.predict(scene, plate.settings[0].sensor, plate.settings[0].light)
    sigma = np.sqrt([each.variance_object for each in found.measurands])
    half = np.array([(q.tolerance.plus + q.tolerance.minus) / 2 for q in scene.quantities])
    assert [each.ratio for each in found.measurands] == pytest.approx((sigma / half).tolist(), rel=1e-12)
    assert found.worst_ratio == pytest.approx((sigma / half).max(), rel=1e-12)
    for over, expected in (("minimax", ((sigma / half) ** 2).max()), ("sum", ((sigma / half) ** 2).sum())):
        assert float(Aim.of(scene.quantities, "object", over)(sigma**2)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("known", "height"), [({"width": 2000}, 1200), ({"pixel_pitch_um": 4.4}, 1200)])
def test_the_pitch_is_the_sensor_s_width_over_its_columns(known, height):
    """8.8 x 5.28 mm of 2,000 columns: 4.4 um, so 1,200 rows; focused at 300 mm."""
    told = completed({"sensor_size_mm": [8.8, 5.28], "focal_length_mm": 25.0, "distance": 300.0, **known}, "mm")
    assert (told["width"], told["height"]) == (2000, height)
    assert told["focal_px"] == pytest.approx(25 * 300 / 275 / 4.4e-3, rel=1e-12)


# --- files


def test_a_cone_of_a_step_file_ends_along_its_axis():
    """Parameters run along the slant (ISO 10303-42): 20 degrees, so nothing is alike; from mm to cm."""
    angle, radius, along = math.radians(20.0), 12.0, (-8.0, 22.0)
    face = {"kind": "cone", "point": [1.0, 2.0, 3.0], "axis": [0.0, 0.6, 0.8], "hollow": True, "radius": radius,
            "half_angle": angle, "along": list(along)}  # fmt: skip
    cone = step._surface(face, 0.1)
    for v in along:
        place = np.array([0.1, 0.2, 0.3]) + 0.1 * v * math.cos(angle) * np.array([0, 0.6, 0.8])
        there = place + 0.1 * (radius + v * math.sin(angle)) * np.array([1.0, 0, 0])
        assert abs(cone.values(there[None])[0]) < 1e-12
        height = (place - cone.point) @ cone.axis
        assert min(abs(height - end) for end in cone.ends) < 1e-12
    assert cone.half_angle_deg == pytest.approx(20.0)
    assert cone.hollow


@pytest.fixture
def adaptor(monkeypatch):
    """A stand-in for OpenCASCADE's surface adaptor: what a face says is what the test puts there."""
    found = SimpleNamespace(face=None)
    rep, top = ModuleType("OCP.BRepAdaptor"), ModuleType("OCP.TopAbs")
    rep.BRepAdaptor_Surface = lambda face: found.face
    top.TopAbs_Orientation = SimpleNamespace(TopAbs_REVERSED="reversed", TopAbs_FORWARD="forward")
    for name, module in (("OCP", ModuleType("OCP")), ("OCP.BRepAdaptor", rep), ("OCP.TopAbs", top)):
        monkeypatch.setitem(sys.modules, name, module)

    def surface(kind, way, direct=True, **numbers):
        vector = lambda *v: SimpleNamespace(X=lambda: v[0], Y=lambda: v[1], Z=lambda: v[2])  # noqa: E731
        position = SimpleNamespace(
            Location=lambda: vector(1, 2, 3), Direction=lambda: vector(0, 0.6, 0.8), Direct=lambda: direct
        )
        shape = SimpleNamespace(
            Position=lambda: position, Location=position.Location, Axis=lambda: position,
            **{name: (lambda v=v: v) for name, v in numbers.items()},
        )  # fmt: skip
        found.face = SimpleNamespace(
            GetType=lambda: f"GeomAbs_SurfaceType.GeomAbs_{kind}", FirstVParameter=lambda: -8.0,
            LastVParameter=lambda: 22.0, **{kind: lambda: shape},
        )  # fmt: skip
        return step_kernel._surface(SimpleNamespace(Orientation=lambda: way))

    return surface


def test_the_kernel_s_surfaces_are_recorded_as_they_are(adaptor):
    """Which number is which, and on which side the material is, of all kinds; no kernel is needed."""
    place = {"point": [1, 2, 3], "axis": [0, 0.6, 0.8]}
    cone = adaptor("Cone", "forward", RefRadius=12.0, SemiAngle=0.35)
    assert cone == place | {"kind": "cone", "hollow": False, "radius": 12.0, "half_angle": 0.35, "along": [-8.0, 22.0]}
    torus = adaptor("Torus", "reversed", MajorRadius=9.0, MinorRadius=2.0)
    assert torus == place | {"kind": "torus", "hollow": True, "radius": 9.0, "tube": 2.0}
    cylinder = adaptor("Cylinder", "forward", direct=False, Radius=4.0)
    assert cylinder == place | {"kind": "cylinder", "hollow": True, "radius": 4.0, "ends": [-8.0, 22.0]}
    assert adaptor("Sphere", "reversed", direct=False, Radius=4.0)["hollow"] is False
    for way, direct, sign in (("forward", True, 1), ("reversed", True, -1), ("forward", False, -1)):
        normal = adaptor("Plane", way, direct=direct)["normal"]
        assert normal == pytest.approx([0, 0.6 * sign, 0.8 * sign])


# --- what runs beside each other


class Alone:
    """Notices who comes in while somebody is."""

    def __init__(self):
        self.inside = self.most = self.calls = 0

    def __call__(self, *_, **__):
        self.inside, self.calls = self.inside + 1, self.calls + 1
        self.most = max(self.most, self.inside)
        time.sleep(0.03)
        self.inside -= 1
        return SimpleNamespace(image=SimpleNamespace(array=lambda: None))


def at_once(work_, count=3):
    threads = [threading.Thread(target=work_) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


@pytest.mark.parametrize("door", ["variants.use", "render_setting", "render.shots"])
def test_one_thread_at_a_time_is_in_the_renderer(task1, monkeypatch, door):
    """A Dask worker has several threads; Mitsuba bears one, whichever way it is entered."""
    alone, nothing = Alone(), SimpleNamespace(image=SimpleNamespace(array=lambda: None))
    monkeypatch.setattr(work.variants, "use", alone if door == "variants.use" else lambda *_: None)
    monkeypatch.setattr(work, "render_setting", alone if door == "render_setting" else lambda *_: nothing)
    monkeypatch.setattr(work.render, "shots", alone if door == "render.shots" else lambda *_, **__: None)
    monkeypatch.setattr(work, "measure_chunk", lambda *a: a[-1] and a[-1](None, 1))
    scene = changed(task1, jitter=scenes.Jitter(sensor_deg=0.1))
    case = SimpleNamespace(scene=scene, setting=scene.settings[0])
    monkeypatch.setattr(work, "_jitter", lambda *_: scene.jitter)
    task = work.Chunks(case, ((0, 1),), 1, "scalar_rgb")
    at_once(lambda: work.perform(task))
    assert (alone.most, alone.calls) == (1, 3)


def test_a_photograph_is_looked_at_by_one_thread_for_all(monkeypatch):
    """The threads of a measurement ask for the same: one of them works, once, the others wait for it."""
    alone = Alone()
    monkeypatch.setattr(recording, "smooth_patches", alone)
    for name in ("scale_of", "curve_of", "is_compressed"):
        monkeypatch.setattr(recording, name, lambda *_: SimpleNamespace(limits=None, step=1.0))
    recording._told.cache_clear()
    photo = Photograph(np.arange(64.0).reshape(8, 8))
    at_once(lambda: recording._whole(photo))
    recording._told.cache_clear()
    assert (alone.most, alone.calls) == (1, 1)


def test_explore_renders_anew_when_a_light_or_the_sensor_moves():
    """And only then; with two lights, each of them counts."""
    scene = scenes.load("two_lights")
    first = State.first(scene)
    assert len(first.lights) == 2
    asked = []

    class Tools:
        async def variant(self):
            return "scalar_rgb"

        async def perform(self, task):
            asked.append(task.case.picture)
            return work.TaskResult(SimpleNamespace(number=len(asked)), {})

    async def run():
        here = session.Session(session.Place(scene, "two_lights", None), Tools(), None)
        one, two = first.lights
        states = [
            (first, 1), (replace(first, measurand=0, shown="ratio"), 1),
            (replace(first, lights=(Pose(one.polar_deg + 1, one.azimuth_deg), two)), 2), (first, 3),
            (replace(first, lights=(one, Pose(two.polar_deg, two.azimuth_deg + 1))), 4), (first, 5),
            (replace(first, sensor=Pose(first.sensor.polar_deg, first.sensor.azimuth_deg + 1)), 6), (first, 7),
        ]  # fmt: skip
        for state, number in states:
            assert (await here._rendered(state)).number == number
            assert (asked[-1].sensor, asked[-1].lights) == (state.sensor, state.lights)

    asyncio.run(run())
