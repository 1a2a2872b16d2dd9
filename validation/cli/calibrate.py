"""``ice calibrate``: what each locator makes of noise (the paper's Fig. 1)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.cli.common import Json, SceneName, Seed, check_number, check_seed, commands, progress, say, scene_of
from validation.cli.outputs import check_file
from validation.defaults import DEFAULT_SEED
from validation.report.terminal import console

commands = commands()
_MOST_IMAGES = 100_000


@commands.command("calibrate")
def calibrate_command(
    scene: SceneName,
    images: Annotated[int, typer.Option(help="Noisy images for each angle and noise level.")] = 200,
    seed: Seed = DEFAULT_SEED,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE.png", help="Picture.")] = None,
    as_json: Json = False,
) -> None:
    """Measure kappa^2 and the correlation length of every locator, and compare with the closed form and the bound."""
    check_number("--images", images, 10, _MOST_IMAGES)
    check_seed(seed)
    check_file("--output", output, ".png")
    loaded = scene_of(scene)
    from measure.calibration import calibrate
    from validation.report import calibration_table

    with progress(f"{loaded.name}: locators", unit="levels", at_once=True) as shown:
        found = calibrate(loaded, images, seed, shown)
    if output is not None:
        from validation.report import calibration_figure  # matplotlib takes half a second to load

        calibration_figure.draw(found, output)
    if as_json:
        say(calibration_table.facts(found), True, "")
        return
    console().print(calibration_table.table(found))
    if output is not None:
        console().print(f"picture: {output}", highlight=False)
