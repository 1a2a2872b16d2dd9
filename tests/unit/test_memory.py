"""Memory that a command frees stays with its process."""

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
