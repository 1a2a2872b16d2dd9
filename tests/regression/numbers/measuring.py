"""What estimators find in pictures that the image model draws, with seeded noise; photographs, boards, fits."""

from functools import cache, partial

import numpy as np

import measure
import planner
import scenes
from tests.boards import SMALL, poses
from tests.photographs import MADE, ellipse, rectangle, tag, turned
from tests.regression.numbers.poses import CHANGED, load, uneven, without_error
from tests.regression.stored import CLOSED, SEARCHED
from validation.report import camera_table

_BY_ALL = ("task1", "wedge", "calibrated_rig", "plate")
_BY_BEST = ("glossy_metal", "low_light", "anodised", "macro", "polarised", "ball", "shaft", "two_lights",
            "backlight_plate", "task1_part1", "copper", "printed_label")  # fmt: skip


@cache
def _pictures(name):
    """A noise-free picture, and two with noise."""
    scene = load(name)
    clean = planner.image(scene, *uneven(scene))
    noise = np.random.default_rng(5).normal(0, 1.7, (2, *clean.shape))
    return clean, clean + noise


def _measured(name, estimator):
    scene = load(name)
    found = without_error(lambda: measure.measure(_pictures(name)[1], scene, *uneven(scene), estimator))
    return found if isinstance(found, str) else {"told": found, "rows": found.as_rows(), "line": str(found)}


def _propagated(name, estimator):
    scene = load(name)
    estimator = estimator or measure.best_estimator(scene)
    return without_error(lambda: measure.propagate(_pictures(name)[0], scene, *uneven(scene), estimator))


def _region(name):
    scene = load(name)
    return measure.region_of_interest(scenes.Picture.of(scene, *uneven(scene)))


def _photographed(name):
    found = without_error(lambda: measure.photograph(MADE[name].image(), most=3))
    return found


def _sharpness():
    image = rectangle(120, 70, 13)
    return [measure.mtf(image, turned(120, 70, 13), side) for side in (0, 1)]


def _lens():
    lens = measure.Intrinsics(fx=420.0, fy=423.0, cx=131.0, cy=97.0, distortion=(-0.11, 0.03, 0.002, -0.001, 0.0))
    return without_error(lambda: measure.measure_quadrilateral(rectangle(120, 70, 13), lens=lens))


def _noise():
    ramp = 20 + 200 * np.linspace(0, 1, 240)[None, :] * np.ones((180, 1))
    ramp = np.repeat(np.repeat(ramp[::30, ::30], 30, 0), 30, 1)
    noise = np.random.default_rng(3).normal(0, 1, ramp.shape) * np.sqrt(1.5 + 0.05 * ramp)
    return measure.noise_curve(np.clip(np.rint(ramp + noise), 0, 255))


@cache
def boards():
    """Three chessboards, measured in noise."""
    rng = np.random.default_rng(11)
    images = [SMALL.image(pose) + rng.normal(0, 1.0, (240, 320)) for pose in poses(SMALL, 3, rng, 600.0)]
    return [measure.chessboard(image, SMALL.board) for image in images]


def _boards():
    found = boards()
    camera = measure.calibrate_camera(found, SMALL.square, (240, 320), "k1,k2", 0.01)
    return {"boards": found, "camera": camera, "summary": camera_table.summary(camera, "mm").splitlines(),
            "covariance": camera_table.uncertainty_file(camera).splitlines(),
            "lens": camera_table.lens_file(camera).splitlines()}  # fmt: skip


def _round_hole():
    image = (
        40 + 130 * ellipse((41.3, 36.8, 21.7, 16.4, 31.0), (74, 86)) + np.random.default_rng(6).normal(0, 1, (74, 86))
    )
    return measure.photograph(image, kinds=("circle", "ellipse"), most=1)


def _conics():
    angle = np.linspace(0.3, 5.1, 23)
    points = np.stack([40 + 21 * np.cos(angle) - 3 * np.sin(angle), 33 + 4 * np.cos(angle) + 13 * np.sin(angle)], -1)
    points += np.random.default_rng(2).normal(0, 0.1, points.shape)
    variance = 0.01 * (1 + np.arange(23) / 23)
    return {"ellipse": measure.fit_ellipse(points, variance), "circle": measure.fit_ellipse(points, 0.01, circle=True)}


def _fitted():
    scene = load("calibrated_rig")
    changed = scene.model_copy(update={"camera": scene.camera.model_copy(update={"width": 128, "height": 120,
                                       "focal_px": scene.camera.focal_px / 2})})  # fmt: skip
    sensor, light = uneven(scene)
    clean = planner.image(changed, sensor, light)
    shown = clean + np.random.default_rng(9).normal(0, 2.0, clean.shape)
    return measure.fit(changed, [shown], sensor, light)


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {}
    for name in _BY_ALL:
        for estimator in measure.ESTIMATORS:
            found[f"measure {name} {estimator}"] = CLOSED, partial(_measured, name, estimator)
            found[f"propagate {name} {estimator}"] = CLOSED, partial(_propagated, name, estimator)
    for name in (*_BY_BEST, *CHANGED):
        found[f"measure {name}"] = CLOSED, partial(_measured, name, None)
        found[f"propagate {name}"] = CLOSED, partial(_propagated, name, None)
    for name in ("task1", "plate", "shaft"):
        found[f"region {name}"] = CLOSED, partial(_region, name)
    for name in ("turned by 45 degrees", "two bricks", "AprilTag", "noise"):
        found[f"photograph {name}"] = SEARCHED, partial(_photographed, name)
    return found | {
        "photograph tag": (SEARCHED, lambda: measure.photograph(tag("4X4_50", 7, 1), most=2)),
        "sharpness": (SEARCHED, _sharpness), "lens": (SEARCHED, _lens), "noise curve": (SEARCHED, _noise),
        "photograph hole": (SEARCHED, _round_hole),
        "boards": (SEARCHED, _boards), "conics": (CLOSED, _conics), "fit": (SEARCHED, _fitted),
    }  # fmt: skip
