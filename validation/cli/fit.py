"""``ice fit``: a scene's camera, poses, light and noise from photographs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenes import InvalidInput
from scenes.files.image import Size
from scenes.photograph import read
from validation.cli import photograph, recorded
from validation.cli.common import Json, SceneName, commands, parse_pose, parse_poses, say, scene_of, taking
from validation.cli.outputs import check_file
from validation.report.terminal import console

if TYPE_CHECKING:
    from rich.table import Table

    from measure.fitting.result import Fit

commands = commands()
_MOST_PHOTOGRAPHS = 1000


@dataclass(frozen=True)
class Options:
    """What a fit is asked for."""

    scene: SceneName
    photographs: Annotated[list[Path], typer.Argument(metavar="PHOTO...", help="PNG, TIFF, JPEG or .npy.")]
    sensor: Annotated[
        str | None, typer.Option(metavar="P,A", help="Where the search begins; the nearest setting if left out.")
    ] = None
    light: Annotated[str | None, typer.Option(metavar="P,A", help="The same of the free light, or of each.")] = None
    free: Annotated[str, typer.Option(metavar="LIST", help="Free besides: focal, k1, with commas between.")] = ""
    noise: Annotated[str, typer.Option(help="estimated, or given by the scene.")] = "estimated"
    gamma: recorded.Gamma = None
    channel: recorded.Channel = None
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.toml", help="Write the fitted scene.")
    ] = None
    residuals: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw what the fit leaves of the photographs.")
    ] = None
    as_json: Json = False


@commands.command("fit")
@taking(Options)
def fit_command(given: Options) -> None:
    """Fit a scene to photographs of its part, by maximum likelihood with the image model."""
    poses = None if given.sensor is None else parse_pose("--sensor", given.sensor), parse_poses("--light", given.light)
    if len(given.photographs) > _MOST_PHOTOGRAPHS:
        raise InvalidInput(f"PHOTO... must be at most {_MOST_PHOTOGRAPHS} files, got {len(given.photographs)}")
    check_file("--output", given.output, ".toml")
    check_file("--residuals", given.residuals, ".png")
    loaded = scene_of(given.scene)
    size = Size.of_camera(loaded.camera)
    images = [read(path, given.gamma, given.channel, size=size) for path in given.photographs]
    import measure

    found = measure.fit(loaded, images, *poses, free=tuple(filter(None, given.free.split(","))), noise=given.noise)
    if given.output:
        from validation import fitted_scene

        fitted_scene.write(found, given.scene, given.output)
    if given.residuals:
        from validation.report import residuals

        residuals.draw(found, [image.levels for image in images], given.residuals)
    if given.as_json:
        fitted = None if given.output is None else str(given.output)
        say({"scene": loaded.name, **facts(found), "fitted": fitted}, True, "")
    else:
        console().print(_table(loaded.name, found))
        console().print(_said(found), highlight=False)
    raise typer.Exit(1 if found.status in ("misfit", "low_contrast") else 0)


def facts(found: Fit) -> dict[str, Any]:
    """What has been fitted, for JSON."""
    rows = zip(found.names, found.units, found.start, found.values, found.standard_errors, found.statuses, strict=True)
    return {
        "status": found.status,
        "p_value": found.p_value if math.isfinite(found.p_value) else None,
        "noise": found.noise,
        "parameters": [
            {
                "name": name, "unit": unit, "start": float(start), "value": float(value),
                "standard_error": float(error) if status == "ok" else None, "status": status,
            }
            for name, unit, start, value, error, status in rows
        ],
        "covariance": found.covariance.tolist(),
        "poses": [
            {"sensor": list(shown.sensor), "lights": [list(pose) for pose in shown.lights], "photographs": len(group)}
            for shown, group in zip(found.pictures, found.members, strict=True)
        ],
    }  # fmt: skip


_TERMS = (
    "parameter: a key of the scene file, a pose (polar, azimuth; degrees), or by how much the camera looks beside "
    "look_at (aim). start: as the scene has it. standard error: 1 sigma."
)


def _table(name: str, found: Fit) -> Table:
    from validation.report import cells

    count = sum(map(len, found.members))
    title = f"{name} fitted to {count} photograph{'s' * (count != 1)}"
    columns = ("parameter", "start", "fitted", "standard error", "unit", "")
    made = cells.table(title, *columns, words=("parameter", "unit", ""), caption=_TERMS)
    rows = zip(found.names, found.units, found.start, found.values, found.standard_errors, found.statuses, strict=True)
    for name, unit, start, value, error, status in rows:
        told = f"{error:.2g}" if status == "ok" else "-"
        held = "" if status == "ok" else "the photographs do not tell it"
        made.add_row(name, f"{start:.6g}", f"{value:.6g}", told, unit, held)
    return made


def _said(found: Fit) -> str:
    whence = {
        "estimated": "noise from differences of neighbouring pixels", "given": "noise as the scene has it",
        "repeated": "noise from repeated photographs (photon transfer)",
    }[found.noise]  # fmt: skip
    if found.status == "low_contrast":
        return "low_contrast: nothing in the photograph stands out of its noise; move the lamp, or expose longer"
    poses = f"{len(found.pictures)} pose{'s' * (len(found.pictures) != 1)}"
    text = f"{found.status}{photograph.fit(found.p_value)}; {poses}, {whence}\n{photograph.of_fit()}"
    if found.status == "tone_unknown":
        text += (
            "\nNeither the files nor the photographs tell whether levels are linear in the light: say it by --gamma."
        )
    if found.status == "misfit":
        text += (
            "\nThe photographs are not what the model says: neither values nor standard errors are to be trusted. "
            "The picture of the residuals (--residuals) shows where; mend the scene there, or free more parameters "
            "(--free)."
        )
    return text
