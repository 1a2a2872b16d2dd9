"""Does this code still measure what it measured when the reference was stored? `make reference` stores a new one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scenes.load import BUNDLED
from validation import comparison

pytestmark = pytest.mark.render

REFERENCE = Path(__file__).with_name("reference.json")


def ice(*arguments):
    """With the variant of the reference: the rays of another one shift the means by some 0.005 px."""
    environment = {**os.environ, "ICE_VARIANT": comparison.read(REFERENCE)["variant"]}
    command = [sys.executable, "-m", "validation.cli", *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)


def compare_with_reference(campaign, directory):
    """What ``ice compare`` says of a new run."""
    made = ice("validate", campaign, "--renders", 250, "--seed", 1, "--workers", 1, "--out", directory)
    assert made.returncode in (0, 1), made.stderr
    return ice("compare", REFERENCE, directory)


def test_nothing_has_changed_beyond_chance(tmp_path):
    done = compare_with_reference(REFERENCE.with_suffix(".toml"), tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    settings = comparison.read(REFERENCE)["settings"]
    assert [row["n"] - row["failed"] for row in settings] == [500] * 4  # the reference itself measured something


def test_a_worse_sensor_is_noticed(tmp_path):
    """Negative control: noise 1.25 x larger."""
    (tmp_path / "task1.toml").write_text((BUNDLED / "task1.toml").read_text().replace("sigma = 2.4", "sigma = 3.0"))
    text = REFERENCE.with_suffix(".toml").read_text().replace('scenes = ["task1"]', 'scenes = ["task1.toml"]')
    (tmp_path / "worse.toml").write_text(text)
    done = compare_with_reference(tmp_path / "worse.toml", tmp_path / "run")
    assert done.returncode == 1
    assert "gradient: variance" in done.stdout
