"""``ice measure``: one image, of a known scene or a photograph."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import numpy as np
import typer

import scenes
import scenes.photograph
from scenes import InvalidInput
from scenes.files.image import Size
from scenes.photograph import Photograph
from scenes.status import ILL_CONDITIONED, is_trusted, legend
from validation.cli import measurands, photograph, placement, recorded, together
from validation.cli.common import Json, commands, parse_pose, parse_poses, progress, say, scene_of, taking
from validation.cli.outputs import check_directory, check_file
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure
    from validation.inspection import Inspection

commands = commands()

_MOST, _ALL = 5, 1000  # shapes that are measured


@dataclass(frozen=True)
class Options:
    """What a measurement is asked for."""

    file: Annotated[Path, typer.Argument(metavar="FILE", help="PNG, TIFF, JPEG or .npy, 8 or 16 bit or float.")]
    scene: Annotated[str | None, typer.Argument(metavar="[SCENE]", help="Scene that the image shows, if known.")] = None
    sensor: Annotated[str | None, typer.Option(metavar="P,A", help="Sensor pose; needed with SCENE.")] = None
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Light pose; tells how bright each face is.")] = None
    estimator: Annotated[str | None, typer.Option(help="How; a wrong name lists them all.")] = None
    threshold: Annotated[float | None, typer.Option(help="Gradient threshold of canny, grey levels a px.")] = None
    lens: Annotated[Path | None, typer.Option(metavar="TOML", help="Camera: fx, fy, cx, cy, distortion.")] = None
    near: Annotated[str | None, typer.Option(metavar="X,Y", help="The shape at this place of a photograph, px.")] = None
    box: Annotated[str | None, typer.Option(metavar="X0,Y0,X1,Y1", help="Shapes in this box, px.")] = None
    corners: Annotated[
        tuple[str, str, str, str] | None,
        typer.Option(metavar="X,Y X,Y X,Y X,Y", help="A quadrilateral whose corners are here, to some 5 px."),
    ] = None
    kind: Annotated[
        str | None, typer.Option(help="quadrilateral, circle, ellipse, tag, chessboard; several with commas.")
    ] = None
    most: Annotated[int | None, typer.Option(help="Shapes to measure, the most prominent first.")] = None
    every: Annotated[bool, typer.Option("--all", help="Measure all shapes that are found.")] = False
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="PNG", help="Draw the photograph with what was found.")
    ] = None
    as_measured: Annotated[
        bool, typer.Option("--as-measured", help="With SCENE: take no bias off, simulate nothing.")
    ] = False
    inspection: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="With SCENE and --light: write inspection.html, .csv, .svg (balloons) and .qif, with U and decisions.",
        ),
    ] = None
    also: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE P,A P,A",
            help='With SCENE: another picture of the part, "FILE SENSOR LIGHT"; each is told by what sees it best.',
        ),
    ] = None
    together: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help="With --also: adjust all pictures together; sensors' places are known, uncertain or unknown.",
        ),
    ] = None
    serial: Annotated[str | None, typer.Option(metavar="TEXT", help="Serial number of the part, for --inspection.")] = (
        None
    )
    gamma: recorded.Gamma = None
    channel: recorded.Channel = None
    bayer: recorded.Bayer = None
    mtf: recorded.Mtf = None
    blur_field: recorded.Field = None
    as_json: Json = False

    @property
    def of_photographs(self) -> dict[str, Any]:
        """What is asked of a photograph without a scene alone, by option; None where it is not."""
        names = ("near", "box", "corners", "kind", "most", "output", "all", "gamma", "channel", "bayer", "mtf",
                 "blur_field")  # fmt: skip
        return {
            f"--{name.replace('_', '-')}": self.every or None if name == "all" else getattr(self, name)
            for name in names
        }

    @property
    def of_scenes(self) -> dict[str, Any]:
        """What is asked of the picture of a scene alone, by option; None or False where it is not."""
        return {"--as-measured": self.as_measured, "--also": self.also, "--inspection": self.inspection,
                "--serial": self.serial, "--together": self.together}  # fmt: skip


@commands.command("measure")
@taking(Options)
def measure_command(given: Options) -> None:
    """Measure an image: the measurands of a known scene, or else the shapes that it shows.

    With a scene and its light the bias is simulated and taken off; what that is not sure of is u_bias. Of a photograph
    the five most prominent shapes are measured where nothing else is said. Exit status 1 if something cannot be
    measured; of a photograph's shapes, if none can.
    """
    import measure

    if given.estimator is not None and given.estimator not in measure.ESTIMATORS:
        raise InvalidInput(f"--estimator must be one of {', '.join(measure.ESTIMATORS)}, got {given.estimator!r}")
    check_file("--output", given.output, ".png", ".pdf", ".svg")
    check_directory("--inspection", given.inspection)
    check_file("--mtf", given.mtf, ".png")
    check_file("--blur-field", given.blur_field, ".toml")
    if given.scene is None:
        _measure_photograph(given)
    _measure_scene(given)


def _measure_photograph(given: Options) -> NoReturn:
    import measure

    for option, value in given.of_scenes.items():
        if value:
            raise InvalidInput(f"{option} must be left out without a scene, got {value if value is not True else 'it'}")
    wanted = _shapes_wanted(given)
    photo = scenes.photograph.read(given.file, given.gamma, given.channel, given.bayer)
    lens = given.lens and measure.load_lens(given.lens)
    found = measure.photograph(photo, **wanted, estimator=given.estimator or "arrangement", lens=lens)
    _say_shapes(given, photo, found)


def _measure_scene(given: Options) -> NoReturn:
    for option, value in given.of_photographs.items():
        if value is not None:
            raise InvalidInput(f"{option} must be left out with a scene, got {value}")
    if given.sensor is None:
        raise InvalidInput("--sensor must be given with a scene, got nothing")
    if given.lens is not None:
        raise InvalidInput(f"--lens must be left out with a scene, whose camera is a pinhole, got {given.lens}")
    if given.together is not None:
        _check_together(given)
    poses = parse_pose("--sensor", given.sensor), parse_poses("--light", given.light)
    from validation import inspection, picture_file

    known = scene_of(given.scene)
    files = [(given.file, *poses), *(_also(text) for text in given.also or [])]
    shown = [scenes.Picture.of(known, *where) for _, *where in files]
    for each in shown:
        _check_inspection(given, each)
    images = [picture_file.read(file, Size.of_camera(known.camera)) for file, *_ in files]
    if given.together is not None:
        named = [file for file, *_ in files]
        correct = not given.as_measured
        together.measured(named, images, shown, given.together, given.estimator, correct=correct, as_json=given.as_json)
    places = [_located(image, each) for image, each in zip(images, shown, strict=True)]
    if any(place is not None and not is_trusted(place.status) for place in places):
        _say_lost(given, [place for place in places if place is not None])
    shown = [each if place is None else place.picture for each, place in zip(shown, places, strict=True)]
    inspected = inspection.inspect(*(_measured(given, image, each) for image, each in zip(images, shown, strict=True)))
    if given.inspection is not None:
        from validation.report import inspection_files

        about = inspection_files.About(given.serial or "", tuple(file.name for file, *_ in files))
        inspection_files.write(inspected, images, about, given.inspection)
    first = inspected.taken[0].found.first if known.task is not None and len(files) == 1 else None
    _say_measurands(given, inspected, first, [place for place in places if place is not None])


def _check_together(given: Options) -> None:
    """What pictures that are adjusted together are not asked for."""
    if given.also is None:
        raise InvalidInput(f"--together must be used with --also, got {given.together!r} alone")
    if given.together not in ("known", "uncertain", "unknown"):
        raise InvalidInput(f"--together must be one of known, uncertain, unknown, got {given.together!r}")
    for option in ("--inspection", "--serial"):
        if given.of_scenes[option]:
            raise InvalidInput(f"{option} must be left out with --together, got it")


def _located(image: np.ndarray, shown: scenes.Picture) -> measure.Located | None:
    """Where the part lies in a picture; None where the scene says it."""
    import measure

    return measure.locate(image, shown) if shown.scene.placement.is_estimated else None


def _say_lost(given: Options, places: list[measure.Located]) -> NoReturn:
    """A part that is not found is not measured; exit status 1."""
    told = {"file": str(given.file), "measurands": [], "covariance": [],
            "placements": [placement.facts(each) for each in places]}  # fmt: skip
    say(told, given.as_json, "\n".join(map(placement.text, places)))
    raise typer.Exit(1)


def _also(text: str) -> tuple[Path, Any, Any]:
    """Another picture: its file, sensor and lights."""
    file, *poses = text.rsplit(maxsplit=2)
    if len(poses) != 2:
        raise InvalidInput(f'--also must be "FILE P,A P,A": a picture, its sensor and light, got {text!r}')
    return Path(file), parse_pose("--also", poses[0]), parse_pose("--also", poses[1])


def _measured(given: Options, image: np.ndarray, shown: scenes.Picture) -> measure.Measurements:
    """One picture of a scene, its bias taken off where its light is known."""
    import measure

    if given.as_measured or not shown.lights:
        return measure.measure(image, shown, estimator=given.estimator, threshold=given.threshold)
    return _corrected(image, shown, given.estimator, given.threshold)


def _check_inspection(given: Options, shown: scenes.Picture) -> None:
    """What is handed on has its bias taken off."""
    if given.inspection is None:
        if given.serial is not None:
            raise InvalidInput(f"--serial must be used with --inspection, got {given.serial!r} alone")
        return
    if given.as_measured:
        raise InvalidInput("--as-measured must be left out with --inspection, whose values have their bias taken off")
    if not shown.lights:
        raise InvalidInput("--light must be given with --inspection, got nothing")


def _corrected(
    image: np.ndarray, picture: scenes.Picture, estimator: str | None, threshold: float | None
) -> measure.Measurements:
    """With the bias taken off that a simulation tells; what is wrong with the image is said before anything is."""
    import measure
    from validation.remeasured import Method

    method = Method(estimator or measure.best_estimator(picture), threshold)
    plain = measure.measure(image, picture, estimator=method.locator, threshold=threshold)
    if not (np.isfinite(plain.value).any() or (estimator is None and (plain.status == ILL_CONDITIONED).any())):
        return plain
    from validation import kept, simulation

    with progress("simulating the picture for its bias", "renders", at_once=True):
        off = kept.correction(picture, method) if estimator else simulation.best(picture, kept.correction)
    if off.estimator != method.locator:
        plain = measure.measure(image, picture, estimator=off.estimator, threshold=threshold)
    return measure.corrected(plain, off, image)


def _shapes_wanted(given: Options) -> dict[str, Any]:
    """Which shapes of a photograph are measured, as `measure.photograph` takes it."""
    if given.every and given.most is not None:
        raise InvalidInput(f"--most must be left out with --all, got {given.most}")
    wanted = {
        "near": photograph.numbers("--near", given.near, 2),
        "box": photograph.numbers("--box", given.box, 4),
        "corners": given.corners and [photograph.numbers("--corners", corner, 2) for corner in given.corners],
        "kinds": None if given.kind is None else tuple(given.kind.split(",")),
        "most": _ALL if given.every else _MOST if given.most is None else given.most,
    }
    for option, file in (("--mtf", given.mtf), ("--blur-field", given.blur_field)):
        if file is not None:
            recorded.check_sides(wanted["kinds"], option)
    return wanted


def _say_measurands(
    given: Options, inspected: Inspection, distance: measure.Measurement | None, places: list[measure.Located]
) -> NoReturn:
    """All measurands of a scene, and its distance edge by edge; exit status 1 where one could not be measured."""
    rows = measurands.facts(inspected)
    told, zones = {"measurands": rows, "covariance": measurands.covariance(inspected)}, measurands.zones(inspected)
    if zones:
        told["zones"] = zones
    if distance is not None:
        told |= _distance_facts(distance)
    if places:
        told["placements"] = [placement.facts(each) for each in places]
    if given.as_json:
        say({"file": str(given.file), **told}, True, "")
    else:
        shown = console()
        shown.print(measurands.table(rows, zones))
        for line in legend([row["status"] for row in rows], measurands.reasons(rows, inspected)):
            shown.print(f" {line}", highlight=False)
        for line in [] if given.estimator else measurands.by_others(inspected):
            shown.print(line, highlight=False)
        for each in places:
            shown.print(placement.text(each), highlight=False)
        if distance is not None:
            shown.print(_distance_text(distance, told["edges"]), highlight=False)
        if given.inspection is not None:
            shown.print(f"inspection.html, .csv, .svg and .qif: {given.inspection}", highlight=False)
    raise typer.Exit(0 if all(row["value"] is not None for row in rows) else 1)


def _say_shapes(given: Options, photo: Photograph, found: measure.Shapes) -> NoReturn:
    """The shapes of a photograph, drawn if wanted; exit status 1 where nothing could be measured."""
    sharp = recorded.sharpness(photo, found, given.mtf) if given.mtf is not None else {}
    field = recorded.field(photo, found, given.blur_field) if given.blur_field is not None else None
    told = {} if field is None else recorded.field_facts(field)
    if given.output is not None:
        from validation.report import overlay

        overlay.write(given.output, photo.levels, found)
    if given.as_json:
        say({"file": str(given.file), **recorded.facts(photo), **photograph.facts(found), **sharp, **told}, True, "")
    else:
        if found.candidates:
            console().print(photograph.table(found), highlight=False)
        lines = [recorded.text(photo), photograph.text(found), *recorded.sharpness_lines(sharp)]
        lines += [] if field is None else recorded.field_lines(field)
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
