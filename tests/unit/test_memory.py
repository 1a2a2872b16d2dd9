"""Memory that a command frees stays with its process, and is seldom looked for."""

import subprocess
import sys

import pytest

COUNTED = """
import resource

import numpy as np

from validation.cli.memory import keep_freed

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        np.ones(8 << 20)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

plain = faults()
keep_freed()
faults()
print(plain, faults())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="glibc alone is told")
def test_arrays_that_come_and_go_have_the_same_pages():
    """Ten of 64 MiB, one after the other: the system gives out pages of 2 MiB at most, each cleared."""
    told = subprocess.run([sys.executable, "-c", COUNTED], capture_output=True, text=True, check=True)
    plain, kept = map(int, told.stdout.split())
    assert plain >= 10 * 32
    assert kept < plain / 10


LOOKED = """
import contextlib, gc, io, sys

looks = []
gc.callbacks.append(lambda phase, facts: looks.append(facts["generation"]) if phase == "stop" else None)
from validation.cli.main import main

sys.argv = ["ice", "scenes"]
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    main()
print(len(looks), gc.get_freeze_count(), len(gc.get_objects()))
"""


def test_what_a_command_loads_is_seldom_looked_through():
    """Nor at its end, when nothing of it is left to look through."""
    told = subprocess.run([sys.executable, "-c", LOOKED], capture_output=True, text=True, check=True)
    looks, frozen, left = map(int, told.stdout.split())
    assert looks < 200  # 309 without, of Python 3.11
    assert frozen > 50_000
    assert left < frozen / 10
