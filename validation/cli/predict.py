"""``ice predict``: how precisely, without an image."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

import scenes
from scenes import InvalidInput, Pose, several
from scenes.status import CLUTTER, is_trusted, legend, worst
from validation.cli.common import Json, SceneName, commands, parse_pose, parse_poses, progress, say, scene_of
from validation.report.cells import PLACES
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    from rich.table import Table

    from measure import Correction
    from planner import Prediction

commands = commands()
_TERMS = (
    "sigma: standard deviation of one picture's value by noise, of the object and, px or degrees, in the image. bias: "
    "mean error."
)
_SIMULATED = (
    "sigma: standard deviation of one picture's value by noise. bias: mean error in a simulated picture, ± its "
    "standard uncertainty; `ice measure` takes it off."
)
_RENDER = "`--render` simulates these pictures and finds the biases, which `ice measure` takes off."
_MOST_TOLD = 8  # pictures whose doubtful edges are told of


@commands.command("predict")
def predict_command(
    scene: SceneName,
    sensor: Annotated[str | None, typer.Option(metavar="P,A", help="Sensor pose; the settings if left out.")] = None,
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Of the free light, or of each.")] = None,
    model: Annotated[str, typer.Option(help="calibrated, paper or bound.")] = "calibrated",
    render: Annotated[
        bool, typer.Option("--render", help="Noise and bias by simulation, the bias as measuring takes it off.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Predict how precisely every measurand is measured, for the scene's settings or a given pose."""
    if render and model != "calibrated":
        raise InvalidInput(f"--render must be left out with --model {model}, got both")
    poses = None if sensor is None else parse_pose("--sensor", sensor), parse_poses("--light", light)
    loaded = scene_of(scene)
    pictures = _pictures(loaded, *poses)
    import planner

    found = [planner.predict(picture, model=model) for picture in pictures]
    rows = [_facts(picture, each) for picture, each in zip(pictures, found, strict=True)]
    if render:
        rows = _simulated(pictures, found, rows)
    if as_json:
        say({"scene": loaded.name, "model": model, "rendered": render, "settings": rows}, True, "")
    else:
        console().print(_table(loaded, model, rows, render))
        edges = [] if render else doubtful_edges(found)
        for line in _below(rows, edges, _SIMULATED if render else _TERMS, offers=not render and model == "calibrated"):
            console().print(f" {line}", highlight=False)
    good = all(each["variance"] is not None for row in rows for each in row["measurands"])
    raise typer.Exit(0 if good else 1)


def _below(rows: list[dict[str, Any]], edges: list[str], terms: str, offers: bool) -> Iterator[str]:
    """What stands below the table; ``offers`` to simulate, where that would tell more."""
    every = [each for row in rows for each in row["measurands"]]
    yield f"{PLACES} {terms}"
    yield from _zones(every)
    yield from legend([each["status"] for each in every], [f"{e['name']}: {e['reason']}" for e in every])
    yield from edges
    if offers and any(each["status"] == CLUTTER for each in every):
        yield _RENDER


def _zones(every: list[dict[str, Any]]) -> Iterator[str]:
    """Of the first forms, what noise makes of a perfect feature: `ice measure` takes its mean off."""
    forms = [each for each in every if "noise_zone" in each]
    for each in forms[:_MOST_TOLD]:
        zone, unit = each["noise_zone"], each["unit"]
        yield (
            f"{each['name']}: by noise {zone['points']} points of a perfect feature seem to need "
            f"{zone['mean']:.3g} {unit}, in 95 % no more than {zone['at_most']:.3g}."
        )


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
                "reason": each.reason, "u_bias": None, **_zone_of_noise(found, each.name),
            }
            for each in found.measurands
        ],
    })  # fmt: skip


def _zone_of_noise(found: Prediction, name: str) -> dict[str, Any]:
    """Of a form the zone that noise makes of a perfect feature."""
    law = found.forms.get(name)
    if law is None:
        return {}
    return {"noise_zone": {"mean": law.noise.mean, "at_most": law.noise.quantile(0.95), "points": len(law.at)}}


def _simulated(
    pictures: list[scenes.Picture], found: list[Prediction], rows: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """The same with noise and bias as simulated pictures have them, and the statuses that values have without it."""
    from validation import budgets

    with progress("simulating pictures for their bias", "pictures", at_once=True) as report:
        made = []
        for number, (picture, predicted, row) in enumerate(zip(pictures, found, rows, strict=True)):
            made.append(_of_correction(budgets.simulated(picture), predicted, row))
            report("rendering and measuring", number + 1, len(pictures))
    return made


def _of_correction(off: Correction, predicted: Prediction, row: dict[str, Any]) -> dict[str, Any]:
    measurands = []
    for m, (forecast, state) in enumerate(zip(predicted.measurands, off.status, strict=True)):
        sigma, u = float(off.sigma[m]), float(off.u_bias[m])
        told = {
            "variance": sigma**2, "bias": off.bias[m], "u_bias": u, "status": state,
            "variance_image": off.covariance_image[m, m], "bias_image": off.bias_image[m],
            "reason": forecast.why(state, u if math.isfinite(off.bias[m]) else None, sigma),
        }  # fmt: skip
        measurands.append(row["measurands"][m] | plain(told))
    return row | {"status": worst(*off.status), "measurands": measurands}


def _table(scene: scenes.Scene, model: str, rows: list[dict[str, Any]], render: bool) -> Table:
    from validation.report.cells import MODELS, number, pose, sigma, table

    columns = ("sensor", "light", "measurand", "value", "sigma", "bias", "unit", "in the image", "sigma", "status")
    by = "by simulated pictures" if render else f"predicted by {MODELS[model]}"
    made = table(f"{scene.name}: {by}", *columns, words=("measurand", "unit", "status"))
    for row in rows:
        for each in row["measurands"]:
            made.add_row(
                pose(row["sensor"]), pose(row["light"]), each["name"], number(each["value"], ".6g"),
                sigma(each["variance"]), _bias(each), each["unit"], number(each["value_image"], ".6g"),
                sigma(each["variance_image"]), each["status"],
            )  # fmt: skip
    return made


def _bias(row: dict[str, Any]) -> str:
    """With what a simulation leaves open of it."""
    from validation.report.cells import number

    beside = "" if row["u_bias"] is None else f" ± {row['u_bias']:.1g}"
    return number(row["bias"], ".2g") + beside
