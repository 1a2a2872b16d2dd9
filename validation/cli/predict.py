"""``ice predict``: how precisely, without an image."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

import scenes
from scenes import InvalidInput, Pose, several
from scenes.status import is_trusted, legend
from validation.cli.common import Json, SceneName, commands, parse_pose, parse_poses, say
from validation.report.cells import PLACES
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    from rich.table import Table

    from planner import Prediction

commands = commands()
_TERMS = (
    "sigma: standard deviation of one picture's value by noise, of the object and, px or degrees, in the image. bias: "
    "mean error."
)
_MOST_TOLD = 8  # pictures whose doubtful edges are told of


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

    found = [planner.predict(picture, model=model) for picture in pictures]
    rows = [_facts(picture, each) for picture, each in zip(pictures, found, strict=True)]
    if as_json:
        say({"scene": loaded.name, "model": model, "settings": rows}, True, "")
    else:
        console().print(_table(loaded, model, rows))
        console().print(f" {PLACES} {_TERMS}", highlight=False)
        every = [each for row in rows for each in row["measurands"]]
        for line in legend([each["status"] for each in every], [f"{e['name']}: {e['reason']}" for e in every]):
            console().print(f" {line}", highlight=False)
        for line in doubtful_edges(found):
            console().print(f" {line}", highlight=False)
    good = all(each["variance"] is not None for row in rows for each in row["measurands"])
    raise typer.Exit(0 if good else 1)


def doubtful_edges(found: list[Prediction]) -> list[str]:
    """Which edges cannot be relied on, and how long and bright they are: a line a picture, at most `_MOST_TOLD`."""
    from validation.report.cells import pose

    lines = []
    for each in found:
        bad = [edge for edge in each.edges if not is_trusted(edge.status)]
        if bad:
            told = (f"{e.name} {e.status}, {e.length_px:.3g} px long, contrast {e.contrast:.3g}" for e in bad)
            place = f"sensor {pose(each.picture.sensor)}, light {pose(each.picture.lights)}"
            lines.append(f"{place}: {'; '.join(told)} grey levels.")
    more = [f"and {len(lines) - _MOST_TOLD} more places"] if len(lines) > _MOST_TOLD else []
    return lines[:_MOST_TOLD] + more


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
    return plain({
        "sensor": list(picture.sensor),
        "light": [list(pose) for pose in picture.lights],
        "status": found.status,
        "measurands": [
            {
                "name": each.name, "kind": each.kind, "unit": each.unit, "value": each.value_object,
                "variance": each.variance_object, "bias": each.bias_object, "value_image": each.value_image,
                "variance_image": each.variance_image, "bias_image": each.bias_image, "status": each.status,
                "reason": each.reason,
            }
            for each in found.measurands
        ],
    })  # fmt: skip


def _table(scene: scenes.Scene, model: str, rows: list[dict[str, Any]]) -> Table:
    from validation.report.cells import MODELS, number, pose, sigma, table

    columns = ("sensor", "light", "measurand", "value", "sigma", "bias", "unit", "in the image", "sigma", "status")
    made = table(f"{scene.name}: predicted by {MODELS[model]}", *columns, words=("measurand", "unit", "status"))
    for row in rows:
        for each in row["measurands"]:
            made.add_row(
                pose(row["sensor"]), pose(row["light"]), each["name"], number(each["value"], ".6g"),
                sigma(each["variance"]), number(each["bias"], ".2g"), each["unit"], number(each["value_image"], ".6g"),
                sigma(each["variance_image"]), each["status"],
            )  # fmt: skip
    return made
