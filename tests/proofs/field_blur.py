"""``python -m tests.proofs field-blur``: do measured values scatter as told where blur varies over the field?

A plate with a bore, some 170 px wide, stands at nine places of the field of a lens whose blur grows towards the corners
(`FIELD`). Each picture is rendered and measured in many noisy images, with the bias taken off that a simulation tells;
variances and means have to hold as those of `tests.proofs.kinds`. The same images are then measured as if the blur were
everywhere as in the middle: there the told variances are wrong by a stated factor, and so are the means.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
import typer

import measure
import planner
import render
import scenes
from imaging.geometry.blur import blur_in_focus
from imaging.geometry.projection import camera_frame, project
from scenes import Picture, Pose, Scene
from tests.proofs.kinds import Row, summed_up, told
from validation import simulation
from validation.remeasured import Method

FIELD = {"polynomial": [1.0, 0.5]}  # 0.6 px in the middle, 1.5 px at the corner
SIZE = {"width": 1280, "height": 960, "focal_px": 4200.0, "distance": 300.0}  # 14 px a cm, all seen from about one side
ASIDE = (470.0, 350.0)  # px: of the plate's middle from the image's, for places at the border
_SEEDS = 4000  # renders that are measured begin here, simulations at 0
_TILTS, _LIGHTS, _TURN = (25.0, 35.0), (8.0, 15.0), 40.0  # degrees: of the sensor, of the light opposite it


def scene(**field: object) -> Scene:
    """The bundled plate before a larger sensor."""
    camera = SIZE | {"blur_field": field or FIELD}
    return scenes.load("plate").with_(camera=camera, object={"units": "cm"})


def places() -> list[tuple[float, float]]:
    """Nine, px from the image's middle."""
    return [(x * ASIDE[0], y * ASIDE[1]) for y in (-1, 0, 1) for x in (-1, 0, 1)]


def picture_at(scene: Scene, place: tuple[float, float], rng: np.random.Generator) -> Picture:
    """Of the plate, its middle at a place of the image, from a random pose above it."""
    sensor = Pose.of((float(rng.uniform(*_TILTS)), float(rng.uniform(0, 360))))
    light = Pose.of((float(rng.uniform(*_LIGHTS)), sensor.azimuth_deg + 180 + float(rng.uniform(-_TURN, _TURN))))
    axes, pixels = camera_frame(scene.camera, np.array(list(sensor))), scene.camera.focal_px / scene.camera.distance
    middle = (scene.solid.vertices.min(0) + scene.solid.vertices.max(0)) / 2
    at = middle - (place[0] * axes.right + place[1] * axes.down) / pixels
    return Picture.of(scene.with_(camera={"look_at": at.tolist()}), sensor, light)


def blur_of(picture: Picture) -> float:
    """Of the lens at the plate's middle, px."""
    vertices = picture.scene.solid.vertices
    at = project(vertices.mean(0, keepdims=True), np.array(list(picture.sensor)), picture.scene.camera)
    return float(np.mean(blur_in_focus(picture.scene.camera, at)))


def unaware(picture: Picture) -> Picture:
    """The same as if its blur were everywhere as in the middle."""
    camera = picture.scene.camera.model_copy(update={"blur_field": None})
    return picture.with_scene(picture.scene.model_copy(update={"camera": camera}))


def rows(
    picture: Picture, images: int, rng: np.random.Generator, seed: int, locator: str = ""
) -> tuple[list[Row], list[Row]]:
    """All numbers of a picture, told with the field and without it; by the best estimator or a named one."""
    method = Method(locator or measure.best_estimator(picture.scene))
    everywhere = not measure.ESTIMATORS[method.locator].within(picture.scene).local
    clean = render.image(picture, quality=render.Quality(seed=seed, everywhere=everywhere))
    taken = render.expose(clean, picture.scene.noise, rng, images)
    true = np.array([each.value_object for each in planner.predict(picture).measurands])
    return _rows(picture, method, taken, true), _rows(unaware(picture), method, taken, true)


def _rows(picture: Picture, method: Method, images: np.ndarray, true: np.ndarray) -> list[Row]:
    off = simulation.simulated(picture, method)
    found = measure.measure(images, picture, method.locator, correction=off)
    return told(picture, found, true, off)


def field_blur(
    poses: Annotated[int, typer.Option(help="Pictures at each place.")] = 2,
    images: Annotated[int, typer.Option(help="Noisy images of each.")] = 150,
    seed: Annotated[int, typer.Option()] = 1,
    locator: Annotated[str, typer.Option(help="The estimator; the best one where not given.")] = "",
) -> None:
    """A lens whose blur varies over the field, at nine places of it; minutes of processor time."""
    rng, every, blind = np.random.default_rng(seed), [], []
    for k in range(poses):
        for i, place in enumerate(places()):
            picture = picture_at(scene(), place, rng)
            seen, unseen = rows(picture, images, rng, _SEEDS + 9 * k + i, locator)
            print(f"place ({place[0]:+.0f}, {place[1]:+.0f}) px, blur {blur_of(picture):.2f} px", *seen, sep="\n")
            print("  as if it were even:", *unseen, sep="\n  ", flush=True)
            every, blind = every + seen, blind + [replace(row, status="ok") for row in unseen]
    print("ignoring the field:", ignored(every, blind))
    raise typer.Exit(0 if summed_up(every) else 1)


def ignored(every: list[Row], blind: list[Row]) -> str:
    """By what variances and means are wrong where the field is not told."""
    pairs = [(a, b) for a, b in zip(every, blind, strict=True) if a.counts and b.count > 1]
    factors = np.array([b.ratio for _, b in pairs])
    off = np.array([abs(b.off) for _, b in pairs])
    return (
        f"measured over told variance up to {factors.max():.2f} (median {np.median(factors):.2f}), means off by up to"
        f" {off.max():.2f} sigma"
    )
