"""Print what came out; exit status 1 if anything was found."""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import reduce
from operator import add

from tests.hard.fuzzing.run import MOST_MEMORY, part


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    began = time.perf_counter()
    parts = 10 * asked.workers + 1  # so that the doors' turns are shared out
    with ProcessPoolExecutor(asked.workers, multiprocessing.get_context("spawn")) as executor:
        waiting = [executor.submit(part, asked.count, asked.seed, first, parts) for first in range(parts)]
        found = reduce(add, (future.result() for future in waiting))
    for number, problem in sorted(found.failures):
        print(f"try {number}: {problem}")
    for outcome, times in sorted(found.outcomes.items()):
        print(f"{times:7d}  {outcome}")
    seconds = time.perf_counter() - began
    print(
        f"{asked.count} tries in {seconds:.0f} s, the slowest {found.slowest:.1f} s, if refused "
        f"{found.slowest_refused:.1f} s; peak {found.memory / 2**20:.0f} MiB"
    )
    print(f"{len(found.failures)} findings")
    sys.exit(bool(found.failures) or found.memory > MOST_MEMORY)


if __name__ == "__main__":
    main()
