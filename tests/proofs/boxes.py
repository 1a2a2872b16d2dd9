"""``python -m tests.proofs boxes``: poses drawn inside installation boxes keep U, poses just outside do not.

Of each scene a box, then poses drawn all over it and in its corners: U of each by the calibrated variance and the
budget's own differences, which share no formula with intervals. The least box that is known to be too large, by those
poses, tells how much of the true one is proved. Some of the poses get whole budgets, also by the estimator that such
scenes are measured with.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import planner
import scenes
from imaging.models import variance_model
from imaging.pictures import Pictures
from scenes import Picture, Scene
from tests.boxes import drawn_part, expanded, toleranced

_OUTSIDE = (1.02, 1.1, 1.2, 1.3)
_COLUMNS = (
    "scene", "box (degrees)", "pairs of cells", "part of what is known to be too large", "largest U / limit inside",
    "by the estimator's budget", f"largest U / limit at {', '.join(f'{each:g}' for each in _OUTSIDE)} of it",
)  # fmt: skip
_SOME = 50  # of a box' poses that get whole budgets


def cases(folder: Path, drawn: int) -> list[tuple[str, Scene, tuple, float]]:
    """Name, scene, poses, and half the tolerance over U."""
    near = ((30, 135), (15, 315)), ((45, 5), (15, 60))
    found = [
        ("task1", toleranced("task1", 0.016), near[0], 4.0),
        ("wedge", toleranced("wedge", 0.028), near[1], 4.0),
        ("calibrated_rig", scenes.load("calibrated_rig"), ((10, 60), (10, 25)), 4.0),
    ]
    draws = np.random.default_rng(2)
    while len(found) < 3 + drawn:
        seed = int(draws.integers(1 << 30))
        poses = tuple((float(draws.uniform(15, 45)), float(draws.uniform(0, 360))) for _ in range(2))
        part = drawn_part(folder, seed, 1.0)
        sigma = float(np.sqrt(planner.variances(part, *poses)))
        if np.isfinite(sigma):
            found.append((f"part {len(found) - 2}", part, poses, 1 / (2.0 * 1.4 * sigma)))
    return found


def boxes(
    poses: Annotated[int, typer.Option(help="Drawn in each box.")] = 10_000,
    drawn: Annotated[int, typer.Option(help="Convex parts, beside three bundled scenes.")] = 3,
    seed: int = 1,
) -> None:
    """Draw poses in installation boxes and beside them."""
    typer.echo(f"| {' | '.join(_COLUMNS)} |")
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, place, k in cases(Path(folder), drawn):
            box = planner.installation_box(scene, *place, k=k)
            typer.echo(_row(name, box, poses, np.random.default_rng(seed)))


def _row(name: str, box: planner.InstallationBox, count: int, draws: np.random.Generator) -> str:
    scene, (limit,) = box.picture.scene, box.limits
    inside = draws.uniform(-1, 1, (count, 4))
    inside[: count // 4] = np.sign(inside[: count // 4])  # corners
    inside[count // 4 : count // 2, ::2] = np.sign(inside[count // 4 : count // 2, ::2])  # and edges
    known = expanded(scene, *box.poses.at(inside)) / limit
    some = inside[np.argsort(-known)[:: max(count // _SOME, 1)][:_SOME]]
    own, other = zip(*(_budgets(box, *pair) for pair in zip(*box.poses.at(some), strict=True)), strict=True)
    edge, outside = draws.permutation(inside[: count // 2])[:400], []
    for factor in _OUTSIDE:
        there = expanded(scene, *box.poses.times(factor).at(edge))
        outside.append(f"{float(np.nan_to_num(there / limit, nan=np.inf).max()):.3f}")
    assert max(*own, known.max()) <= 1, f"{name}: a pose inside has {known.max()} times its U"
    return (
        f"| {name} | {box.sensor_deg:.2f} | {box.pairs} | {box.share:.2f} | {known.max():.4f} | "
        f"{max(other):.3f} | {', '.join(outside)} |"
    )


def _budgets(box: planner.InstallationBox, sensor: np.ndarray, light: np.ndarray) -> tuple[float, float]:
    """U over its limit by whole budgets: at the calibrated variance, and of the estimator that measures."""
    picture = Picture.of(box.picture.scene, sensor, light)
    noise = variance_model("calibrated")(Pictures.of(picture)).variances_object
    own, other = planner.budget(picture, variances=noise, biased=False), planner.budget(picture)
    assert other.statuses == ("ok",), other.statuses
    return own.measurands[0].U / box.limits[0], other.measurands[0].U / box.limits[0]
