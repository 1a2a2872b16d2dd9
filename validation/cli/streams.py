"""Standard streams that anything can be printed to, whatever the caller has made of them."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def make_usable() -> None:
    """A closed stream becomes one that swallows all; what a stream's encoding lacks is printed as its escape.

    Whoever closes standard output wants nothing printed, and a file that is opened later must not take its place.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115 - until the process ends
        elif mode == "w" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
