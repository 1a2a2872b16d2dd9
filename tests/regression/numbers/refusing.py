"""Where values end: one below a limit and one above it, in scenes, campaigns, runs' files, folders of photographs."""

import copy
import math
import sqlite3
import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np

import planner
import scenes
from planner.robustness import Move, Robust
from scenes import Pose, errors, results
from scenes.files import written
from scenes.load import from_document
from scenes.registry import Registry
from tests.regression.numbers.checking import run_folder
from tests.regression.numbers.files import folder, refused
from tests.regression.numbers.poses import load, uneven
from tests.regression.numbers.reporting import printed
from tests.regression.stored import CLOSED, SEARCHED
from validation import plan_check, strict_json
from validation.batch import campaign, photographs, stages, store
from validation.batch.store import RunFile
from validation.chain import Chain
from validation.report import guide, plan_table

# by scene: keys with dots, and values that are tried one after another
_TRIED = {
    "task1": {
        "camera.width": (0, 1, 15, 16, 20000, 1.5, "x"),
        "camera.height": (-1, 16),
        "camera.distance": (0, 1e-9, 5.0, 1e13),
        "camera.focal_px": (0, -1, 1e-13, 1e13),
        "camera.blur_px": (-0.1, 0, 51.0, 1e3),
        "camera.exposure": (-1, 0, 1e13),
        "camera.roll_deg": (-360, 361, 1e300),
        "camera.look_at": ([1, 2], [0, 0, math.nan], [1e13, 0, 0]),
        "camera.aperture": (-1, 0, 1e6),
        "camera.lens": ({"distortion": [1]}, {"distortion": [0.1] * 5}, {"distortion": [9.0] * 5}),
        "noise.sigma": (
            -1,
            0,
            1e13,
            {"value": 2, "sd": 0.1},
            {"sd": 0.1},
            {"value": 2, "sd": -1},
            {"value": 2, "x": 1},
        ),
        "noise.bits": (0, 1, 8, 16, 17),
        "noise.gain": (-1, 0.1),
        "noise.prnu": (-0.1, 0.01, 2.0),
        "noise.dsnu": (-1, 0.5),
        "noise.dark_level": (-1, 3),
        "noise.read": (1,),
        "light.distance": (0, 0.5, 1e13),
        "light.kind": ("x", "ring", "bar"),
        "light.radius": (-1, 0.0, 2.0),
        "light.spectrum": ([], [[500, 1]], [[500, 1], [400, 1]], [[500, 0], [600, 0]], [[500, -1], [600, 1]]),
        "light.degree_of_polarisation": (-0.1, 1.0, 1.1),
        "light.polarisation_deg": (-400, 30.0),
        "material.specular_fraction": (-0.1, 0, 1, 1.1),
        "material.roughness": (0, 1e-3, 0.3, 11),
        "material.refractive_index": (0, 0.5, 1, 1e6),
        "material.extinction": (-1, 3),
        "material.diffuse_reflectance": (-0.1, 0, 1.0, 1.1),
        "object.size": ([1, 2], [0, 1, 1], [12, 7, 2], [1e13, 1, 1]),
        "object.kind": ("x", "mesh"),
        "object.file": ("none.stl", ""),
        "task.corners": ([], "x"),
        "units": ("mm", "ell"),
        "name": ("", "x" * 300),
        "settings": (
            [],
            "x",
            [{"sensor": [1, 2]}],
            [{"sensor": [30, 80], "light": [1, 2, 3]}],
            [{"sensor": [181, 0], "light": [20, 200]}],
            [{"sensor": [30, 80], "light": [[20, 200], [21, 201]]}],
            [{"sensor": [30, math.inf], "light": [20, 200]}],
        ),
        "jitter.sensor_deg": (-1, 0.1, 91),
        "locator.scale_px": (0, 0.5, 1.0, 100),
        "locator.thresholds": ([], [-1], [10, 10]),
        "floor": ({"height": 0.0}, {"height": 1.0}, {"height": -1, "reflectance": 2}),
        "obstacles": (
            [{"corner": [0, 0, 0], "size": [1, 1, 1]}],
            [{"corner": [20, 0, 0], "size": [0, 1, 1]}],
            [{"corner": [-9, 0, 0], "size": [2, 2, 3]}],
        ),
        "filters": ([{"name": "a", "pass": [[500, 1], [600, 1]]}], [{"name": "a"}]),
        "several_lights": ([],),
        "unknown": (1,),
        "camera.unknown": (1,),
        "uncertainty": (
            {"k": 0},
            {"rounding": -1},
            {"rounding": 0.01},
            {"temperature": 20},
        ),
        "backlight": ({"distance": 5.0}, {"distance": 20.0, "width": 0}),
        "textures": ([{"faces": ["top"], "file": "none.png"}], [{"faces": ["x"]}]),
        "materials": (
            [{"faces": ["top"], "roughness": 0.2}],
            [{"faces": ["none"]}],
            [{"faces": ["top"]}, {"faces": ["top"]}],
        ),
    },
    "plate": {
        "measurands": (
            [],
            [{"name": "a", "kind": "x", "features": []}],
            [{"name": "", "kind": "diameter", "features": [{"circle": "c1"}]}],
            [{"name": "a", "kind": "diameter", "features": [{"circle": "none"}]}],
            [{"name": "a", "kind": "diameter", "features": [{"circle": "c1"}, {"circle": "c2"}]}],
            [{"name": "a", "kind": "diameter", "features": [{"edge": "e8"}]}],
            [{"name": "a", "kind": "width", "features": [{"edge": "e8"}, {"edge": "e11"}], "tolerance": 0.02}],
            [{"name": "a", "kind": "width", "features": [{"edge": "e8"}, {"edge": "e8"}]}],
            [{"name": "a", "kind": "width", "features": [{"edge": "e8"}, {"edge": "e4"}]}],
            [
                {
                    "name": "a",
                    "kind": "angle",
                    "features": [{"edge": "e8"}, {"edge": "e4"}],
                    "tolerance": {"plus": 0.1, "minus": 0},
                }
            ],
            [{"name": "a", "kind": "angle", "features": [{"edge": "e8"}, {"edge": "e11"}]}],
            [{"name": "a", "kind": "distance", "features": [{"vertex": "v3"}]}],
            [
                {
                    "name": "a",
                    "kind": "distance",
                    "features": [{"vertex": "v3", "edges": ["e4", "e5"]}, {"circle": "c2"}],
                    "tolerance": -1,
                }
            ],
            [{"name": "a", "kind": "taper", "features": [{"wall": "k1"}]}],
            [{"name": "a", "kind": "position", "features": [{"circle": "c2"}]}],
            [{"name": "a", "kind": "offset", "features": [{"circle": "c2"}, {"edge": "e8"}]}] * 2,
            [{"name": "a", "kind": "offset", "features": [{"circle": "c2"}, {"circle": "c2"}]}],
        ),
        "object.holes": ([], [{"centre": [1, 1], "radius": 0}], [{"centre": [0, 0], "radius": 1}]),
    },
    "two_lights": {
        "lights": ([], [{"distance": 50.0}] * 9),
        "settings": ([{"sensor": [60, 277], "light": [75, 280]}],),
    },
    "ball": {"object.radius": (0, -1, 1e13), "object.kind": ("block",), "floor": ({"height": 5.0},)},
}


def _scene(name):
    """What is said of each value; of a scene that is one, what it measures."""
    path = scenes.find(name)
    document, found = tomllib.loads(Path(path).read_text(encoding="utf-8")), {}
    for key, values in _TRIED[name].items():
        for value in values:
            changed = copy.deepcopy(document)
            *tables, last = key.split(".")
            table = changed
            for each in tables:
                table = table.setdefault(each, {})
            table[last] = value
            said = refused(lambda c=changed: _made(path, c))
            found[f"{key} {value}"[:120]] = said.split(".toml: ")[-1] if isinstance(said, str) else said
    return found


def _made(path, document):
    made = from_document(Path(path), document)
    return [[each.name, each.kind, each.edges, each.tolerance] for each in made.quantities]


_CAMPAIGNS = {
    "grid": 'scenes = ["task1", "plate"]\n[grid]\nsensor_polar = [20, 31]\n'
    "sensor_azimuth = {from = 10, to = 30, step = 7}\n"
    "light_polar = [24]\n"
    "light_azimuth = {from = 200, to = 260, count = 3}",
    "sweep": 'scenes = ["task1"]\n[sweep]\nnoise.sigma = {from = 1, to = 3, count = 3}\ncamera.blur_px = [0.5, 0.7]',
    "both": 'scenes = ["task1"]\n[grid]\nsensor_polar = [20]\nsensor_azimuth = [10]\n'
    "light_polar = [24]\nlight_azimuth = [200]\n[sweep.noise]\nsigma = [1, 2]",
    "words": 'scenes = "task1"',
    "numbers": "scenes = [1]",
    "empty": "scenes = []",
    "many": f"scenes = {['task1'] * 1001}",
    "none": 'scenes = ["no such"]',
    "key": 'scenes = ["task1"]\nx = 1',
    "deep": 'scenes = ["task1"]\n[sweep]\nno.key = [1]',
    "bad": 'scenes = ["task1"]\n[sweep]\nnoise.sigma = [-1]',
    "no values": 'scenes = ["task1"]\n[sweep]\nnoise.sigma = []',
    "keys": 'scenes = ["task1"]\n[sweep]\n' + "\n".join(f"camera.look{n} = [1]" for n in range(9)),
    "eight": 'scenes = ["task1"]\n[sweep]\n'
    + "\n".join(
        f"{key} = [1.5]"
        for key in (
            "noise.sigma",
            "noise.gain",
            "noise.dsnu",
            "noise.dark_level",
            "camera.blur_px",
            "camera.roll_deg",
            "camera.exposure",
            "noise.prnu",
        )
    ),
    "huge": 'scenes = ["task1"]\n[sweep]\nnoise.sigma = {from = 1, to = 2, count = 1001}',
    "polar": 'scenes = ["task1"]\n[grid]\nsensor_polar = [181]',
    "toml": "scenes = [",
    "scene": 'name = "x"',
}
_RANGES = (
    {"from": 0, "to": 1, "count": 5},
    {"from": 0, "to": 1, "step": 0.3},
    {"from": 0, "to": 0.9, "step": 0.3},
    {"from": 1, "to": 0, "step": -0.5},
    {"from": 0, "to": 1, "count": 1},
    {"from": 0, "to": 1, "count": 0},
    {"from": 0, "to": 1, "count": 2.5},
    {"from": 0, "to": 1, "step": 0},
    {"from": 0, "to": 1},
    {"from": 0, "to": 1, "count": 3, "step": 1},
    {"from": 0, "to": 1, "x": 3},
    {"from": "a", "to": 1, "count": 3},
    {"from": 0, "to": 2e15, "count": 3},
    {"from": 0, "to": 1e15, "count": 3},
    {"from": 0, "to": 1, "step": -1},
    {"from": 0, "to": 999, "step": 1},
    {"from": 0, "to": 1000, "step": 1},
    [1, 2],
    {"from": 0, "to": math.nan, "count": 2},
)


def _campaigns():
    found = {}
    with folder():
        for name, text in _CAMPAIGNS.items():
            Path(f"{name}.toml").write_text(text)
            found[name] = refused(lambda n=name: _cases(campaign.load(f"{n}.toml")))
    return found | {"ranges": [refused(partial(campaign._values, each)) for each in _RANGES]}


def _cases(found):
    some = [found.case(index) for index in range(0, len(found), 5)]
    samples = [[len(each.settings), each.settings[:1]] for each in found.samples(3)]
    return [
        found.name,
        len(found),
        [
            [each.index, each.setting.sensor, each.setting.light, each.scene.noise.sigma, each.scene.camera.blur_px]
            for each in some
        ],
        samples,
    ]


_BROKEN = {
    "size": "UPDATE setting SET height = NULL",
    "zero": "UPDATE setting SET width = 0",
    "image": "UPDATE setting SET image = x'00'",
    "count": "UPDATE chunk SET count = -1",
    "large count": "UPDATE chunk SET count = 10000000",
    "chunk": "UPDATE chunk SET chunk = 'x'",
    "values": "UPDATE distance SET values_px = x'0011'",
    "far": "UPDATE distance SET values_px = zeroblob(96)",
    "predicted": "UPDATE setting SET predicted = '['",
    "list": "UPDATE setting SET predicted = '[]'",
    "trouble": "UPDATE setting SET trouble = 'words'",
    "variance": "UPDATE propagated SET variance_px2 = -1",
    "status": "UPDATE propagated SET status = 'x'",
    "gone": "DELETE FROM propagated",
    "failure": "INSERT INTO failure VALUES (0, 0, 'gradient', 3, 2, 'clutter')",
    "wrong failure": "INSERT INTO failure VALUES (0, 0, 'gradient', 0, -1, 'x')",
    "seconds": 'UPDATE setting SET seconds = \'{"render": "x"}\'',
    "identity": "DELETE FROM run WHERE key = 'identity'",
    "run": "UPDATE run SET value = '[]'",
    "table": "DROP TABLE chunk",
    "version": "PRAGMA user_version = 1",
    "application": "PRAGMA application_id = 7",
}


def _stores():
    """What each reading says of a run's file that was broken in one place."""
    whole, found = (run_folder() / "run" / "run.sqlite").read_bytes(), {}
    readings = {
        "identity": lambda s: sorted(s.identity()),
        "campaign": lambda s: len(s.campaign()),
        "image": lambda s: s.image(0) is not None,
        "chunks": lambda s: s.chunks(0),
        "images": lambda s: s.images(),
        "predicted": lambda s: sorted(s.predicted(0) or {}),
        "trouble": lambda s: s.trouble(0),
        "propagated": lambda s: s.propagated(0, "gradient")[2],
        "distances": lambda s: s.distances(0, "gradient").size,
        "failures": lambda s: s.failures(0, "gradient"),
        "seconds": lambda s: sorted(s.seconds()),
        "fact": lambda s: s.fact("none", 3),
        "packed": lambda s: s.packed(7),
        "has": lambda s: s.has_image(1),
    }
    with folder():
        for name, change in {"nothing": "SELECT 1", **_BROKEN}.items():
            Path(name).mkdir()
            Path(name, "run.sqlite").write_bytes(whole)
            data = sqlite3.connect(Path(name, "run.sqlite"))
            data.execute(change)
            data.commit()
            data.close()
            opened = refused(partial(RunFile.reopen, Path(name)))
            found[name] = (
                _first(opened)
                if isinstance(opened, str)
                else {key: _first(refused(partial(read, opened))) for key, read in readings.items()}
            )
            if not isinstance(opened, str):
                opened.close()
        Path("empty").mkdir()
        Path("empty", "run.sqlite").write_bytes(b"no database of any kind, but of some size" * 9)
        found["no database"] = _first(refused(partial(RunFile.reopen, Path("empty"))))
        mine = RunFile(Path("mine"), {"seed": 1, "versions": {"a": "1"}, "renders": 3})
        found["others"] = [_first(refused(partial(RunFile, Path("mine"), each))) for each in ({"seed": 1}, {"seed": 2})]
        mine.close()
        found["another"] = [
            _first(refused(lambda e=each: RunFile(Path("mine"), e).close()))
            for each in (
                {"seed": 2, "versions": {"a": "1"}, "renders": 3},
                {"seed": 1, "versions": {"a": "2"}, "renders": 3},
                {"seed": 1, "versions": {"a": "1"}, "renders": 3},
            )
        ]
    runs = [list(store._runs(each)) for each in ({}, {3: "a"}, {1: "a", 2: "a", 3: "b", 5: "b", 6: "b"})]
    differ = list(
        store._differences({"a": {"b": [1, 2], "c": 3}, "d": 1, "e": "x" * 99}, {"a": {"b": [1, 3], "c": 3}, "e": "y"})
    )
    return found | {"runs": runs, "differences": differ}


def _first(said):
    """The first words of what is refused, without what a library adds."""
    return said.split(" (")[0] if isinstance(said, str) else said


_FOLDERS = {
    "named": {"sensor_30_90_light_15_270": ["a.npy", "b.npy", "c.txt", ".d.npy"]},
    "unnamed": {"x": ["a.npy"]},
    "few": {"sensor_30_90_light_15_270": ["a.npy"]},
    "inside": {"sensor_30_90_light_15_270": ["a.npy", "b.npy"], "sensor_200_1_light_15_2": ["a.npy"]},
    "none": {},
    "two": {"sensor_30_90_light_15_270": ["a.npy", "b.npy"], "sensor_31.5_91_light_15_-90": ["a.npy"]},
    "lights": {"sensor_30_90_light_15_270_light_20_30": ["a.npy", "b.npy"]},
}
_INDEXES = (
    '[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = ["*.npy"]',
    '[[settings]]\nsensor = [30, 90]\nlight = [[15, 270]]\nfiles = ["a.npy", "a.npy", "b*"]',
    '[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = ["../a.npy"]',
    '[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = ["/a.npy"]',
    "[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = []",
    '[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = [" "]',
    '[[settings]]\nsensor = [30]\nlight = [15, 270]\nfiles = ["a.npy"]',
    '[[settings]]\nsensor = [30, 90]\nlight = [15, 270, 3]\nfiles = ["a.npy"]',
    '[[settings]]\nlight = [15, 270]\nfiles = ["a.npy"]',
    "x = 1",
    "settings = 3",
    "settings = []",
    "[",
    '[[settings]]\nsensor = [30, 90]\nfiles = ["none.npy"]',
)


def _folders():
    known, found = campaign.Campaign.of(load("task1")), {}
    camera, rng = known.scenes[0].camera, np.random.default_rng(3)
    shots = [rng.uniform(20, 90, (camera.height, camera.width)) for _ in range(3)]
    with folder():
        for name, inside in _FOLDERS.items():
            Path(name).mkdir()
            for each, files in inside.items():
                Path(name, each).mkdir()
                for number, file in enumerate(files):
                    np.save(Path(name, each, file), shots[number % 3]) if file.endswith(".npy") else Path(
                        name, each, file
                    ).touch()
            found[name] = refused(lambda n=name: _photos(known, n))
        Path("index").mkdir()
        for number, file in enumerate(("a.npy", "b.npy")):
            np.save(Path("index", file), shots[number])
        np.save(Path("index", "b2.npy"), shots[0][:-1])
        np.save(Path("index", "b3.npy"), np.where(shots[0] > 80, np.nan, shots[0]))
        for number, text in enumerate(_INDEXES):
            Path("index", "photos.toml").write_text(text)
            found[f"index {number}"] = refused(lambda: _photos(known, "index"))
        grid = known.model_copy(update={"sweep": {"noise.sigma": (1.0,)}})
        found["swept"], found["absent"] = (
            refused(partial(_photos, each, where)) for each, where in ((grid, "named"), (known, "no such"))
        )
        names = [str(Path("named", "sensor_30_90_light_15_270", file)) for file in ("a.npy", "b.npy")]
        take = photographs.exposures(known.scenes[0], names)
        found["mean"], found["taken"] = photographs.mean(known.scenes[0], names), [take(None, 1), take(None, 1)]
        with mock.patch.object(photographs, "MOST", 2):
            found["most"] = [refused(partial(_photos, known, name)) for name in ("few", "named", "two")]
    return found


def _photos(known, name):
    reports = []
    made = photographs.load(known, Path(name), progress=lambda *about: reports.append(about))
    return [
        [[Path(each).name for each in files] for files in made.files],
        made.troubles,
        made.counts,
        made.left_out,
        made.exact_poses,
        reports,
        made.campaign.scenes[0].settings,
    ]


def _checks():
    """Tables of plans that were checked, each ending in its own way."""
    found = planner.plan(load("task1"), step_deg=45.0, refined=False, light=(17.1, 311.3))
    several = planner.plan(load("plate"), step_deg=60.0, refined=False, light=(17.1, 311.3))
    rows = [
        _checked(found, n, *about)
        for n, about in enumerate(
            (
                (1.1e-6, 1.31e-6, 2, "ok", ()),
                (1.2e-6, 1.17e-6, 1, "ok", ("shadow", "glare")),
                (1.3e-6, math.nan, None, "clutter", ("glare",)),
            ),
            1,
        )
    ]
    good, better, lost = rows
    near = replace(better, propagated=1.305e-6)
    ends = {
        "moved": plan_check.PlanCheck(tuple(rows), better, True, "", 2.5),
        "kept": plan_check.PlanCheck((good,), good, False, "", 2.5),
        "near": plan_check.PlanCheck(tuple(rows), near, True, "", 2.5),
        "none": plan_check.PlanCheck((), None, None, "too small", 2.5),
        "lost": plan_check.PlanCheck((lost, good), good, True, "", 1.0),
        "all lost": plan_check.PlanCheck((lost,), None, None, "clutter", 1.0),
    }
    moves = (Move("noise.sigma", 1.1, 1.2345, 1.2222, 3.456, 0.0), Move("camera.blur_px", 0.9, 0.91, 0.9, 0.0, 12.3))
    robust = [
        Robust(Pose(30, 80), Pose(20, 200), 2.5e-6, 1.5e-6, worst, some, 12)
        for worst, some in ((3e-6, moves), (math.inf, ()), (2.4e-6, moves))
    ]
    told = {name: printed(plan_table.report(found, end, None, 1.5)) for name, end in ends.items()}
    told |= {f"robust {n}": printed(plan_table.report(found, None, each, 1.5))[-9:] for n, each in enumerate(robust)}
    told["several"] = printed(plan_table.report(several, ends["moved"], robust[0], 1.5))
    return told | {
        "judged": [plan_check._judged(some, "reason", 1.0) for some in (rows, rows[:1], [], rows[2:])],
        "same": [
            plan_check._same((Pose(30, 80), Pose(20, a), ()), (Pose(30, 80 + b), Pose(20, 200), ()))
            for a, b in ((200, 0), (200, 9), (230, 0), (200, 40))
        ],
    }


def _checked(found, rank, calibrated, propagated, after, status, names):
    at = found.candidates[min(rank, len(found.candidates)) - 1]
    return plan_check.CheckedSetting(at.sensor, at.light, (), calibrated, propagated, status, names, rank, after)


def _words():
    """Small steps: rows as HTML, values with their digits, errors in a line, documents without NaN, tables written."""
    values = (0.000123456, None, (30.0, 135.5), "a<b", 12, math.inf)
    rows = [{"a": 1.0, "b<": "x&"}, {"a": None, "b<": "y"}]
    documents = (
        {"a": math.nan, "b": [1.5, math.inf]},
        {"c": np.float64(2.5), "d": np.arange(3), "e": Path("x")},
        [np.bool_(True), (1, 2)],
    )
    tables = (
        {"a": 1, "b": {"c": [1.5, 2.0], "d": 'x"y\\'}, "e": [{"f": True}, {"f": False}]},
        {"g h": -0.0, "i": [[1, 2], [3, 4]], "j": []},
    )
    return {
        "short": [results.short(each) for each in values],
        "table": results._table(rows),
        "none": results._table([]),
        "values": [results.value(8.061254, sigma, "cm") for sigma in (0.00231, None, 0.0, math.inf, 12.3, 1e-15)],
        "finite": [results.finite(each) for each in (1, math.nan, -math.inf)],
        "poses": [
            results.poses((30, 80), each)
            for each in ((20, 200), ((20, 200), (31, 1)), ((None, None), (1, 2)), (None, None))
        ],
        "dumps": [refused(partial(strict_json.dumps, each)) for each in documents],
        "toml": [written.edited("", each) for each in tables],
        "lines": [errors.one_line(text) for text in ("a\nb", "x" * 999, "", "a\tb")],
        "advice": [guide.advice(each) for each in (True, False)],
    }


def _repr():
    """How results show themselves."""
    scene = load("plate")
    made = [
        planner.predict(scene, *uneven(scene)),
        planner.plan(load("task1"), step_deg=60.0, refined=False, light=(17.1, 311.3)),
        planner.budget(load("task1"), *uneven(load("task1"))),
    ]
    return [[repr(each), each._repr_html_().count("<td>"), each.as_rows()[:3]] for each in made]


def _registries():
    """Names that are added, twice, wrong ones; what follows them."""
    made, said = Registry("lamp"), []
    made.followed_by(lambda: said.append(made.names))
    found = [
        refused(lambda n=name, v=value: made.add(n)(v)) for name, value in (("a", 1), ("a", 2), ("b", 3), ("a", 1))
    ]
    found += [refused(partial(made.__getitem__, name)) for name in ("a", "x", 3)]
    made.remove("a")
    return [*found, made.names, len(made), "a" in made, "b" in made, list(made), said]


def _stages():
    """Images of settings, wanted in stages."""
    made = stages.Stages([[300, 20, 0]])
    grown = [made.extend(each) for each in ([300, 20, 0], [100, 20.9, 0], [510, 10, 1])]
    return {
        "grown": grown,
        "total": made.total,
        "later": made.later,
        "sizes": [made.sizes(index) for index in range(3)],
    }


def _stations():
    """Pictures of drawn stations, and what is measured in them."""
    scene = load("task1")
    picture = scenes.Picture.of(scene, *uneven(scene))
    chain = Chain(planner.budget(picture))
    rng = np.random.default_rng(3)
    values, states = chain.pictured(rng, 2)
    return {"values": values, "states": states}


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {f"refused of {name}": (CLOSED, partial(_scene, name)) for name in _TRIED}
    made = {
        "campaigns": (CLOSED, _campaigns),
        "stores": (CLOSED, _stores),
        "folders": (CLOSED, _folders),
        "checks": (SEARCHED, _checks),
        "words": (CLOSED, _words),
        "shown": (SEARCHED, _repr),
        "registries": (CLOSED, _registries),
        "stages": (CLOSED, _stages),
        "stations": (SEARCHED, _stations),
    }
    return found | {f"limits of {name}": case for name, case in made.items()}
