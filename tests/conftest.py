import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is loaded: each of the tests' processes has one core

import numpy as np
import pytest

import scenes


@pytest.fixture(scope="session")
def task1():
    return scenes.load("task1")


@pytest.fixture
def rng():
    return np.random.default_rng(20261121)
