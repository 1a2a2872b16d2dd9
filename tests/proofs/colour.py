"""``python -m tests.proofs colour``: do pictures of colour sensors scatter as told, about the true value?

The bundled plate at random poses of camera and lamp, by sensors with colour filters of random patterns and responses:
the raw mosaic, the demosaiced picture of all colours, and of one. Each is rendered and measured in many noisy images,
with the bias taken off that a simulation tells; variances and means have to hold as those of `tests.proofs.kinds`.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer

import planner
import scenes
from scenes import InvalidInput, Picture
from tests.proofs import kinds

_SEEDS = 3000  # renders that are measured begin here
_WAYS = {
    "raw": {"demosaicing": "none"},
    "bilinear": {"demosaicing": "bilinear"},
    **{name: {"demosaicing": "bilinear", "reads": name} for name in ("red", "green", "blue")},
}


def filters(way: str, rng: np.random.Generator) -> dict[str, Any]:
    """Colour filters of a random pattern and response, 0.3 to 1 of the strongest colour that is read."""
    response = rng.uniform(0.3, 1.0, 3)
    read = ["red", "green", "blue"].index(way) if way in ("red", "green", "blue") else int(response.argmax())
    pattern = str(rng.choice(["RGGB", "BGGR", "GRBG", "GBRG"]))
    return {"pattern": pattern, "response": tuple((response / response[read]).tolist()), **_WAYS[way]}


def picture_of(way: str, rng: np.random.Generator) -> Picture:
    """The plate from above, from where all of it can be measured."""
    scale = 1.5 if way in ("red", "blue") else 1.0
    plate = scenes.load("plate").with_(
        camera={"blur_px": 0.9}, locator={"scale_px": scale, "window_px": 3 * scale},
        noise={"gain": 0.02, "dark_level": 16.0, "bits": 10, "colour": filters(way, rng)},
    )  # fmt: skip
    while True:
        sensor, light = ((float(rng.uniform(5, 30)), float(rng.uniform(0, 360))) for _ in range(2))
        try:
            picture = Picture.of(plate, sensor, light)
        except InvalidInput:
            continue
        if planner.predict(picture).status in ("ok", "clutter"):
            return picture


def colour(
    poses: Annotated[int, typer.Option(help="Pictures of each way.")] = 4,
    images: Annotated[int, typer.Option(help="Noisy images of each.")] = 150,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Ways whose names begin so.")] = "",
) -> None:
    """Colour sensors at random poses, rendered and measured; ten minutes of processor time."""
    rng, found = np.random.default_rng(seed), []
    for way in _WAYS:
        for k in range(poses if way.startswith(only) else 0):
            picture = picture_of(way, rng)
            told = planner.predict(picture).measurands
            rows, _ = kinds.rows(picture, images, rng, _SEEDS + k, {each.name: each.value_object for each in told})
            print(f"{way} {picture.scene.noise.colour.pattern}", *rows, sep="\n", flush=True)
            found += rows
    raise typer.Exit(0 if kinds.summed_up(found) else 1)
