"""``ice render``: one image."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

import scenes
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
    tolerance,
)
from validation.cli.outputs import check_file

if TYPE_CHECKING:
    pass

commands = commands()


@commands.command("render")
def render_command(
    scene: SceneName,
    sensor: Sensor,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help=".png, .tif (float) or .npy")],
    light: LightPose = None,
    noise_seed: Annotated[int | None, typer.Option(help="Add the sensor's noise, from this seed.")] = None,
    effects: Effects = "auto",
    bias_px: LeaveOutPx = None,
    variance: LeaveOutVariance = None,
    as_json: Json = False,
) -> None:
    """Render one image of a scene."""
    poses = parse_pose("--sensor", sensor), parse_poses("--light", light)
    check_seed(noise_seed, "--noise-seed")
    check_file("--output", output, ".png", ".tif", ".tiff", ".npy")
    loaded = scenes.load(scene)
    import render
    from validation import picture_file

    image = render.image(loaded, *poses, effects=effects, tolerance=tolerance(bias_px, variance))
    if noise_seed is not None:
        image = render.expose(image, loaded.noise, np.random.default_rng(noise_seed), 1)[0]
    picture_file.write(output, image)
    facts = {
        "file": str(output),
        "width": image.shape[1],
        "height": image.shape[0],
        "least": float(image.min()),
        "greatest": float(image.max()),
    }
    say(
        facts,
        as_json,
        f"{output}: {image.shape[1]} x {image.shape[0]} px, grey levels {image.min():.1f} to {image.max():.1f}",
    )
