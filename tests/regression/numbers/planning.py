"""Predictions, maps, plans and budgets: closed forms and searches on coarse grids."""

from functools import partial

import numpy as np

import planner
import scenes
from imaging.models import variance_model
from imaging.models.bias import bias, cluttered
from imaging.pictures import Pictures
from planner.budgeting.sensitivities import sensitivities
from planner.search.grid import ViewingSpace
from planner.search.local import alternating
from planner.search.objective import SearchProblem
from planner.uncertainty import improve, risks
from scenes import Pose
from tests.regression.numbers.poses import CHANGED, load, uneven, without_error
from tests.regression.stored import CLOSED, SEARCHED, TRACED

MODELS = ("paper", "calibrated", "bound")
_SLOW = ("bracket_mm", "bracket_station", "flange", "shaft_ring")  # seconds a picture
_STEPS = np.array([[0.0, 0.0], [3.1, 17.3], [11.7, -41.9], [29.3, 100.1]])


def _predicted(name, model, number=-1):
    scene = load(name)
    found = without_error(lambda: planner.predict(scene, *uneven(scene, number), model))
    if isinstance(found, str):
        return found
    return {"told": found, "rows": found.as_rows(), "line": str(found), "limiting": found.limiting,
            "ratio": found.worst_ratio}  # fmt: skip


def _over_poses(name, model, objective):
    scene = load(name)
    sensor, light = uneven(scene)
    if isinstance(light, tuple):
        return planner.variance_map(scene, light=light, space=ViewingSpace(45, (0, 90)), model=model)
    return planner.variances(
        scene, np.array(list(sensor)) + _STEPS[:, None], np.array(list(light)) + _STEPS[None, ::-1], model, objective
    )


def _biases(name):
    scene = load(name)
    pictures = Pictures.of(scenes.Picture.of(scene, *uneven(scene)))
    return {"bias": bias(pictures), "clutter": cluttered(pictures)}


def _errors(name, model):
    scene = load(name)
    return variance_model(model)(Pictures.of(scenes.Picture.of(scene, *uneven(scene)))).variances_object


def _mapped(name):
    scene = load(name)
    found = planner.pose_map(scene, light=uneven(scene)[1], space=ViewingSpace(37, (0, 90)))
    return {"map": found, "rows": found.as_rows()[3:6], "line": str(found)}


def _budget(name):
    scene = load(name)
    return without_error(lambda: _budget_of(scene))


def _budget_of(scene):
    found = planner.budget(scene, *uneven(scene), p=0.9)
    first = found.measurands[-1]
    return {
        "whole": [[each.name, each.unit, each.value, each.u, each.U, each.k, each.dof] for each in found],
        "statuses": found.statuses, "line": str(found), "terms": found.terms, "rows": found.as_rows(),
        "accuracy": [(each.repeatability, each.accuracy, each.interval) for each in found],
        "improvements": improve.improvements(first, 0.4),
        "needed": improve.needed(first, 0.8 * first.U, first.contributions[0].source),
    }  # fmt: skip


def _slopes(name, biased):
    scene = load(name)
    found = planner.budget(scene, *uneven(scene))
    return sensitivities(found.features, found.sources, biased=biased)


def _image(name):
    scene = load(name)
    return without_error(lambda: planner.image(scene, *uneven(scene)))


def _planned(name, **how):
    how = {"step_deg": 45.0, "refined": False} | how
    found = planner.plan(load(name), **how)
    return {"told": found, "rows": found.as_rows()[:3], "line": str(found)}


def _constraints(**how):
    scene = load("task1")
    limits = planner.Constraints(**how)
    near = np.array([[20.3, 31.0], [44.0, 200.7], [80.1, 305.2], [95.0, 10.0]])
    far = np.array([[12.9, 50.0], [60.0, 185.3], [33.3, 280.0], [21.0, 33.5]])
    return {
        "sensors": limits.sensors(scene, near), "lights": limits.lights(far),
        "pairs": limits.pairs(scene, near[:3, None], far[None]),
        "one by one": [limits.allows(scene, s, k) for s, k in zip(near[:3], far[:3], strict=True)],
    }  # fmt: skip


def _views(name, **how):
    return planner.plan_views(load(name), 3, step_deg=45.0, refined=False, **how)


def _capable(scene):
    limits = planner.Constraints(sensor_polar_deg=(0.0, 30.0), light_polar_deg=(0.0, 60.0))
    found = planner.plan_capability(scene, step_deg=30.0, refined=False, constraints=limits)
    return [found.pairs, *([each.sensor, each.light, each.ratios] for each in (found.best, found.quiet))]


def _combined():
    scene = load("plate")
    made = [planner.predict(scene, *uneven(scene, n)) for n in (0, 1, 2)]
    found = planner.combine(made)
    values = np.array([[each.value_object for each in one.measurands] for one in made])
    return {"told": found, "variances": found.variances, "weighted": found.weighted(values),
            "least squares": found.least_squares(values)}  # fmt: skip


def _risks():
    limits = risks.Limits.of(12.5, scenes.Tolerance(plus=0.13, minus=0.07))
    guarded = limits.guarded(0.031, 0.7)
    return {
        "limits": [limits, guarded],
        "probability": [risks.nonconforming_probability(v, 0.021, limits) for v in (12.44, 12.5, 12.61)],
        "global": [risks.global_risks(12.52, 0.05, 0.021, limits, each) for each in (None, guarded)],
    }  # fmt: skip


def _jitter(name):
    scene = load(name)
    sensors = np.array([list(uneven(scene, n)[0]) for n in range(len(scene.settings))])
    return {"scatter": planner.pose_scatter(scene, sensors)}


def _with_choices():
    scene = load("polarised")
    choices = [planner.Choice(31.0, 17.0), planner.Choice(None, 77.0), planner.Choice(103.0, None)]
    changed = [planner.with_choice(scene, choice, hold) for choice in choices for hold in ("time", "white")]
    return [[each.camera.exposure, each.camera.analyser_deg, each.lights, planner.predict(each, *uneven(each)).edges]
            for each in changed]  # fmt: skip


def _alternated():
    spaces = ViewingSpace(15, (0, 90)), ViewingSpace(20, (10, 80))
    return alternating(SearchProblem.of(load("task1"), "calibrated", "object"), *spaces, np.array([40.7, 41.3]))


_PLANS = {
    "best edges": ("wedge", {"edges": "best"}),
    "alternating": ("copper", {"search": "alternating", "step_deg": 30.0}),
    "paper in the image": ("task1", {"model": "paper", "objective": "image", "step_deg": 30.0}),
    "refined": ("macro", {"refined": True, "step_deg": 60.0}),
    "one light fixed": ("glossy_metal", {"light": Pose(23.1, 301.7)}),
    "one sensor fixed": ("low_light", {"sensor": Pose(33.7, 141.9), "step_deg": 20.0}),
    "within bounds": ("grey_floor", {"constraints": planner.Constraints(
        sensor_polar_deg=(10.0, 50.0), light_azimuth_deg=(200.0, 30.0), min_separation_deg=12.0,
        light_out_of_view=True)}),
    "clear edges": ("task1", {"step_deg": 30.0, "constraints": planner.Constraints(
        min_edge_px=31.0, min_clearance_px=7.0, forbidden_sensor=((30.0, 45.0, 21.0),))}),
    "at the sensor": ("anodised", {"step_deg": 20.0, "constraints": planner.Constraints(same_mount=True)}),
    "of several": ("plate", {"over": "sum", "step_deg": 60.0}),
    "shares of two": ("two_lights", {}),
    "given shares": ("two_lights", {"shares": "given", "step_deg": 60.0}),
    "both lights held": ("two_lights", {"light": (Pose(58.3, 275.1), Pose(37.1, 283.3)), "step_deg": 30.0}),
    "no free light": ("ring_light", {"step_deg": 20.0}),
    "before light": ("backlight_plate", {"step_deg": 45.0}),
    "polarisers": ("polarised", {"vary": ("analyser",), "step_deg": 60.0, "sensor": Pose(31.3, 131.7),
                                 "light": Pose(17.1, 311.3)}),
    "lamps": ("copper", {"vary": ("band",), "hold": "white", "sensor": Pose(31.3, 137.1), "light": Pose(17.1, 311.3)}),
}  # fmt: skip


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {}
    for name in scenes.names():
        if name not in _SLOW:
            rel = TRACED if name == "grey_floor" else CLOSED
            for model in MODELS:
                found[f"predict {name} {model}"] = rel, partial(_predicted, name, model)
            found[f"predict {name} at the first setting"] = rel, partial(_predicted, name, "calibrated", 0)
            found[f"bias {name}"] = rel, partial(_biases, name)
            found[f"budget {name}"] = CLOSED, partial(_budget, name)
            found[f"variances {name} paper"] = CLOSED, partial(_over_poses, name, "paper", "object")
            found[f"image {name}"] = CLOSED, partial(_image, name)
        found[f"variances {name}"] = CLOSED, partial(_over_poses, name, "calibrated", "object")
    for name in CHANGED:
        rel = TRACED if "floor" in name else CLOSED
        for model in ("calibrated", "bound"):
            found[f"predict {name} {model}"] = rel, partial(_predicted, name, model)
        found[f"bias {name}"] = rel, partial(_biases, name)
        found[f"image {name}"] = CLOSED, partial(_image, name)
        found[f"variances {name}"] = CLOSED, partial(_over_poses, name, "calibrated", "object")
    for name in ("task1", "calibrated_rig", "glossy_metal"):
        found[f"variances {name} in the image"] = CLOSED, partial(_over_poses, name, "calibrated", "image")
        found[f"variances {name} bound"] = CLOSED, partial(_over_poses, name, "bound", "object")
    for name in ("task1", "ball", "two_lights"):
        found[f"map {name}"] = CLOSED, partial(_mapped, name)
    for name, (scene, how) in _PLANS.items():
        found[f"plan {name}"] = SEARCHED, partial(_planned, scene, **how)
    for name, how in {
        "bodies": {"camera_body": 9.0, "light_body": 14.0}, "out of view": {"light_out_of_view": True},
        "apart": {"min_separation_deg": 23.0, "sensor_polar_deg": (5.0, 85.0)}, "one mount": {"same_mount": True},
        "azimuths": {"sensor_azimuth_deg": (350.0, 210.0), "light_azimuth_deg": (40.0, 290.0)},
        "edges": {"min_edge_px": 25.0, "min_clearance_px": 9.0}, "forbidden": {
            "forbidden_sensor": ((40.0, 190.0, 15.0),), "forbidden_light": ((60.0, 190.0, 9.0), (15.0, 40.0, 9.0))},
    }.items():  # fmt: skip
        found[f"constraints {name}"] = CLOSED, partial(_constraints, **how)
    return found | {
        "predict shaft_ring": (CLOSED, partial(_predicted, "shaft_ring", "calibrated")),
        "slopes calibrated_rig": (CLOSED, partial(_slopes, "calibrated_rig", True)),
        "slopes ball": (CLOSED, partial(_slopes, "ball", False)),
        "slopes plate": (CLOSED, partial(_slopes, "plate", True)),
        "slopes shaft": (CLOSED, partial(_slopes, "shaft", False)),
        "plan views": (SEARCHED, partial(_views, "plate")),
        "plan views of a block": (SEARCHED, partial(_views, "calibrated_rig", share="light")),
        "plan alternating steps": (SEARCHED, _alternated),
        "plan for capability": (SEARCHED, lambda: _capable(load("calibrated_rig"))),
        "combined": (CLOSED, _combined),
        "risks": (CLOSED, _risks),
        "choices": (CLOSED, _with_choices),
        "jitter of poses": (CLOSED, partial(_jitter, "calibrated_rig")),
        "jitter of a station": (CLOSED, partial(_jitter, "bracket_station")),
    }
