"""What a compiled variant of the renderer gains: ``python -m tests.benchmarks.variants [SCENE ...]``.

Each variant that works here draws the noise-free picture of each scene's first setting in a process of its own, by the
clock: the first picture, with compilation, and the median of those after it. Beside it how far it is from the scalar
one, in standard deviations of a pixel's noise; no test, for times are machines'.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import render
import scenes
from imaging import sensor
from render import variant as variants
from scenes import Picture

SCENES = "task1", "bracket_mm", "shaft", "flange", "glossy_metal"
_AGAIN = 3
_NVIDIA = Path("/dev/nvidiactl")  # what its driver makes


def drawn(name: str) -> tuple[np.ndarray, Picture, list[float]]:
    """A scene's picture, and seconds by the clock of each time that it was drawn."""
    scene = scenes.load(name)
    there = scene.settings[0]
    picture, seconds = Picture.of(scene, there.sensor, there.light), []
    for _ in range(1 + _AGAIN):
        start = time.perf_counter()
        image = render.image(picture)
        seconds.append(time.perf_counter() - start)
    return image, picture, seconds


def _one(name: str, path: Path) -> None:
    """The picture into a file, its times printed."""
    image, _, seconds = drawn(name)
    np.save(path, image)
    print(*seconds)


def _other(name: str, variant: str, path: Path) -> tuple[np.ndarray, list[float]]:
    """Of a variant, in a process of its own: one that aborts takes nothing along."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.variants", "--one", name, str(path)],
        env={**os.environ, variants.OVERRIDE: variant},
        capture_output=True,
        text=True,
        check=True,
    )
    return np.load(path), [float(each) for each in done.stdout.split()]


def available() -> list[str]:
    """Variants that work here, the scalar one first."""
    llvm = variants.choose() == variants.LLVM or any(map(variants._works, variants._candidates()))
    return [variants.SCALAR, *[variants.LLVM] * llvm, *[variants.CUDA] * _NVIDIA.exists()]


def main(names: list[str]) -> None:
    """The table."""
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            first, there = None, scenes.load(name).settings[0]
            picture = Picture.of(scenes.load(name), there.sensor, there.light)
            for variant in available():
                image, seconds = _other(name, variant, Path(folder) / "image.npy")
                first = image if first is None else first
                off = (image - first) / np.sqrt(sensor.recorded(picture.scene.noise, first).noise_variance)
                print(
                    f"{name:<13}{image.shape[1]:5d} x {image.shape[0]:<5d}{variant:<14}first {seconds[0]:6.2f} s   "
                    f"again {np.median(seconds[1:]):6.2f} s   off scalar {np.sqrt(np.mean(off**2)):.4f} sigma",
                    flush=True,
                )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        _one(sys.argv[2], Path(sys.argv[3]))
    else:
        main(sys.argv[1:] or list(SCENES))
