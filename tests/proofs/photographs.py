"""Is that found in photographs what a person sees in them? With a drawing of each."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import measure
from scenes import InvalidInput
from tests.photographs import MADE, SHIPPED, rectangle, turned
from validation.report import overlay


def _drawn(name: str, image: np.ndarray, out: Path) -> str:
    """Measure up to ten shapes and draw them; their statuses."""
    try:
        found = measure.photograph(image, most=10)
    except InvalidInput as error:
        return str(error)
    overlay.write(out / f"{name.rsplit('.', 1)[0].replace(' ', '_')}.png", image, found)
    return ", ".join(f"{count} {state}" for state, count in Counter(one.status for one in found.found).items())


def rectangles(count: int, rng: np.random.Generator) -> int:
    """How many of so many random rectangles centred on the image, a third of them turned by 45 degrees, are missed."""
    missed = 0
    for k in range(count):
        width, height = rng.uniform(20, 130), rng.uniform(20, 90)
        degrees = 45.0 if k % 3 == 0 else rng.uniform(0, 90)
        true = turned(width, height, degrees)
        inside = (true > 4).all() and (true < [255, 195]).all()
        if inside:
            found = measure.find(rectangle(width, height, degrees, seed=k), ("quadrilateral",))
            far = [np.linalg.norm(one.outline[:, None] - true, axis=-1).min(1).max() for one in found]
            missed += len(found) != 1 or min(far) > 2
    return missed


def noise(count: int) -> int:
    """In how many pictures of noise alone something is found."""
    return sum(bool(measure.find(100 + 5 * np.random.default_rng(seed).standard_normal((300, 400))))
               for seed in range(count))  # fmt: skip


def photographs(
    out: Annotated[Path | None, typer.Option(help="Where drawings are written.")] = None,
    count: Annotated[int, typer.Option(help="Rectangles, and pictures of noise.")] = 100,
) -> None:
    """Find in photographs what a person sees there; exit status 1 if something else is found."""
    wrong = 0
    for name, photo in {**SHIPPED, **MADE}.items():
        image = photo.image()
        found = measure.find(image)
        missed = photo.missed(found)
        wrong += bool(missed)
        kinds = ", ".join(f"{n} {kind}" for kind, n in Counter(one.kind for one in found).items()) or "none"
        print(f"{'NO ' if missed else 'yes'} {name:22s} {photo.said:52s} found: {kinds}", flush=True)
        for line in missed:
            print(f"      {line}")
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            print(f"      measured: {_drawn(name, image, out)}", flush=True)
    missed, invented = rectangles(count, np.random.default_rng(1)), noise(count)
    print(f"{missed} of {count} rectangles missed, something found in {invented} of {count} pictures of noise")
    raise typer.Exit(1 if wrong or missed or invented else 0)
