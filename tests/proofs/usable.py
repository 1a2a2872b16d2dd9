"""``python -m tests.proofs usable``: how many values of the bundled scenes are `ok` at random poses that measure them?

Camera and lights stand 10 to 50 degrees off the vertical, anywhere around; lights that go with the camera, or face it,
stand where they do. Before a light that faces it the camera stands up to twice as far off as in the scene's settings:
the light has to be behind the part. Measured is a value where a prediction without an image says that it can be,
whatever its bias (not where it says that a board beside the part is hidden: `unplaced`); then its bias is simulated and
taken off, as `ice measure` does, by the estimator that it takes (`validation.simulation.best`), and it is counted
whether it is `ok`. At least 90 % have to be.
"""

from __future__ import annotations

from collections import Counter
from typing import Annotated

import numpy as np
import typer

import planner
import scenes
from imaging.light.backlight import backlights
from scenes import Picture, Pose, Scene
from scenes.status import CLUTTER, OK, is_trusted
from validation import simulation

LEAST = 0.9
_TRIES = 200


def placed(scene: Scene, rng: np.random.Generator) -> Picture:
    """A picture at random poses."""
    stated = scene.settings[0].lights  # those that go with the camera, or face it, are not
    farthest = 2 * max(setting.sensor.polar_deg for setting in scene.settings)
    sensor = _anywhere(rng, 0.0, farthest) if backlights(scene) else _anywhere(rng)
    return Picture.of(scene, sensor, tuple(_anywhere(rng) for _ in stated))


def _anywhere(rng: np.random.Generator, least: float = 10.0, most: float = 50.0) -> Pose:
    return Pose(round(rng.uniform(least, most), 1), round(rng.uniform(0, 360), 1))


def measurable(picture: Picture) -> np.ndarray:
    """Which of the M values a prediction calls measurable, bool (M,)."""
    return np.array([each.status in (OK, CLUTTER) for each in planner.predict(picture).measurands])


def states(scene: Scene, poses: int, seed: int) -> list[str]:
    """Statuses, once corrected, of all values that are measurable at some poses that measure one at least."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(_TRIES):
        picture = placed(scene, rng)
        some = measurable(picture)
        if some.any():
            found.append(np.array(simulation.best(picture).status)[some])
        if len(found) == poses:
            break
    return np.concatenate(found).tolist() if found else []


def usable(
    scene: Annotated[list[str] | None, typer.Option(help="Bundled names; may be repeated. [default: all]")] = None,
    poses: Annotated[int, typer.Option(help="Of each.")] = 4,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Statuses of the bundled scenes' values at random poses; a quarter of an hour."""
    fewest = 1.0
    for name in scene or scenes.names():
        found = states(scenes.load(name), poses, seed)
        share = float(np.mean([is_trusted(each) for each in found])) if found else 1.0
        fewest = min(fewest, share)
        print(f"{name}: {share:.0%} of {len(found)} ok; {dict(Counter(found))}", flush=True)
    print(f"The least: {fewest:.0%}; {LEAST:.0%} is asked.")
    raise typer.Exit(0 if fewest >= LEAST else 1)
