"""A file of the user's own by the name of one of the packages is named, not stumbled over."""

import subprocess
import sys
from pathlib import Path

import pytest

import ice_vision
import scenes

PACKAGES = ("scenes", "imaging", "planner", "render", "measure", "validation")
ROOT = Path(scenes.__file__).parents[1]


@pytest.mark.parametrize(
    ("wanted", "own"),
    [("planner", "scenes"), ("measure", "scenes"), ("validation", "measure"), ("validation", "render")],
)
def test_a_script_beside_a_file_of_that_name_reads_both_names(wanted, own, tmp_path):
    (tmp_path / f"{own}.py").write_text("mine = 1\n")
    (tmp_path / "script.py").write_text(f"import sys\nsys.path.append({str(ROOT)!r})\nimport {wanted}\n")
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    last = done.stderr.strip().splitlines()[-1]
    assert last == (
        f"ImportError: {own} must be {ROOT / own / '__init__.py'}, got {tmp_path / f'{own}.py'}, "
        "which stands before it on Python's path: rename it"
    )


def test_the_packages_themselves_are_let_in():
    ice_vision.check(scenes.__file__, *PACKAGES)


@pytest.mark.parametrize("name", PACKAGES)
def test_type_checkers_read_the_packages(name):
    assert (ROOT / name / "py.typed").exists()
