"""The report of a run, tables and figures that commands print, references at 50 digits."""

import io
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest import mock

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

import measure
import planner
from render.phenomena import Influence
from tests.boards import Rig
from tests.regression.numbers.checking import run_folder, verdict
from tests.regression.numbers.drawing import LAID_OUT, content, placed, shown
from tests.regression.numbers.files import folder, refused
from tests.regression.numbers.poses import load
from tests.regression.numbers.working import lamps
from tests.regression.stored import CLOSED, SEARCHED
from validation import effects_check, hard, plan_check, vary_check
from validation.batch.result import collect
from validation.batch.store import RunFile
from validation.boards import Boards
from validation.hard import precise, precise_models, precision
from validation.hard import table as hard_table
from validation.report import (
    camera_figure,
    camera_table,
    effects_table,
    export,
    page,
    page_tables,
    plan_table,
    precision_figure,
    proof_figures,
    run_cells,
    station,
    vary_table,
)

_ELSEWHERE = ("versions", "machine", "time", "digest of the code")


def printed(*parts):
    """The lines that a terminal of 160 columns shows."""
    text = io.StringIO()
    console = Console(file=text, width=160, highlight=False)
    for part in parts:
        console.print(part)
    return [line.rstrip() for line in text.getvalue().splitlines()]


def figures(draw):
    """What figures hold, which are files afterwards, and what comes back."""
    found = []

    def keep(figure, path, **_):
        inline = isinstance(path, io.StringIO)
        if inline:
            path.write("<svg></svg>")
        if not inline and not any(name in Path(path).stem for name in _RENDERED):
            found.append(content(figure))
        if not inline:
            Path(path).write_bytes(b"drawn")

    with mock.patch.object(Figure, "savefig", keep):
        return draw(), found


# pictures, counts, an order of zeros: what another machine's rounding changes
_RENDERED = ("images", "edges", "distribution", "budget")
_ROUNDING = re.compile(r"e-1\d\b")


@cache
def _run():
    """A run, what is not alike in its rows made so: other estimators, failures, refusals."""
    store = RunFile.reopen(run_folder() / "run")
    try:
        return store.campaign(), collect(store.campaign(), store), store.identity()
    finally:
        store.close()


def _taken_off(size):
    """A correction: two rough renders tell it, whose noise is another on another processor."""
    return {"correction": 0.0123 * size, "u_bias": 0.0017 * size, "render_noise": 0.0009 * size}


def _uneven_run(many=False):
    campaign, found, _ = _run()
    rows = []
    for number, row in enumerate([*found.rows] * (33 if many else 1)):
        ratio = None if number == 1 else 0.7 + 0.17 * number
        interval = None if ratio is None else (0.8 * ratio, 1.3 * ratio)
        main = replace(
            row.main,
            ratio=ratio,
            ratio_interval=interval,
            failed=number,
            bias=0.01 * number - 0.02,
            status="ok" if number != 1 else "clutter",
            propagated=2e-3 * (1 + number),
            empirical=1.7e-3 * (1 + number),
            rmse=0.031 + 0.01 * number,
            **_taken_off(1 + number),
        )
        several = tuple(
            replace(
                each,
                predicted=2e-5 * k,
                empirical=1.9e-5 * k,
                ratio=0.95 / k,
                ratio_interval=(0.8 / k, 1.2),
                bias=0.0031 * k - 0.01,
                status="ok" if k != 2 else "clutter",
                **_taken_off(k),
            )
            for k, each in enumerate(row.measurands, 1)
        )
        classic = tuple(
            replace(
                main,
                method=each.method,
                empirical=3e-3 / k,
                ratio=1.1 / k,
                ratio_interval=(0.9 / k, 1.7),
                bias=0.01 * k,
                rmse=0.05,
                n=12 * k,
                **_taken_off(3 * k),
            )
            for k, each in enumerate(row.classic, 1)
        )
        rows.append(
            replace(
                row,
                index=2 * number + 1,
                main=main,
                classic=classic,
                measurands=several,
                parameters={"camera.blur_px": 0.5 + number, "noise.sigma": 2.0},
                scene=row.scene if number != 2 else "other",
                paper_ice=0.0123,
                paper_real=(0.013, 0.017),
            )
        )
    refusals = {0: "the object must be seen, got none", 4: "a & <b> | `c`"}
    return campaign, replace(
        found,
        rows=rows,
        refused=refusals,
        paper_scale=1.07,
        machines=(),
        verdict=verdict(),
        seconds={"render": 3.5, "expose": 1.25, "gradient:0": 0.75, "wall": 9.0, "workers": 3},
    )


def _page():
    campaign, found = _uneven_run()
    store = RunFile.reopen(run_folder() / "run")
    try:
        best = station.of_run(campaign, found, store)
        with folder() as here:
            paths, drawn = figures(lambda: page.write(campaign, found, store, best, here))
            texts = [path.read_text(encoding="utf-8") for path in paths]
    finally:
        store.close()
    lines = [
        [
            line
            for line in text.splitlines()
            if not any(f"{mark}{name}" in line for name in _ELSEWHERE for mark in ("| ", "<td>"))
            and not _ROUNDING.search(line)
        ]
        for text in texts
    ]
    return {
        "lines": lines[1],
        "page": [line for line in lines[0] if "base64" in line or "<t" in line],
        "figures": drawn,
    }


def _tables():
    found = _uneven_run()[1]
    several = _uneven_run(True)[1]
    made = {
        "ratios": page_tables.ratios,
        "variances": page_tables.variances,
        "units": page_tables.units,
        "estimators": page_tables.estimators,
        "refused": page_tables.refused,
    }
    told = {name: make(found) for name, make in made.items()}
    more = replace(several, refused={number: f"reason {number}" for number in range(3, 68)})
    contradicted = replace(found, verdict=replace(found.verdict, agrees=False, pooled=None, bias=None))
    return told | {
        "far": [row.index for row in run_cells.far(several)[0]],
        "which": run_cells.far(several)[1],
        "more refused": [
            len(page_tables.refused(each).rows) for each in (more, replace(more, refused=dict.fromkeys(range(64), "")))
        ],
        "note": page_tables.refused(more).note,
        "contradicted": page_tables.estimators(contradicted),
        "cells": [
            [run_cells.number(v), run_cells.small(v), run_cells.shift(v), run_cells.small_sigma(v)]
            for v in (None, math.inf, 0.0123, 4.0)
        ]
        + [run_cells.small(math.nan), run_cells.shift(math.nan)],
    }


def _exported():
    found = _uneven_run()[1]
    with folder() as here:
        paths = [export.write_csv(found, here / "table.csv"), export.write_json(found, here / "result.json")]
        return [path.read_text(encoding="utf-8").replace("gradient:0", "gradient").splitlines()[:90] for path in paths]


@cache
def _proofs():
    """A run, values of its distances, and what draws its proof."""
    found, rng = _uneven_run()[1], np.random.default_rng(4)
    size = np.sqrt(np.array([row.main.propagated for row in found.rows]))
    values = [np.append(3.0 + rng.normal(0, 1.3 * s, 60), [np.nan, 9.0]) for s in size]
    values[-1] = values[-1][:1]
    store = mock.Mock()
    store.distances = lambda index, method: values[[row.index for row in found.rows].index(index)]
    lines = proof_figures.lines_of(found, {found.rows[0].measurands[0].name: 0.03})
    return (
        found,
        store,
        [
            lambda _: proof_figures.distributions(found, store),
            lambda _: proof_figures.forest(lines),
            lambda _: proof_figures.bias(lines),
            lambda _: proof_figures.forest(lines * 30),
            lambda _: proof_figures.bias(lines * 30),
        ],
    )


def _distances():
    found, store, draws = _proofs()
    return {
        "counts": proof_figures.standardised(found, store),
        "words": [page.words("`a-b` of v3-v6 & 5 %"), page.markdown("a\\|b\n<c>[x](y)`&")],
        "drawn": [shown(draw) for draw in draws],
    }


def _laid_out():
    """Of a run's proof, and of a camera."""
    found, seen = camera()
    draws = [*_proofs()[2], lambda path: camera_figure.draw(found, seen.boards, path)]
    return [placed(draw) for draw in draws]


@cache
def camera():
    """Of a camera, without any picture."""
    rng = np.random.default_rng(6)
    rig = Rig(
        np.array([[701.3, 0, 331.0], [0, 694.1, 236.5], [0, 0, 1.0]]), (-0.11, 0.04, 0.001, -0.002, 0.0), board=(5, 4)
    )
    poses = [
        np.array([x, y, 0.1 * x, -40 + 9 * x, -30 - 8 * y, 390 + 60 * x])
        for x, y in ((0.4, 0.1), (-0.3, 0.35), (0.1, -0.5), (-0.45, -0.3))
    ]
    boards = []
    for number, pose in enumerate(poses):
        corners = rig.corners(pose) + rng.normal(0, 0.05, (20, 2))
        status = ["ok"] * 20
        corners, covariance = corners.copy(), np.tile(np.eye(2) * 0.05**2, (20, 1, 1))
        if number == 1:
            corners[3], status[3] = np.nan, "not_visible"
        boards.append(
            measure.Board(
                (5, 4), corners, covariance, tuple(status), np.full(20, 0.4), 2.0 + number, 0.7 + 0.1 * number
            )
        )
    found = measure.calibrate_camera(boards, 25.0, (480, 640), "k1,k2,p1,p2", 0.01)
    left = ((Path("c.png"), "board must be seen, got none"),)
    return found, Boards(tuple(Path(f"{n}.png") for n in range(4)), tuple(boards), left, (480, 640))


def _camera_told():
    found, seen = camera()
    other = replace(found, dispersion=1.7, status="misfit")
    with folder():
        return {
            "printed": printed(camera_table.boards(found, seen, "mm"), camera_table.parameters(found)),
            "summary": [camera_table.summary(each, "mm") for each in (found, other)],
            "lens": camera_table.lens_file(found),
            "covariance": camera_table.uncertainty_file(found),
            "facts": camera_table.facts(found, seen, "mm"),
            "lines": [
                refused(lambda b=b: camera_table.scene_lines(found, "task1", b)) for b in (None, Path("x/y.json"))
            ],
            "figure": shown(lambda path: camera_figure.draw(found, seen.boards, path)),
            "many": shown(
                lambda path: camera_figure.draw(replace(found, residuals=found.residuals * 3), seen.boards * 3, path)
            ),
            "steps": [camera_figure._round(factor) for factor in (1.0, 1.99, 2.0, 4.9, 5.0, 9.99, 10.0, 0.034, 7e3)],
            "fixed": camera_table.lens_file(_fixed()[0]),
        }


@cache
def _fixed():
    """One focal length, no distortion."""
    boards = camera()[1].boards
    return measure.calibrate_camera(boards, 25.0, (480, 640), "f", 0.0), boards


def _planned(name, **how):
    return planner.plan(load(name), step_deg=45.0, refined=False, sensor=(31.3, 137.1), **how)


def _checks(found):
    """A check whose order changed, and the ways in which it may end."""
    poses = [(c.sensor, c.light) for c in found.candidates][:3]
    values = [
        (1.1e-6, 1.31e-6, 2, "ok", ()),
        (1.2e-6, 1.17e-6, 1, "ok", ("shadow", "glare")),
        (1.3e-6, math.nan, None, "clutter", ("glare",)),
    ]
    rows = tuple(
        plan_check.CheckedSetting(
            sensor=s,
            light=k,
            calibrated=c,
            propagated=p,
            rank_before=n,
            rank_after=after,
            ratio=None if math.isnan(p) else p / c,
            status=status,
            without_formula=names,
        )
        for n, ((s, k), (c, p, after, status, names)) in enumerate(zip(poses, values, strict=False), 1)
    )
    return rows


def _plans():
    several, one = _planned("plate"), _planned("task1")
    alternating = _planned("task1", search="alternating")
    uneven_one = _planned("printed_label")
    aside = replace(one, set_aside=(replace(one.candidates[0], variance=0.9 * one.variance),) * 2)
    texts = {
        name: printed(plan_table.report(found, None, None, 1.5))
        for name, found in (
            ("several", several),
            ("one", one),
            ("alternating", alternating),
            ("texture", uneven_one),
            ("aside", aside),
            ("one aside", replace(aside, set_aside=aside.set_aside[:1])),
            ("sum", replace(several, over="sum")),
            ("image", replace(one, objective="image")),
            ("shares", replace(one, shares=(0.3, 0.7), alone=1.21 * one.variance)),
        )
    }
    return texts


def _scatter(number, **how):
    made = vary_check.Scatter(
        measurand="width",
        share=1.0,
        predicted=1.1e-5,
        propagated=1.3e-5 * number,
        measured=1.4e-5,
        interval=(1e-5, 2e-5 * number),
        n=40,
        failed=number,
        status="ok",
    )
    return replace(made, **how)


def _varied():
    found = lamps()
    made = vary_check.VaryCheck(
        _scatter(1), _scatter(3, measured=math.nan), 1.9, 1.7, (1.2, math.inf), 0.013, "as predicted"
    )
    return {
        "printed": printed(vary_table.report(found, made, 2.5)),
        "alone": printed(vary_table.report(found, None, 2.5)),
        "facts": [vary_table.facts(found.varied, each) for each in (made, None)],
        "none": vary_table.facts(None, None),
    }


def _effects():
    scene = load("task1")
    setting = scene.settings[1]
    made = [
        effects_check.Switched(
            setting, name, Influence(bound, change), 0.0031 * sign, -0.002 * sign, 0.0004, 0.0011, 1.3, 0.4
        )
        for name, bound, change, sign in (
            ("glare", 0.01, 0.02, 1),
            ("all", math.inf, 0.0, -1),
            ("shadow", 0.0, 1e-3, 1),
        )
    ]
    import render

    decisions = render.effects(scene)
    return {
        "table": printed(effects_table.table(decisions), effects_table.check_table(made)),
        "total": effects_table.total(made),
        "facts": [effects_table.checked(each) for each in made] + [effects_table.fact(each) for each in decisions],
        "saving": [effects_table.saving(render.effects(load(name))) for name in ("task1", "plate", "ball")],
    }


def _models():
    """Both models at 50 digits: at a pose without symmetry, seen from below, and of a hidden edge."""
    scene = load("task1")
    found = {}
    for sensor, light in (
        ((31.3, 137.1), (17.1, 311.3)),
        ((30.0, 312.0), (24.0, 250.0)),
        ((95.0, 10.0), (24.0, 250.0)),
    ):
        inputs = precise.Inputs.of(scene, sensor, light)
        found[f"{sensor} {light}"] = [
            _float(model(scene, inputs, objective=objective, **how))
            for objective in ("image", "object")
            for model, how in ((precise_models.paper, {"points": 20}), (precise_models.calibrated, {"adaptive": False}))
        ]
    nudged = inputs.nudged()
    return found | {
        "nudged": len(nudged),
        "faces": precise.fresnel(precise.mpf("0.31"), 1.5, 0.2) * 1.0,
        "fresnel": [
            _float(precise.fresnel(precise.mpf(c), n, k))
            for c, n, k in (("0.3", 1.5, 0), ("0.9", 2.1, 3.3), ("0.2", 1, 0))
        ],
        "condition": precise.condition_of(lambda x: x[0] ** 3 / (x[1] - x[2]), [precise.mpf(v) for v in (2, 5, 3.5)]),
        "brightness": [
            _float(
                precise.brightness(
                    load("glossy_metal").material,
                    *(
                        precise.unit([precise.mpf(v) for v in each])
                        for each in ((0.1, 0.2, 1.0), (0.3, -0.4, z), (-0.5, 0.1, 0.8))
                    ),
                )
            )
            for z in (0.9, -0.9)
        ],
    }


def _float(value):
    return value if isinstance(value, str) else float(value)


def _precisions():
    scene = load("task1")
    sensors = np.array([[30.0, 135.0], [31.3, 137.1], [5.0, 20.0], [89.0, 170.0]])
    lights = np.array([[15.0, 315.0], [17.1, 311.3], [40.0, 100.0], [3.0, 10.0]])
    wide = precision.paper_in(np.float64, scene, sensors, lights)
    # of single precision the size alone: its rounding is the processor's
    return {
        "double": wide,
        "single": [bool(v < precision.SAFE) for v in precision.error_of_single(scene, sensors, lights)],
    }


def _precision_figure():
    """Poses and words, for errors that are told."""

    def error(scene, sensors, lights):
        return np.where(sensors[:, 0] > 80, np.nan, 1e-7 * (1 + sensors[:, 1] + 300 * lights[:, 0]))

    with mock.patch.object(precision_figure, "error_of_single", error):
        return shown(lambda path: precision_figure.draw(path, 30.0))


def _hard_table():
    rows = [hard.run(case) for case in hard.catalogue() if case.area in ("reflectance", "limb")][::5]
    rows = [replace(row, seconds=0.0123 * n) for n, row in enumerate(rows)]
    rows[1:2] = [replace(rows[1], verdict="WRONG", ours=None)]
    return hard_table.text(rows).splitlines() + [hard_table.facts(rows)["wrong"]]


def cases():
    """By name: relative tolerance, and what makes the result."""
    made = {
        "page": (SEARCHED, _page),
        "tables": (SEARCHED, _tables),
        "exported": (SEARCHED, _exported),
        "distances": (SEARCHED, _distances),
        "laid out": (LAID_OUT, _laid_out),
        "camera": (SEARCHED, _camera_told),
        "plans": (SEARCHED, _plans),
        "varied": (SEARCHED, _varied),
        "effects": (CLOSED, _effects),
        "models": (CLOSED, _models),
        "precisions": (CLOSED, _precisions),
        "precision drawn": (CLOSED, _precision_figure),
        "hard table": (CLOSED, _hard_table),
    }
    return {f"report {name}": case for name, case in made.items()}
