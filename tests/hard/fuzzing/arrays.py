"""The public functions that take arrays, with arrays of all kinds."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

import measure
import planner
import render
import scenes
from measure.features.optics import Optics
from scenes import Noise, Pose


def array(rng: np.random.Generator) -> str:
    """One function with one hostile array, image or pose."""
    use = _USES[rng.integers(len(_USES))]
    use(rng, _hostile(rng))
    return f"{use.__name__[1:]} answered"


@cache
def _scene() -> scenes.Scene:
    return scenes.load("task1")


@cache
def _clean() -> np.ndarray:
    """Not rendered: a bright block on a dark ground."""
    image = np.full((240, 256), 20.0)
    image[80:160, 60:190] = 180.0
    return image


def _hostile(rng: np.random.Generator) -> Any:
    """A good image as another kind of array, or something else altogether."""
    kinds: tuple[Callable[[], Any], ...] = (
        lambda: None, lambda: "image", lambda: 5.0, lambda: [], lambda: [[1, 2], [3]], lambda: np.zeros((0, 3)),
        lambda: np.zeros((240, 256, 3)), lambda: np.zeros((240, 0)), lambda: np.array(3.0), lambda: _clean() + 1j,
        lambda: _clean().astype("datetime64[s]"), lambda: _clean().astype(str), lambda: _clean().astype(object),
        lambda: np.ma.masked_greater(_clean(), 100), lambda: _clean() * 1e-320, lambda: _clean() * 1e305,
        lambda: np.where(_clean() > 100, np.nan, 1.0), lambda: np.full((240, 256), np.inf), lambda: -_clean(),
        lambda: _clean().astype(np.float16), lambda: _clean().astype(np.longdouble), lambda: _clean() > 100,
        lambda: _clean()[::-1, ::-1], lambda: np.asfortranarray(_clean()), lambda: _clean().astype(np.uint8),
        lambda: _clean().astype(">i2"), lambda: np.stack([_clean()] * 2), lambda: _clean()[:100], lambda: object(),
        lambda: np.zeros(3, [("a", float)]), lambda: rng.normal(0, 10.0 ** rng.uniform(-300, 300), (240, 256)),
        lambda: _clean().tolist(), lambda: {"a": 1}, lambda: np.array([30.0, 135.0]), lambda: (30, 135),
        lambda: (np.nan, 0),
        lambda: ("a", 0), lambda: (30,), lambda: (200, 0), lambda: rng.normal(0, 1, (20, 2)),
        lambda: np.full((3, 2), 1e308),
        lambda: _clean() * 0, lambda: np.float64("nan"), lambda: True, lambda: b"bytes", lambda: Pose(30, 135),
    )  # fmt: skip
    return kinds[rng.integers(len(kinds))]()


def _distance(rng: np.random.Generator, value: Any) -> None:
    found = measure.distance(value, _scene(), (30, 135), estimator=str(rng.choice(measure.ESTIMATORS.names)))
    good = np.isin(found.status, ("ok", "clutter"))
    if not (np.isfinite(found.value_px) == good).all() or not (found.variance_px2 > 0).all():
        raise AssertionError(f"value {found.value_px}, variance {found.variance_px2}, status {found.status}")


def _distance_poses(rng: np.random.Generator, value: Any) -> None:
    measure.distance(_clean(), _scene(), value, light=value if rng.random() < 0.3 else None)


def _distance_arguments(rng: np.random.Generator, value: Any) -> None:
    scene, estimator, threshold = _scene(), "canny", None
    what = rng.integers(3)
    scene, estimator, threshold = (
        (value, estimator, threshold), (scene, value, threshold), (scene, estimator, value)
    )[what]  # fmt: skip
    measure.distance(_clean(), scene, (30, 135), estimator=estimator, threshold=threshold)


def _propagate(rng: np.random.Generator, value: Any) -> None:
    found = measure.propagate(value, _scene(), (30, 135), estimator=str(rng.choice(measure.ESTIMATORS.names)))
    if not (found.variance_px2 > 0 or found.status not in ("ok", "clutter")):
        raise AssertionError(f"variance {found.variance_px2}, status {found.status}")


def _quadrilateral(_rng: np.random.Generator, value: Any) -> None:
    measure.measure_quadrilateral(value)


def _chessboard(rng: np.random.Generator, value: Any) -> None:
    arguments = [_clean()[:90, :90], (4, 3), 2.0]
    arguments[rng.integers(3)] = value
    measure.chessboard(*arguments)


def _calibrate_camera(rng: np.random.Generator, value: Any) -> None:
    board = measure.Board((3, 3), np.zeros((9, 2)), np.tile(np.eye(2), (9, 1, 1)), ("ok",) * 9, np.ones(9), 1.0, 1.0)
    arguments = [[board] * 3, 25.0, (60, 80), "k1", 0.1]
    arguments[rng.integers(5)] = value
    measure.calibrate_camera(*arguments)


def _fit_ellipse(rng: np.random.Generator, value: Any) -> None:
    if rng.random() < 0.5:
        measure.fit_ellipse(value)
    else:
        t = np.linspace(0, 6, 20)
        measure.fit_ellipse(np.stack([9 * np.cos(t), 5 * np.sin(t)], -1), value)


def _find_ellipse(rng: np.random.Generator, value: Any) -> None:
    optics = Optics((240, 256), 0.6, 4.0, 1.0, 4.0)
    if rng.random() < 0.5:
        measure.find_ellipse(value, [128, 120, 30, 20, 10], optics)
    else:
        measure.find_ellipse(_clean(), value, optics)


def _expose(rng: np.random.Generator, value: Any) -> None:
    what = rng.integers(4)
    if what == 0:
        render.expose(_clean(), Noise(sigma=2.0), rng, value)
    elif what == 1:
        render.expose(_clean(), Noise(sigma=2.0), rng, 1, value)
    else:
        render.expose(value, Noise(sigma=2.0, bits=8), rng, 1)


def _variance(_rng: np.random.Generator, value: Any) -> None:
    render.variance(value, Noise(sigma=2.0, bits=8))


def _variances(rng: np.random.Generator, value: Any) -> None:
    others = [(15, 315), value][rng.integers(2)]
    planner.variances(_scene(), value, others, str(rng.choice(["paper", "calibrated", "bound"])))


def _predict(rng: np.random.Generator, value: Any) -> None:
    what = rng.integers(4)
    arguments = [_scene(), (30, 135), (15, 315), "calibrated"]
    arguments[what] = value
    planner.predict(*arguments)


def _pose(_rng: np.random.Generator, value: Any) -> None:
    Pose.of(value)


def _region(_rng: np.random.Generator, value: Any) -> None:
    measure.region_of_interest(_scene(), value)


_USES = (
    _distance, _distance, _distance_poses, _distance_arguments, _propagate, _quadrilateral, _fit_ellipse,
    _chessboard, _calibrate_camera, _find_ellipse, _expose, _variance, _variances, _predict, _pose,
    _region,
)  # fmt: skip
