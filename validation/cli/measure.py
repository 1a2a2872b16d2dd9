"""``ice measure``: one image, of a known scene or a photograph."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import numpy as np
import typer

import scenes
import scenes.photograph
from scenes import InvalidInput
from scenes.files.image import Size
from scenes.photograph import Photograph
from scenes.status import legend
from validation.cli import measurands, photograph, recorded
from validation.cli.common import Json, commands, parse_pose, parse_poses, progress, say
from validation.cli.outputs import check_file
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure

commands = commands()

_MOST, _ALL = 5, 1000  # shapes that are measured


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
    near: Annotated[
        str | None, typer.Option(metavar="X,Y", help="The shape at this place of a photograph, px.")
    ] = None,
    box: Annotated[str | None, typer.Option(metavar="X0,Y0,X1,Y1", help="Shapes in this box, px.")] = None,
    corners: Annotated[
        tuple[str, str, str, str] | None,
        typer.Option(metavar="X,Y X,Y X,Y X,Y", help="A quadrilateral whose corners are here, to some 5 px."),
    ] = None,
    kind: Annotated[
        str | None, typer.Option(help="quadrilateral, circle, ellipse, tag, chessboard; several with commas.")
    ] = None,
    most: Annotated[int | None, typer.Option(help="Shapes to measure, the most prominent first.")] = None,
    every: Annotated[bool, typer.Option("--all", help="Measure all shapes that are found.")] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="PNG", help="Draw the photograph with what was found.")
    ] = None,
    as_measured: Annotated[
        bool, typer.Option("--as-measured", help="With SCENE: take no bias off, simulate nothing.")
    ] = False,
    gamma: recorded.Gamma = None,
    channel: recorded.Channel = None,
    bayer: recorded.Bayer = None,
    mtf: recorded.Mtf = None,
    as_json: Json = False,
) -> None:
    """Measure an image: the measurands of a known scene, or else the shapes that it shows.

    With a scene and its light the bias is simulated and taken off; what that is not sure of is u_bias. Of a photograph
    the five most prominent shapes are measured where nothing else is said. Exit status 1 if something cannot be
    measured; of a photograph's shapes, if none can.
    """
    import measure

    if estimator is not None and estimator not in measure.ESTIMATORS:
        raise InvalidInput(f"--estimator must be one of {', '.join(measure.ESTIMATORS)}, got {estimator!r}")
    check_file("--output", output, ".png", ".pdf", ".svg")
    check_file("--mtf", mtf, ".png")
    options = {
        "--near": near, "--box": box, "--corners": corners, "--kind": kind, "--most": most, "--output": output,
        "--all": every or None, "--gamma": gamma, "--channel": channel, "--bayer": bayer, "--mtf": mtf,
    }  # fmt: skip
    if scene is None:
        if as_measured:
            raise InvalidInput("--as-measured must be left out without a scene, got it")
        wanted = _shapes_wanted(options)
        photo = scenes.photograph.read(file, gamma, channel, bayer)
        found = measure.photograph(
            photo, **wanted, estimator=estimator or "arrangement", lens=lens and measure.load_lens(lens)
        )
        _say_shapes(file, photo, found, output, mtf, as_json)
    for option, value in options.items():
        if value is not None:
            raise InvalidInput(f"{option} must be left out with a scene, got {value}")
    if sensor is None:
        raise InvalidInput("--sensor must be given with a scene, got nothing")
    if lens is not None:
        raise InvalidInput(f"--lens must be left out with a scene, whose camera is a pinhole, got {lens}")
    poses = parse_pose("--sensor", sensor), parse_poses("--light", light)
    from validation import picture_file

    known = scenes.load(scene)
    picture = picture_file.read(file, Size.of_camera(known.camera))
    shown = scenes.Picture.of(known, *poses)
    if as_measured or not shown.lights:
        found = measure.measure(picture, shown, estimator=estimator, threshold=threshold)
    else:
        found = _corrected(picture, shown, estimator, threshold)
    _say_measurands(file, found, found.first if known.task is not None else None, as_json)


def _corrected(
    image: np.ndarray, picture: scenes.Picture, estimator: str | None, threshold: float | None
) -> measure.Measurements:
    """With the bias taken off that a simulation tells; what is wrong with the image is said before anything is."""
    import measure
    from validation.remeasured import Method

    method = Method(estimator or measure.best_estimator(picture.scene), threshold)
    plain = measure.measure(image, picture, estimator=method.locator, threshold=threshold)
    if not np.isfinite(plain.value).any():
        return plain
    from validation import kept

    with progress("simulating the picture for its bias", "renders", at_once=True):
        return measure.corrected(plain, kept.correction(picture, method))


def _shapes_wanted(options: dict[str, Any]) -> dict[str, Any]:
    """Which shapes of a photograph are measured, as `measure.photograph` takes it."""
    corners, kind, most = options["--corners"], options["--kind"], options["--most"]
    if options["--all"] and most is not None:
        raise InvalidInput(f"--most must be left out with --all, got {most}")
    wanted = {
        "near": photograph.numbers("--near", options["--near"], 2),
        "box": photograph.numbers("--box", options["--box"], 4),
        "corners": corners and [photograph.numbers("--corners", corner, 2) for corner in corners],
        "kinds": None if kind is None else tuple(kind.split(",")),
        "most": _ALL if options["--all"] else _MOST if most is None else most,
    }
    if options["--mtf"] is not None:
        recorded.check_mtf(wanted["kinds"])
    return wanted


def _say_measurands(
    file: Path,
    found: measure.Measurements,
    distance: measure.Measurement | None,
    as_json: bool,
) -> NoReturn:
    """All measurands of a scene, and its distance edge by edge; exit status 1 where one could not be measured."""
    rows = measurands.facts(found)
    told = {"measurands": rows, "covariance": measurands.covariance(found)}
    if distance is not None:
        told |= _distance_facts(distance)
    if as_json:
        say({"file": str(file), **told}, True, "")
    else:
        shown = console()
        shown.print(measurands.table(rows))
        for line in legend([row["status"] for row in rows], measurands.reasons(rows, found)):
            shown.print(f" {line}", highlight=False)
        if distance is not None:
            shown.print(_distance_text(distance, told["edges"]), highlight=False)
    raise typer.Exit(0 if all(row["value"] is not None for row in rows) else 1)


def _say_shapes(
    file: Path, photo: Photograph, found: measure.Shapes, output: Path | None, mtf: Path | None, as_json: bool
) -> NoReturn:
    """The shapes of a photograph, drawn if wanted; exit status 1 where nothing could be measured."""
    sharp = recorded.sharpness(photo, found, mtf) if mtf is not None else {}
    if output is not None:
        from validation.report import overlay

        overlay.write(output, photo.levels, found)
    if as_json:
        say({"file": str(file), **recorded.facts(photo), **photograph.facts(found), **sharp}, True, "")
    else:
        if found.candidates:
            console().print(photograph.table(found), highlight=False)
        lines = [recorded.text(photo), photograph.text(found), *recorded.sharpness_lines(sharp)]
        say({}, False, "\n".join(lines))
    good = any(one.measured for one in found.found) and sharp.get("mtf") != []
    raise typer.Exit(0 if good else 1)


def _distance_facts(found: measure.Measurement) -> dict:
    good = bool(np.isfinite(found.value_px))
    edges = zip(found.edge_names, found.edge_status, found.used, found.rejected, found.edge_contrast, strict=True)
    keys = ("name", "status", "used", "rejected", "contrast")
    return plain({
        "value_px": found.value_px,
        "variance_px2": found.variance_px2 if good else None,
        "status": str(found.status),
        "p_value": found.p_value,
        "corners": found.corners if good else None,
        "edges": [dict(zip(keys, edge, strict=True)) for edge in edges],
    })  # fmt: skip


def _distance_text(found: measure.Measurement, edges: list[dict]) -> str:
    good = np.isfinite(found.value_px)
    value = f"{found.value_px:.4f} +- {np.sqrt(found.variance_px2):.4f} px (1 sigma)" if good else "not measured"
    told = ", ".join(f"{e['name']} {e['status']} ({e['used']}, {e['contrast']:.0f})" for e in edges)
    return "\n".join([
        f"The distance in the image: {value}, {found.status}{photograph.fit(found.p_value)}",
        f"Its edges, with the samples used and the contrast in grey levels: {told}",
        *([photograph.of_fit()] if np.isfinite(found.p_value) else []),
    ])  # fmt: skip
