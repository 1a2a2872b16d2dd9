"""How long a measurement of costs may take, and that it tells of going on."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

AT_ONCE = 1 << 23  # pixels of noisy pictures in memory


@dataclass(frozen=True)
class Watch:
    """Seconds that may be taken from now on, and a function that is called between samples.

    Examples
    --------
    >>> list(Watch(0.0).samples(10, least=2))
    [0, 1]
    """

    seconds: float = float("inf")
    tell: Callable[[], None] = lambda: None
    began: float = field(default_factory=time.perf_counter)

    def samples(self, most: int, least: int) -> Iterator[int]:
        """0, 1, ... below ``most`` until the time is over, but at least so many."""
        for done in range(most):
            self.tell()
            if done >= least and self.left <= 0:
                return
            yield done

    @property
    def left(self) -> float:
        """Seconds."""
        return self.seconds - (time.perf_counter() - self.began)


def at_once(pixels: int, most: int) -> int:
    """How many pictures of so many pixels are in memory at a time."""
    return max(1, min(most, AT_ONCE // pixels))
