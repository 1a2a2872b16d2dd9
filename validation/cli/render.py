"""``ice render``: one image."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from validation.cli.common import (
    Effects,
    Json,
    LeaveOutPx,
    LeaveOutVariance,
    LightPose,
    SceneName,
    Sensor,
    check_seed,
    commands,
    parse_pose,
    parse_poses,
    say,
    scene_of,
    taking,
    tolerance,
)
from validation.cli.outputs import check_file

commands = commands()


@dataclass(frozen=True)
class Options:
    """What a render is asked for."""

    scene: SceneName
    sensor: Sensor
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help=".png, .tif (float) or .npy")]
    light: LightPose = None
    noise_seed: Annotated[int | None, typer.Option(help="Add the sensor's noise, from this seed.")] = None
    effects: Effects = "auto"
    bias_px: LeaveOutPx = None
    variance: LeaveOutVariance = None
    as_json: Json = False


@commands.command("render")
@taking(Options)
def render_command(given: Options) -> None:
    """Render one image of a scene."""
    poses = parse_pose("--sensor", given.sensor), parse_poses("--light", given.light)
    check_seed(given.noise_seed, "--noise-seed")
    check_file("--output", given.output, ".png", ".tif", ".tiff", ".npy")
    loaded = scene_of(given.scene)
    import render
    from validation import picture_file

    limits = tolerance(given.bias_px, given.variance)
    image = render.image(loaded, *poses, effects=given.effects, tolerance=limits)
    if given.noise_seed is not None:
        image = render.expose(image, loaded.noise, np.random.default_rng(given.noise_seed), 1)[0]
    picture_file.write(given.output, image)
    (height, width), least, greatest = image.shape, float(image.min()), float(image.max())
    facts = {"file": str(given.output), "width": width, "height": height, "least": least, "greatest": greatest}
    text = f"{given.output}: {width} x {height} px, grey levels {least:.1f} to {greatest:.1f}"
    say(facts, given.as_json, text)
