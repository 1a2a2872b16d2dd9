"""Feed the doors. Each try ends in an answer, or is refused in one line; anything else, a warning too, is a finding.

What is refused is refused within five seconds of the processor, an answer takes at most a minute of it, and memory
stays below 1 GiB.
"""

from __future__ import annotations

import resource
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scenes import InvalidInput
from tests.hard.fuzzing.doors import DOORS, Room

MOST_SECONDS, MOST_REFUSED = 60, 5
MOST_MEMORY = 2**30


@dataclass
class Findings:
    """How often what came out, and every failure (try's number, what went wrong)."""

    outcomes: Counter = field(default_factory=Counter)
    failures: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0
    slowest_refused: float = 0.0
    memory: int = 0

    def __add__(self, other: Findings) -> Findings:
        return Findings(
            self.outcomes + other.outcomes,
            self.failures + other.failures,
            max(self.slowest, other.slowest),
            max(self.slowest_refused, other.slowest_refused),
            max(self.memory, other.memory),
        )


class _TooSlow(BaseException):
    """Not an Exception, so that nothing in between catches it."""


def run(count: int, seed: int, folder: Path, first: int = 0, step: int = 1) -> Findings:
    """Make the tries ``first``, ``first + step``, ... below ``count``; each depends on seed and number alone."""
    found, room = Findings(), Room(folder)
    signal.signal(signal.SIGALRM, _stop)
    signal.signal(signal.SIGPROF, _stop)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "Glyph .* missing")  # of a figure's font
        for number in range(first, count, step):
            _try(found, room, number, seed)
    found.memory = peak_memory()
    return found


def part(count: int, seed: int, first: int, step: int) -> Findings:
    """Every ``step``-th try, in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        return run(count, seed, Path(folder), first, step)


def _try(found: Findings, room: Room, number: int, seed: int) -> None:
    rng, feed = np.random.default_rng([seed, number]), DOORS[number % len(DOORS)]
    began, refused = time.process_time(), False
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    signal.alarm(10 * MOST_SECONDS)  # for what waits and does not work
    try:
        found.outcomes[f"{feed.__name__}: {feed(rng, room)}"] += 1
    except InvalidInput as error:
        refused = True
        found.outcomes[f"{feed.__name__}: refused"] += 1
        if "\n" in str(error) or " must " not in str(error) or len(str(error)) > 1300:
            found.failures.append((number, f"not one line of what must be: {str(error)[:300]!r}"))
    except (Exception, _TooSlow) as error:
        found.failures.append((number, f"{feed.__name__}: {type(error).__name__}: {str(error)[:300]}"))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.alarm(0)
    spent = time.process_time() - began
    found.slowest = max(found.slowest, spent)
    if refused:
        found.slowest_refused = max(found.slowest_refused, spent)
        if spent > MOST_REFUSED:
            found.failures.append((number, f"{feed.__name__}: refused after {spent:.1f} s"))


def _stop(*_) -> None:
    raise _TooSlow(f"more than {MOST_SECONDS} s")


def peak_memory() -> int:
    """Most memory that this process ever had, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
