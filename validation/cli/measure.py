"""``ice measure``: one image, of a known scene or a photograph."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

import scenes
from scenes import InvalidInput, photograph
from validation.cli import measurands, recorded
from validation.cli.common import Json, commands, parse_pose, parse_poses, say
from validation.report.terminal import console

if TYPE_CHECKING:
    import measure

commands = commands()


@commands.command("measure")
def measure_command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="PNG, TIFF, JPEG or .npy, 8 or 16 bit or float.")],
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="Scene that the image shows, if known.")
    ] = None,
    sensor: Annotated[str | None, typer.Option(metavar="P,A", help="Sensor pose; needed with SCENE.")] = None,
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Light pose; tells how bright each face is.")] = None,
    estimator: Annotated[str | None, typer.Option(help="How; a wrong name lists them all.")] = None,
    threshold: Annotated[float | None, typer.Option(help="Gradient threshold of canny, grey levels a px.")] = None,
    lens: Annotated[Path | None, typer.Option(metavar="TOML", help="Camera: fx, fy, cx, cy, distortion.")] = None,
    gamma: recorded.Gamma = None,
    channel: recorded.Channel = None,
    bayer: recorded.Bayer = None,
    mtf: recorded.Mtf = None,
    as_json: Json = False,
) -> None:
    """Measure an image: the measurands of a known scene, or else the quadrilateral that it shows.

    Exit status 1 if something cannot be measured.
    """
    import measure
    from validation import picture_file

    if scene is None:
        photo = photograph.read(file, gamma, channel, bayer)
        found = measure.measure_quadrilateral(photo, estimator or "arrangement", lens and measure.load_lens(lens))
        facts = _quadrilateral_facts(found) | recorded.facts(photo, found, mtf)
        say({"file": str(file), **facts}, as_json, f"{_quadrilateral_text(found)}\n{recorded.text(facts)}")
        raise typer.Exit(0 if found.measurands else 1)
    recorded.refuse({"--gamma": gamma, "--channel": channel, "--bayer": bayer, "--mtf": mtf})
    picture = picture_file.read(file)
    if sensor is None:
        raise InvalidInput("--sensor must be given with a scene, got nothing")
    if lens is not None:
        raise InvalidInput(f"--lens must be left out with a scene, whose camera is a pinhole, got {lens}")
    poses = parse_pose("--sensor", sensor), parse_poses("--light", light)
    known = scenes.load(scene)
    found = measure.measure(picture, known, *poses, estimator, threshold)
    rows = measurands.facts(found)
    told = {"measurands": rows, "covariance": measurands.covariance(found)}
    distance = found.first if known.task is not None else None
    if distance is not None:
        told |= _distance_facts(distance)
    if as_json:
        say({"file": str(file), **told}, True, "")
    else:
        shown = console()
        shown.print(measurands.table(rows))
        if distance is not None:
            shown.print(_distance_text(distance, told["edges"]), highlight=False)
    raise typer.Exit(0 if all(row["value"] is not None for row in rows) else 1)


def _distance_facts(found: measure.Measurement) -> dict:
    good = bool(np.isfinite(found.value_px))
    return {
        "value_px": float(found.value_px) if good else None,
        "variance_px2": float(found.variance_px2) if good else None,
        "status": str(found.status),
        "p_value": float(found.p_value) if np.isfinite(found.p_value) else None,
        "corners": found.corners.tolist() if good else None,
        "edges": [
            {
                "name": name,
                "status": str(found.edge_status[i]),
                "used": int(found.used[i]),
                "rejected": int(found.rejected[i]),
                "contrast": float(found.edge_contrast[i]),
            }
            for i, name in enumerate(found.edge_names)
        ],
    }


def _distance_text(found: measure.Measurement, edges: list[dict]) -> str:
    good = np.isfinite(found.value_px)
    value = f"{found.value_px:.4f} +- {np.sqrt(found.variance_px2):.4f} px (1 sigma)" if good else "not measured"
    told = ", ".join(f"{e['name']} {e['status']} ({e['used']} used, contrast {e['contrast']:.0f})" for e in edges)
    return f"{value}, {found.status}{_fit(found.p_value)}\nedges: {told}"


def _fit(p_value: float) -> str:
    return f" (goodness of fit: p = {p_value:.2g})" if np.isfinite(p_value) else ""


def _quadrilateral_facts(found: measure.Quadrilateral) -> dict:
    return {
        "status": found.status,
        "p_value": found.p_value if np.isfinite(found.p_value) else None,
        "corners": found.corners.tolist() if found.measurands else None,
        "noise": found.noise,
        "blur_px": found.blur_px,
        "quantities": [vars(value) for value in found.measurands],
    }


def _quadrilateral_text(found: measure.Quadrilateral) -> str:
    seen = f"noise {found.noise:.2f} grey levels, blur {found.blur_px:.2f} px{_fit(found.p_value)}"
    lines = [f"quadrilateral: {found.status}; {seen}"]
    if found.measurands:
        sigma = np.sqrt(np.diag(found.covariance)).reshape(4, 2)
        for i, ((x, y), (sx, sy)) in enumerate(zip(found.corners, sigma, strict=True), 1):
            lines.append(f"corner {i:<12} ({x:.3f} +- {sx:.3f}, {y:.3f} +- {sy:.3f}) px")
    lines += [f"{q.name:<19} {q.value:.3f} +- {q.sigma:.3f} {q.unit}" for q in found.measurands]
    return "\n".join([*lines, "(1 sigma)"])
