"""Branches that the bundled scenes do not take: scattering poses, limbs of every kind, full budgets, refusals."""

from functools import cache, partial

import numpy as np

import planner
import scenes
from imaging import sensor as imaging_sensor
from imaging.contours import limb, shading, tori
from imaging.features.measurand import required_edges
from imaging.geometry import projection, rays
from imaging.light import backlight, bore, revolved
from imaging.models import moments
from imaging.pictures import Pictures
from planner.budgeting import plans
from planner.budgeting.sources import sources
from planner.search.grid import ViewingSpace
from planner.uncertainty import Input, budget, conformity, gauge, improve, inputs, risks
from planner.uncertainty.groups import Group, draw
from planner.uncertainty.ufloats import as_ufloats
from scenes import Noise, Picture, Pose, Tolerance
from scenes.parts.surfaces import Torus, axes_beside
from scenes.viewpoint import Viewpoint
from tests.curved import SURFACES
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED, SEARCHED
from tests.unit.test_limbs import CAMERA, POSES

_STATION = {
    "sensor_deg": 0.05, "light_deg": {"half_width": 0.7}, "sensor_roll_deg": 0.04, "sensor_distance": 0.02,
    "part_shift": 0.007, "part_tilt_deg": {"half_width": 0.03}, "principal_point_px": 0.6, "rounding": 0.002,
    "temperature_K": {"value": 0.7, "half_width": 1.0}, "expansion_per_K": {"value": 11.5e-6, "half_width": 1e-6},
}  # fmt: skip
_CLOSED_FORM = {"cylinder", "cone", "narrowing cone", "sphere", "torus", "hollow torus"}
_OFF = ("plate", "ball", "shaft", "task1", "calibrated_rig", "two_lights", "flange", "block through a lens")


def _scattered(name):
    scene = load(name).with_(jitter={"sensor_deg": 0.13})
    if name == "ball":  # beside the axis, or nothing moves
        scene = scene.with_(camera={"look_at": [3.1, -2.3, 8.7]})
    here = np.array(list(uneven(scene)[0]))
    sensors = here + np.array([[0.0, 0.0], [7.3, -31.0], [-5.1, 12.0]])
    beside = np.concatenate([sensors, [[0.2, 40.0]]])
    return planner.pose_scatter(scene, beside)


def _contours(name):
    surface = SURFACES[name]
    found = []
    for pose in POSES[:2]:
        seen = limb(surface, pose, CAMERA, 9)
        known = name in _CLOSED_FORM  # of the others an eigenvector's sign says where they begin
        found.append({"status": seen.status, "count": len(seen.strands)} | {
            "strands": seen.strands} if known else [seen.status, len(seen.strands)])  # fmt: skip
    return found


def _shading():
    places = np.linspace(0.05, 1, 9)
    levels = np.stack([3 + 2 * places**2, 7 - places + np.sin(3 * places)])
    told = shading.fitted(places, levels, 2.7)
    return {"fitted": told, "levels": told.levels(np.array([0.1, 1.3]))}


def _tori():
    torus, u = Torus(np.array([1.0, 2, 3]), np.array([0.48, -0.6, 0.64]), 2.3, 0.6), np.linspace(0.03, 0.97, 7)
    hole = Torus(np.array([1.0, 2, 3]), np.array([0.48, -0.6, 0.64]), 2.3, 0.6, hollow=True)
    one, two = axes_beside(torus.axis)
    eyes = {"above": 9 * torus.axis + 2 * one, "beside": 8 * one + 0.2 * torus.axis, "far": 30 * two + 0.3 * torus.axis,
            "within": 2.4 * one, "on": 2.9 * one, "hole": 0.3 * one + 0.1 * torus.axis,
            "over": 9 * torus.axis}  # fmt: skip
    found = {}
    for name, away in eyes.items():
        for kind, each in (("torus", torus), ("hollow", hole)):
            status, branches = tori.torus_branches(each, Viewpoint(each.centre + away))
            found[f"{name} {kind}"] = [status, [[b.middle, b.half, b.side, b.points(u)] for b in branches]]
    return found


def _sensed():
    levels = np.concatenate([np.linspace(0.2, 9.7, 8), np.linspace(235, 259, 9)])
    found = {}
    for name, noise in {
        "quiet": Noise(sigma=0.2, bits=8), "loud": Noise(sigma=9.0, bits=8, dark_level=5.0), "shot": Noise(
            sigma=1.3, bits=8, gain=0.2, dark_level=3.0), "free": Noise(sigma=1.3, gain=0.2),
                "none": Noise(sigma=0.0, bits=8),
    }.items():  # fmt: skip
        like = imaging_sensor.recorded(noise, levels)
        found[name] = {"like": like, "errors": imaging_sensor.squared_errors(noise, levels, like),
                       "slope": imaging_sensor.sensitivity(noise, levels), "room": imaging_sensor.headroom(noise),
                       "low": imaging_sensor.recorded(noise, levels[:8]), "full": imaging_sensor.full_scale(noise),
                       "shot": imaging_sensor.shot_noise(noise, levels - 5),
                       "low errors": imaging_sensor.squared_errors(noise, levels[:8], imaging_sensor.recorded(
                           noise, levels[:8]))}  # fmt: skip
    return found


def _moments():
    scene = load("task1")
    sensor, light = (np.array(list(pose)) for pose in uneven(scene))
    steps = np.array([[0.0, 0.0], [3.1, 17.3], [11.7, -41.9]])
    names = scene.required
    lamps = Pictures.of(scene, sensor, light + steps)
    eyes = Pictures.of(scene, sensor + steps, light)
    pairs = Pictures.of(scene, (sensor + steps)[:, None], (light + steps)[None])
    return {
        name: moments.moments(each, names, 11) for name, each in (("lamps", lamps), ("eyes", eyes), ("pairs", pairs))
    }


def _backlit():
    scene = load("backlight_plate")
    pictures = Pictures.of(Picture.of(scene, *uneven(scene)))
    rng = np.random.default_rng(3)
    points = rng.uniform(-30, 40, (6, 3))
    way = points - pictures.sensor_at
    told = [backlight.backlit(pictures, i, points, way, None) for i in backlight.backlights(scene)]
    ring = load("ring_light")
    return {"lights": backlight.backlights(scene), "none": backlight.backlights(ring), "levels": told,
            "back": [backlight.backlit(pictures, i, points, -way,
            None) for i in backlight.backlights(scene)]}  # fmt: skip


def _analysed(angle):
    scene = load("backlight_plate")
    polarised = [each.model_copy(update={"polarisation_deg": angle}) for each in scene.lights]
    changed = scene.model_copy(update={"light": None, "several_lights": tuple(polarised)})
    pictures = Pictures.of(Picture.of(changed, *uneven(changed)))
    analyser = np.array([0.6, 0.48, 0.64])
    return [backlight.passed(pictures, i, each) for i in backlight.backlights(changed) for each in (None, analyser)]


def _bores():
    found = {}
    for name in ("plate", "bracket_mm", "flange"):
        for i, each in enumerate(bore.bores(load(name).solid)[:2]):
            one, two = each.rim.axes
            turn = np.array([0.3, 2.1, 4.4, 5.9])
            wall = each.rim.centre + each.rim.radius * (np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * two)
            wall = wall - each.rim.axis * each.length * np.array([[0.1], [0.4], [0.7], [0.95]])
            found[f"{name} {i}"] = [each.length, each.free_radius, len(each.faces), bore.place_in(each, wall)]
    form, gather, nodes = bore._form_factors(0.37)
    return found | {"form": [form.real, form.imag, gather.real, nodes]}


def _rays():
    solid, rng = load("bracket_mm").solid, np.random.default_rng(5)
    origins, ways = rng.uniform(-5, 65, (40, 3)), rng.standard_normal((40, 3))
    ways[3] = np.nan
    order = rays._alike(origins, ways)
    with np.errstate(invalid="ignore"):
        return {"order": order, "met": rays.first_face(solid, origins, ways, ()), "own": rays.first_face(
            solid, origins, ways, (0, 3, 7))}  # fmt: skip


def _projected():
    scene = load("ring_light")
    lamp = scene.lights[0].model_copy(update={"offset": (3.0, -7.0)})
    poses = np.array([[20.0, 130.0], [55.0, -40.0]])
    turned = [scenes.load(name) for name in ("task1", "wedge", "macro")]
    return {"offset": projection.light_position(scene.camera, lamp, poses), "plain": projection.light_position(
                scene.camera, scene.lights[0], poses),
            "edges": [[" ".join(task.edges) for task in required_edges(each)] for each in turned]}  # fmt: skip


def _rings():
    found = {}
    for name in ("shaft", "shaft_ring"):
        rings = revolved.rings_of(load(name).solid)
        if rings is None:
            continue
        rng = np.random.default_rng(1)
        start, stop = rings.origin + rng.normal(0, 12, (7, 3)), rings.origin + rng.normal(0, 40, (7, 3))
        found[name] = [rings.profile, rings.of_wall, revolved.passes(rings, start, stop)]
    others = [revolved.rings_of(load(name).solid) is None for name in ("ball", "plate", "task1")]
    return found | {"others": others}


@cache
def _station(name, covariance=None):
    scene = load(name)
    said = dict(_STATION)
    if any(scene.lights) and not scene.free:
        said.pop("light_deg")
    if covariance is not None:
        rng = np.random.default_rng(2)
        root = rng.normal(0, 1, (4, 4)) * [[0.3], [0.4], [0.5], [1e-4]]
        said.pop("principal_point_px")
        said["covariance"] = {"names": list(covariance), "matrix": (root @ root.T).tolist()}
    return scene.with_(uncertainty=said)


def _full_budget(name, covariance=None, number=-1):
    scene = _station(name, covariance)
    found = planner.budget(scene, *uneven(scene, number), p=0.93)
    numbers = {} if name in ("ball", "shaft") else found.ufloats()  # what is 0 there cannot be one
    return {
        "whole": [[each.name, each.value, each.u, each.U, each.k, each.dof] for each in found], "line": str(found),
        "terms": found.terms, "rows": found.as_rows(),
        "numbers": {name: [each.nominal_value, each.std_dev] for name, each in numbers.items()},
        "joint": [(a + 2 * b).std_dev for a in numbers.values() for b in numbers.values()],
        "first": found[next(iter(found)).name].u,
    }  # fmt: skip


def _named_sources():
    told = []
    for names in (("fx", "cx", "cy", "k1"), ("fx", "fy", "cx", "p2"), None):
        scene = _station("block through a lens", names)
        told.append([[s.name, s.value, s.told, s.unit, s.kind, s.scale] for s in sources(scene)])
        told.append(plans.systematic(scene, np.array(list(uneven(scene)[0])), sources(scene)))
    with_jitter = load("two_lights").with_(jitter={"sensor_deg": 0.2, "light_deg": 0.4})
    return [*told, [[s.name, s.told, s.kind] for s in sources(with_jitter)]]


def _budget_refused():
    scene = _station("plate")
    pose = uneven(scene)
    count = len(scene.quantities)
    asked = [{"variances": [1.0]}, {"variances": [-1.0] * count}, {"biases": [0.1]}, {"variances": ["x"] * count},
             {"p": 1.2}, {"p": 0.0}]  # fmt: skip
    given = planner.budget(scene, *pose, variances=np.arange(1.0, count + 1) * 1e-6, biases=np.arange(count) * 1e-3)
    return {"refused": [without_error(partial(planner.budget, scene, *pose, **each)) for each in asked],
            "given": [[each.u, each.U] for each in given], "unbiased": [
                each.u for each in planner.budget(scene, *pose, biased=False)]}  # fmt: skip


def _capable_refused():
    two = load("two_lights")
    asked = [
        lambda: planner.plan_capability(two, step_deg=60.0),
        lambda: planner.plan_capability(load("plate"), step_deg=60.0, constraints=planner.Constraints(
            sensor_polar_deg=(1.0, 2.0), sensor_azimuth_deg=(1.0, 2.0))),
        lambda: planner.plan(load("task1"), step_deg=60.0, search="none"),
        lambda: planner.plan(load("task1"), step_deg=60.0, objective="none"),
        lambda: planner.plan(load("task1"), step_deg=60.0, model="none"),
        lambda: planner.plan(load("task1"), step_deg=0.0), lambda: planner.plan(load("task1"), step_deg=91.0),
        lambda: planner.plan(load("task1"), step_deg=60.0, edges="none"),
        lambda: planner.plan(load("plate"), step_deg=60.0, over="none"),
        lambda: planner.plan(load("task1"), step_deg=60.0, constraints=planner.Constraints(min_edge_px=1e4)),
        lambda: planner.plan(load("task1"), step_deg=60.0, vary=("none",)),
        lambda: planner.plan(load("task1"), step_deg=60.0, vary=("band",)),
        lambda: planner.plan(load("copper"), vary=("band", "band"), hold="none"),
        lambda: planner.plan(load("task1"), step_deg=60.0, shares="none"),
        lambda: planner.plan_views(load("task1"), 0), lambda: planner.plan_views(load("task1"), 2.5),
        lambda: planner.plan_views(load("plate"), 2, share="none"), lambda: planner.plan_views(load("plate"), 1000),
        lambda: planner.predict(load("task1"), (95.0, 10.0), (20.0, 0.0)),
        lambda: planner.predict(load("task1"), (30.0, 10.0)), lambda: planner.predict(load("task1"), (30.0, 10.0),
        (1.0,)),
        lambda: planner.variances(load("task1"), [[1.0, 2.0, 3.0]], [[1.0, 2.0]]),
        lambda: planner.variances(load("task1"), [[1.0, 2.0]], [[1.0, 2.0]], "none"),
        lambda: planner.variances(load("task1"), [[1.0, 2.0]], [[1.0, 2.0]], "paper", "none"),
        lambda: planner.pose_map(load("task1")), lambda: planner.combine([]),
        lambda: planner.Constraints(sensor_polar_deg=(30.0, 20.0)), lambda: planner.Constraints(camera_body=-1.0),
        lambda: planner.Constraints(min_separation_deg=181.0), lambda: planner.Constraints(min_edge_px=-1),
        lambda: planner.Constraints(forbidden_light=((1.0, 2.0),)),
        lambda: planner.Constraints(sensor_polar_deg=(1.0,)),
        lambda: planner.Constraints(light_azimuth_deg=(0.0, 400.0)), lambda: ViewingSpace(0.0, (0, 90)),
        lambda: ViewingSpace(10.0, (40, 20)), lambda: ViewingSpace(1e-4, (0, 90)), lambda: ViewingSpace(10.0, (0, 190)),
    ]  # fmt: skip
    return [_words(each) for each in asked]


def _words(make):
    """What is refused, or that it was not."""
    try:
        make()
    except (scenes.InvalidInput, ValueError, TypeError) as error:
        return [type(error).__name__, str(error).splitlines()[0]]
    return "taken"


def _inputs():
    made = {
        kind: Input("x", 1.7, 0.3, distribution=kind) for kind in ("normal", "rectangular", "triangular", "arcsine")
    }
    made["t"] = Input("x", 1.7, 0.3, dof=5, distribution="t")
    level = np.array([0.02, 0.31, 0.5, 0.77, 0.999])
    asked = [
        lambda: Input("", 1.0, 0.1), lambda: Input("x", np.nan, 0.1), lambda: Input("x", 1.0, -0.1),
        lambda: Input("x", 1.0, np.inf), lambda: Input("x", 1.0, 0.1, dof=0.5), lambda: Input("x", 1, 0.1, kind="no"),
        lambda: Input("x", 1.0, 0.1, distribution="no"), lambda: Input("x", 1.0, 0.1, dof=2, distribution="t"),
        lambda: Input("x", 1.0, 0.1, type="C"), lambda: Input.from_half_width("x", 1.0, -0.2),
        lambda: Input.from_half_width("x", 1.0, 0.2, "t"), lambda: Input.from_half_width("x", 1.0, 0.2, "normal"),
        lambda: inputs.Input("x", 1.0, 0.1, dof=np.inf, distribution="t"), lambda: Input("x", "1", 0.1),
        lambda: Group((), []), lambda: Group((made["normal"],), [[1.0, 0.0]]), lambda: Group((made["normal"],),
        [[2.0]]),
        lambda: Group((made["normal"], Input("y", 1.0, 0.1)), [[1.0, 0.4], [0.3, 1.0]]),
        lambda: Group((made["normal"], Input("y", 1.0, 0.1)), [[1.0, 1.4], [1.4, 1.0]]),
        lambda: Group((made["normal"], Input("y", 1.0, 0.1)), [[1.0, np.nan], [np.nan, 1.0]]),
        lambda: Group((made["normal"],), [[1.0]], dof=0.2), lambda: Group(
            (made["normal"], Input("y", 1.0, 0.1,
            kind="noise" if made["normal"].kind == "systematic" else "systematic")),
            np.eye(2)),
    ]  # fmt: skip
    some = Input("a", 1.0, 2.0), Input("b", 2.0, 3.0), Input("c", 3.0, 0.0)
    joint = Group(some, [[1.0, 1 / 6, 0.0], [1 / 6, 1.0, 0.0], [0.0, 0.0, 1.0]], "abc")
    mixed = Group((made["normal"], Input("y", 2.0, 0.5, distribution="rectangular")), [[1.0, 0.6], [0.6, 1.0]])
    rng = np.random.default_rng(4)
    halves = [Input.from_half_width("x", 1.0, 0.2, kind) for kind in ("rectangular", "triangular", "arcsine")]
    return {
        "quantile": {kind: each.quantile(level) for kind, each in made.items()}, "halves": halves,
        "draws": {kind: each.draw(np.random.default_rng(2), 4) for kind, each in made.items()},
        "joint": [joint, joint.covariance, joint.kind, joint.draw(rng, 4), mixed.draw(rng, 4), mixed.name, mixed.dof],
        "all": draw((made["t"], joint, Input("z", 0, 1)), rng, 3), "refused": [_words(each) for each in asked],
    }  # fmt: skip


def _of_budgets():
    scale, angle = Input("scale", 1.7, 0.03, dof=7), Input("angle", 0.4, 0.05, dof=12)
    pair = Group((Input("a", 1.0, 0.02), Input("b", 2.0, 0.05)), np.array([[1.0, -0.4], [-0.4, 1.0]]), "pair")
    slopes = {"scale": 1.3, "angle": -0.8, "a": 0.6, "b": 0.35}
    found = budget("length", "mm", 12.0, [scale, angle, pair], slopes, p=0.9)
    other = budget("width", "mm", 7.0, [scale, pair], {"scale": 0.4, "a": -0.6, "b": 1.0})
    numbers = as_ufloats([found, other])
    free = budget("length", "", 12.0, [Input("s", 1.0, 0.2), Input("t", 1.0, 0.1)], {"s": 1.0, "t": 0.0})
    asked = [
        lambda: budget("x", "mm", 1.0, [scale, scale], {"scale": 1.0}), lambda: budget("x", "mm", 1.0, [scale], {}),
        lambda: budget("x", "mm", 1.0, [scale], {"scale": np.nan}), lambda: budget("x", "mm", np.inf, [scale],
        {"scale": 1}),
        lambda: budget("x", "mm", 1.0, [scale], {"scale": 1.0, "no": 2.0}), lambda: budget(
            "x", "mm", 1.0, [scale], {"scale": 1.0}, p=1.0), lambda: found.of("none"), lambda: found.without("none"),
        lambda: improve.needed(found, 0.0, "scale"), lambda: improve.needed(found, np.inf, "scale"),
        lambda: improve.improvements(found, 1.2), lambda: improve.improvements(found, 0.0),
        lambda: as_ufloats([found, found]), lambda: as_ufloats([found, budget("w", "", 1.0, [Input("scale", 1, 9)],
                                                                             {"scale": 1.0})]),
        lambda: as_ufloats([found, budget("w", "", 1.0, [Input("a", 1, 9)], {"a": 1.0})]),
    ]  # fmt: skip
    return {
        "numbers": [[each.nominal_value, each.std_dev] for each in numbers.values()],
        "joint": (numbers["length"] - 2 * numbers["width"]).std_dev,
        "needed": [improve.needed(found, wanted * found.U, source) for wanted in (0.3, 0.8, 0.95, 1.2)
                   for source in ("scale", "angle", "pair")],
        "at the limit": [[one.reachable, one.u is None or one.u < 1e-6] for one in (
            improve.needed(found, found.without(each).U, each) for each in ("scale", "angle", "pair"))],
        "free": [improve.needed(free, wanted, source) for wanted in (0.3, 0.1) for source in ("s", "t")],
        "improvements": improve.improvements(found, 0.5), "rows": found.as_rows(),
        "refused": [_words(e) for e in asked],
        "lines": [str(found), str(free)],
    }  # fmt: skip


def _decisions():
    zones = [Tolerance(plus=0.03, minus=0.01), Tolerance(plus=0.03, minus=0.03)]
    limits = [risks.Limits.of(12.5, zone) for zone in zones]
    asked = [
        lambda: gauge(np.array([1.0]), 1.0, 0.05), lambda: gauge(np.array([1.0, np.nan]), 1.0, 0.05),
        lambda: gauge(np.array([1.0, 1.1]), 1.0, 0.0), lambda: gauge(np.array([1.0, 1.0]), 1.0, 0.5),
        lambda: conformity.decide(1.0, -0.1, 1.0, zones[0], 2.0), lambda: conformity.decide(np.nan, 0.1, 1, zones[0],
        2.0),
        lambda: limits[0].guarded(-0.1, 1.0), lambda: limits[0].guarded(9.0, 1.0),
        lambda: risks.nonconforming_probability(12.5, -0.1, limits[0]),
        lambda: risks.global_risks(12.5, 0.0, 0.1, limits[0], None), lambda: risks.Limits(2.0, 1.0),
    ]  # fmt: skip
    return {
        "edges": [[without_error(partial(conformity.decide, 12.5 + off, u, 12.5, zone, 2.0)) for off in (
                  -0.0101, -0.0061, 0.0, 0.0259, 0.0301)] for zone in zones for u in (0.0, 0.002)],
        "probability": [risks.nonconforming_probability(v, u, limit) for v in (12.48, 12.5, 12.53) for u in (0.001,
        0.01)
                        for limit in limits],
        "global": [risks.global_risks(12.51, 0.02, u, limit, None) for u in (0.003, 0.012) for limit in limits],
        "refused": [_words(each) for each in asked],
    }  # fmt: skip


_SEEN = planner.Constraints(sensor_polar_deg=(5.0, 70.0), sensor_azimuth_deg=(10.0, 170.0))
_FIXED = {"sensor": Pose(31.3, 131.7)}
_MORE_PLANS = {
    "wedge by the bound": ("wedge", {"model": "bound", "step_deg": 60.0, "constraints": _SEEN}),
    "wedge in the image": ("wedge", {"objective": "image", "step_deg": 45.0, **_FIXED}),
    "plate, sum": ("plate", {"over": "sum", "step_deg": 60.0, **_FIXED}),
    "plate, refined": ("plate", {"step_deg": 60.0, "refined": True, **_FIXED}),
    "two lights, refined": ("two_lights", {"step_deg": 60.0, "refined": True, "light": (
        Pose(58.3, 275.1), Pose(37.1, 283.3))}),
    "rig, alternating": ("calibrated_rig", {"step_deg": 30.0, "search": "alternating", "constraints": _SEEN}),
    "rig, best edges": ("calibrated_rig", {"step_deg": 60.0, "edges": "best", **_FIXED}),
    "lens": ("block through a lens", {"step_deg": 45.0, "constraints": _SEEN}),
}  # fmt: skip


def _planned(name, **how):
    found = planner.plan(load(name), **({"refined": False} | how))
    return {"sensor": found.sensor, "light": found.light, "variance": found.variance, "grid": [
                found.grid_sensor, found.grid_light, found.grid_variance], "guarantee": found.guarantee,
            "counts": [found.pairs, found.evaluated, len(found.candidates)], "gap": found.gap, "shares": found.shares,
            "candidates": sorted(each.variance for each in found.candidates), "alone": found.alone,
            "limiting": found.limiting, "line": str(found)}  # fmt: skip


def _views(name, count, **how):
    return planner.plan_views(load(name), count, step_deg=60.0, refined=False, **how)


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {
        "of shading": _shading, "of tori": _tori, "of sensors": _sensed, "of moments": _moments,
        "of backlights": _backlit, "analysed": partial(_analysed, 31.0), "analysed, plain": partial(_analysed, None),
        "of bores": _bores, "of rays": _rays, "projected": _projected, "of rings": _rings, "sources": _named_sources,
        "budget refused": _budget_refused, "plans refused": _capable_refused, "inputs": _inputs,
        "of budgets": _of_budgets, "of decisions": _decisions,
    }  # fmt: skip
    found |= {f"scattered {name}": partial(_scattered, name) for name in _OFF}
    found |= {f"contour of {name}": partial(_contours, name) for name in SURFACES}
    for name in ("plate", "ball", "shaft", "task1", "calibrated_rig", "block through a lens"):
        found[f"full budget {name}"] = partial(_full_budget, name)
    found["full budget of a calibrated camera"] = partial(
        _full_budget, "block through a lens", ("fx", "cx", "cy", "k1")
    )
    found["full budget of two focal lengths"] = partial(_full_budget, "block through a lens", ("fx", "fy", "cx", "p2"))
    found |= {f"plan more {name}": partial(_planned, scene, **how) for name, (scene, how) in _MORE_PLANS.items()}
    for name, count, how in (("plate", 2, {}), ("plate", 4, {"over": "sum"}), ("wedge", 3, {"share": "sensor"}),
                             ("ball", 3, {})):  # fmt: skip
        found[f"more views {name} {count}"] = partial(_views, name, count, **how)
    return {name: (SEARCHED if "rays" in name else CLOSED, make) for name, make in found.items()}
