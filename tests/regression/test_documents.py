"""Do the commands still print what they printed when it was stored, number for number?

``python -m tests.regression.test_documents FOLDER`` stores them anew, after a change that was wanted. The scene has no
symmetry, so that what is taken for its neighbour - another axis, unit, end, key, column - is another number. How far
numbers may be off: closed forms by what another order of additions makes of them, searches by where a descent ends,
renders by what another instruction set makes of a ray.
"""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import planner
import scenes
from tests.commands import ice

pytestmark = pytest.mark.render

SCENE = Path(__file__).with_name("uneven.toml")
STORED = Path(__file__).with_name("documents.json")
POSES = ("--sensor", "33,312", "--light", "24,250")
CLOSED, SEARCHED, RENDERED = 1e-6, 2e-3, 5e-3  # relative; measured: 1e-12, 1e-6, 1e-4
CASES = {
    "predict": (CLOSED, ["predict", SCENE]),
    "predict at a pose": (CLOSED, ["predict", SCENE, "--sensor", "25,300", "--light", "30,200"]),
    "bound": (CLOSED, ["predict", SCENE, "--model", "bound"]),
    "paper": (CLOSED, ["predict", SCENE, "--model", "paper"]),
    "budget": (CLOSED, ["budget", SCENE, "--reach", "0.04"]),
    "effects": (CLOSED, ["effects", SCENE]),
    "show": (CLOSED, ["show", SCENE]),
    "measure": (CLOSED, ["measure", "shot.npy", SCENE, *POSES, "--estimator", "gradient"]),
    "measure by the whole picture": (CLOSED, ["measure", "shot.npy", SCENE, *POSES]),
    "plan": (SEARCHED, ["plan", SCENE, "--step", "30", "--no-check", "--over", "sum", "--sensor-polar", "10,50",
                        "--light-azimuth", "200,30"]),
    "views": (SEARCHED, ["plan", SCENE, "--step", "45", "--no-check", "--views", "2"]),
    "validate": (RENDERED, ["validate", SCENE, "--renders", "40", "--workers", "1", "--seed", "3", "--out", "run"]),
}  # fmt: skip
_ELSEWHERE = ("seconds", "variant", "machines", "file", "dask")  # keys of what another machine may say
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def document(name: str, folder: Path) -> dict:
    """What a command prints now."""
    if not (folder / "shot.npy").exists():
        scene = scenes.load(SCENE)
        clean = planner.image(scene, scene.settings[0].sensor, scene.settings[0].light)
        np.save(folder / "shot.npy", clean + np.random.default_rng(7).normal(0, 3, clean.shape))
    done = ice(*CASES[name][1], "--json", "-q", cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


def differences(stored, found, rel, where="", size=0.0):
    """Where two documents differ, as "key: stored, found"; ``size`` is what a number near zero is small against."""
    if isinstance(stored, dict) and isinstance(found, dict):
        spread = _spread(stored)
        for key in dict.fromkeys([*stored, *found]):
            if key not in _ELSEWHERE:
                yield from differences(stored.get(key), found.get(key), rel, f"{where}.{key}", spread)
    elif isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        numbers = [abs(value) for value in stored if isinstance(value, int | float)]
        for i, pair in enumerate(zip(stored, found, strict=True)):
            yield from differences(*pair, rel, f"{where}[{i}]", max(numbers, default=size))
    elif not _alike(stored, found, rel, size):
        yield f"{where.lstrip('.')}: {stored}, {found}"


def _spread(row: dict) -> float:
    """One standard deviation of what a row is about, which its biases are small against."""
    variances = [row.get(key) for key in ("empirical", "variance", "variance_object") if row.get(key)]
    sigmas = [row.get(key) for key in ("sigma", "u") if row.get(key)]
    return max([*(math.sqrt(v) for v in variances), *sigmas], default=0.0)


def _alike(stored, found, rel, size):
    if isinstance(stored, str) and isinstance(found, str):
        pairs = zip(_NUMBER.findall(stored), _NUMBER.findall(found), strict=False)
        same = _NUMBER.sub("#", stored) == _NUMBER.sub("#", found)
        return same and all(math.isclose(float(a), float(b), rel_tol=0.05) for a, b in pairs)  # a last digit of two
    if isinstance(stored, bool) or stored is None or isinstance(stored, int):
        return stored == found
    return isinstance(found, int | float) and math.isclose(stored, found, rel_tol=rel, abs_tol=rel * size + 1e-13)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("documents")


@pytest.mark.parametrize("name", CASES)
def test_the_numbers_are_those_that_were_stored(name, folder):
    stored = json.loads(STORED.read_text(encoding="utf-8"))[name]
    assert list(differences(stored, document(name, folder), CASES[name][0])) == []


def test_a_slip_is_a_difference():
    """Negative controls: a swapped pair, a lost key, a sign, a status, a percent, a number in a sentence."""
    row = {"name": "a", "status": "ok", "variance": 4.0, "bias": 0.0, "ends": [1.0, 2.0], "said": "U = 0.0052 mm"}
    assert list(differences(row, {**row, "bias": 1e-7}, 1e-6)) == []
    for key, value in (("status", "short"), ("variance", 4.0001), ("bias", 1e-3), ("ends", [2.0, 1.0]), ("ends", [1.0]),
                       ("said", "U = 0.0152 mm"), ("said", "U = 0.0052 cm"), ("name", None)):  # fmt: skip
        assert len(list(differences(row, {**row, key: value}, 1e-6))) >= 1, (key, value)
    assert list(differences(row, {k: v for k, v in row.items() if k != "variance"}, 1e-6))


if __name__ == "__main__":
    made = Path(sys.argv[1])
    documents = {name: document(name, made) for name in CASES}
    STORED.write_text(json.dumps(documents, indent=1) + "\n", encoding="utf-8")
