"""Which Mitsuba variant is safe on this machine: compiled with LLVM where that works, otherwise scalar.

Some releases of libLLVM load but abort the whole process in the first compilation, which no `try` can catch. So a
candidate is tried in a process of its own, with an operation that those releases cannot compile.
"""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scenes import InvalidInput

SCALAR = "scalar_rgb"
LLVM = "llvm_ad_mono"
OVERRIDE = "ICE_VARIANT"
_LIBRARY = "DRJIT_LIBLLVM_PATH"
_PLACES = (
    "usr/lib/*/libLLVM*.so*",
    "usr/lib/llvm-*/lib/libLLVM*.so*",
    "usr/lib64/libLLVM*.so*",
    "opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
)
_PROBE = f"""
import mitsuba, drjit
mitsuba.set_variant("{LLVM}")
from drjit.llvm import Float
assert list(drjit.minimum(Float(1, 2, 3), 2)) == [1, 2, 2]
"""


@functools.cache
def choose() -> str:
    """Name of the variant to render with; found once a process.

    The environment variable ICE_VARIANT overrides the choice. DRJIT_LIBLLVM_PATH, where set, is the only libLLVM
    that is tried; otherwise the newest installed one that passes.
    """
    if OVERRIDE in os.environ:
        return os.environ[OVERRIDE]
    if _LIBRARY in os.environ:
        return LLVM if _works(os.environ[_LIBRARY]) else SCALAR
    for library in _candidates():
        if _works(library):
            os.environ[_LIBRARY] = library
            return LLVM
    return SCALAR


@functools.cache
def use(name: str):
    """The mitsuba module with the named variant active.

    Raises
    ------
    InvalidInput
        If this build of Mitsuba lacks the variant, or it cannot be activated here.
    """
    with _silent():
        import mitsuba

    if name not in mitsuba.variants():
        raise InvalidInput(f"{OVERRIDE} must be one of {', '.join(mitsuba.variants())}, got {name!r}")
    try:
        with _silent():
            mitsuba.set_variant(name)
    except ImportError as error:
        raise InvalidInput(
            f"{OVERRIDE} must be a variant that works here, got {name!r} ({str(error).splitlines()[0]})"
        ) from None
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


@contextmanager
def _silent() -> Iterator[None]:
    """Keep the native libraries' remarks about a missing libLLVM off standard error; errors are raised all the same."""
    sys.stderr.flush()
    saved = os.dup(2)
    with Path(os.devnull).open("wb") as sink:
        os.dup2(sink.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)


def _candidates() -> list[str]:
    """Installed libLLVM files, the newest first."""
    found = {os.path.realpath(path) for place in _PLACES for path in Path("/").glob(place)}
    return sorted(found, key=_release, reverse=True)


def _release(path: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", Path(path).name))


def _works(library: str) -> bool:
    """Whether a separate process can compile and run with this libLLVM."""
    environment = {**os.environ, _LIBRARY: library}
    try:
        probe = subprocess.run([sys.executable, "-c", _PROBE], env=environment, capture_output=True, timeout=120)
    except subprocess.TimeoutExpired:
        return False
    return probe.returncode == 0
