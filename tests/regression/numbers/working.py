"""Checks that render, costs and the hard catalogue: small pictures, few of them."""

import tempfile
from dataclasses import fields, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from unittest import mock

import numpy as np
from pydantic import BaseModel

import measure
import planner
import render
from measure.calibration import calibrate
from render import Quality
from scenes import Scene
from scenes.load import BUNDLED
from tests.commands import ice
from tests.regression.numbers.parts import small
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED, RENDERED, SEARCHED
from validation import fitted_scene, hard, plan_check, vary_check, views_check
from validation.batch.campaign import Campaign
from validation.cost import grid, locators, pareto, points, rays, sampling, scaling
from validation.cost.model import CostModel, Rendered
from validation.cost.trial import spread_cases
from validation.cost.watch import Watch
from validation.explore import preview, save, sphere
from validation.explore.state import State

_QUICK = Quality(supersample=2, edge_samples=4)
_HARD = ("reflectance", "limb", "fit")


@cache
def plan_of(name, step=45.0, **how):
    """A plan of a small scene."""
    return planner.plan(small(name, 2.0), step_deg=step, refined=False, **how)


@cache
def views_of():
    """A plan of two pictures."""
    return planner.plan_views(small("calibrated_rig", 2.0), 2, step_deg=45.0, refined=False)


@cache
def lamps():
    """A plan of poses and lamps."""
    scene = small("copper", 2.0)
    return planner.plan(scene, vary=("band",), sensor=(31.3, 137.1), light=(17.1, 311.3), refined=False)


@cache
def fit():
    """A fit to one photograph, and the photograph."""
    scene = small("calibrated_rig", 2.0)
    sensor, light = uneven(scene)
    clean = planner.image(scene, sensor, light)
    image = clean + np.random.default_rng(9).normal(0, 2.0, clean.shape)
    return measure.fit(scene, [image], sensor, light), image


def campaign():
    """Four settings of a small block."""
    scene = small("task1", 2.0)
    return Campaign.of(scene.model_copy(update={"settings": scene.settings[5:9]}))


def _cost(name):
    """One parameter, without its seconds."""
    known, variant = campaign(), render.variant.choose()
    cases = spread_cases(known, 2)
    if name in ("images", "estimators"):
        images = [render.image(c.scene, c.setting.sensor, c.setting.light, _QUICK, variant) for c in cases]
    watch = Watch(0.0)
    made = {
        "points": lambda: points.points_parameter(cases[0]), "grid": lambda: grid.grid_parameter(cases[0].scene, watch),
        "rays": lambda: rays.rays_parameter(cases[:1], variant, watch),
        "images": lambda: sampling.images_parameter(cases[0], images[0], 3, watch),
        "estimators": lambda: locators.estimators_parameter(cases, images, 3, watch),
        "scaling": lambda: scaling.scaling_parameter(cost_model()),
        "pareto": lambda: pareto.pareto_parameter(cost_model()),
    }[name]()  # fmt: skip
    told = [name in ("scaling", "pareto") or not _is_time(column) for column in made.columns]
    rows = [[value for value, is_told in zip(row, told, strict=True) if is_told] for row in made.rows]
    return {"columns": made.columns, "rows": rows, "note": made.note, "title": made.title}


def _is_time(column):
    return any(word in column for word in ("second", "ms", " s", "time", "us"))


def cost_model():
    """Of made up costs."""
    rendered = tuple(Rendered(Quality(edge_samples=n), 0.1 * n, 0.18 / n) for n in (4, 9, 25))
    return CostModel(7, 3, "scalar_rgb", rendered, 0.007, 0.002, 1.3, 0.21, 0.0017, 0.9, 3.1)


def _hard(area):
    rows = [hard.run(case) for case in hard.catalogue() if case.area == area]
    return [replace(row, seconds=0.0, error=None) for row in rows]


def _few_hard():
    cases = [each for each in hard.catalogue() if each.area in ("measure", "render")]
    rows = [
        hard.run(each)
        for each in cases
        if each.measurand.startswith(("gradient", "grey")) and "corner" not in each.name
    ]
    return [(row.name, row.measurand, row.verdict, row.reference, row.tolerance, row.condition) for row in rows]


def _asked():
    """Every hard case: what is asked, and the numbers that it is asked of."""
    return [(each.area, each.name, each.measurand, each.refusals, _inputs(each)) for each in hard.catalogue()]


def _inputs(case):
    """What our answer and the reference are made from, in one row."""
    found = []
    for function in (case.ours, case.reference):
        if isinstance(function, partial):
            given = (*function.args, *function.keywords.values())
        else:
            given = [cell.cell_contents for cell in function.__closure__ or ()]
        for each in given:
            found += _flat(each)
    return np.array([0.0, *found])


def _flat(given):
    """The numbers of scenes, arrays, poses and references; surfaces and functions have none."""
    if isinstance(given, Scene):
        parts = (given.camera, given.lights, given.material, given.noise, given.solid.vertices)
        return [number for part in parts for number in _flat(part)]
    if isinstance(given, BaseModel):
        return _flat(list(given.model_dump().values()))
    if is_dataclass(given) and not isinstance(given, type):
        return _flat([getattr(given, field.name) for field in fields(given)])
    if isinstance(given, np.ndarray | list | tuple):
        return [number for each in given for number in _flat(each)]
    return [float(given)] if isinstance(given, int | float) and np.isfinite(given) else []


def _explored(name):
    scene = load(name)
    state = State.first(scene)
    picture = state.picture(scene)
    part = preview.window(scene, picture)
    cells = sphere.cells(30.0)
    moved = [np.concatenate(list(sphere.values(scene, replace(state, moving=moving), cells.poses)))
             for moving in range(-1, len(state.lights))]  # fmt: skip
    return {"window": part, "drawn": preview.drawn(scene, picture, part).astype(float), "cells": cells, "moved": moved,
            "key": sphere.key(state), "setting": save.settings(state)}  # fmt: skip


def _without_seconds(found):
    return replace(found, seconds=0.0) if hasattr(found, "seconds") else found


def _new():
    with tempfile.TemporaryDirectory() as folder:
        part = BUNDLED / "wedge.stl"
        done = ice("new", part, "--units", "mm", "-o", "new.toml", cwd=Path(folder))
        text = (Path(folder) / "new.toml").read_text(encoding="utf-8").splitlines()
    return {"status": done.returncode, "text": [line for line in text if "file" not in line and "Made" not in line]}


def _fitted():
    found, _ = fit()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fitted.toml"
        without_error(lambda: fitted_scene.write(found, "calibrated_rig", path))
        text = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {"text": text, "errors": found.standard_errors}


@cache
def calibrated():
    """Locators of a small scene, at three noise levels."""
    with mock.patch("measure.calibration.RATIOS", np.array([0.02, 0.05, 0.11])):
        return calibrate(small("task1", 2.0), 2, 5)


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {f"hard {area}": (CLOSED, partial(_hard, area)) for area in _HARD}
    for name in ("points", "grid", "rays", "images", "estimators", "scaling", "pareto"):
        found[f"cost {name}"] = RENDERED, partial(_cost, name)
    for name in ("task1", "plate", "two_lights"):
        found[f"explorer {name}"] = CLOSED, partial(_explored, name)
    return found | {
        "hard pictures": (SEARCHED, _few_hard), "hard cases": (CLOSED, _asked),
        "calibrate": (SEARCHED, calibrated), "new": (SEARCHED, _new), "fitted": (SEARCHED, _fitted),
        "check of a plan": (RENDERED, lambda: _without_seconds(plan_check.check_plan(plan_of("task1"), 2, _QUICK))),
        "check of views": (RENDERED, lambda: _without_seconds(views_check.check_views(views_of(), 12, 3, _QUICK))),
        "check of lamps": (RENDERED, lambda: vary_check.check_varied(lamps(), 20, _QUICK, 3)),
    }  # fmt: skip
