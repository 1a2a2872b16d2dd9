"""A recipe's folder: code, data, an example with the answer that is expected, and what a line engineer reads."""

from __future__ import annotations

import hashlib
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

import measure
from scenes.load import find
from validation import inspection
from validation.cli.measurands import facts as as_told
from validation.recipe import code
from validation.recipe.export import Export
from validation.recipe.readme import readme
from validation.remeasured import Method
from validation.simulation import How
from validation.strict_json import dumps, plain
from validation.versions import PROGRAM, version

_ALIKE = 1e-9  # of a number: rounding is less
_TOLD = ("value", "sigma", "U", "status", "decision")


def write(made: Export, source: str, folder: Path) -> dict[str, Any]:
    """Write a recipe of a scene that was read from a source; what was written, as `ice export --json` tells it.

    The folder measures its example by itself, and what it answers is compared with the program.
    """
    data = folder / "data"
    data.mkdir(parents=True, exist_ok=True)
    package, modules = code.copied(folder)
    (data / "facts.json").write_text(dumps(plain(made.facts)), encoding="utf-8")
    (data / "formulas.py").write_text(made.formulas, encoding="utf-8")
    np.savez(data / "arrays.npz", **made.arrays)
    picture = recorded(made)
    np.save(folder / "example.npy", picture)
    answer = _answered(folder)
    _check(answer, made, picture)
    (folder / "expected.json").write_text(dumps(answer), encoding="utf-8")
    facts = _facts(made, source, package)
    (folder / "README.md").write_text(readme(facts), encoding="utf-8")
    names = ["README.md", "data/arrays.npz", "data/facts.json", "data/formulas.py", "example.npy", "expected.json"]
    files = sorted([*names, *modules])
    return facts | {"folder": str(folder), "files": files, "bytes": sum((folder / f).stat().st_size for f in files)}


def recorded(made: Export) -> np.ndarray:
    """A noise-free picture of the scene as its sensor records it: rendered where something is measured."""
    noise, how = made.picture.scene.noise, How().by(Method(made.facts["estimator"]), of=made.picture.scene).rough
    if made.correction is not None and made.correction.adjusted is not None:
        how = How(quality=how.quality, everywhere=True)
    image = how.image(made.picture)
    if noise.bits is None:
        return image
    depth = np.uint8 if noise.bits <= 8 else np.uint16
    return np.clip(np.rint(image), 0, 2**noise.bits - 1).astype(depth)


def _answered(folder: Path) -> dict[str, Any]:
    """What the folder alone answers for its example."""
    command = [sys.executable, "-I", "-B", str(folder / "recipe.py"), str(folder / "example.npy")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"the recipe ended with {done.returncode}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def _check(answer: dict[str, Any], made: Export, picture: np.ndarray) -> None:
    """See that the program answers the same; a recipe that does not is an error of the program."""
    found = measure.measure(picture, made.picture, estimator=made.facts["estimator"])
    if made.correction is not None and np.isfinite(found.value).any():
        found = measure.corrected(found, made.correction, picture.astype(float))
    for mine, own in zip(answer["measurands"], as_told(inspection.inspect(found)), strict=True):
        for key in _TOLD:
            one, other = mine[key], own[key]
            numbers = isinstance(one, float) and isinstance(other, float)
            if one != other and not (numbers and math.isclose(one, other, rel_tol=_ALIKE)):
                raise RuntimeError(f"the recipe answers {key} of {own['name']} by {one}, the program by {other}")


def _facts(made: Export, source: str, package: str) -> dict[str, Any]:
    picture = made.picture
    return {
        "scene": picture.scene.name, "sha256": hashlib.sha256(find(source).read_bytes()).hexdigest(),
        "sensor": list(picture.sensor), "light": [list(pose) for pose in picture.free_lights],
        "estimator": made.facts["estimator"], "as_measured": made.correction is None,
        "program": PROGRAM, "version": version(), "code": package,
        "width": made.facts["shape"][1], "height": made.facts["shape"][0],
        "measurands": [{key: each[key] for key in ("name", "kind", "unit")} for each in made.facts["characteristics"]],
    }  # fmt: skip
