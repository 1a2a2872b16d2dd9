"""Do the commands still print what they printed when it was stored, number for number?

``python -m tests.regression.test_documents FOLDER`` stores them anew, after a change that was wanted. The scene has no
symmetry, so that what is taken for its neighbour - another axis, unit, end, key, column - is another number. How far
numbers may be off: closed forms by what another order of additions makes of them, searches by where a descent ends,
renders by what another instruction set makes of a ray.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import planner
import scenes
from tests.commands import ice
from tests.regression.stored import CLOSED, RENDERED, SEARCHED, differences, read, write

pytestmark = pytest.mark.render

SCENE = Path(__file__).with_name("uneven.toml")
STORED = Path(__file__).with_name("documents.json")
POSES = ("--sensor", "33,312", "--light", "24,250")
CASES = {
    "predict": (CLOSED, ["predict", SCENE]),
    "predict at a pose": (CLOSED, ["predict", SCENE, "--sensor", "25,300", "--light", "30,200"]),
    "bound": (CLOSED, ["predict", SCENE, "--model", "bound"]),
    "paper": (CLOSED, ["predict", SCENE, "--model", "paper"]),
    "budget": (RENDERED, ["budget", SCENE, "--reach", "0.04"]),
    "effects": (CLOSED, ["effects", SCENE]),
    "show": (CLOSED, ["show", SCENE]),
    "measure": (CLOSED, ["measure", "shot.npy", SCENE, *POSES, "--estimator", "gradient", "--as-measured"]),
    "measure by the whole picture": (CLOSED, ["measure", "shot.npy", SCENE, *POSES, "--as-measured"]),
    "measure less the bias": (RENDERED, ["measure", "shot.npy", SCENE, *POSES, "--estimator", "gradient"]),
    "plan": (SEARCHED, ["plan", SCENE, "--step", "30", "--no-check", "--over", "sum", "--sensor-polar", "10,50",
                        "--light-azimuth", "200,30"]),
    "views": (SEARCHED, ["plan", SCENE, "--step", "45", "--no-check", "--views", "2"]),
    "validate": (RENDERED, ["validate", SCENE, "--renders", "40", "--workers", "1", "--seed", "3", "--out", "run"]),
}  # fmt: skip


def document(name: str, folder: Path) -> dict:
    """What a command prints now."""
    if not (folder / "shot.npy").exists():
        scene = scenes.load(SCENE)
        clean = planner.image(scene, scene.settings[0].sensor, scene.settings[0].light)
        np.save(folder / "shot.npy", clean + np.random.default_rng(7).normal(0, 3, clean.shape))
    done = ice(*CASES[name][1], "--json", "-q", cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("documents")


@pytest.mark.parametrize("name", CASES)
def test_the_numbers_are_those_that_were_stored(name, folder):
    stored = read(STORED)[name]
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
    write(STORED, documents)
