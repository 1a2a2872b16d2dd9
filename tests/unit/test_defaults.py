"""What holds where nobody says otherwise is said once, and no public default changes without a word."""

import ast
import inspect
from pathlib import Path

import pytest

from measure.features.optics import Optics
from planner import plan
from scenes import Locator, Noise
from tests.constants import changes, constants, files
from tests.regression.stored import read, write
from validation import run
from validation.batch.options import RunOptions
from validation.cli.batch import validate_command
from validation.cli.calibrate import calibrate_command
from validation.cli.cost import cost_command
from validation.cli.plan import plan_command
from validation.cost.goal import reach
from validation.cost.sweep import sweep
from validation.cost.trial import trial

ROOT = Path(__file__).parents[2]
PACKAGES = "scenes", "imaging", "planner", "measure", "render", "validation"
STORED, CONSTANTS = (ROOT / "tests" / "regression" / f"{name}.json" for name in ("defaults", "constants"))
_TO_DO = "name the reason in CHANGELOG.md, then `python -m tests.unit.test_defaults`"


@pytest.mark.parametrize("function", [run, RunOptions, sweep, validate_command, cost_command, calibrate_command])
def test_one_seed(function):
    """A run from Python and one from the command line give the same numbers."""
    assert inspect.signature(function).parameters["seed"].default == 1995


@pytest.mark.parametrize("function", [reach, trial])
def test_one_record_of_options(function):
    assert inspect.signature(function).parameters["options"].default == RunOptions()


def test_one_start(task1):
    """The alternating search begins at the paper's pose, from Python and from the command line."""
    found, given = (
        plan(task1, search="alternating", step_deg=30, refined=False, **start) for start in ({}, {"start": (40, 41)})
    )
    assert found.poses == given.poses
    assert inspect.signature(plan).parameters["start"].default == (40, 41)
    assert inspect.signature(plan_command).parameters["start"].default == "40,41"


def test_one_locator():
    """Optics that nobody describes have the settings of a scene that nobody describes."""
    optics, locator = Optics((10, 10)), Locator()
    assert (optics.scale_px, optics.window_px) == (locator.scale_px, locator.window_px) == (1.0, 3.0)
    assert (optics.noise_variance, optics.dark_level, optics.sensor) == (1.0, 0.0, Noise(sigma=1.0))


def defaults(text):
    """What a module's public functions, methods and dataclasses take, and where nothing is said, as it is written."""
    found = {}
    for name, node in _public(ast.parse(text).body):
        if isinstance(node, ast.FunctionDef):
            if node.args.defaults or node.args.kwonlyargs:
                found[name] = _bare(node.args)
        else:
            fields = [each for each in node.body if isinstance(each, ast.AnnAssign) and each.value is not None]
            told = {ast.unparse(each.target): ast.unparse(each.value) for each in fields}
            found |= {name: told} if told else {}
    return found


def _bare(arguments):
    """How a function is called, without annotations."""
    for each in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        each.annotation = None
    return ast.unparse(arguments)


def _public(nodes, before=""):
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield f"{before}{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from _public(node.body, f"{before}{node.name}.")


def every_default():
    """Of all modules, by file."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    told = {str(path.relative_to(ROOT)): defaults(path.read_text(encoding="utf-8")) for path in paths}
    return {file: each for file, each in told.items() if each}


def test_no_default_changes_unnoticed():
    """A default that changes is named in the CHANGELOG, and stored anew: ``python -m tests.unit.test_defaults``."""
    assert every_default() == read(STORED)


@pytest.mark.parametrize("file", sorted(read(CONSTANTS)))
def test_no_number_changes_unnoticed(file):
    """A threshold that changes is named in the CHANGELOG with its reason, and stored anew."""
    found = constants(file) if (ROOT / file).exists() else {}
    different = changes(read(CONSTANTS)[file], found)
    assert not different, "\n".join([f"{file}:", *different, _TO_DO])


def test_numbers_are_stored_of_every_module_that_holds_some():
    missing = [file for file in files() if file not in read(CONSTANTS) and constants(file)]
    assert not missing, f"not stored: {', '.join(missing)}; {_TO_DO}"


def test_numbers_are_read_of_constants_classes_and_private_defaults():
    """A number, a record, one of a class, one of a private function; no text, and nothing from another module."""
    told = {file: constants(file) for file in ("render/phenomena/base.py", "validation/hard/table.py")}
    assert told["render/phenomena/base.py"]["SAFETY"] == 2.0
    assert told["render/phenomena/base.py"]["NOTHING"] == [0.0, 0.0]
    assert told["validation/hard/table.py"]["_number(digits)"] == 4
    classes = [name for name in constants("render/phenomena/sensor.py") if name.endswith("._MARGIN")]
    assert len(classes) == 1
    assert not {"ROOT", "PACKAGES", "STORED"} & constants("tests/constants.py").keys()


def test_defaults_are_read_of_functions_methods_and_records():
    text = "def f(a, b: int=1, *, c, d=0): ...\nclass A:\n    n: int = 3\n    def g(self, e=None): ...\n"
    assert defaults(text + "def _h(i=0): ...") == {"f": "a, b=1, *, c, d=0", "A": {"n": "3"}, "A.g": "self, e=None"}


if __name__ == "__main__":
    write(STORED, every_default())
    write(CONSTANTS, {file: found for file in files() if (found := constants(file))})
