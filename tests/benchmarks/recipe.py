"""How long a recipe takes a picture: ``python -m tests.benchmarks.recipe FOLDER ...`` of folders by `ice export`.

Whole numbers of 8 bits with noise, one core: wall time, and processor time, which tells more where others work, too.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from validation.recipe.runtime import Recipe

_TIMES = 1000


def _milliseconds(function: Callable[[], object], clock: Callable[[], float]) -> tuple[float, float]:
    """The least and the median of some calls."""
    taken = []
    for _ in range(_TIMES):
        begun = clock()
        function()
        taken.append(1e3 * (clock() - begun))
    return min(taken), float(np.median(taken))


def measured(folder: Path) -> str:
    """A line: preparation, then the least and the median of pictures."""
    begun = time.process_time()
    recipe, example = Recipe.load(folder / "data"), np.load(folder / "example.npy")
    noisy = example + np.random.default_rng(0).normal(0, np.sqrt(recipe.sensor.noise_variance), example.shape)
    image = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    recipe.measure(image)
    prepared = time.process_time() - begun
    wall, own = (
        _milliseconds(lambda: recipe.measure(image), clock) for clock in (time.perf_counter, time.process_time)
    )
    names = len(recipe.values)
    return (
        f"{folder.name}: {names} values, {len(recipe.pixels)} pixels, prepared in {prepared:.1f} s; a picture: "
        f"{wall[0]:.2f} ms at least, {wall[1]:.2f} ms median; of the processor {own[0]:.2f}, {own[1]:.2f} ms"
    )


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(measured(Path(name).resolve()), flush=True)
