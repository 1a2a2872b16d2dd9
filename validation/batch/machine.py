"""Which machine a run's numbers are made on: what decides their last digits, and what else its report tells."""

from __future__ import annotations

import importlib
import platform
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_info

from validation.batch import pool

_EMBREE = {
    "sse4_2": "SSE4.2",
    "avx": "AVX",
    "avx2": "AVX2",
    "avx512vl": "AVX512",
}  # its kernels, by what a processor has
_LAST_DIGITS = ("processor", "numpy", "blas", "embree")


def here() -> dict[str, str | int]:
    """This machine: processor, the instruction sets that NumPy and Embree take on it, BLAS kernels, system, cores."""
    name, flags = _processor()
    core: Any = importlib.import_module("numpy._core._multiarray_umath")  # what np.show_runtime() prints
    taken = [each for each in core.__cpu_baseline__ + core.__cpu_dispatch__ if core.__cpu_features__.get(each)]
    kernels = [library.get("architecture", "") for library in threadpool_info() if library["user_api"] == "blas"]
    return {
        "processor": name,
        "numpy": taken[-1] if taken else "",
        "blas": " ".join(sorted({*filter(None, kernels)})),
        "embree": next((said for flag, said in reversed(_EMBREE.items()) if flag in flags), ""),
        "system": platform.platform(),
        "python": platform.python_version(),
        "cores": pool.cores(),
    }


def same(one: dict, other: dict) -> bool:
    """Whether both give the same numbers to the last bit."""
    return all(one.get(key) == other.get(key) for key in _LAST_DIGITS)


def named(machine: dict) -> str:
    """What decides the last digits, in words."""
    return ", ".join(f"{key} {machine[key]}" for key in _LAST_DIGITS if machine.get(key))


def _processor() -> tuple[str, set[str]]:
    """Its name, and the names of its instruction sets where the system tells them."""
    try:
        lines = [line.partition(":") for line in Path("/proc/cpuinfo").read_text().splitlines()]
    except OSError:
        return platform.processor() or platform.machine(), set()
    told = {key.strip(): value.strip() for key, _, value in reversed(lines)}
    return told.get("model name") or platform.machine(), set(told.get("flags", "").split())
