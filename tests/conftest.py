import os
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is loaded: each of the tests' processes has one core

import numpy as np
import pytest

import scenes

_CACHE = tempfile.TemporaryDirectory(prefix="ice-vision-")
os.environ["XDG_CACHE_HOME"] = _CACHE.name  # nothing that a user has kept is read, or written
collect_ignore = ["outside"]  # imported, its modules add kinds for all tests of a process

_LONG = [
    line.split(maxsplit=1)[1]
    for line in Path(__file__).with_name("long.txt").read_text().splitlines()
    if line[0] != "#"
]


def pytest_collection_modifyitems(config, items):
    """Mark what `long.txt` names; a name in it that is no test is an error where all tests are collected."""
    there = {item.nodeid: item for item in items}
    for name in _LONG:
        if name in there:
            there[name].add_marker("long")
        elif config.args == config.getini("testpaths"):
            raise pytest.UsageError(f"tests/long.txt must name tests, got {name!r}")


@pytest.fixture(scope="session")
def task1():
    return scenes.load("task1")


@pytest.fixture(scope="session")
def small_task1(task1):
    """At 96 x 90 px, where nearly every edge has a neighbour."""
    camera = task1.camera.model_copy(update={"width": 96, "height": 90, "focal_px": 300.0})
    return task1.model_copy(update={"camera": camera})


@pytest.fixture
def rng():
    return np.random.default_rng(20261121)
