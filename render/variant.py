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
CUDA = "cuda_ad_mono"
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

    The environment variable ICE_VARIANT overrides the choice. CUDA is taken only where that names it: a limb beside an
    arc was 278 sigma off with it, for a reason that is not known.
    DRJIT_LIBLLVM_PATH, where set, is the only libLLVM that is tried; otherwise the newest installed one that passes.
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


def use(name: str):
    """The mitsuba module with the named variant active, whichever was before.

    Raises
    ------
    InvalidInput
        If Mitsuba cannot be loaded, its build lacks the variant, or it cannot be activated here.
    """
    mitsuba = _loaded()
    if name not in mitsuba.variants():
        raise InvalidInput(f"{OVERRIDE} must be one of {', '.join(mitsuba.variants())}, got {name!r}")
    if mitsuba.variant() == name:
        return mitsuba
    try:
        with _silent():
            mitsuba.set_variant(name)
    except ImportError as error:
        raise InvalidInput(
            f"{OVERRIDE} must be a variant that works here, got {name!r} ({str(error).splitlines()[0]})"
        ) from None
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


def _loaded():
    """The module; where a library of the system is missing, libatomic on some, Dr.Jit ends in a NameError."""
    try:
        with _silent():
            import mitsuba
    except (ImportError, NameError) as error:
        cause = error.__cause__ or error.__context__ or error
        raise InvalidInput(f"mitsuba must be loadable, got {str(cause).splitlines()[0]} (see README)") from None
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
    """Whether a separate process can compile and run with this libLLVM; not where there is no such file."""
    if Path(library).is_absolute() and not Path(library).exists():
        return False
    return _runs(_PROBE, {**os.environ, _LIBRARY: library})


def _runs(code: str, environment: dict[str, str]) -> bool:
    """Whether a separate process runs the code to its end; an abort there does no harm here."""
    try:
        probe = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, timeout=120)
    except subprocess.TimeoutExpired:
        return False
    return probe.returncode == 0
