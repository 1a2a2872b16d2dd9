"""What the program imports is what its installation brings: nothing of the tests, of their tools, or by accident."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from validation.cli.commands import COMMANDS

ROOT = Path(__file__).parents[2]
OURS = ("scenes", "imaging", "planner", "render", "measure", "validation")
CHECK = {"ice_vision"}  # the module beside them
OPTIONAL = {
    "distributed": "dask",
    "pyarrow": "pyarrow",
    "OCP": "cadquery-ocp-novtk",
    "pandas": "frames",
    "aiohttp": "aiohttp",
    "lxml": "lxml",
}  # extras, imported only where they are asked for


def imported(file: Path) -> set[str]:
    """Top-level packages that a file imports anywhere."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module.split(".")[0])
    return found


def name(requirement: str) -> str:
    return re.split(r"[\[<>=!~ ]", requirement)[0].lower()


@pytest.mark.parametrize("package", OURS)
def test_a_package_needs_no_extra(package):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    core = {name(requirement) for requirement in project["dependencies"]}
    known = packages_distributions()
    for file in (ROOT / package).rglob("*.py"):
        for module in imported(file) - set(OURS) - CHECK - set(OPTIONAL) - sys.stdlib_module_names:
            assert core & {dist.lower() for dist in known.get(module, (module,))}, f"{file} imports {module}"


def test_it_would_be_seen(tmp_path):
    """Negative control: imports within functions count, and the test extra's packages are no core dependencies."""
    (tmp_path / "a.py").write_text("def f():\n    from hypothesis import given\n    import tests.oracle\n")
    assert imported(tmp_path / "a.py") == {"hypothesis", "tests"}
    assert "hypothesis" not in {name(r) for r in ("numpy>=2.0,<3", "threadpoolctl>=3.5")}
    assert name("ice-vision[dask]") == "ice-vision"


def test_what_a_command_may_say_is_known_before_anything_that_computes_is_loaded():
    """Help and refusals of options wait for no package but `scenes` and what reads pictures.

    Loading the others takes half a second.
    """
    modules = sorted({f"validation.cli.{module}" for module, _ in COMMANDS.values()})
    code = f"import sys, {', '.join(modules)}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"scenes", "validation"} <= set(loaded)
    assert {"imaging", "planner", "measure", "render", "scipy", "mitsuba", "matplotlib"} & set(loaded) == set()


@pytest.mark.parametrize("needed", ["measure", "validation.simulation", "validation.inspection"])
def test_measuring_waits_for_no_statistics_and_no_splines(needed: str):
    """`ice measure` of a scene loads neither; adjusting pictures together and calibrating do, when asked for."""
    code = f"import sys, {needed}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"scipy.special", needed} <= set(loaded)
    assert {"scipy.stats", "scipy.interpolate", "scipy.optimize", "measure.boards.camera"} & set(loaded) == set()


def test_what_is_loaded_later_is_all_there():
    import measure
    import planner

    for package in (measure, planner):
        assert set(package._LATER) <= set(package.__all__)
        assert all(callable(getattr(package, name)) for name in package.__all__ if name in package._LATER)
