"""``python -m tests.proofs form-poses``: forms in renders at random poses: do perfect features need what is told?

A plate with bores (`tests.toleranced`) is rendered at random poses and measured in many noisy images, with the bias
taken off that a simulation tells. The zone that a feature's points seem to need has the law of noise about what the
noise-free render leaves: its mean, and how many exceed its 95 % quantile, lie within chance (Sidak, 1 % over all rows),
and the value, from which is taken what noise adds, is on the mean within 0.3 sigma of 0. Chains of the numbers beside
have the variance that is told, and their own value.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy import stats

import measure
import render
from measure.known_bias import RENDERING
from scenes import Picture, Pose, Scene
from scenes.status import is_trusted
from tests import toleranced
from tests.proofs.corpus import chance
from tests.proofs.kinds import is_on_mean, pictures
from validation import simulation
from validation.remeasured import Method
from validation.statistics import sidak

_LEVEL = 0.01
_FEATURES = {"c2": "circle", "c4": "circle", "e4": "edge", "e5": "edge", "e8": "edge", "e15": "edge"}
_CHAINS = "mean", "sum", "largest", "smallest"  # of the diameters of two bores


@dataclass(frozen=True)
class Row:
    """Of a form or a chain in one picture: status, n good images, p values of mean and tail (of a chain its variance
    alone), and how far the mean value is off, sigma, beside what rays leave."""

    sensor: Pose
    name: str
    status: str
    count: int
    p: tuple[float, ...]
    off: float
    rays: float

    def is_told(self, tests: int) -> bool:
        """Whether all of it lies within chance, of so many tests."""
        return min(self.p) > sidak(_LEVEL, tests) and is_on_mean(self.off, self.rays, self.count)

    def __str__(self) -> str:
        pose, p = "({:.0f}, {:.0f})".format(*self.sensor), ", ".join(f"{each:.3f}" for each in self.p)
        return f"{pose:<11}{self.name:<18}{self.count:4} {self.status}  p {p}, mean {self.off:+.2f} sigma"


def scene(folder: Path) -> Scene:
    """A plate of which forms of bores and edges are asked, and chains of two diameters."""
    asked = [
        {"name": f"{kind} {place}", "kind": kind, "features": [{feature: place}], "tolerance": 0.2}
        for place, feature in _FEATURES.items()
        for kind in ("roundness" if feature == "circle" else "straightness", "profile")
    ]
    asked += [{"name": n, "kind": "diameter", "features": [{"circle": c}]} for n, c in (("B", "c2"), ("C", "c6"))]
    asked += [{"name": kind, "kind": kind, "of": ["B", "C"]} for kind in _CHAINS]
    small = {"width": 480, "height": 384, "focal_px": 1800.0}
    return toleranced.scene(folder, ("back",), **small).with_(measurands=asked)


def rows(picture: Picture, images: int, rng: np.random.Generator, seed: int) -> Iterator[Row]:
    """Of all that is `ok` in a picture's simulation."""
    off = simulation.simulated(picture, Method("gradient"))
    clean = render.image(picture, quality=render.Quality(seed=seed))
    noisy = render.expose(clean, picture.scene.noise, rng, images)
    found = measure.measure(noisy, picture, correction=off)
    told = measure.measure(clean, picture)
    for m, name in enumerate(found.names):
        good = is_trusted(found.status[:, m])
        if off.status[m] != "ok" or name in "BC" or good.sum() < images / 2:
            continue
        rays = float(np.hypot(off.sources[RENDERING][m], off.beside[m]) / off.sigma[m])
        value, true = found.value[good, m], float(found.nominal[m])
        if name in found.forms:
            p = _of_form([each for each, is_good in zip(found.forms[name], good, strict=True) if is_good],
                         told.forms[name][0])  # fmt: skip
        else:
            p = (chance(value.var(ddof=1) / off.sigma[m] ** 2, value.size),)
        yield Row(picture.sensor, name, off.status[m], value.size, p, (value.mean() - true) / off.sigma[m], rays)


def _of_form(found: list, clean) -> tuple[float, float]:
    """That the mean, and the share beyond the 95 % quantile, of sizes are those of noise about the clean points."""
    law, sizes = clean.law.of(clean.points), np.array([each.size for each in found])
    mean = 2 * stats.norm.sf(abs(sizes.mean() - law.mean) / (law.u / len(sizes) ** 0.5))
    return float(mean), float(stats.binomtest(int((sizes > law.quantile(0.95)).sum()), len(sizes), 0.05).pvalue)


def form_poses(
    poses: Annotated[int, typer.Option(help="Pictures.")] = 20,
    images: Annotated[int, typer.Option(help="Noisy images of each.")] = 100,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Forms and chains in renders at random poses; ten minutes."""
    rng, found = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as folder:
        for number, picture in enumerate(pictures(scene(Path(folder)), poses, rng), seed):
            for row in rows(picture, images, rng, number):
                print(row, flush=True)
                found.append(row)
    tests = sum(len(row.p) for row in found)
    wrong = [row for row in found if not row.is_told(tests)]
    print(f"of {len(found)} rows that are ok {len(found) - len(wrong)} are as told ({tests} tests)")
    for row in wrong:
        print(f"not: {row}")
    raise typer.Exit(1 if wrong or not found else 0)
