"""python -m tests.machines [--all] [arguments of pytest]: the tests on other processors than this one.

Each pass has the environment of another machine: OpenBLAS's kernels and threads, the instruction sets that NumPy,
OpenCV and the C library may take, and Embree's. Only what this processor has can be left out, so newer ones try more.
Without --all the passes are two, of the tests in machines.txt, long ones too; with it they are four, of all that
`make test` runs.

Embree takes the best that the processor has, for Mitsuba gives it a fixed configuration: libmitsuba.so holds the text
"threads=%i,user_threads=%i". Here it is another one in a copy, found by LD_LIBRARY_PATH; what Embree says it uses is
checked.
"""

import argparse
import importlib
import importlib.util
import os
import platform
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

PART = [line for line in Path(__file__).with_name("machines.txt").read_text().splitlines() if line[0] != "#"]
_SAID = {"Prescott": "Katmai"}  # by OpenBLAS, of the same kernels
_TEXT = b"threads=%i,user_threads=%i"
_LOOK = """
import threadpoolctl, mitsuba, scipy.linalg
from validation.batch import machine
mitsuba.set_variant("scalar_rgb")
mitsuba.load_dict({"type": "scene", "shape": {"type": "cube"}})
print("found:", {one["num_threads"] for one in threadpoolctl.threadpool_info()}, machine.here())
"""


@dataclass(frozen=True)
class Machine:
    """Names as the libraries have them: an OpenBLAS core, its threads, how many of NumPy's dispatched levels are kept,
    Embree's and OpenCV's instruction sets, and what the C library does without."""

    name: str
    core: str
    threads: int
    levels: int
    embree: str
    without: str
    without_libc: str

    def environment(self, folder: Path) -> dict[str, str]:
        """With Mitsuba's libraries in that folder."""
        tunables = f"glibc.cpu.hwcaps={self.without_libc}" if self.without_libc else ""
        own = {
            "OPENBLAS_CORETYPE": self.core, "OPENBLAS_NUM_THREADS": self.threads, "OMP_NUM_THREADS": self.threads,
            "OPENBLAS_THREAD_TIMEOUT": 10,  # idle threads sleep at once, for there are more of them than cores
            "NPY_DISABLE_CPU_FEATURES": " ".join(dispatched()[self.levels :]), "OPENCV_CPU_DISABLE": self.without,
            "GLIBC_TUNABLES": tunables, "LD_LIBRARY_PATH": folder,
        }  # fmt: skip
        return os.environ | {name: str(value) for name, value in own.items() if value}

    @property
    def configuration(self) -> bytes:
        """Of Embree, as Mitsuba hands it on."""
        return f"isa={self.embree},threads=%i".encode() if self.embree else _TEXT


_NO_512, _NO_AVX = "AVX512-SKX", "AVX,FP16,AVX2,AVX512-SKX"
_LIBC_512, _LIBC_AVX = "-AVX512F,-AVX512VL,-AVX512BW", "-AVX,-AVX2,-FMA,-AVX512F,-AVX512VL,-AVX512BW"
OLD = Machine("old", "Prescott", 1, 0, "sse4.2", _NO_AVX, _LIBC_AVX)
HASWELL = Machine("Haswell", "Haswell", 2, 1, "avx2", _NO_512, _LIBC_512)
SANDY = Machine("Sandy Bridge", "Sandybridge", 2, 0, "avx", _NO_512 + ",AVX2", _LIBC_512 + ",-AVX2,-FMA")
THIS = Machine("this, with two threads", "", 2, 99, "", "", "")
KERNELS = Machine("this, with the old one's matrix products", "Prescott", 1, 99, "", "", "")


def dispatched() -> list[str]:
    """NumPy's names of the instruction sets that it takes here and could do without."""
    core = importlib.import_module("numpy._core._multiarray_umath")
    return [name for name in core.__cpu_dispatch__ if core.__cpu_features__[name]]


def libraries(folder: Path, configuration: bytes) -> Path:
    """A folder with Mitsuba's libraries, whose Embree has another configuration."""
    folder.mkdir()
    for file in Path(importlib.util.find_spec("mitsuba").origin).parent.iterdir():
        if file.name == "libmitsuba.so":
            before, _, after = file.read_bytes().partition(_TEXT)
            (folder / file.name).write_bytes(before + configuration.ljust(len(_TEXT), b"\0") + after)
        else:
            (folder / file.name).symlink_to(file)
    return folder


def check(machine: Machine, folder: Path) -> None:
    """Say what the libraries take; stop if it is not what they were told."""
    told = f"isa={machine.embree},verbose=1".encode() if machine.embree else b"verbose=1"
    environment = machine.environment(libraries(folder, told))
    text = subprocess.run(
        [sys.executable, "-c", _LOOK], env=environment, text=True, capture_output=True, check=True
    ).stdout
    lines = [line.split(":", 1)[1].strip() for line in text.splitlines() if line.strip().startswith(("ISA", "found"))]
    embree, found = lines[1:]  # the first tells of the processor
    print(f"{machine.name}: {found}; Embree: {embree}", flush=True)
    kernels = _SAID.get(machine.core, machine.core)
    right = machine.embree.upper() in embree.split() and f"'{kernels}'" in found and f"{{{machine.threads}}}" in found
    if machine is not THIS and not right:
        raise SystemExit(f"{machine.name}: the libraries must take what they are told, got {embree}, {found}")


def passes(machine: Machine, arguments: list[str]) -> int:
    """The exit status of the tests on that machine."""
    with tempfile.TemporaryDirectory() as directory:
        check(machine, Path(directory, "verbose"))
        environment = machine.environment(libraries(Path(directory, "mitsuba"), machine.configuration))
        command = ["-m", "pytest", "-q", "-n", "2", "--dist", "worksteal", "-p", "no:cacheprovider", *arguments]
        return subprocess.run([sys.executable, *command], env=environment).returncode


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--all", action="store_true", help="all tests, and more machines")
    chosen, arguments = parser.parse_known_args()
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        print("other processors can be taken for this one on Linux on x86_64 only")
        return 0
    machines = (OLD, HASWELL, SANDY, THIS) if chosen.all else (OLD, HASWELL)
    failed = [
        machine.name
        for machine in machines
        if passes(machine, arguments or (["-m", "not long"] if chosen.all else PART))
    ]
    print(f"failed on: {', '.join(failed)}" if failed else f"passed on {len(machines)} machines")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
