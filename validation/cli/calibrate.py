"""``ice calibrate``: what each locator makes of noise (the paper's Fig. 1)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

import scenes
from measure.calibration import Calibration, blur_for, calibrate
from scenes import InvalidInput
from validation.cli.common import Json, SceneName, Seed, app, progress, say
from validation.defaults import DEFAULT_SEED
from validation.report.table import console


@app.command("calibrate")
def calibrate_command(
    scene: SceneName,
    images: Annotated[int, typer.Option(help="Noisy images for each angle and noise level.")] = 200,
    seed: Seed = DEFAULT_SEED,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE.png", help="Picture.")] = None,
    as_json: Json = False,
) -> None:
    """Measure kappa^2 and the correlation length of every locator, and compare with the closed form and the bound."""
    if images < 10:
        raise InvalidInput(f"--images must be at least 10, got {images}")
    loaded = scenes.load(scene)
    with progress(f"{loaded.name}: locators", unit="levels") as shown:
        found = calibrate(loaded, images, seed, shown or (lambda *_: None))
    if output is not None:
        from validation.report import calibration_figure  # matplotlib takes half a second to load

        calibration_figure.draw(found, output)
    if as_json:
        say(_facts(found), True, "")
        return
    console().print(_table(found))
    if output is not None:
        console().print(f"picture: {output}", highlight=False)


def _facts(found: Calibration) -> dict:
    curves = [
        {**vars(curve), "ratios": curve.ratios.tolist(), "sigma_px": _finite(curve.sigma_px)} for curve in found.curves
    ]
    for curve in curves:
        for key in ("floor_px", "kappa2", "correlation_px", "linear_to", "efficiency"):
            curve[key] = curve[key] if np.isfinite(curve[key]) else None
    return {**vars(found), "curves": curves}


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def _table(found: Calibration) -> Table:
    caption = (
        f"closed form of gradient: kappa^2 {found.closed_kappa2:.3f} over {found.closed_correlation_px:.2f} px; the "
        f"calibrated model uses it. Bound of kappa^2 x length: {found.bound:.3f} px.\n"
        f"The paper's kappa^2 is {found.paper_kappa2}; the closed form gives that at a lens blur of "
        f"{blur_for(found.paper_kappa2, found.scale_px):.2f} px instead of {found.blur_px:g}.\n"
        "floor: noise-free error of the points. strip and polygon find none: theirs is the variance "
        "of a line's middle, told at gradient's length."
    )
    table = Table(title=f"{found.scene}: position noise of the locators", caption=caption, box=None, padding=(0, 2))
    table.title_justify = table.caption_justify = "left"
    for name in (
        "locator",
        "floor px",
        "kappa^2",
        "correlation px",
        "product px",
        "efficiency",
        "linear to noise/contrast",
    ):
        table.add_column(name, justify="right", no_wrap=True)
    for curve in found.curves:
        product = curve.kappa2 * curve.correlation_px
        cells = (curve.floor_px, curve.kappa2, curve.correlation_px, product, curve.efficiency, curve.linear_to)
        table.add_row(curve.name, *(f"{value:.3g}" if np.isfinite(value) else "-" for value in cells))
    return table
