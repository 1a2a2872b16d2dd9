"""Every kind of light by quadrature against as many of Mitsuba's rays, where it is all seen, in part, or not at all."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated
from unittest import mock

import numpy as np
import typer

import scenes
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import frame
from imaging.light import behind
from imaging.light.behind import seen_by_rays
from imaging.light.emitters import Emitter
from imaging.pictures import Pictures
from render import variant as variants
from render.build import description
from render.parts import Part
from scenes import AnyLight, Bar, Disc, Dome, Light, Obstacle, Picture, Ring, Scene

FINE = 16  # parts of a pixel, each way, that one of Mitsuba's pixels is here
SENSOR, LIGHT = (20.0, 30.0), (35.0, 315.0)
LIGHTS: dict[str, AnyLight] = {
    "point": Light(distance=60.0),
    "sphere": Light(distance=60.0, radius=6.0),
    "disc": Disc(kind="disc", distance=60.0, radius=6.0),
    "bar": Bar(kind="bar", distance=60.0, length=30.0, width=4.0, turn_deg=25.0),
    "ring": Ring(kind="ring", distance=40.0, inner_radius=6.0, outer_radius=10.0, tilt_deg=20.0),
    "ring at the camera": Ring(kind="ring", distance=90.0, inner_radius=5.0, outer_radius=9.0, mount="camera"),
    "dome": Dome(kind="dome", distance=60.0, half_angle_deg=70.0, opening_deg=15.0),
}


@dataclass(frozen=True)
class Compared:
    """Largest differences, of the brightest level, where the light is all seen or not at all, and where in part.

    ``scatter`` is by how much Mitsuba's own numbers do.
    """

    name: str
    whole: int
    part: int
    of_whole: float
    of_part: float
    scatter: float


def crowded(light: AnyLight) -> Scene:
    """A block and a post on a floor under a light."""
    found = scenes.load("grey_floor")
    post = Obstacle(corner=(5.0, 8.5, 0.0), size=(2.0, 2.0, 7.0))
    return found.model_copy(update={"light": light, "obstacles": (*found.obstacles, post)})


def compare(name: str, scene: Scene, places: int, rays: int, rng: np.random.Generator) -> Compared:
    """Random places of the picture, ``rays`` each (a square number)."""
    light = LIGHT
    picture = Picture.of(scene, SENSOR, None if not scene.free else light)
    camera = scene.camera
    pictures, found, exact, part = Pictures.of(picture), [], [], []
    for _ in range(places):
        at = [int(rng.integers(0, n * FINE)) for n in (camera.height, camera.width)]
        found.append([_by_rays(picture, at, rays // 4, seed) for seed in range(4)])
        ways = _ways(picture, at)
        start = np.broadcast_to(pictures.sensor_at, ways.shape)
        with mock.patch.object(behind, "light_between", return_value=0.0):  # direct light is compared
            exact.append(float(seen_by_rays(pictures, start, ways).mean()))
        lit = np.array([seen_by_rays(_of_one(pictures, each), start, ways) > 0 for each in pictures.emitters])
        part.append(bool(lit.any() and not lit.all()))
    top, part = max(exact), np.array(part)
    scatter = np.std(found, 1, ddof=1).mean() / 2 / top
    off = np.abs(np.array(exact) - np.mean(found, 1)) / top
    largest = (float(off[which].max(initial=0.0)) for which in (~part, part))
    return Compared(name, int((~part).sum()), int(part.sum()), *largest, float(scatter))


def _of_one(pictures: Pictures, emitter: Emitter) -> Pictures:
    """The same with one point alone."""
    return replace(pictures, _known={"emitters": (emitter,)})


def _by_rays(picture: Picture, at: list[int], rays: int, seed: int) -> float:
    mitsuba, camera = variants.use(variants.choose()), picture.scene.camera
    active = frozenset({"attached_shadow", "cast_shadow", "fall_off", "floor", "light_size"})
    crop = tuple(slice(place, place + 1) for place in at)
    told = description(mitsuba, Part(picture, active), (camera.width * FINE, camera.height * FINE), crop, rays)
    return float(np.array(mitsuba.render(mitsuba.load_dict(told, parallel=False), seed=seed))[0, 0, 0])


def _ways(picture: Picture, at: list[int]) -> np.ndarray:
    """Rays through one of Mitsuba's pixels, at its quarters' middles."""
    camera, axes = picture.scene.camera, frame(np.array(list(picture.sensor)))
    y, x = ((place + np.array([0.25, 0.75])) / FINE - 0.5 for place in at)
    x, y = (part.ravel() for part in np.meshgrid(x - image_centre(camera)[0], y - image_centre(camera)[1]))
    return x[:, None] / camera.focal_px * axes.right + y[:, None] / camera.focal_px * axes.down + axes.forward


def lights(
    rays: Annotated[int, typer.Option(help="Of Mitsuba, for each kind of light.")] = 10_000_000,
    places: Annotated[int, typer.Option(help="In each picture.")] = 40,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Irradiance of every kind of light, occluded and not, against Mitsuba's rays; of the brightest level."""
    rng, each = np.random.default_rng(seed), int(np.sqrt(rays / places / 4)) ** 2 * 4
    print(f"{'light':20s} {'whole':>6s} {'off by':>9s} {'part':>6s} {'off by':>9s} {'scatter':>9s}")
    for name, light in LIGHTS.items():
        row = compare(name, crowded(light), places, each, rng)
        print(f"{name:20s} {row.whole:6d} {row.of_whole:9.1e} {row.part:6d} {row.of_part:9.1e} {row.scatter:9.1e}")
