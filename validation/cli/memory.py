"""Memory of a command: what is freed is kept for what comes next, and seldom looked for."""

from __future__ import annotations

import ctypes
import gc
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # parameters of glibc's mallopt
_KEPT = 1 << 30  # bytes
_NEW = 10_000  # objects


def keep_freed() -> None:
    """Let freed memory stay with the process, where the C library is glibc: up to a GiB, and of arrays up to that size.

    Images of megapixels come and go. The system clears each page that it gives out: a tenth of the first measurement
    of a picture of 5 megapixels.
    """
    change = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if change is not None:
        change(_TRIM_THRESHOLD, _KEPT)
        change(_MMAP_THRESHOLD, _KEPT)


def collect_seldom() -> None:
    """Look for objects that only keep each other after 10,000 new ones: Python does after 700 (2,000 from 3.13 on).

    What a command loads are hundreds of thousands, which all stay.
    """
    gc.set_threshold(_NEW)


def leave_all() -> None:
    """Leave everything to the end of the process: Python would look through all that was loaded once more."""
    gc.freeze()
