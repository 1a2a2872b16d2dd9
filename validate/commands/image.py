"""``ice render`` and ``ice measure``: one image."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import measure
import render
import scenes
from validate import picture_file
from validate.commands.common import Json, LightPose, SceneName, Sensor, app, parse_pose, say


@app.command("render")
def render_command(
    scene: SceneName,
    sensor: Sensor,
    light: LightPose,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help=".png, .tif (float) or .npy")],
    noise_seed: Annotated[int | None, typer.Option(help="Add the sensor's noise, from this seed.")] = None,
    as_json: Json = False,
) -> None:
    """Render one image of a scene."""
    loaded = scenes.load(scene)
    image = render.image(loaded, parse_pose("--sensor", sensor), parse_pose("--light", light))
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


@app.command("measure")
def measure_command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Image of the camera's size.")],
    scene: SceneName,
    sensor: Sensor,
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Light pose; not needed to measure.")] = None,
    estimator: Annotated[str, typer.Option(help=" or ".join(measure.ESTIMATORS))] = "gradient",
    threshold: Annotated[float | None, typer.Option(help="Gradient threshold of canny, grey levels a px.")] = None,
    as_json: Json = False,
) -> None:
    """Measure the scene's distance in an image. Exit status 1 if it cannot be measured."""
    loaded = scenes.load(scene)
    poses = parse_pose("--sensor", sensor), light and parse_pose("--light", light)
    found = measure.distance(picture_file.read(file), loaded, *poses, estimator, threshold)
    good = bool(np.isfinite(found.value_px))
    facts = {
        "file": str(file),
        "value_px": float(found.value_px) if good else None,
        "variance_px2": float(found.variance_px2) if good else None,
        "status": str(found.status),
        "corners": found.corners.tolist() if good else None,
        "edges": [
            {
                "name": name,
                "status": str(found.edge_status[i]),
                "points": int(found.used[i]),
                "contrast": float(found.edge_contrast[i]),
            }
            for i, name in enumerate(found.edge_names)
        ],
    }
    edges = ", ".join(
        f"{edge['name']} {edge['status']} ({edge['points']} points, contrast {edge['contrast']:.0f})"
        for edge in facts["edges"]
    )
    value = f"{found.value_px:.4f} +- {np.sqrt(found.variance_px2):.4f} px (1 sigma)" if good else "not measured"
    say(facts, as_json, f"{value}, {found.status}\nedges: {edges}")
    raise typer.Exit(0 if good else 1)
