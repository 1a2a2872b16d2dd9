"""Time and memory of `ice measure PHOTO` on photographs of 5 megapixels.

    python -m tests.benchmarks.photograph [NAME ...]

Makes the pictures (2592 x 1944 px) and runs the whole command for each, a process of its own, with ``--json`` and with
an overlay (``-o``) beside: processor time (user and system), wall time, the largest resident memory, and the statuses;
before these the library alone, once it is loaded. Modules are compiled first, as at an installation.
The limit is 2 s of wall time on a machine that does nothing else, and 500 MiB; NAME picks pictures by the beginnings
of their names.
"""

from __future__ import annotations

import compileall
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from tests.oracle import polygon_image

ROOT = Path(__file__).parents[2]
WIDTH, HEIGHT = 2592, 1944
DARK, STEP = 40.0, 140.0
_CORNERS = np.array([[0.20, 0.22], [0.83, 0.18], [0.79, 0.85], [0.17, 0.77]])
_TILE = 24  # px


class Cost(NamedTuple):
    """Of one run: processor and wall time, s, largest resident memory, MiB, exit status, what is said of each shape."""

    processor: float
    wall: float
    memory: float
    code: int
    said: tuple[str, ...]


def plate(scale: int = 1, blur: float = 0.8, parts: tuple[int, int] = (1, 1)) -> np.ndarray:
    """Quadrilaterals in rows and columns, blurred by so many px, in a picture ``scale`` times smaller: exact levels."""
    width, height = WIDTH // scale, HEIGHT // scale
    levels, cell = np.full((height, width), DARK, np.float32), np.array([width, height]) / parts[::-1]
    for place in np.ndindex(parts):
        _draw(levels, (_CORNERS + place[::-1]) * cell, blur)
    return levels


def _draw(levels: np.ndarray, corners: np.ndarray, blur: float) -> None:
    """A quadrilateral, in place: exact in the tiles that its blurred sides touch, for the oracle takes its time."""
    outline = corners.astype(np.float32)
    low, high = corners.min(0).astype(int) // _TILE, corners.max(0).astype(int) // _TILE
    for column in range(low[0] - 1, high[0] + 2):
        for row in range(low[1] - 1, high[1] + 2):
            first = _TILE * np.array([column, row])
            part = levels[first[1] : first[1] + _TILE, first[0] : first[0] + _TILE]
            away = cv2.pointPolygonTest(outline, (first + _TILE / 2).tolist(), True)
            if abs(away) < _TILE + 9 * blur:
                here = _within(corners - first, _TILE + 9 * blur)
                part[:] = polygon_image(here, part.shape, blur, STEP, DARK) if len(here) else DARK
            elif away > 0:
                part[:] = DARK + STEP


def _within(corners: np.ndarray, most: float) -> np.ndarray:
    """What of a convex polygon (k, 2) has both coordinates between ``-most`` and ``most``: its corners, or none."""
    for normal in ([1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]):
        inside, kept = most - corners @ normal, []
        for i in range(len(corners)):
            if inside[i - 1] * inside[i] < 0:
                share = inside[i - 1] / (inside[i - 1] - inside[i])
                kept.append(corners[i - 1] + share * (corners[i] - corners[i - 1]))
            if inside[i] >= 0:
                kept.append(corners[i])
        corners = np.reshape(kept, (-1, 2))
    return corners


def noisy(clean: np.ndarray, sigma: float = 2.0) -> np.ndarray:
    """With white noise of so many grey levels."""
    return clean + np.random.default_rng(1).normal(0, sigma, clean.shape).astype(np.float32)


def enlarged() -> np.ndarray:
    """A picture of 648 x 486 px, four times larger and blurred, so that neighbours share noise."""
    large = cv2.resize(noisy(plate(4)), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return cv2.GaussianBlur(large, (0, 0), 2.0)


def colour() -> np.ndarray:
    """Blue, green and red, each with noise of its own."""
    channels = [noisy(share * plate()) for share in (0.8, 1.0, 0.9)]
    return np.stack([np.roll(part, i, 0) for i, part in enumerate(channels)], -1)


PICTURES: dict[str, tuple[Callable[[], np.ndarray], str]] = {
    "plain": (lambda: noisy(plate()), "png"),
    "colour": (colour, "png"),
    "jpeg": (lambda: noisy(plate()), "jpg"),
    "noise-10": (lambda: noisy(plate(), 10.0), "png"),
    "blurred": (lambda: noisy(plate(blur=2.0)), "png"),
    "smoothed": (lambda: cv2.GaussianBlur(noisy(plate(blur=0.6), 4.0), (0, 0), 1.0), "png"),
    "enlarged": (enlarged, "png"),
    "enlarged-sharp": (lambda: cv2.resize(noisy(plate(4)), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC), "png"),
    "four": (lambda: noisy(plate(parts=(2, 2))), "png"),
}


def cost(photo: Path, *options: str) -> Cost:
    """Of ``ice measure`` with a photograph, in a process of its own."""
    command = [sys.executable, "-m", "validation.cli", "measure", str(photo), "--json", *options]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as wrong:
        begun = time.perf_counter()
        process = subprocess.Popen(command, stdout=out, stderr=wrong, env={**os.environ, **threads})
        _, state, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begun
        process.returncode = os.waitstatus_to_exitcode(state)
        out.seek(0)
        said = _statuses(out.read())
    return Cost(used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1024, process.returncode, said)


_ALONE = """
import sys, time
from pathlib import Path
import measure
from scenes.photograph import read
begun = time.process_time(), time.perf_counter()
measure.photograph(read(Path(sys.argv[1])))
print(time.process_time() - begun[0], time.perf_counter() - begun[1])
"""


def alone(photo: Path) -> tuple[float, ...]:
    """Processor and wall time of reading and measuring a photograph by the library, once that is loaded, s."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    command = [sys.executable, "-c", _ALONE, str(photo)]
    told = subprocess.run(command, capture_output=True, check=True, env={**os.environ, **threads}).stdout
    return tuple(map(float, told.split()))


def _statuses(told: bytes) -> tuple[str, ...]:
    """Of each shape in a command's JSON; nothing where there is none."""
    shapes = json.loads(told)["found"] if told.strip() else []
    return tuple(f"{each['kind']}: {each['status']}" for each in shapes)


def main(names: list[str]) -> None:
    """Print a row for each picture and each way."""
    for package in ("measure", "planner", "scenes", "validation"):
        compileall.compile_dir(ROOT / package, quiet=1)
    wanted = [name for name in PICTURES if not names or any(name.startswith(each) for each in names)]
    print(f"{'picture':<16}{'':<8}{'processor s':>12}{'wall s':>8}{'MiB':>6}  shapes")
    with tempfile.TemporaryDirectory() as directory:
        for name in wanted:
            make, ending = PICTURES[name]
            photo = Path(directory) / f"{name}.{ending}"
            cv2.imwrite(str(photo), np.clip(np.rint(make()), 0, 255).astype(np.uint8))
            print("{:<16}{:<8}{:12.2f}{:8.2f}".format(name, "library", *alone(photo)), flush=True)
            for way, options in (("--json", ()), ("-o", ("-o", str(photo.with_suffix(".o.png"))))):
                one = cost(photo, *options)
                said = ", ".join(one.said) or f"none, exit status {one.code}"
                print(f"{name:<16}{way:<8}{one.processor:12.2f}{one.wall:8.2f}{one.memory:6.0f}  {said}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
