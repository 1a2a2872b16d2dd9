"""Functions that take numbers, names and tables, with absurd ones."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import measure
import planner
import render
import scenes

_VALUES: tuple[Any, ...] = (
    None, "x", "", "3", b"3", True, -1, 0, 0.0, 1e-320, 1e300, 10**400, 10**5000, float("nan"), float("inf"),
    -float("inf"), [], (), {}, [[]], [None], {"a": 1}, (30,), (30, 135), ("30", "135"), (np.nan, 0), (200, 0),
    ((15, 315),), ((15, 315), None), np.zeros(0), np.zeros((2, 2)), np.array(["a"]), np.float32(2), np.int64(3),
    object(), 1j, "\ud800", "a\nb", range(3), {1, 2}, scenes.Pose(30, 135),
)  # fmt: skip
_KEYS = (
    "noise", "noise.sigma", "noise.bits", "camera", "camera.width", "camera.look_at[1]", "light", "light.distance",
    "lights", "lights[0].distance", "settings", "settings[0]", "settings[3].light", "object.size", "task", "task.start",
    "material", "uncertain", "uncertainty", "units", "name", "nonsense", "a.b", "", "noise..sigma", "floor",
    "obstacles", "measurands",
)  # fmt: skip


def library(rng: np.random.Generator) -> str:
    """One function with one absurd argument."""
    use = _USES[rng.integers(len(_USES))]
    use(rng, _VALUES[rng.integers(len(_VALUES))])
    return f"{use.__name__[1:]} answered"


@cache
def _scene() -> scenes.Scene:
    return scenes.load("task1")


def _with(rng: np.random.Generator, value: Any) -> None:
    key = str(rng.choice(_KEYS))
    inside = {"value": value, "sd": 1.0} if rng.random() < 0.2 else {key: value} if rng.random() < 0.2 else value
    planner.predict(_scene().with_(**{key: inside}), (30, 135), (15, 315))


def _copy(rng: np.random.Generator, value: Any) -> None:
    part = getattr(_scene(), str(rng.choice(["noise", "camera", "light", "material", "task"])))
    part.model_copy(update={str(rng.choice([*type(part).model_fields, "nonsense"])): value})


def _space(rng: np.random.Generator, value: Any) -> None:
    arguments: list[Any] = [30.0, (0.0, 90.0)]
    arguments[rng.integers(2)] = value
    len(planner.ViewingSpace(*arguments))


def _map(rng: np.random.Generator, value: Any) -> None:
    how: dict[str, Any] = {
        "sensor": (30, 135),
        "space": planner.ViewingSpace(45),
        "model": "paper",
        "objective": "object",
    }
    how[str(rng.choice(list(how)))] = value
    planner.pose_map(_scene(), **how, biased=False).as_rows()


def _plan(rng: np.random.Generator, value: Any) -> None:
    how: dict[str, Any] = {"step_deg": 45, "model": "paper", "objective": "object"}
    planner.plan(_scene(), **how | {str(rng.choice(list(how))): value})


def _bound(rng: np.random.Generator, value: Any) -> None:
    poses: list[Any] = [(30, 135), (15, 315)]
    poses[rng.integers(2)] = value
    measure.bound(_scene(), *poses)


def _budget(rng: np.random.Generator, value: Any) -> None:
    how: dict[str, Any] = {"p": 0.95, "variances": None, "biases": None}
    planner.budget(_scene(), (30, 135), (15, 315), **how | {str(rng.choice(list(how))): value})


def _load(_rng: np.random.Generator, value: Any) -> None:
    scenes.load(value)


def _picture(rng: np.random.Generator, value: Any) -> None:
    arguments: list[Any] = [_scene(), (30, 135), (15, 315)]
    arguments[rng.integers(3)] = value
    _ = scenes.Picture.of(*arguments).row


def _region(_rng: np.random.Generator, value: Any) -> None:
    measure.region_of_interest(_scene(), (30, 135), estimators=value)


def _effects(_rng: np.random.Generator, value: Any) -> None:
    render.effects(value)


_USES = (_with, _with, _copy, _copy, _space, _map, _plan, _bound, _budget, _load, _picture, _region, _effects)
