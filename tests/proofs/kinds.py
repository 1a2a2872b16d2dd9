"""``python -m tests.proofs kinds``: do kinds of measurands scatter as propagated, and is their mean the part's own?

A plate with bores and a slot (`tests.toleranced`) is rendered at random poses; of each picture all kinds and features
between others are measured at once, in many noisy images, with the bias taken off that a simulation tells. Measured
over propagated variance has to lie in its interval of 99 % over all rows (Sidak), the mean within 0.3 sigma of the
plate's own value, beyond what rays leave; 1.3 times the variance is refused. Sizes of zones, whose law is not normal,
are compared as laws: of their probabilities under what is told, a Kolmogorov-Smirnov test.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy import stats

import measure
import render
from measure.known_bias import RENDERING
from planner.uncertainty.zones import ZoneSize
from scenes import Picture, Pose, Scene
from scenes.status import is_trusted
from tests import toleranced
from validation import simulation
from validation.remeasured import Method
from validation.statistics import sidak

MOST_OFF = 0.3  # sigma
CONTROL = 1.3  # times the propagated variance, which has to be refused
_SEEDS = 1000  # renders that are measured begin here, simulations at 0
_LEVEL = 0.01
_MOST_TILT, _TURN = 40.0, 60.0  # degrees: of the sensor, of the light beside it


@dataclass(frozen=True)
class Row:
    """A number in many images of one picture: status as simulated, part of images that are ok, measured over propagated
    variance, mean error and what rays leave of it, both over sigma."""

    sensor: Pose
    name: str
    status: str
    ok: float
    count: int
    ratio: float
    off: float
    rays: float

    @property
    def counts(self) -> bool:
        """Whether it is one that may be relied on."""
        return bool(is_trusted(self.status)) and self.ok == 1

    def holds(self, tests: int, factor: float = 1.0) -> bool:
        """Whether so many times the propagated variance is the measured one, with 99 % over so many rows."""
        level, free = sidak(_LEVEL, tests), self.count - 1
        low, high = stats.chi2.ppf([level / 2, 1 - level / 2], free) / free
        return bool(low < self.ratio / factor < high)

    @property
    def is_true(self) -> bool:
        """Whether the mean is the part's value, beyond what rays and the images' number leave."""
        return is_on_mean(self.off, self.rays, self.count)

    def __str__(self) -> str:
        pose = "({:.0f}, {:.0f})".format(*self.sensor)
        return (
            f"{pose:<11}{self.name:<17}{self.status:<14}{self.ok:4.0%} ok  variance {self.ratio:5.3f}, "
            f"mean error {self.off:+.2f} +- {self.rays:.2f} sigma"
        )


def is_on_mean(off: float, rays: float, count: int) -> bool:
    """Whether a mean of so many values is the true one, sigma, beyond what rays and their number leave."""
    return abs(off) < MOST_OFF + 2 * float(np.hypot(rays, count**-0.5))


@dataclass(frozen=True)
class ZoneRow:
    """Of a zone's size in many images of one part: the p value of the law that its components tell, and of the normal
    law of a propagated standard deviation."""

    name: str
    p: float
    p_normal: float


def pictures(scene: Scene, count: int, rng: np.random.Generator) -> list[Picture]:
    """At random poses of the sensor above the plate, and of the light beside it."""
    found = []
    for _ in range(count):
        polar, azimuth = float(rng.uniform(5, _MOST_TILT)), float(rng.uniform(0, 360))
        turn = float(rng.choice([-1, 1]) * rng.uniform(_TURN / 2, _TURN))
        found.append(Picture.of(scene, (polar, azimuth), (float(rng.uniform(10, 35)), azimuth + turn)))
    return found


def rows(
    picture: Picture, images: int, rng: np.random.Generator, seed: int, values: Mapping[str, float] = toleranced.VALUES
) -> tuple[list[Row], list[ZoneRow]]:
    """All numbers of a picture, of a part of such values, and its zones."""
    scene = picture.scene
    method = Method(measure.best_estimator(scene))
    off = simulation.simulated(picture, method)
    everywhere = not measure.ESTIMATORS[method.locator].within(scene).local
    clean = render.image(picture, quality=render.Quality(seed=seed, everywhere=everywhere))
    found = measure.measure(render.expose(clean, scene.noise, rng, images), picture, correction=off)
    true = np.array([values[name] for name in found.names])
    return told(picture, found, true, off), _zone_rows(picture, found, true, off)


def told(picture: Picture, found: measure.Measurements, true: np.ndarray, off: measure.Correction) -> list[Row]:
    """How the numbers (n, M) found in noisy images of a picture scatter about true ones (M,), over what is told."""
    good, rows = is_trusted(found.status), []
    rays = np.hypot(off.sources[RENDERING], off.beside)
    for m, name in enumerate(found.names):
        some, sigma = found.value[:, m][good[:, m]], off.sigma[m]
        known = sigma > 0
        measured = some.var(ddof=1) if len(some) > 1 else np.nan
        mean = (some.mean() - true[m]) / sigma if len(some) and known else np.nan
        rows.append(Row(
            picture.sensor, name, off.status[m], float(good[:, m].mean()), len(some),
            measured / sigma**2 if known else np.nan, mean, rays[m] / sigma,
        ))  # fmt: skip
    return rows


def _zone_rows(
    picture: Picture, found: measure.Measurements, true: np.ndarray, off: measure.Correction
) -> list[ZoneRow]:
    """Of each joint zone: deviations about their mean, so that what rays leave of a bias is no part of the law."""
    told = []
    for zone in picture.scene.zones:
        which = [found.names.index(name) for name in zone.parts]
        if not zone.is_joint or not is_trusted(found.status[:, which]).all():
            continue
        away = found.value[:, which] - found.value[:, which].mean(0)
        covariance = off.covariance[np.ix_(which, which)]
        law = ZoneSize(np.zeros(len(which)), covariance, zone.factor)
        sizes = zone.factor * np.linalg.norm(away, axis=-1)
        normal = stats.norm(0, zone.factor * np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
        told.append(ZoneRow(
            zone.name,
            float(stats.kstest([law.below(size) for size in sizes], "uniform").pvalue),
            float(stats.kstest(normal.cdf(sizes), "uniform").pvalue),
        ))  # fmt: skip
    return told


def kinds(
    poses: Annotated[int, typer.Option(help="Pictures.")] = 20,
    images: Annotated[int, typer.Option(help="Noisy images of each.")] = 150,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Names of measurands that begin so.")] = "",
) -> None:
    """Geometric tolerances and features between others, rendered and measured; half an hour of processor time."""
    rng, every, zones = np.random.default_rng(seed), [], []
    with tempfile.TemporaryDirectory() as folder:
        names = tuple(name for name, *_ in toleranced.ASKED if name.startswith(only))
        scene = toleranced.scene(Path(folder), names, width=640, height=512, focal_px=2400.0)
        for k, picture in enumerate(pictures(scene, poses, rng)):
            found, sizes = rows(picture, images, rng, _SEEDS + k)
            print(*found, sep="\n", flush=True)
            every += found
            zones += sizes
    raise typer.Exit(0 if summed_up(every) & _follow(zones) else 1)


def summed_up(every: list[Row]) -> bool:
    """Print what holds of numbers; whether all of it does."""
    used = [row for row in every if row.counts]
    inside, true = sum(row.holds(len(used)) for row in used), sum(row.is_true for row in used)
    pooled = sum((row.count - 1) * row.ratio for row in used) / max(sum(row.count - 1 for row in used), 1)
    refused = sum(not row.holds(len(used), CONTROL) for row in used)
    print(
        f"{len(used)} of {len(every)} rows are ok; {inside} variances as propagated (pooled {pooled:.4f}), {true} means"
    )
    print(f"of {CONTROL} times the variance {refused} rows are refused")
    return bool(used) and inside == true == len(used) and refused > 0


def _follow(zones: list[ZoneRow]) -> bool:
    """The same of zones."""
    level = sidak(_LEVEL, max(len(zones), 1))
    laws, normal = sum(zone.p > level for zone in zones), sum(zone.p_normal > level for zone in zones)
    print(f"of {len(zones)} zones {laws} sizes follow their law, {normal} a normal one")
    return laws == len(zones) and normal < len(zones)
