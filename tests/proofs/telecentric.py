"""``python -m tests.proofs telecentric``: do pictures of telecentric cameras scatter as told, about the true value?

A plate and a shaft against a telecentric backlight, and a plate under a lamp, before telecentric lenses whose chief
rays' angle is drawn anew for each random pose, of either sign or 0. Each is rendered and measured in many noisy images,
with the bias taken off that a simulation tells; variances and means have to hold as those of `tests.proofs.kinds`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import scenes
from scenes import Picture, Scene
from tests import toleranced
from tests.proofs import kinds

_SEEDS = 2000  # renders that are measured begin here
_MOST_ANGLE, _PARALLEL = 0.5, 0.3  # degrees of a chief ray at the image's corner; share of lenses without
VALUES = {
    "telecentric_plate": {"bore": 6.0, "pin hole": 4.0, "hole to hole": 8.0, "bore to hole": np.hypot(11, 4)},
    "telecentric_shaft": {"d1": 6.0, "d2": 10.0, "d3": 7.0},
    "under a lamp": toleranced.VALUES,
}
LENS = {
    "kind": "telecentric", "magnification": 0.1, "pixel_pitch_um": 12.5, "working_distance_mm": 150.0,
    "width": 640, "height": 512,
}  # fmt: skip
NAMES = ("round end", "in edges", "slot to plate", "back", "right", "to the middle", "wall", "lines")


def lensed(scene: Scene, rng: np.random.Generator) -> Scene:
    """With a known angle of the chief rays."""
    angle = 0.0 if rng.random() < _PARALLEL else float(rng.uniform(-_MOST_ANGLE, _MOST_ANGLE))
    return scene.with_(camera={"telecentricity_deg": angle})


def above(scene: Scene, rng: np.random.Generator) -> Picture:
    """Of a plate against its backlight, from a pose near its axis: its bores are deep."""
    return Picture.of(lensed(scene, rng), (float(rng.uniform(0, 12)), float(rng.uniform(0, 360))))


def beside(scene: Scene, rng: np.random.Generator) -> Picture:
    """Of a shaft along x, from any side that shows it in the image's width."""
    return Picture.of(
        lensed(scene, rng), (float(rng.uniform(0, 80)), float(rng.choice([90, 270]) + rng.uniform(-12, 12)))
    )


def under_a_lamp(scene: Scene, rng: np.random.Generator) -> Picture:
    """As of `tests.proofs.kinds`."""
    return kinds.pictures(lensed(scene, rng), 1, rng)[0]


def asked(folder: Path) -> dict[str, tuple[Scene, Callable[[Scene, np.random.Generator], Picture]]]:
    """Scenes by name, and what draws a picture of each."""
    plate = toleranced.scene(folder, NAMES)
    lens = LENS | {"look_at": plate.camera.look_at, "blur_px": plate.camera.blur_px, "exposure": plate.camera.exposure}
    return {
        "telecentric_plate": (scenes.load("telecentric_plate"), above),
        "telecentric_shaft": (scenes.load("telecentric_shaft"), beside),
        "under a lamp": (plate.with_(camera=lens), under_a_lamp),
    }


def rows(
    scene: Scene, draw: Callable[[Scene, np.random.Generator], Picture], values: Mapping[str, float],
    poses: int, images: int, rng: np.random.Generator,
) -> list[kinds.Row]:  # fmt: skip
    """All numbers of a scene's pictures, printed as they come."""
    found = []
    for k in range(poses):
        picture = draw(scene, rng)
        told, _ = kinds.rows(picture, images, rng, _SEEDS + k, values)
        print(f"chief rays {picture.scene.camera.telecentricity_deg:+.2f} degrees", *told, sep="\n", flush=True)
        found += told
    return found


def telecentric(
    poses: Annotated[int, typer.Option(help="Pictures of each scene.")] = 20,
    images: Annotated[int, typer.Option(help="Noisy images of each.")] = 150,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Scenes whose names begin so.")] = "",
) -> None:
    """Telecentric cameras at random poses, rendered and measured; an hour of processor time."""
    rng, good = np.random.default_rng(seed), True
    with tempfile.TemporaryDirectory() as folder:
        for name, (scene, draw) in asked(Path(folder)).items():
            if name.startswith(only):
                print(name)
                good &= kinds.summed_up(rows(scene, draw, VALUES[name], poses, images, rng))
    raise typer.Exit(0 if good else 1)
