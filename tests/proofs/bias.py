"""``python -m tests.proofs bias``: is what is left of a corrected bias as large as it is told?

The part that is measured reflects otherwise than its scene says, each surface by up to 10 %, and each light stands up
to 1 % of its distance elsewhere; it is rendered with rays of its own. Who measures it knows nothing of that: the bias
of the scene as it stands is simulated and taken off. Over u(bias), what is left of noise-free pictures scatters by 1
where that tells it (the true picture's own render has noise, too, which a camera's has not: it is allowed for), and
over the combined uncertainty single noisy values have to scatter by 1 within 10 %, beyond chance. Counted are values
that are `ok`, both in the simulation and in their own pictures: one that is cut off at the end of the scale is not.
Where trials are many and `--images 1`, each is another station: of the intervals value +- U, 95 %, 93 to 97 % have to
hold the true value, beyond chance (`--stations`). Statistical textures are another part's in each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer
from scipy import stats

import measure
import render
import scenes
from measure.known_bias import RENDERING
from scenes import Picture, Pose, Scene, StatisticalTexture
from scenes.status import is_trusted
from validation import simulation
from validation.remeasured import Method

REFLECTANCE, LIGHT = 0.1, 0.01  # largest deviations, uniformly drawn
WITHIN = 0.1  # of 1, the spread of pulls
LEAST, MOST = 0.93, 0.97  # of stated 95 % intervals
_K = float(stats.norm.ppf(0.975))
_SCENES = ("bracket", "plate", "grey_floor")
_SEEDS = 1000  # renders of true pictures begin here, corrections at 0


@dataclass(frozen=True)
class Pulls:
    """What is left in true pictures, (trials, M): noise-free over u(bias), and noisy over the combined uncertainty.

    NaN where a picture's own value is not `ok`.
    """

    scene: str
    names: tuple[str, ...]
    status: tuple[str, ...]
    off: np.ndarray
    quiet: np.ndarray
    noisy: np.ndarray

    @property
    def trusted(self) -> np.ndarray:
        """Which of the M values are `ok`."""
        return np.array([bool(is_trusted(state)) for state in self.status])


def deviating(scene: Scene, rng: np.random.Generator) -> Scene:
    """A scene whose surfaces reflect otherwise, each by a factor of its own."""
    update = {"material": scene.material.dimmed(_factor(rng))}
    update["materials"] = tuple(each.dimmed(_factor(rng)) for each in scene.materials)
    if scene.floor is not None:
        update["floor"] = scene.floor.tried(reflectance=(1 - _factor(rng)) * scene.floor.reflectance)
    lights = tuple(light.tried(distance=(1 + rng.uniform(-LIGHT, LIGHT)) * light.distance) for light in scene.lights)
    update["textures"] = tuple(
        each.tried(seed=int(rng.integers(1 << 62))) if isinstance(each, StatisticalTexture) else each
        for each in scene.textures
    )
    update |= {"light": lights[0]} if scene.light is not None else {"several_lights": lights}
    return scene.tried(**update)


def _factor(rng: np.random.Generator) -> float:
    """A part less, negative: more; a Lambertian surface cannot reflect more than all, but its renders may."""
    return float(rng.uniform(-REFLECTANCE, REFLECTANCE))


def moved(pose: Pose, rng: np.random.Generator) -> Pose:
    """A light's pose, off by up to 1 % of its distance along two directions across its beam, independently."""
    p, a = np.radians(list(pose))
    away = np.array([math.sin(p) * math.cos(a), math.sin(p) * math.sin(a), math.cos(p)])
    south = np.array([math.cos(p) * math.cos(a), math.cos(p) * math.sin(a), -math.sin(p)])
    east = np.array([-math.sin(a), math.cos(a), 0.0])
    x, y, z = away + rng.uniform(-LIGHT, LIGHT) * south + rng.uniform(-LIGHT, LIGHT) * east
    return Pose(math.degrees(math.atan2(math.hypot(x, y), z)), math.degrees(math.atan2(y, x)))


def pulls(picture: Picture, trials: int, seed: int, images: int = 1, estimator: str | None = None) -> Pulls:
    """Of a picture, its reflectances and lights drawn anew in each trial; by the estimator that `ice measure` takes."""
    scene, rng = picture.scene, np.random.default_rng(seed)
    off = simulation.simulated(picture, Method(estimator)) if estimator else simulation.best(picture)
    everywhere = off.adjusted is not None or not measure.ESTIMATORS[off.estimator].within(scene).local
    (true, own), left, noisy = _true(picture, off), [], []
    for trial in range(trials):
        actual = Picture(deviating(scene, rng), picture.sensor, tuple(moved(pose, rng) for pose in picture.lights))
        clean = render.image(actual, quality=render.Quality(seed=_SEEDS + trial, everywhere=everywhere))
        exposed = render.expose(clean, scene.noise, rng, images)
        found = measure.measure(
            np.concatenate([clean[None], exposed]), picture, correction=off, estimator=off.estimator
        )
        away = np.where(is_trusted(found.status), found.value - true, np.nan)
        beside = np.hypot(_by_inputs(found.u_bias, off), np.hypot(off.sources[RENDERING], own))
        left.append(away[0] / beside[0])
        sigma = np.sqrt(np.einsum("kmm->km", found.covariance))  # as each picture is told its own
        noisy += list(away[1:] / np.hypot(sigma, beside)[1:])
    names = tuple(quantity.name for quantity in scene.quantities)
    return Pulls(scene.name, names, off.status, off.bias / off.sigma, np.array(left), np.array(noisy))


def _by_inputs(u_bias: np.ndarray, off: measure.Correction) -> np.ndarray:
    """Standard uncertainties (n, M) of biases by all but the renderer's noise."""
    with np.errstate(invalid="ignore"):  # infinite where a value is not measured
        return np.sqrt(np.maximum(u_bias**2 - off.sources[RENDERING] ** 2, 0.0))


def _true(picture: Picture, off: measure.Correction) -> tuple[np.ndarray, np.ndarray]:
    """The object's own values, and the standard deviations of those in one render by its own noise, (M,) each."""
    pair = tuple(render.image(picture, quality=render.Quality(seed=_SEEDS - k, everywhere=False)) for k in (1, 2))
    found = measure.propagate(pair[0], picture, estimator=off.estimator).measurands
    images = measure.Images(pair, by_pixel=simulation.How().by_pixel)
    noise = measure.correction(images, picture, off.estimator, off.threshold).sources[RENDERING]
    return found.value - found.bias, np.sqrt(2) * noise


def _pictures(names: list[str], poses: int) -> Iterator[Picture]:
    for name in names:
        scene = scenes.load(name)
        for setting in scene.settings[:poses]:
            yield Picture.of(scene, setting.sensor, setting.light)


def bias(
    scene: Annotated[list[str], typer.Option(help="Bundled names; may be repeated.")] = list(_SCENES),  # noqa: B006
    poses: Annotated[int, typer.Option(help="Settings of each.")] = 2,
    trials: Annotated[int, typer.Option()] = 15,
    images: Annotated[int, typer.Option(help="Noisy images a trial.")] = 20,
    seed: Annotated[int, typer.Option()] = 1,
    stations: Annotated[bool, typer.Option("--stations", help="Ask for the coverage of intervals.")] = False,
) -> None:
    """Pulls of corrected values where reflectances are off by up to 10 % and lights by 1 %; half an hour."""
    quiet, noisy = [], []
    for picture in _pictures(scene, poses):
        found = pulls(picture, trials, seed, images)
        for m, name in enumerate(found.names):
            print(
                f"{found.scene} {picture.sensor} {name}: {found.status[m]}, bias {found.off[m]:+.2f} sigma taken off, "
                f"left over u(bias) {rms(found.quiet[:, m]):.2f} rms, pull of values {rms(found.noisy[:, m]):.2f}, "
                f"held by 95 % intervals {held(found.noisy[:, m]):.3f}, "
                f"not ok {np.mean(np.isnan(found.noisy[:, m])):.3f}",
                flush=True,
            )
        quiet.append(found.quiet[:, found.trusted].ravel())
        noisy.append(found.noisy[:, found.trusted].ravel())
    values = np.concatenate(noisy)
    spread, count = rms(values), int(np.isfinite(values).sum())
    low, high = np.sqrt(stats.chi2.ppf((0.005, 0.995), count) / max(count, 1))
    print(f"All: left over u(bias) {rms(np.concatenate(quiet)):.3f}, pulls {spread:.3f}; 1 within 10 % is asked.")
    if count == 0:
        print("No value is ok: none is stated with an interval.")
        raise typer.Exit(1)
    if stations:
        inside = int(np.sum(np.abs(values) <= _K))
        low, high = stats.binomtest(inside, count).proportion_ci(0.99)
        print(f"{inside} of {count} intervals hold the true value: {inside / count:.3f} [{low:.3f}, {high:.3f}]")
        raise typer.Exit(0 if low <= MOST and high >= LEAST else 1)
    raise typer.Exit(0 if (1 - WITHIN) * low <= spread <= (1 + WITHIN) * high else 1)


def held(pulls: np.ndarray) -> float:
    """Part of the known pulls within the coverage factor of 95 %."""
    good = pulls[np.isfinite(pulls)]
    return float(np.mean(np.abs(good) <= _K)) if good.size else math.nan


def rms(values: np.ndarray) -> float:
    """Root mean square of those that are known."""
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if good.size else math.nan
