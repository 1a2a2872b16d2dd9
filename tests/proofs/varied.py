"""``python -m tests.proofs varied``: random scenes with several things at once: no value is `ok` and wrong.

A bundled scene is changed at random: its light's kind, its surface, its brightness up to the end of the scale, blur and
noise, a lens that bends or has an aperture, a floor, an obstacle beside the part; camera and lights stand anywhere that
measures one value at least. Every estimator measures noisy pictures of it, as they are and with the bias taken off that
renders of other rays tell. Of each value that is `ok` in most pictures the mean error may be 0.3 of its standard
uncertainty, beyond chance, and its scatter has to be what is told, within chance and 10 %. What the scene is not sure
of (`tests.proofs.bias`) and textures of which nobody knows how they lie (`tests.proofs.uneven`) are not asked here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer
from scipy import stats

import measure
import render
import scenes
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from measure import Images
from measure.known_bias import RENDERING
from render import Quality
from scenes import InvalidInput, Picture, Scene
from scenes.status import is_trusted
from tests.proofs.usable import measurable, placed
from validation.simulation import How

SHIFT, SCATTER = 0.3, 0.1  # of the standard uncertainty; of the standard deviation
CHANCE = 1e-6  # of one row: thousands are judged
BASES = (
    "anodised", "ball", "bracket", "calibrated_rig", "copper", "glossy_metal", "grey_floor", "low_light", "macro",
    "plate", "printed_label", "ring_light", "shaft", "task1", "two_lights", "wedge",
)  # fmt: skip
_OFTEN = 0.35  # how often each change is made
_TRIES = 100  # of poses


@dataclass(frozen=True)
class Row:
    """A value by one estimator, in pictures as they are or corrected; ``wrong`` in words, empty where it is not."""

    estimator: str
    name: str
    corrected: bool
    ok: bool
    wrong: str


Change = Callable[[Scene, np.random.Generator], dict[str, Any]]


def _light(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    away = float(scene.lights[0].distance)
    kind = str(rng.choice(["disc", "bar", "ring"]))
    size = {
        "disc": {"radius": 0.05 * away},
        "bar": {"length": 0.2 * away, "width": 0.04 * away},
        "ring": {"inner_radius": 0.1 * away, "outer_radius": 0.15 * away},
    }[kind]
    return {"light": {"kind": kind, "distance": away, **size}}


def _surface(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    return {"material": {"diffuse_reflectance": rng.uniform(0.3, 1), "specular_fraction": rng.uniform(0, 0.3)}}


def _exposure(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    return {"camera": {"exposure": rng.uniform(0.5, 1.6) * scene.camera.exposure}}


def _blur(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    return {"camera": {"blur_px": rng.uniform(0.5, 1.2)}}


def _noise(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    return {"noise": {"sigma": rng.uniform(1, 4), "gain": rng.choice([0.0, 0.03]), "bits": int(rng.choice([8, 12]))}}


def _bent(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    return {"camera": {"lens": {"distortion": [rng.uniform(-0.2, 0.2)]}}}


def _aperture(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    return {"camera": {"lens": {"aperture_radius": rng.uniform(1e-3, 6e-3) * scene.camera.distance}}}


def _floor(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    low = float(scene.solid.vertices[:, 2].min())
    return {"floor": {"reflectance": rng.uniform(0.05, 0.6), "height": low - rng.uniform(0, 0.3) * scene.solid.extent}}


def _obstacle(scene: Scene, rng: np.random.Generator) -> dict[str, Any]:
    low, high = scene.solid.vertices.min(0), scene.solid.vertices.max(0)
    size = rng.uniform(0.1, 0.6, 3) * (high - low)
    corner = np.array([high[0] + rng.uniform(0.05, 0.4) * (high - low)[0], *low[1:]])
    return {"obstacles": [{"corner": corner.tolist(), "size": size.tolist()}]}


CHANGES: tuple[Change, ...] = (_light, _surface, _exposure, _blur, _noise, _bent, _aperture, _floor, _obstacle)


def drawn(rng: np.random.Generator) -> tuple[Scene, list[str]]:
    """A scene, and what it is made of; a change that its kind of scene cannot have is not made."""
    base = str(rng.choice(BASES))
    scene, made = scenes.load(base), [base]
    known = [each for each in scene.textures if each.kind != "statistical"]
    scene = scene if len(known) == len(scene.textures) else scene.tried(textures=tuple(known))
    for change in CHANGES:
        if rng.random() < _OFTEN:
            try:
                scene = scene.with_(**change(scene, rng))
            except InvalidInput:
                continue
            made.append(change.__name__[1:])
    return scene, made


def taken(scene: Scene, rng: np.random.Generator) -> Picture | None:
    """A picture that measures one value at least; None where none is found."""
    for _ in range(_TRIES):
        try:
            picture = placed(scene, rng)
            if measurable(picture).any():
                return picture
        except InvalidInput:
            continue
    return None


def judged(picture: Picture, count: int, rng: np.random.Generator) -> Iterator[Row]:
    """Rows of a picture by every estimator, as measured and corrected; two renders are measured, two tell the bias."""
    how = How(quality=Quality(everywhere=True), everywhere=True)
    renders = [how.image(picture, seed) for seed in range(4)]
    exposed = render.expose(np.mean(renders[2:], 0), picture.scene.noise, rng, count)
    true = measurands(Pictures.of(picture)).value_object
    for estimator in measure.ESTIMATORS:
        try:
            off = measure.correction(Images(tuple(renders[:2]), by_pixel=how.by_pixel), picture, estimator)
        except InvalidInput:
            continue
        noise = off.sources[RENDERING]
        for corrected in (False, True):
            found = measure.measure(exposed, picture, estimator=estimator, correction=off if corrected else None)
            sigma = np.sqrt(np.einsum("kmm->km", found.covariance))
            for m, quantity in enumerate(off.quantities):
                ok = is_trusted(found.status[:, m])
                if ok.mean() > 0.5:
                    beside = float(noise[m] * np.sqrt(1 + corrected)) if np.isfinite(noise[m]) else 0.0
                    wrong = _wrong(found.value[ok, m] - true[m], float(np.mean(sigma[ok, m])), beside)
                else:
                    wrong = ""
                yield Row(estimator, quantity.name, corrected, bool(ok.mean() > 0.5), wrong)


def _wrong(errors: np.ndarray, sigma: float, beside: float) -> str:
    """What is wrong with values of some errors (k,), of one told sigma; ``beside`` is by the renderer's noise.

    >>> rng = np.random.default_rng(1)
    >>> _wrong(rng.normal(0, 1, 50), 1.0, 0.0)
    ''
    >>> _wrong(rng.normal(1.5, 1, 50), 1.0, 0.0)[:10], _wrong(rng.normal(0, 3, 50), 1.0, 0.0)[:7]
    ('mean error', 'scatter')
    """
    count, by_chance = len(errors), stats.norm.isf(CHANCE / 2)
    error = float(errors.mean())
    if abs(error) > SHIFT * sigma + by_chance * np.hypot(sigma / np.sqrt(count), beside):
        return f"mean error {error / sigma:+.2f} sigma"
    ratio = float(errors.std(ddof=1)) / sigma
    low, high = np.sqrt(stats.chi2.ppf((CHANCE / 2, 1 - CHANCE / 2), count - 1) / (count - 1))
    if not (1 - SCATTER) * low <= ratio <= (1 + SCATTER) * high:
        return f"scatter {ratio:.2f} of what is told"
    return ""


def varied(
    count: Annotated[int, typer.Option(help="Scenes.")] = 200,
    images: Annotated[int, typer.Option(help="Noisy pictures of each.")] = 40,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Random scenes with several things at once, by every estimator: no value is ok and wrong; many hours."""
    rows: list[Row] = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        scene, made = drawn(rng)
        picture = taken(scene, rng)
        if picture is None:
            print(f"{number:3d} {', '.join(made)}: no pose measures anything", flush=True)
            continue
        own = list(judged(picture, images, rng))
        rows += own
        good, bad = sum(row.ok for row in own), [row for row in own if row.wrong]
        print(f"{number:3d} {', '.join(made)} {picture.sensor} {picture.lights}: {good} of {len(own)} ok", flush=True)
        for row in bad:
            print(f"    {row.estimator} {row.name}{', corrected' if row.corrected else ''}: {row.wrong}", flush=True)
    wrong = sum(bool(row.wrong) for row in rows)
    print(f"{len(rows)} values, {sum(row.ok for row in rows)} ok, {wrong} of those wrong.")
    raise typer.Exit(1 if wrong else 0)
