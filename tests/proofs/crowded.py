"""Does `arrangement` stand at the bound where edges crowd, unbiased, with the variance that it tells?

Random poses of task1, the same in small images, and random blocks. Images are the oracle's, whose projection and
shading are its own; noise is the scene's, rounded. Rows whose status is not ok are counted, not judged.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer
from scipy.stats import chi2, kstest

import measure
import scenes
from scenes import InvalidInput, Picture, Scene
from scenes.parts.block import Block
from tests.oracle import block_image, pinhole

POSES = {"task1": 200, "small": 100, "blocks": 200}
FINE = 0.1  # px: standard deviation below which a pose ought to be measured
LEVEL = 0.01


@dataclass(frozen=True)
class Row:
    """One pose: variances, px^2, of ``count`` ok images; bias in standard deviations; the commonest status."""

    sensor: tuple[float, float]
    light: tuple[float, float]
    status: str
    count: int
    failed: int
    empirical: float
    predicted: float
    bound: float
    bias: float
    p_value: float

    @property
    def probability(self) -> float:
        """Two-sided p-value of the empirical variance."""
        found = chi2.cdf((self.count - 1) * self.empirical / self.predicted, self.count - 1)
        return float(2 * min(found, 1 - found))


def row(scene: Scene, sensor, light, count: int, rng: np.random.Generator, estimator: str = "arrangement") -> Row:
    """Measure one pose."""
    picture = Picture.of(scene, sensor, light)
    clean, noise = block_image(scene, sensor, light), scene.noise
    told = measure.propagate(clean, picture, estimator=estimator)
    bound = measure.bound(scene, sensor, light)
    if told.status != "ok":
        return Row(sensor, light, told.status, 0, count, np.nan, told.variance_px2, bound, np.nan, np.nan)
    images = clean + noise.sigma * rng.standard_normal((count, *clean.shape))
    found = measure.distance(np.clip(np.rint(images), 0, 255), picture, estimator=estimator)
    good = found.status == "ok"
    values = found.value_px[good]
    empirical = float(values.var(ddof=1)) if good.sum() > 1 else np.nan
    bias = float((values.mean() - true_distance(scene, sensor)) / np.sqrt(told.variance_px2)) if good.any() else np.nan
    states, counts = np.unique(found.status, return_counts=True)
    return Row(sensor, light, str(states[counts.argmax()]), int(good.sum()), int((~good).sum()), empirical,
               told.variance_px2, bound, bias, float(np.mean(found.p_value < 1e-4)))  # fmt: skip


def true_distance(scene: Scene, sensor) -> float:
    """From the oracle's own pinhole, px."""
    corners = np.array([scene.solid.vertex(feature.vertex) for feature in scene.task.corners])
    return float(np.linalg.norm(np.diff(pinhole(corners, sensor, scene.camera), axis=0)))


def poses(rng: np.random.Generator, scene: Scene):
    """A random sensor and light from which something can be seen."""
    while True:
        sensor, light = ((float(rng.uniform(low, 75)), float(rng.uniform(0, 360))) for low in (5, 2))
        try:
            Picture.of(scene, sensor, light)
        except InvalidInput:
            continue
        return sensor, light


def small(scene: Scene) -> Scene:
    """The same in images of 96 x 90 px."""
    return scene.model_copy(
        update={"camera": scene.camera.model_copy(update={"width": 96, "height": 90, "focal_px": 300.0})}
    )


def random_block(scene: Scene, rng: np.random.Generator) -> Scene:
    """Another block, of sides from 2 to 13 cm."""
    size = tuple(float(side) for side in rng.uniform(2, 13, 3))
    return scene.model_copy(update={"object": Block(kind="block", size=size), "settings": ()})


def judge(rows: list[Row]) -> dict[str, float | bool]:
    """What the rows say together: figures and whether each claim holds."""
    good = [found for found in rows if found.status == "ok" and found.count > 1]
    ratio = np.array([found.predicted / found.bound for found in good])
    bias = np.abs([found.bias for found in good])
    probability = np.array([found.probability for found in good])
    fine = [found for found in rows if found.bound < FINE**2]
    sidak = 1 - (1 - LEVEL) ** (1 / max(len(good), 1))
    pooled = sum((found.count - 1) * found.empirical / found.predicted for found in good)
    figures = {
        "rows": len(rows), "ok": len(good), "ok of fine": sum(f.status == "ok" for f in fine) / max(len(fine), 1),
        "lost images": sum(found.failed for found in good), "median of the bound": float(np.median(ratio)),
        "95 % of the bound": float(np.quantile(ratio, 0.95)), "least of the bound": float(ratio.min()),
        "empirical / predicted": pooled / sum(found.count - 1 for found in good),
        "KS": kstest(probability, "uniform").pvalue,
        "least p": float(probability.min()), "Sidak": sidak, "bias within 0.3": float(np.mean(bias < 0.3)),
        "largest bias": float(bias.max()),
    }  # fmt: skip
    figures["holds"] = bool(
        figures["least p"] > sidak and figures["KS"] > LEVEL and figures["bias within 0.3"] >= 0.99
        and figures["largest bias"] < 1 and figures["median of the bound"] <= 1.10
        and figures["95 % of the bound"] <= 1.25 and figures["ok of fine"] >= 0.85
    )  # fmt: skip
    return figures


def study(kind: str, count: int, images: int, seed: int, show: bool = True) -> list[Row]:
    """Rows of one kind: task1, small or blocks (10 poses each)."""
    rng, task1, rows = np.random.default_rng(seed), scenes.load("task1"), []
    scene = small(task1) if kind == "small" else task1
    for number in range(count):
        if kind == "blocks" and number % 10 == 0:
            scene = random_block(task1, rng)
        found = row(scene, *poses(rng, scene), images, rng)
        rows.append(found)
        if show:
            ratio = found.empirical / found.predicted
            print(
                f"{kind:6s} {number:3d} s({found.sensor[0]:.1f},{found.sensor[1]:.1f})"
                f" l({found.light[0]:.1f},{found.light[1]:.1f}) {found.status:15s} lost {found.failed:3d} R {ratio:.3f}"
                f" told/bound {found.predicted / found.bound:.3f} bound {np.sqrt(found.bound):.4f} px"
                f" bias {found.bias:+.2f}",
                flush=True,
            )
    return rows


def crowded(
    kind: Annotated[str, typer.Option(help="task1, small, blocks or all.")] = "all",
    count: Annotated[int | None, typer.Option(help="Poses a kind; 200, 100 and 200 when not given.")] = None,
    images: Annotated[int, typer.Option(help="Images a pose.")] = 300,
    seed: Annotated[int, typer.Option()] = 1,
    workers: Annotated[int, typer.Option(min=1)] = 2,
) -> None:
    """Measure random poses of crowded edges and judge each kind; exit status 1 if a claim does not hold."""
    kinds = list(POSES) if kind == "all" else [kind]
    with ProcessPoolExecutor(workers) as pool:
        done = [pool.submit(study, one, count or POSES[one], images, seed) for one in kinds]
        found = {one: judge(future.result()) for one, future in zip(kinds, done, strict=True)}
    for one, figures in found.items():
        print(f"\n{one}")
        for name, value in figures.items():
            print(f"  {name}: {value if isinstance(value, bool | int) else format(value, '.4g')}")
    raise typer.Exit(0 if all(figures["holds"] for figures in found.values()) else 1)
