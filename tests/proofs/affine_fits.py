"""Fits of photographs that GalSim drew: a block from so far away that each face is a parallelogram of one brightness.

Nothing of it is shared with the image model or the renderer: places by a pinhole and brightness by Lambert's cosine,
written out here and in `tests.oracle`; blur and pixels by GalSim in Fourier space.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

import measure
import scenes
from measure.fitting.result import Fit
from scenes import Block, Pose, Scene
from tests.oracle import axes, pinhole
from tests.proofs.fits import table

_AWAY = 1e6  # cm, of camera and light: perspective moves no corner by 1e-3 px
_SCALE = 6.0  # px a cm
_WHITE = 0.9  # of a sponge: what is not reflected as from a mirror


def hidden(rng: np.random.Generator) -> tuple[Scene, dict[str, float]]:
    """A scene of a block as its user believes it, and the true values of what is photographed."""
    base = scenes.load("task1")
    size = tuple(np.round(rng.uniform([8, 5, 3], [14, 9, 6]), 2).tolist())
    camera = base.camera.model_copy(
        update={"width": 176, "height": 168, "focal_px": _SCALE * _AWAY, "distance": _AWAY, "blur_px": 0.7}
    )
    lights = tuple(each.model_copy(update={"distance": _AWAY}) for each in base.lights)
    part = {"object": Block(kind="block", size=size), "settings": (), "same_scale": (), "camera": camera}
    sensor, light = Pose(rng.uniform(25, 55), rng.uniform(0, 360)), Pose(rng.uniform(20, 50), rng.uniform(0, 360))
    return base.model_copy(update=part).lit_by(*lights), {
        "camera.exposure": float(rng.uniform(120, 190)), "noise.dark_level": float(rng.uniform(16, 30)),
        "camera.blur_px": float(rng.uniform(0.6, 1.2)), "noise.sigma": float(rng.uniform(0.8, 2.5)), "noise.gain": 0.0,
        "sensor.polar": sensor.polar_deg, "sensor.azimuth": sensor.azimuth_deg,
        "light.polar": light.polar_deg, "light.azimuth": light.azimuth_deg,
        "aim.right": 0.0, "aim.down": 0.0, "camera.roll_deg": 0.0, "camera.distance": _AWAY,
    }  # fmt: skip


def drawn(scene: Scene, true: dict[str, float]) -> np.ndarray:
    """The noise-free photograph, grey levels (height, width)."""
    from tests.galsim_images import parallelogram

    sensor = (true["sensor.polar"], true["sensor.azimuth"])
    eye, lamp = axes(sensor)[0], axes((true["light.polar"], true["light.azimuth"]))[0]
    solid, camera = scene.solid, scene.camera
    image = np.full((camera.height, camera.width), true["noise.dark_level"])
    for face, normal in zip(solid.faces, solid.normals, strict=True):
        if normal @ eye <= 0 or normal @ lamp <= 0:
            continue
        corners = pinhole(solid.vertices[list(face)], sensor, camera)
        image += true["camera.exposure"] * _WHITE * (normal @ lamp) * parallelogram(
            corners, image.shape, true["camera.blur_px"]
        )  # fmt: skip
    return image


def fitted(scene: Scene, true: dict[str, float], rng: np.random.Generator) -> Fit:
    """From a noisy photograph, beginning some degrees off."""
    image = drawn(scene, true)
    shot = np.rint(image + true["noise.sigma"] * rng.standard_normal(image.shape))
    off = rng.uniform(-6, 6, 4)
    sensor = Pose(true["sensor.polar"] + off[0], true["sensor.azimuth"] + off[1])
    light = Pose(true["light.polar"] + off[2], true["light.azimuth"] + off[3])
    return measure.fit(scene, [np.clip(shot, 0, 255)], sensor, light)


def pulls(found: Fit, true: dict[str, float]) -> dict[str, float]:
    """(fitted - true) / standard error of what is told; angles by the shorter way."""
    result = {}
    for name, unit, value, error, status in zip(
        found.names, found.units, found.values, found.standard_errors, found.statuses, strict=True
    ):
        if status == "ok" and error > 0 and name != "noise.gain":
            off = value - true[name]
            result[name] = ((off + 180) % 360 - 180 if unit == "deg" else off) / error
    return result


def affine_fits(
    count: Annotated[int, typer.Option(help="Hidden scenes.")] = 40,
    seed: Annotated[int, typer.Option(help="Root of all random numbers.")] = 1,
) -> None:
    """Pulls of fits of photographs that GalSim drew."""
    rows, statuses = [], []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        scene, true = hidden(rng)
        found = fitted(scene, true, rng)
        statuses.append(found.status)
        rows.append(pulls(found, true) if found.status != "misfit" else {})
        held = [name for name, status in zip(found.names, found.statuses, strict=True) if status != "ok"]
        worst = max(rows[-1], key=lambda name: abs(rows[-1][name]), default="")
        print(f"{number}: {found.status}, p {found.p_value:.2g}, largest {worst} {rows[-1].get(worst, 0):+.2f}, "
              f"held {', '.join(held) or 'nothing'}", flush=True)  # fmt: skip
    lines, within = table(rows)
    print("\n".join(lines))
    print(f"within 3 standard errors: {within:.4f} of all pulls")
    print("statuses:", {status: statuses.count(status) for status in sorted(set(statuses))})
    raise typer.Exit(int(within < 0.98))
