"""``ice predict``: how precisely, without an image."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import scenes
from scenes import InvalidInput, Pose, several
from validation.cli.common import Json, SceneName, commands, parse_pose, parse_poses, say
from validation.report.terminal import console

if TYPE_CHECKING:
    from rich.table import Table

    from planner import Prediction

commands = commands()


@commands.command("predict")
def predict_command(
    scene: SceneName,
    sensor: Annotated[str | None, typer.Option(metavar="P,A", help="Sensor pose; the settings if left out.")] = None,
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Of the free light, or of each.")] = None,
    model: Annotated[str, typer.Option(help="calibrated, paper or bound.")] = "calibrated",
    as_json: Json = False,
) -> None:
    """Predict how precisely every measurand is measured, for the scene's settings or a given pose."""
    poses = None if sensor is None else parse_pose("--sensor", sensor), parse_poses("--light", light)
    loaded = scenes.load(scene)
    pictures = _pictures(loaded, *poses)
    import planner

    rows = [_facts(picture, planner.predict(picture, model=model)) for picture in pictures]
    if as_json:
        say({"scene": loaded.name, "model": model, "settings": rows}, True, "")
    else:
        console().print(_table(loaded, model, rows))
    good = all(each["variance"] is not None for row in rows for each in row["measurands"])
    raise typer.Exit(0 if good else 1)


def _pictures(scene: scenes.Scene, sensor: Pose | None, light: Any) -> list[scenes.Picture]:
    if sensor is not None:
        return [scenes.Picture.of(scene, sensor, () if light is None else several(light))]
    if light is not None:
        raise InvalidInput("--sensor must be given with --light, got none")
    if not scene.settings:
        raise InvalidInput("--sensor must be given for a scene without settings, got none")
    return [scenes.Picture.of(scene, each.sensor, each.lights) for each in scene.settings]


def _facts(picture: scenes.Picture, found: Prediction) -> dict[str, Any]:
    """Variances, not standard deviations; null for what is not known."""
    return {
        "sensor": list(picture.sensor),
        "light": [list(pose) for pose in picture.lights],
        "status": found.status,
        "measurands": [
            {
                "name": each.name, "kind": each.kind, "unit": each.unit, "value": _known(each.value_object),
                "variance": _known(each.variance_object), "bias": _known(each.bias_object),
                "value_image": _known(each.value_image), "variance_image": _known(each.variance_image),
                "bias_image": _known(each.bias_image), "status": each.status,
            }
            for each in found.measurands
        ],
    }  # fmt: skip


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _table(scene: scenes.Scene, model: str, rows: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    made = Table(title=f"{scene.name}: predicted ({model}, +- 1 sigma)", title_justify="left", box=None, padding=(0, 1),
                 title_style="bold")  # fmt: skip
    for column in ("sensor", "light", "measurand", "value", "sigma", "bias", "unit", "in the image", "sigma", "status"):
        made.add_column(column, justify="left" if column in ("measurand", "unit", "status") else "right", no_wrap=True)
    for row in rows:
        lights = " ".join(_pose(pose) for pose in row["light"])
        for each in row["measurands"]:
            sigma, image = (_root(each[key]) for key in ("variance", "variance_image"))
            made.add_row(
                _pose(row["sensor"]), lights, each["name"], _number(each["value"], 6), sigma,
                _number(each["bias"], 2), each["unit"], _number(each["value_image"], 6), image, each["status"],
            )  # fmt: skip
    return made


def _pose(pose: list[float]) -> str:
    return f"({pose[0]:.4g}, {pose[1]:.4g})"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _root(variance: float | None) -> str:
    return "-" if variance is None else f"{np.sqrt(variance):.3g}"
