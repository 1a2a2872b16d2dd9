"""Verdicts, comparisons, costs, budgets in words, what the explorer answers, and what commands print in words."""

import atexit
import contextlib
import copy
import json
import re
import tempfile
from functools import cache, partial
from pathlib import Path

import numpy as np

import planner
import scenes
from planner.uncertainty import Input, budget, gauge, monte_carlo, validate
from planner.uncertainty.conformity import decide
from planner.uncertainty.groups import Group
from render import Quality
from tests.commands import ice
from tests.regression.numbers.poses import load, uneven, without_error
from tests.regression.stored import CLOSED, SEARCHED
from tests.sequential import simulate
from validation import budgets, comparison, statistics
from validation.cost import interval
from validation.cost.model import CostModel, Rendered
from validation.explore.answers import answer, to_message
from validation.explore.messages import Message
from validation.explore.state import State

_REFERENCE = Path(__file__).parents[1] / "reference.json"
_UNEVEN = Path(__file__).parents[1] / "uneven.toml"
_ELSEWHERE = re.compile(r"^\| (?:versions|machine|time|digest of the code) |e-1\d\b")  # the last: rounding
_SECONDS = re.compile(r"\d[\d.]* (?:s|ms|min)\b")


def verdict(**how):
    """Of seven rows, some of which were not measured."""
    ratios = np.array([0.93, 1.11, np.nan, 1.31, 0.88, 1.02, 1.19])
    counts, lost = np.array([400, 390, 0, 200, 401, 77, 300]), np.array([0, 10, 400, 3, 0, 1, 0])
    status = np.array(["ok", "ok", "not_visible", "clutter", "ok", "ok", "misfit"])
    bias, sigma = np.array([0.001, -0.004, np.nan, 0.05, 0.003, 0.0, 0.011]), np.full(7, 0.013)
    how = {
        "lost": lost,
        "bias_px": bias,
        "sigma_px": sigma,
        "status": status,
        "independent": np.linspace(0.4, 1, 7),
    } | how
    return statistics.verdict(how.pop("ratios", ratios), counts, **how)


def _statistics():
    return {
        "intervals": [statistics.ratio_interval(1.1, n, level) for n, level in ((5, 0.95), (300, 0.9), (1, 0.95))],
        "p": [statistics.p_value(ratio, n) for ratio, n in ((1.13, 400), (0.7, 20))],
        "sidak": statistics.sidak(0.01, 17), "bias": statistics.bias_p_value([0.02, 0.4, -0.5], [50, 300, 90]),
        "correlation": statistics.correlation([1.0, 2.5, 2.0, 4.4, 5.0], [1.2, 2.2, 2.9, 3.0, 6.1]),
    }  # fmt: skip


def _compared():
    before = comparison.read(_REFERENCE)
    after = copy.deepcopy(before)
    for number, row in enumerate(after["settings"]):
        for scale, each in zip((1.1, 0.8, 1.4, 1.0, 1.02), (row, *row["classic"]), strict=False):
            each["empirical"] *= scale + 0.05 * number
            each["bias"] += 0.002 * (number - 1)
            each["failed"] = 7 * number
    after["settings"].pop(1)
    return comparison.compare(before, after, 0.02)


def _cost():
    rendered = [Rendered(Quality(edge_samples=count), 0.1 * count, 0.18 / count) for count in (4, 9, 25)]
    model = CostModel(7, 3, "scalar_rgb", tuple(rendered), 0.007, 0.002, 1.3, 0.21, 0.0017, 0.9, 3.1)
    chosen = [model.for_accuracy(0.08), model.for_accuracy(0.031), model.for_budget(33.0), model.for_budget(140.0)]
    return {
        "chosen": chosen, "text": [each.text for each in chosen], "refused": without_error(
            lambda: model.for_accuracy(0.003)), "short": without_error(lambda: model.for_budget(2.0)),
        "half width": [interval.half_width(n) for n in (12, 345)], "images": [interval.images(w) for w in (0.31, 0.07)],
        "wanted": [interval.wanted(1.3, 200, 0.1), interval.wanted(0.7, 900, 0.1), interval.wanted(1.0, 400, 0.13)],
        "simulated": simulate(1.2, 0.2, 30, np.random.default_rng(1)),
    }  # fmt: skip


def _uncertain():
    inputs = [
        Input("scale", 1.7, 0.03, dof=7), Input.from_half_width("angle", 0.4, 0.05),
        Group((Input("a", 1.0, 0.02), Input("b", 2.0, 0.05)), np.array([[1.0, -0.4], [-0.4, 1.0]]), "pair"),
    ]  # fmt: skip
    slopes = {"scale": 1.3, "angle": -0.8, "a": 0.6, "b": 0.35}
    found = budget("length", "mm", 12.0, inputs, slopes, p=0.9)
    drawn = monte_carlo(
        lambda x: x["scale"] * np.cos(x["angle"]) + 0.6 * x["a"] + 0.35 * x["b"] ** 2, inputs, 5, 0.9, block=2000,
        most=20_000, name="length")  # fmt: skip
    return {"budget": found, "rows": found.as_rows(),
            "drawn": drawn, "compared": validate(found, drawn),
            "without": found.without("angle"),
            "split": (found.repeatability, found.accuracy, found.interval)}  # fmt: skip


def _capable():
    repeats = 10 + np.array([0.003, -0.001, 0.004, 0.002, -0.0005, 0.0011])
    zone = scenes.Tolerance(plus=0.03, minus=0.01)
    values = (9.985, 9.993, 10.0, 10.021, 10.026, 10.034, 10.05)
    return {"gauge": gauge(repeats, 10.001, 0.05),
            "decided": [decide(value, 0.003, 10.0, zone, k) for value in values for k in (1.0, 2.0)]}  # fmt: skip


def _budget_facts():
    scene = scenes.load(_UNEVEN)
    found = planner.budget(scene, *uneven(scene, 0))
    drawn = budgets.monte_carlo(found, 3, digits=1, margin=1.0)
    facts = budgets.facts(found, drawn, None, 0.04, 1)
    return {
        "facts": facts, "draws": [budgets.said_of_draws(row) for row in drawn],
        "tolerance": [budgets.said_of_tolerance(found, each) for each in found],
        "improvement": [budgets.said_of_improvement(each) for each in found],
        "reach": [budgets.said_of_reach(each, 0.03) for each in found],
    }  # fmt: skip


def _explored(name):
    scene = load(name)
    state = State.first(scene)
    return {"state": state, "said": to_message(answer(scene, state)), "told": answer(scene, state, closely=False)}


def _asked():
    texts = ('{"type": "best", "number": 3}', '{"type": "save", "replace": 1}', "[1]", "{", '{"type": "state", "x": 1}')
    return [without_error(partial(Message.of, text)) for text in texts]


_LASTING = contextlib.ExitStack()
atexit.register(_LASTING.close)


@cache
def _folder():
    """A folder of runs, kept to the end of the process."""
    folder = Path(_LASTING.enter_context(tempfile.TemporaryDirectory()))
    scene = scenes.load(_UNEVEN)
    pose = scene.settings[0].sensor, scene.settings[0].light
    clean = planner.image(scene, *pose)
    np.save(folder / "shot.npy", clean + np.random.default_rng(7).normal(0, 3, clean.shape))
    ice("validate", _UNEVEN, "--renders", "12", "--workers", "1", "--seed", "3", "--out", "run", cwd=folder)
    return folder


def run_folder():
    """Where the run lies, as ``run``, and a picture, as ``shot.npy``."""
    return _folder()


def printed(*arguments):
    """What a command says in words, or as JSON."""
    done = ice(*arguments, "-q", cwd=run_folder())
    said = json.loads(done.stdout) if "--json" in arguments else _words(done.stdout)
    return {"status": done.returncode, "said": said, "errors": done.stderr.splitlines()}


def _words(text):
    """The lines, without what another machine says and what is rounding."""
    return [line for line in _SECONDS.sub("# s", text).splitlines() if not _ELSEWHERE.search(line)]


def _photographed():
    """Repeated photographs of two settings in the place of renders, one of them none."""
    scene, folder = load("task1"), run_folder() / "photos"
    for number, setting in enumerate(scene.settings[:2]):
        (s, k), clean = (setting.sensor, setting.light), planner.image(scene, setting.sensor, setting.light)
        place = folder / f"sensor_{s.polar_deg:g}_{s.azimuth_deg:g}_light_{k.polar_deg:g}_{k.azimuth_deg:g}"
        place.mkdir(parents=True, exist_ok=True)
        noise = np.random.default_rng(number).normal(0, 2.4, (5, *clean.shape))
        for i, shot in enumerate(clean + noise):
            np.save(place / f"{i}.npy", shot)
    (place / "9.npy").write_bytes(b"none")
    done = ice("validate", "task1", "--photos", folder, "--out", "shown", "--workers", "1", "--json", "-q",
               cwd=run_folder())  # fmt: skip
    said = json.loads(done.stdout)
    return {"status": done.returncode, "left out": len(said.pop("left_out")), "said": said}


_POSES = ("--sensor", "33,312", "--light", "24,250")
_PRINTED = {
    "predict": ["predict", _UNEVEN], "predict bound": ["predict", _UNEVEN, "--model", "bound", *_POSES],
    "predict blocks": ["predict", "task1", "--model", "paper"], "budget": ["budget", _UNEVEN, "--reach", "0.04"],
    "effects": ["effects", _UNEVEN], "show": ["show", _UNEVEN], "show plate": ["show", "plate"], "scenes": ["scenes"],
    "measure": ["measure", "shot.npy", _UNEVEN, *_POSES, "--as-measured"], "compare": ["compare", "run", _REFERENCE],
    "measure a photograph": ["measure", "shot.npy", "--kind", "quadrilateral", "--json"],
    "plan": ["plan", "wedge", "--step", "45", "--no-check", "--sensor", "31,133"],
    "plan views": ["plan", "calibrated_rig", "--step", "60", "--no-check", "--views", "2"],
    "plan capability": ["plan", _UNEVEN, "--step", "45", "--no-check", "--objective", "capability",
                        "--sensor", "21,305", "--light-polar", "20,60"],
    "plan tolerance": ["plan", "task1", "--step", "45", "--no-check", "--sensor", "31,133", "--tolerance", "noise=0.1",
                       "--tolerance", "light_deg=2"],
    "plan lamps": ["plan", "copper", "--vary", "band", "--sensor", "31,137", "--light", "17,311", "--no-check"],
    "plan shares": ["plan", "two_lights", "--step", "60", "--no-check", "--sensor", "58.3,275.1"],
    "plan by turns": ["plan", "task1", "--search", "alternating", "--step", "30", "--sensor-polar", "25,60",
                      "--no-check", "--json"],
    "pose": ["predict", "task1", "--sensor", "100"], "unknown": ["plan", "no such"],
}  # fmt: skip


def cases():
    """By name: relative tolerance, and what makes the result."""
    found = {f"print {name}": (SEARCHED, partial(printed, *command)) for name, command in _PRINTED.items()}
    for name in ("task1", "plate", "two_lights", "ball", "backlight_plate"):
        found[f"explore {name}"] = CLOSED, partial(_explored, name)
    return found | {
        "verdict": (CLOSED, verdict), "verdict of few": (CLOSED, partial(verdict, lost=np.full(7, 350))),
        "verdict without bias": (CLOSED, partial(verdict, bias_px=None)),
        "verdict of none": (CLOSED, partial(verdict, ratios=np.full(7, np.nan))),
        "verdict of far ones": (CLOSED, partial(verdict, ratios=np.linspace(0.6, 1.7, 7), level=0.05)),
        "statistics": (CLOSED, _statistics), "compared": (CLOSED, _compared), "cost": (CLOSED, _cost),
        "uncertain": (CLOSED, _uncertain), "capable": (CLOSED, _capable), "budget in words": (CLOSED, _budget_facts),
        "messages": (CLOSED, _asked),
        "photographs of settings": (SEARCHED, _photographed),
    }  # fmt: skip
