"""``ice export``: what measures one picture at a known place with NumPy alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import scenes
from validation.cli.common import Json, SceneName, commands, parse_pose, parse_poses, progress, say, scene_of
from validation.cli.outputs import check_directory

commands = commands()


@commands.command("export")
def export_command(
    scene: SceneName,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Where it is written.")],
    sensor: Annotated[str, typer.Option(metavar="P,A", help="Sensor pose: polar angle and azimuth, degrees.")],
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Of the free light, or of each.")] = None,
    estimator: Annotated[str, typer.Option(help="Of the straight edges: gradient.")] = "gradient",
    as_measured: Annotated[bool, typer.Option("--as-measured", help="Take no bias off, simulate no bias.")] = False,
    as_json: Json = False,
) -> None:
    """Write a line's recipe: a folder that measures pictures of a scene from one place, with NumPy alone.

    Its answers are those of `ice measure` by the same estimator; README.md in it says how it is used.
    """
    import measure

    if estimator not in measure.ESTIMATORS:
        raise scenes.InvalidInput(f"--estimator must be one of {', '.join(measure.ESTIMATORS)}, got {estimator!r}")
    check_directory("--output", output)
    picture = scenes.Picture.of(scene_of(scene), parse_pose("--sensor", sensor), parse_poses("--light", light))
    from validation.recipe import export, folder

    export.check(picture, estimator)
    with progress("simulating the picture", "renders", at_once=True):
        told = folder.write(export.export(picture, estimator, as_measured=as_measured), scene, output)
    kept = f"{len(told['files'])} files, {told['bytes'] / 1e6:.1f} MB"
    names = ", ".join(each["name"] for each in told["measurands"])
    say(told, as_json, f"{output}: {kept}. recipe.py measures {names}; README.md says how it is used.")
