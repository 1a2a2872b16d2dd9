"""What a run does on its way and what it costs, what commands say; clocks tell what is wanted."""

import contextlib
import io
import itertools
import json
import math
import signal
import time
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import cv2
import numpy as np
from rich.console import Console

import render
from measure.boards.printed import Printed
from measure.photo.photograph import photograph as shapes
from render import EffectTolerance, Quality
from scenes import InvalidInput
from scenes.photograph import Photograph
from tests.boards import Rig
from tests.commands import ice
from tests.photographs import rectangle
from tests.regression.numbers.files import folder, refused
from tests.regression.numbers.parts import small
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.numbers.reporting import camera, figures, printed
from tests.regression.numbers.working import calibrated, campaign, cost_model, fit
from tests.regression.stored import CLOSED, RENDERED, SEARCHED
from validation import boards, effects_check
from validation.batch import cluster, pool, work
from validation.batch.campaign import Case
from validation.batch.options import RunOptions
from validation.batch.work import Packed, Rendering
from validation.cli import bar, commands, photograph, recorded
from validation.cost import effects, goal, size, sweep, table, trial, watch
from validation.cost.parameter import Parameter, Trend
from validation.cost.pareto import pareto_parameter
from validation.cost.scaling import scaling_parameter
from validation.cost.sweep import Sweep
from validation.cost.watch import Watch

_QUICK = Quality(supersample=2, edge_samples=4)


@contextlib.contextmanager
def ticking(step=0.5):
    """A clock that goes on by a step each time it is looked at."""
    times = itertools.count(100.0, step)
    with mock.patch.object(time, "perf_counter", side_effect=times):
        yield


def without_seconds(found, *more):
    """A record whose times are 0."""
    return replace(found, **dict.fromkeys(("seconds", *more), 0.0))


@cache
def _tried():
    said = []
    with mock.patch.object(trial, "SAMPLES", (4, 9)), mock.patch.object(trial, "_IMAGES", 6):
        options = RunOptions(seed=5, workers=3, rendering=Rendering(_QUICK))
        found = trial.trial(campaign(), options, 2, 0.5, lambda *about: said.append(about), Watch(0.0))
    rendered = tuple(without_seconds(each) for each in found.rendered)
    return replace(found, rendered=rendered, seconds=0.0, model=0.0, image=0.0, start=0.0, setting=0.0), said


def _trial():
    found, said = _tried()
    scene = campaign().scenes[0]
    blocked = scene.model_copy(update={"settings": scene.settings[:1]})
    cases = [trial.spread_cases(campaign(), count) for count in (1, 2, 3, 9)]
    tried = [
        SimpleNamespace(rendered=lambda quality, k=k: (0.1 * k * quality.edge_samples, 0.3 * k / quality.edge_samples))
        for k in (1, 3)
    ]
    return {
        "found": found,
        "said": len(said),
        "about": said[0],
        "last": said[-1],
        "cases": [[case.index for case in some] for some in cases],
        "blocked": len(blocked.settings),
        "ladders": [trial._ladder(tried, fine, Watch(left)) for fine, left in ((0.0, 9.9), (0.06, 9.9), (0.0, 0.0))],
        "rms": trial._rms([3.0, 4.0, 1.0]),
    }


def _one_tried():
    """A setting of a trial, step by step."""
    with mock.patch.object(trial, "_IMAGES", 20):
        one = trial._Tried(
            campaign().case(1), "scalar_rgb", RunOptions(seed=3, rendering=Rendering(_QUICK)), lambda: None
        )
        return {
            "linear": one.linearity(),
            "phase": one.phase(),
            "rendered": one.rendered(_QUICK)[1],
            "status": [one.status, one.usable],
            "response": one.found.response,
        }


class _Store:
    """A run's file of which only what a goal asks is known."""

    def __init__(self, chunks, values, propagated, spent):
        self._chunks, self._values, self._propagated, self._spent = chunks, values, propagated, spent

    def chunks(self, index):
        return dict(enumerate(self._chunks[index]))

    def distances(self, index, method):
        return self._values[index]

    def propagated(self, index, method):
        return self._propagated[index], 1.0, "ok"

    def seconds(self):
        return self._spent

    def images(self):
        return sum(sum(each) for each in self._chunks)


def _goals():
    rng = np.random.default_rng(3)
    known, model = campaign(), cost_model()
    values = [rng.normal(0, s, n) for s, n in ((0.02, 300), (0.03, 40), (0.02, 250), (0.02, 900))]
    values[0][::7] = np.nan
    store = _Store(
        [(250, 50), (40,), (), (250,) * 3 + (150,)],
        values,
        [3.3e-4, 9e-4, 4e-4, np.inf],
        {"render": 2.0, "predict": 0.5, "propagate": 0.25, "expose": 3.0, "gradient": 4.0},
    )
    few = _Store(
        [(1, 1), (250,), (1,), (2,)],
        [np.array([0.1, 0.2]), rng.normal(0, 0.02, 250), np.array([1.0]), np.array([0.0, np.nan])],
        [1.0, 4e-4, 1.0, 1.0],
        {},
    )
    choice = model.for_accuracy(0.08)
    asked = {
        accuracy: [list(goal._Narrower(known, model, choice, accuracy)(each)) for each in (store, few)]
        for accuracy in (0.02, 0.08, 0.3, 0.9)
    }
    longer = []
    for seconds in (20.0, 60.0, 3.5, 3.4):
        with ticking():
            more = goal._Longer(model, choice, 100.0 + seconds)
            longer.append([more(store) for _ in range(5)])
    rows = [
        SimpleNamespace(main=SimpleNamespace(ratio=r, n=n, failed=f))
        for r, n, f in ((1.1, 300, 7), (None, 9, 9), (0.8, 90, 0))
    ]
    widths, images = goal._widths(SimpleNamespace(rows=rows), model, choice)
    reached = goal.Reached(0.08, "half-width", model, choice, widths, images, 12.5)
    texts = ("60", "60s", "2min", "1.5h", " 7 s ", "0", "0.0s", "5 d", "", "-3", "1e3")
    return {
        "narrower": asked,
        "longer": longer,
        "reached": [reached.text, reached.to_json(), reached.widest],
        "none": goal.Reached(3.0, "seconds", model, choice, (), (), 1.0).text,
        "seconds": [refused(partial(goal.seconds, text)) for text in texts],
        "accuracy": [refused(partial(goal.check_accuracy, value)) for value in (0.0, 1e-9, 0.999, 1.0, -1.0, 2.0)],
    }


def _reached():
    """How a run with a goal is begun: what it asks the trial and the run for."""
    told, model = [], cost_model()

    def tried(_, options, settings, fine):
        told.append(["trial", settings, fine, options.seed, options.workers, options.rendering])
        return model

    def ran(options, _, first, progress, more):
        told.append(["run", first, type(more).__name__, options])
        return SimpleNamespace(rows=[])

    say, loose = [], Rendering(tolerance=EffectTolerance(0.01, 0.1))
    with mock.patch.object(goal, "trial", tried), mock.patch.object(goal, "run_by", ran), ticking(0.25):
        for aim, options in (
            ({"accuracy": 0.08}, RunOptions()),
            ({"accuracy": 0.15}, RunOptions()),
            ({"accuracy": 0.149}, RunOptions()),
            ({"budget": 30.0}, RunOptions()),
            ({"budget": 140.0}, RunOptions(rendering=Rendering(effects="all"))),
            ({"accuracy": 2.0}, RunOptions()),
            ({"accuracy": 0.001}, RunOptions()),
            ({"budget": 2.0}, RunOptions(rendering=loose)),
            ({"budget": 90.0, "started": 95.0}, RunOptions(seed=11, workers=2, fresh=True)),
        ):
            found = without_error(lambda a=aim, o=options: goal.reach(campaign(), goal.Goal(**a), o, say=say.append)[1])
            told.append(found if isinstance(found, str) else [found.asked, found.unit, found.choice, found.seconds])
    return {"told": told, "said": say}


def _watches():
    with ticking(1.0):
        made = [
            list(Watch(seconds, lambda: None, 100.0).samples(most, least))
            for seconds, most, least in ((3.0, 9, 1), (0.0, 9, 2), (99.0, 4, 0), (0.0, 3, 0), (3.0, 9, 5))
        ]
        told = []
        list(Watch(45.0, lambda: told.append(1), 100.0).samples(5, 1))
        return {
            "samples": made,
            "told": len(told),
            "left": Watch(7.0, lambda: None, 100.0).left,
            "at once": [
                watch.at_once(pixels, most) for pixels, most in ((1 << 20, 50), (1 << 24, 9), (100, 7), (1 << 23, 3))
            ],
            "share": [
                refused(lambda w=w: sweep._share(Watch(w, lambda: None, 100.0), 4, lambda: None).seconds)
                for w in (400.0, 30.0, 0.5)
            ],
        }


def _parameters():
    """Image sizes, and effects switched on one by one."""
    scene = small("task1", 2.0)
    case = Case(3, scene, campaign().case(1).setting)
    found = {}
    with mock.patch.object(size, "_IMAGES", 2), mock.patch.object(size, "_FACTORS", (0.5, 1.0, 1.25)):
        made = size.size_parameter(case, "scalar_rgb", 3, Watch())
        found["size"] = [
            [row[:2] + row[4:] for row in made.rows],
            made.fits[2],
            made.columns,
            made.x,
            made.y,
            made.note,
        ]
        found["fits"] = [fit.what for fit in made.fits]
        with mock.patch.object(size, "_LARGEST", scene.camera.width * scene.camera.height * 1.25):
            found["large"] = without_error(lambda: size.size_parameter(case, "scalar_rgb", 3))
        found["late"] = without_error(lambda: size.size_parameter(case, "scalar_rgb", 3, Watch(0.0))).split("got")[0]
    found["effects of a slow renderer"] = without_error(lambda: effects.effects_parameter(case, "scalar_rgb"))
    switched = [
        effects_check.Switched(
            case.setting, name, effects_check.Influence(0.01, 0.02), -0.003 * k, 0.02 / k, 0.0004, 0.0011, 1.2 * k, 0.4
        )
        for k, name in enumerate(("glare", "floor"), 1)
    ]
    with mock.patch.object(effects, "check", lambda scene, settings, only: switched if only[0] == "floor" else []):
        found["effects"] = effects.effects_parameter(case, "llvm_ad_rgb")
    return found


def _checked_effects():
    scene = small("wedge", 4.0)
    setting = scene.settings[0]
    with mock.patch.object(effects_check, "_SEEDS", (0, 1)):
        rows = effects_check.check(
            scene, quality=_QUICK, settings=(setting,), only=("specular_lobe", "light_size", "all")
        )
    base, runs = (
        SimpleNamespace(values=np.array(v), variances=np.array(w), seconds=s)
        for v, w, s in (
            ((1.0, 1.1, 1.2, 0.9, 1.0), (2.0, 2.1, 2.2, 2.1, 2.0), 0.5),
            ((1.1, 1.0, 1.3, 1.2, 0.8), (2.3, 2.2, 2.2, 2.0, 1.9), 0.7),
        )
    )
    made = effects_check._row(setting, "floor", effects_check.Influence(0.01, 0.02), base, runs)
    ends = [
        replace(
            made,
            bias_px=b,
            variance=v,
            resolution_px=0.5,
            resolution_variance=0.25,
            estimated=effects_check.Influence(0.5, 0.25),
        ).holds
        for b, v in ((1.0, 0.5), (-1.0, -0.5), (1.001, 0.0), (0.0, 0.501), (0.0, -0.501))
    ]
    return {
        "names": [row.name for row in rows],
        "estimated": [row.estimated for row in rows],
        "row": made,
        "holds": ends,
    }


def _sweep():
    """The tables of one, and its order, with parameters that are refused."""
    fits = (Trend("error against rays", -0.512, -0.5), Trend("time", 1.1, None))
    made = (
        Parameter(
            name="rays",
            title="Rays",
            columns=("rays", "error", "front"),
            rows=((4, 0.123456, True), (9, 0.07, False)),
            x="rays",
            y="error",
            fits=fits,
            note="A note.",
        ),
        Parameter(
            name="grid", title="Grid", columns=("step", "over"), rows=((20.0, 0.1), (10.0, 0.0211)), x="step", y="over"
        ),
    )
    found = Sweep("task1", cost_model(), made, {"effects": "too slow"}, 61.5)
    with folder() as here:
        files = {path.name: path.read_text().splitlines() for path in table.write_csv(found, here)}
    reports = []

    def named(name, *_, **__):
        if name in ("size", "grid"):
            raise InvalidInput(f"{name} must be small")
        return replace(made[0], name=name)

    with contextlib.ExitStack() as several:
        for name in ("images", "estimators", "rays", "size", "effects", "grid", "scaling", "pareto", "points"):
            several.enter_context(mock.patch.object(sweep, f"{name}_parameter", partial(named, name)))
        several.enter_context(mock.patch.object(sweep, "trial", return_value=cost_model()))
        several.enter_context(mock.patch.object(render, "image", return_value=np.zeros((2, 2))))
        told = sweep.sweep(campaign(), 3, lambda *about: reports.append(about), 60.0)
        short = sweep.sweep(campaign(), 3, budget=0.0)
    return {
        "printed": printed(table.tables(found)),
        "files": files,
        "reports": reports,
        "omitted": [told.omitted, short.omitted],
        "names": [[each.name for each in one.parameters] for one in (told, short)],
        "json": found.to_json(),
    }


def _worked():
    """A setting's work: rendered, photographed, in several batches, of a scene whose poses shake."""
    scene = small("calibrated_rig", 2.0)
    case = Case(4, scene, scene.settings[0])
    clean = work.render_setting(case, "scalar_rgb", Rendering(_QUICK))
    image = clean.image.array()
    with mock.patch.object(work, "_BATCH", 5):
        chunk = work.measure_chunk(case, image, 7, 3, 12)
    with mock.patch.object(work, "_MOST_PIXELS", 3 * image.size):
        smaller = work.measure_chunk(case, image, 7, 3, 4)
    mean = work.render_setting(case, "scalar_rgb", Rendering(_QUICK), image)
    keep = [
        {name: value for name, value in each.items() if not name.startswith("canny")}
        for each in (clean.propagated, mean.propagated, chunk.distances, smaller.distances)
    ]
    packed = Packed.of(image[:3, :4])
    return {
        "clean": [clean.predicted, sorted(clean.seconds)],
        "kept": keep,
        "photographed": sorted(mean.seconds),
        "failures": {name: len(each) for name, each in chunk.failures.items() if not name.startswith("canny")},
        "methods": [each.name for each in work.methods(scene)],
        "laps": sorted(chunk.seconds),
        "fits": [
            packed._replace(height=h, width=w).fits() for h, w in ((3, 4), (0, 4), (3, -1), (3.0, 4), (10**5, 10**5))
        ],
        "packed": [
            packed.array(),
            refused(lambda: packed._replace(width=5).array()),
            refused(lambda: packed._replace(height=2).array()),
        ],
        "effects": work.effects(scene)[:3],
    }


def _shaken():
    scene = small("task1", 2.0).model_copy(
        update={"jitter": load("task1").jitter.model_copy(update={"sensor_deg": 0.07})}
    )
    case = Case(2, scene, campaign().case(1).setting)
    how = Rendering(_QUICK)
    return {
        "jitter": [work._jitter(case, how), work._jitter(campaign().case(1), how)],
        "clean": {
            name: value
            for name, value in work.render_setting(case, "scalar_rgb", how).propagated.items()
            if not name.startswith("canny")
        },
    }


def _clusters():
    texts = (
        "x",
        "tcp://",
        "127.0.0.1:x",
        "inproc://",
        "tcp://127.0.0.1:1",
        "nohost.invalid:99999",
        "TCP://a:1",
        "ucx://a:123456",
    )
    with mock.patch.object(cluster.socket, "create_connection", mock.Mock(side_effect=OSError("first\nsecond"))):
        found = [refused(partial(cluster.check_address, text)) for text in texts]
    lines = [cluster._line(each) for each in (ValueError("one\ntwo"), ValueError(), "text")]
    return found + lines + [str(cluster._no_scheduler("tcp://a:1", "a Worker answers"))]


def _pools():
    with pool.local(1) as crew:
        done = [crew.executor.submit(sum, (1, 2)).result(), crew.size(), crew.check(None)]
    with mock.patch.object(pool.os, "sched_getaffinity", return_value={1, 5, 9}, create=True):
        return [done, pool.cores()]


def _commands():
    """What the commands that are seldom asked say, short of their work."""
    asked = {
        "calibrate": ["calibrate", "task1", "--images", "9"],
        "many": ["calibrate", "task1", "--images", "100001"],
        "calibrate to": ["calibrate", "task1", "-o", "x.txt"],
        "area": ["hard", "--area", "x"],
        "hard to": ["hard", "--precision", "x.txt"],
        "report": ["report", "no such"],
        "cost": ["cost", "task1", "--budget", "0"],
        "seed": ["cost", "task1", "--seed", "-1"],
        "port": ["explore", "task1", "--port", "65536"],
        "render to": ["render", "task1", "--sensor", "30,80", "-o", "x.gif"],
        "render": ["render", "task1", "--sensor", "30", "-o", "x.png"],
        "noise seed": ["render", "task1", "--sensor", "30,80", "-o", "x.png", "--noise-seed", "-1"],
        "boards": ["calibrate-camera", "a.png", "--square", "25"],
        "square": ["calibrate-camera", "a.png", "--square", "0"],
        "units": ["calibrate-camera", "a.png", "--square", "25", "--units", "ell"],
        "shape": ["calibrate-camera", "a.png", "--square", "25", "--shape", "9"],
        "shape of": ["calibrate-camera", "a.png", "--square", "25", "--shape", "2X9"],
        "model": ["calibrate-camera", "a.png", "--square", "25", "--model", "k9"],
        "square sd": ["calibrate-camera", "a.png", "--square", "25", "--square-sd", "25.1"],
        "noise": ["calibrate-camera", "a.png", "--square", "25", "--noise", "0"],
        "fit": ["fit", "task1", "a.png"],
        "fit to": ["fit", "task1", "a.png", "-o", "x.png"],
        "fits": ["fit", "task1", *["a.png"] * 1001],
        "fit poses": ["fit", "task1", "a.png", "--sensor", "1,2,3"],
        "compare": ["compare", "a", "b"],
        "command": ["no-such"],
        "option": ["plan", "task1", "--no-such"],
        "argument": ["plan"],
        "type": ["calibrate", "task1", "--images", "x"],
        "version": ["--version", "--x"],
        "photograph": ["measure", "a.png"],
        "plugin": ["--plugin", "no_such_module", "scenes"],
        "accuracy": ["validate", "task1", "--accuracy", "2"],
        "both": ["validate", "task1", "--accuracy", "0.1", "--budget", "9s"],
        "workers": ["validate", "task1", "--workers", "1025"],
        "renders": ["validate", "task1", "--renders", "0"],
        "dask": ["validate", "task1", "--dask", "x"],
        "effects": ["effects", "task1", "--effects", "x"],
        "view": ["plan", "task1", "--views", "0"],
        "step": ["plan", "task1", "--step", "0"],
        "kind": ["measure", "a.png", "--kind", "x"],
        "mtf": ["measure", "a.png", "--mtf", "a.txt"],
        "reach": ["budget", "task1", "--reach", "-1"],
    }
    with folder():
        done = {name: ice(*each) for name, each in asked.items()}
        left = sorted(path.name for path in Path().iterdir())
    return {
        name: [each.returncode, each.stdout.splitlines()[:9], each.stderr.splitlines()[:9]]
        for name, each in done.items()
    } | {"left": left}


def _worked_commands():
    """Commands that are quick where the scene is small: a picture, locators, hard cases, a run's report."""
    with folder():
        scene = small("task1", 2.0)
        clean = render.image(scene, *uneven(scene), _QUICK)
        with mock.patch.object(render, "image", return_value=clean):
            asked = {
                "render": ["render", "task1", "--sensor", "31,137", "-o", "a.png"],
                "render noisy": ["render", "task1", "--sensor", "31,137", "-o", "a.npy", "--noise-seed", "3", "--json"],
                "hard": ["hard", "--area", "limb", "--json"],
            }
            done = {name: ice(*each, "-q") for name, each in asked.items()}
        shot = cv2.imread("a.png", cv2.IMREAD_UNCHANGED)
    told = json.loads(done["hard"].stdout)
    return {
        "render": done["render"].stdout,
        "noisy": json.loads(done["render noisy"].stdout),
        "shape": shot.shape,
        "hard": [[row["name"], row["verdict"]] for row in told["cases"]] + [told["wrong"], done["hard"].returncode],
    }


def _said(arguments, **how):
    """What a command says and what figures hold, in a folder of its own; and its files of words."""
    with folder():
        done, drawn = figures(lambda: ice(*arguments, "-q"))
        kept = {
            path.name: path.read_text().splitlines()[:40]
            for path in sorted(Path().rglob("*.*"))
            if path.suffix in (".toml", ".json", ".csv")
        }
    return {
        "status": done.returncode,
        "said": done.stdout.splitlines(),
        "errors": done.stderr.splitlines(),
        "files": kept,
        "figures": drawn,
    }


def _cost_command():
    made = Sweep("task1", cost_model(), (scaling_parameter(cost_model()), pareto_parameter(cost_model())), {}, 61.5)
    with mock.patch.object(sweep, "sweep", return_value=made):
        return [_said(["cost", "task1", "--out", "made/there"]), _said(["cost", "task1", "--json"])]


def _calibrate_command():
    with mock.patch("measure.calibration.calibrate", return_value=calibrated()):
        return [_said(["calibrate", "task1", "--images", "10", "-o", "a.png"]), _said(["calibrate", "task1", "--json"])]


def _camera_command():
    found, seen = camera()
    files = ["calibrate-camera", *(f"{n}.png" for n in range(4)), "--square", "25"]
    asked = (
        [],
        ["-o", "lens.toml", "--residuals", "r.png"],
        ["--json"],
        ["--scene", "task1"],
        ["--shape", "5X4", "-o", "no/l.toml"],
    )
    told = []
    for status in ("ok", "ill_conditioned"):
        with (
            mock.patch.object(boards, "read_boards", return_value=seen),
            mock.patch("measure.calibrate_camera", return_value=replace(found, status=status)),
        ):
            told += [_said([*files, *more]) for more in (asked if status == "ok" else asked[:1])]
    return told


def _fit_command():
    (found, image), told = fit(), []
    states = (
        ("ok", 0.31, "estimated"),
        ("misfit", 1e-5, "repeated"),
        ("low_contrast", math.nan, "given"),
        ("tone_unknown", 0.2, "given"),
    )
    for status, p_value, noise in states:
        made = replace(
            found, status=status, p_value=p_value, noise=noise, statuses=(*found.statuses[:-1], "ill_conditioned")
        )
        with (
            mock.patch("measure.fit", return_value=made),
            mock.patch("validation.cli.fit.read", return_value=Photograph(image)),
        ):
            told += [_said(["fit", "calibrated_rig", "a.png", *more]) for more in ([], ["--json"])]
    return told


def _explore_command():
    """Its one line, and how it ends by Ctrl-C."""

    async def serve(place, host, port, token, said, stop):
        said(f"http://{host}:{port} {token is None} {place.source}")
        signal.raise_signal(signal.SIGINT)
        await stop.wait()

    with mock.patch("validation.explore.server.serve", serve):
        asked = ([], ["--json"], ["--port", "7", "--host", "0.0.0.0"])
        return [_said(["explore", "task1", *more]) for more in asked]


def _photograph():
    """What is said of shapes: of a quadrilateral, of a board, of what was not measured."""
    light = rectangle(120, 70, 13)
    found = shapes(light, most=1)
    (one,) = found.found
    lost = replace(one, status="misfit", p_value=math.nan, covariance=None)
    many = replace(found, candidates=found.candidates[:1] * 33)
    photo = Photograph(light)
    grown = replace(one.quadrilateral.curve, gain=0.013, dark_level=17.0, step=1.0) if one.quadrilateral else None
    with folder() as here:
        told, drawn = figures(lambda: recorded.sharpness(photo, found, here / "m.png"))
    rows = [
        {"side": 1, "mtf50": 0.21, "error": 0.01},
        {"side": 2, "refused": "no"},
        {"side": 3, "mtf50": None, "error": None},
    ]
    return {
        "text": photograph.text(found),
        "lost": photograph.text(replace(found, found=(lost,))),
        "tables": [printed(photograph.table(each)) for each in (found, many)],
        "mtf": told,
        "drawn": drawn,
        "none": recorded.sharpness(photo, replace(found, found=()), Path("x")),
        "lines": [recorded.sharpness_lines(each) for each in (told, {"mtf": []}, {}, {"mtf": rows})],
        "recorded": [[recorded.text(each), recorded.facts(each)] for each in (photo, replace(photo, tone_known=False))],
        "sides": [
            recorded.of_sides_lines(each)
            for each in (
                one.quadrilateral,
                replace(one.quadrilateral, curve=grown, side_blur_px=np.array([1.0, np.nan, 1.0, 1.0])),
            )
        ],
        "kinds": [
            refused(partial(recorded.check_sides, kinds, "--mtf"))
            for kinds in (None, ("tag",), ("ellipse", "chessboard"))
        ],
        "facts": photograph.facts(found) if hasattr(photograph, "facts") else None,
    }


def _boards():
    """Photographs of a board: too few of them, one without it, one of another size."""
    rig = Rig(np.array([[330.0, 0, 101.0], [0, 330.0, 76.5], [0, 0, 1.0]]), size=(200, 150), board=(4, 3), blur=0.8)
    poses = [
        np.array([a, b, 0.1 * a, -38 + 9 * a, -25 - 8 * b, 330.0]) for a, b in ((0.3, 0.1), (-0.3, 0.3), (0.1, -0.4))
    ]
    rng = np.random.default_rng(3)
    with folder():
        for number, pose in enumerate(poses):
            np.save(f"{number}.npy", rig.image(pose, 3) + rng.normal(0, 1.0, (150, 200)))
        np.save("none.npy", rng.normal(90, 1.0, (150, 200)))
        np.save("small.npy", rng.normal(90, 1.0, (100, 200)))
        names, reports, printed = [Path(f"{number}.npy") for number in range(3)], [], Printed(shape=(4, 3))
        asked = {
            "all": ([*names, Path("none.npy"), Path("absent.npy")], printed, 1.0, lambda *about: reports.append(about)),
            "few": (names[:2],),
            "two": ([*names[:2], Path("none.npy")], printed, 1.0),
            "other": ([*names[:2], Path("small.npy")], printed, 1.0),
        }
        found = {name: refused(lambda how=how: boards.read_boards(*how)) for name, how in asked.items()}
    every = found.pop("all")
    return found | {
        "reports": reports,
        "left out": every.left_out and [str(reason) for _, reason in every.left_out],
        "files": [path.name for path in every.files],
        "shape": every.image_shape,
        "noise": [each.noise for each in every.boards],
        "measured": [int(each.measured.sum()) for each in every.boards],
        "corners": [each.corners for each in every.boards],
    }


def _bars():
    text = io.StringIO()
    with bar.bar(Console(file=text, width=100, force_terminal=False), "title", "images") as report:
        report("x", 3, 9)
        report("x", 5, 9)
        tasks = [report.__closure__ is not None]
    rate = bar._Rate()
    return [tasks, [rate.render(SimpleNamespace(speed=speed)) for speed in (None, 0.0, 12.6)]]


def _groups():
    group = commands.Commands(name="ice")
    return {
        "names": group.list_commands(None),
        "unknown": group.get_command(None, "none"),
        "known": group.get_command(None, "hard").name,
        "completed": [[each.value, each.help] for each in group.shell_complete(click_context(group), "me")],
    }


def click_context(group):
    """Of a group, as a shell asks it."""
    import typer

    return typer.Context(group)


def cases():
    """By name: relative tolerance, and what makes the result."""
    made = {
        "trial": (RENDERED, _trial),
        "one tried": (RENDERED, _one_tried),
        "goals": (CLOSED, _goals),
        "reached": (CLOSED, _reached),
        "watches": (CLOSED, _watches),
        "parameters": (RENDERED, _parameters),
        "checked effects": (CLOSED, _checked_effects),
        "sweep": (CLOSED, _sweep),
        "worked": (RENDERED, _worked),
        "shaken": (RENDERED, _shaken),
        "clusters": (CLOSED, _clusters),
        "pools": (CLOSED, _pools),
        "commands": (CLOSED, _commands),
        "worked commands": (RENDERED, _worked_commands),
        "cost command": (CLOSED, _cost_command),
        "calibrate command": (SEARCHED, _calibrate_command),
        "camera command": (SEARCHED, _camera_command),
        "fit command": (SEARCHED, _fit_command),
        "explore command": (CLOSED, _explore_command),
        "photograph": (SEARCHED, _photograph),
        "boards": (SEARCHED, _boards),
        "bars": (CLOSED, _bars),
        "groups": (CLOSED, _groups),
    }
    return {f"run {name}": case for name, case in made.items()}
