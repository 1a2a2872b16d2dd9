"""Holes, shafts and balls measured in pictures that are painted: a silhouette, and holes in it, in noise."""

from dataclasses import replace
from functools import cache, partial

import cv2
import numpy as np

import measure
import planner
import scenes
from imaging.geometry.projection import project
from measure.features import found, linearity, rim_fit, rim_noise, rims, shape, tools
from measure.features.layout import layout_of
from measure.features.optics import Optics
from tests.oracle import polygon_image
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED


@cache
def painted(name, sigma=1.3, moved=(0.0, 0.0)):
    """Bright on dark, with bright light through holes left dark; two pictures with noise."""
    scene = load(name)
    sensor, camera = np.array(list(uneven(scene)[0])), scene.camera
    shape = camera.height, camera.width
    hull = cv2.convexHull(project(scene.solid.vertices, sensor, camera).astype(np.float32))[:, 0].astype(float)
    image = polygon_image(hull[::-1] + moved, shape, camera.blur_px, 110.0, 30.0)
    for circle in scene.solid.circles:
        if circle.hole and circle.axis[2] > 0.5:
            points = circle.at(circle.angles(90))
            image -= polygon_image(project(points, sensor, camera) + moved, shape, camera.blur_px, 100.0, 0.0)
    return image + np.random.default_rng(6).normal(0, sigma, (2, *shape))


def _measured(name, estimator=None, with_light=True, **how):
    scene = load(name)
    sensor, light = uneven(scene)
    lights = light if with_light else None
    told = without_error(lambda: measure.measure(painted(name, **how), scene, sensor, lights, estimator))
    if isinstance(told, str):
        return told
    return {"told": told, "rows": told.as_rows(), "line": str(told), "sigma": told.sigma, "names": told.names}


def _propagated(name):
    scene = load(name)
    return without_error(lambda: measure.propagate(painted(name)[0], scene, *uneven(scene), "gradient"))


def _region(name):
    scene = load(name)
    return measure.region_of_interest(scenes.Picture.of(scene, *uneven(scene)))


def _rims(name, which, lit=True):
    scene = load(name)
    picture = scenes.Picture.of(scene, uneven(scene)[0], uneven(scene)[1] if lit else None)
    tool = rims.rim_tool(picture, which, rims.unmoved(picture, which))
    near = rims.rim_tool(picture, which, tuple(0.3 * (i - 1) + 0.1 for i in range(tool.design.shape[1])))
    images, spread = painted(name), np.abs(tool.design).max()
    off = np.arange(1, 1 + tool.design.shape[1]) * np.array([[0.2], [-0.9]]) / spread
    away = painted(name, moved=(2.3, -1.7))
    stack = rim_noise.Stack(images.reshape(len(images), -1)), rim_noise.Stack(away.reshape(len(away), -1))
    return {
        "tools": [[each.design, each.weights, each.inward, each.state] for each in (tool, near)],
        "found": rims.find_circle(images, picture, which), "away": rims.find_circle(away, picture, which),
        "once": rims._find(stack[1], picture, which, rims.unmoved(picture, which), 0),
        "far": tool.is_far(off), "rounded": [rims._rounded(tool, row) for row in off],
        "response": rims.circle_response(images[0], picture, which).toarray(),
        "measured": rims._measured(stack[0], near),
        "away again": rims.circle_response(away[0], picture, which).toarray(),
    }  # fmt: skip


def _tools():
    rng = np.random.default_rng(5)
    design, weights = rng.normal(0, 1, (9, 3)), rng.uniform(0.2, 2, 9)
    optics = Optics((50, 70), 0.7, 1.0, 1.2, 3.4)
    valid = np.array([np.ones(9), [1, 1, 0, 0, 0, 0, 0, 0, 0], [1, 0, 1, 1, 0, 1, 1, 1, 0], np.zeros(9)], bool)
    tool = rim_fit.RimFit(design, weights, np.zeros(9), "ok", optics)
    flat = rim_fit.RimFit(design * [1, 1, 0], weights, np.zeros(9), "ok", optics)
    places = np.array([[3.0, 30.0], [60.0, 47.0], [np.nan, 20.0], [30.0, 20.0]])
    return {"fit": tool.fit(valid), "flat": flat.fit(valid[:1]), "held": tools.held(places, optics),
            "small": tools.held(places, replace(optics, shape=(9, 12)))}  # fmt: skip


def _lens():
    scene = load("block through a lens")
    optics = Optics.of(scene)
    ideal = np.array([[20.0, 30.0], [130.0, 110.0], [240.0, 17.0]])
    normals = np.array([[0.6, 0.8], [1.0, 0.0], [-0.8, 0.6]])
    levels = np.array([3.0, 90.0, 250.0])
    noisy = [Optics.of(load(name)) for name in ("low_light", "task1", "anodised")]
    return {
        "optics": optics, "sagitta": [optics.sagitta, noisy[0].sagitta], "recorded": optics.recorded(ideal),
        "ideal": optics.ideal(ideal), "gradient": optics.gradient(ideal, normals),
        "noise": [each.noise_at(levels) for each in noisy], "sensor": [each.sensor for each in noisy],
        "plain": [Optics((9, 7)).gradient(ideal, normals), Optics((9, 7)).recorded(ideal)],
    }  # fmt: skip


def _gathered():
    scene = load("task1")
    picture = scenes.Picture.of(scene, *uneven(scene))
    layout, clean, rng = layout_of(picture), planner.image(picture), np.random.default_rng(4)
    images = [clean + rng.normal(0, sigma, (2, *clean.shape)) for sigma in (1.3, 2.1)]
    parts = [shape.find_shape(some, layout, by) for some, by in zip(images, ("gradient", "isophote"), strict=True)]
    return {"gathered": found.gather(parts, np.array([0, 1, 1]), np.array([1, 1, 0])), "nothing": found.nothing(3)}


def _linear():
    rng = np.random.default_rng(8)
    linear = rng.normal(0, [1.0, 0.3], (24, 2))
    offs = {"same": 0 * linear, "noise": rng.normal(0, 0.05, (24, 2)), "second": np.stack([0 * linear[:, 0],
        0.2 + 0 * linear[
        :, 0]], 1), "wider": 0.12 * linear, "little": 0.03 * linear, "shift": 0 * linear + [0.1, 0.02],
        "much": rng.normal(0, [0.4, 0.1], (24, 2))}  # fmt: skip
    return {name: [linearity._is_linear(linear, linear + off, leeway) for leeway in (0.0, 0.3)]
            for name, off in offs.items()}  # fmt: skip


def cases():
    """By name: relative tolerance, and what makes the result."""
    made = {
        "of rim tools": _tools, "of lenses": _lens, "gathered": _gathered,
        "is linear": _linear,
    }  # fmt: skip
    for name in ("plate", "backlight_plate", "ball", "shaft"):
        made[f"painted {name}"] = partial(_measured, name)
        made[f"painted {name}, light unknown"] = partial(_measured, name, with_light=False)
        made[f"painted {name}, moved"] = partial(_measured, name, moved=(2.3, -1.7))
        made[f"propagate painted {name}"] = partial(_propagated, name)
        made[f"region of painted {name}"] = partial(_region, name)
    for estimator in ("gradient", "isophote", "canny", "strip"):
        made[f"painted plate by {estimator}"] = partial(_measured, "plate", estimator)
    for name, which in (("plate", None), ("shaft", None), ("ball", None)):
        solid = load(name).solid
        for each in [which] if which else _round_names(solid):
            made[f"rim {each} of {name}"] = partial(_rims, name, each)
    made["rim of plate in the dark"] = partial(_rims, "plate", _round_names(load("plate").solid)[0], False)
    return {name: (CLOSED, make) for name, make in made.items()}


def _round_names(solid):
    return [each.name for each in solid.curved] or [each.name for each in solid.circles[:2]]
