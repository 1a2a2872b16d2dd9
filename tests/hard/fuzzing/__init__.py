"""Hostile input by the thousand, at every door: ``python -m tests.hard.fuzzing [--count 20000] [--seed 1]``."""

from tests.hard.fuzzing.run import MOST_MEMORY, Findings, peak_memory, run

__all__ = ["MOST_MEMORY", "Findings", "peak_memory", "run"]
