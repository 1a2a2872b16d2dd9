"""``ice calibrate-camera``: intrinsics and distortion from photographs of a board, with their covariance."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from scenes import InvalidInput
from scenes.files.image import Size
from validation.cli.common import Json, check_number, commands, first_picture, progress, say, scene_of, taking
from validation.cli.outputs import check_file
from validation.report.terminal import console

commands = commands()
_LONGEST = 1e9


@dataclass(frozen=True)
class Options:
    """What a calibration is asked for."""

    boards: Annotated[list[Path], typer.Argument(metavar="BOARD...", help="Photographs of one board, 3 or more.")]
    square: Annotated[
        float,
        typer.Option(metavar="LENGTH", help="Side of the board's squares; from dot or marker to the next."),
    ]
    square_sd: Annotated[float, typer.Option(help="Its standard uncertainty, the same for all squares.")] = 0.0
    units: Annotated[str, typer.Option(help="Of the squares and of the poses: mm, cm, m, inch.")] = "mm"
    shape: Annotated[
        str | None, typer.Option(metavar="9x6", help="Inner corners, dots or markers: columns x rows; else counted.")
    ] = None
    dots: Annotated[bool, typer.Option(help="The board is a grid of dots, not a chessboard.")] = False
    charuco: Annotated[
        str | None,
        typer.Option(
            metavar="DICTIONARY", help="A ChArUco board: its markers, as DICT_5X5_100. Needs --shape, --marker."
        ),
    ] = None
    markers: Annotated[
        str | None, typer.Option(metavar="DICTIONARY", help="A grid of markers, as DICT_APRILTAG_36h11.")
    ] = None
    marker: Annotated[
        float | None, typer.Option(metavar="LENGTH", help="Side of the markers, of the same unit as --square.")
    ] = None
    model: Annotated[
        str,
        typer.Option(
            help="Free coefficients with commas between: k1, k2, p1, p2, k3, f (fx = fy); or none; or splined, "
            "splined:12x8 with that many control points."
        ),
    ] = "k1,k2,p1,p2,k3"
    curved: Annotated[
        bool, typer.Option(help="The board may be bent: how far its middle stands out is unknown, too.")
    ] = False
    noise: Annotated[
        float | None, typer.Option(help="Standard deviation of the noise, grey levels; else from each image.")
    ] = None
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="LENS.toml", help="For `ice measure --lens`.")
    ] = None
    scene: Annotated[
        str | None, typer.Option(metavar="SCENE", help="Print its [camera] and [uncertainty] as they should read.")
    ] = None
    following: Annotated[
        str | None,
        typer.Option("--next", metavar="MEASURAND", help="Propose the next board, for U of this measurand of SCENE."),
    ] = None
    residuals: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Picture of the residuals.")] = None
    as_json: Json = False


@commands.command("calibrate-camera")
@taking(Options)
def calibrate_camera_command(given: Options) -> None:
    """Calibrate a camera from photographs of a board, seen from different directions.

    The board is a chessboard; with --dots a grid of dots; with --charuco a ChArUco board, with --markers a grid of
    markers: both need --shape and --marker, and a part of them is enough.

    --model splined fits displacements that are splines, and says whether boards that are left out are seen better so
    than with the usual coefficients: only then they are proposed.

    --next proposes where to hold the board for the next photograph, and says what that would leave of U.

    -o writes the lens, and beside it LENS_covariance.json for a scene's uncertainty.covariance, of a splined lens
    LENS_modes.json for its uncertainty.lens_modes. Exit status 1 if the boards do not determine the focal length.
    """
    printed = _checked(given)
    import measure
    from measure.boards.camera import DEFAULT_MODEL
    from measure.boards.parameters import read_model, splined_control
    from scenes import status
    from validation.boards import read_boards
    from validation.report import camera_table

    splined = splined_control(given.model) is not None
    if not splined:
        read_model(given.model)
    scene, beside = given.scene, given.output and _beside(given.output, splined)
    camera = None if scene is None else scene_of(scene).camera
    with progress("corners") as shown:
        size = camera and Size(camera.height, camera.width, scene)
        seen = read_boards(given.boards, printed, given.noise, shown, size)
    for _, reason in seen.left_out:
        print(f"left out: {reason}", file=sys.stderr)
    found = measure.calibrate_camera(
        seen.boards, given.square, seen.image_shape, given.model, given.square_sd, given.curved
    )
    models = (DEFAULT_MODEL, given.model)
    compared = (
        measure.compare_models(seen.boards, given.square, seen.image_shape, models, given.curved) if splined else None
    )
    lines = camera_table.scene_lines(found, scene, beside) if scene is not None else None
    proposal = _proposal(given, found, seen)
    written = _write_files(found, seen, given.output, given.residuals)
    if given.as_json:
        told = camera_table.facts(found, seen, given.units, compared)
        told |= {} if lines is None else {"scene": lines}
        say(told if proposal is None else {**told, "next": proposal.facts}, True, "")
    else:
        _show(found, seen, given.units, lines)
        if compared is not None:
            console().print(camera_table.comparison(compared), highlight=False)
        if proposal is not None:
            console().print(proposal.text, highlight=False)
        for path in written:
            console().print(f"written: {path}", highlight=False)
    raise typer.Exit(1 if found.status == status.ILL_CONDITIONED else 0)


def _checked(given: Options):
    """See that options are in their ranges; what is printed on the board."""
    from scenes.units import UNITS

    check_number("--square", given.square, 1e-9, _LONGEST)
    check_number("--square-sd", given.square_sd, 0, given.square)
    check_number("--noise", given.noise, 1e-6, 1e6)
    if given.units not in UNITS:
        raise InvalidInput(f"--units must be one of {', '.join(UNITS)}, got {given.units!r}")
    printed = _printed(given)
    if given.following is not None and given.scene is None:
        raise InvalidInput(f"--next must be used with --scene, got {given.following!r} alone")
    check_file("--output", given.output, ".toml")
    check_file("--residuals", given.residuals, ".png")
    return printed


def _proposal(given: Options, found, seen):
    """Of the next board; None where none is asked for, or the boards so far determine no camera."""
    from scenes import status

    if given.following is None or given.scene is None or found.status == status.ILL_CONDITIONED:
        return None
    from validation.next_board import propose

    picture = first_picture(scene_of(given.scene), None, None)
    return propose(found, seen.boards, given.square, picture, given.following)


def _printed(given: Options):
    """The board that is asked for.

    Raises
    ------
    InvalidInput
        If there is no such board.
    """
    from measure.boards.printed import CHARUCO, CHESSBOARD, DOTS, MARKERS, Printed

    shape, square = _shape(given.shape), given.square
    asked = {DOTS: given.dots or None, CHARUCO: given.charuco, MARKERS: given.markers}
    kinds = [kind for kind, told in asked.items() if told is not None] or [CHESSBOARD]
    if len(kinds) > 1:
        raise InvalidInput(f"--dots, --charuco, --markers must be one at most, got --{' and --'.join(kinds)}")
    dictionary = given.markers if given.charuco is None else given.charuco
    if dictionary is None:
        if given.marker is not None:
            raise InvalidInput(f"--marker must be left out of a board without markers, got {given.marker:g}")
        return Printed(kinds[0], shape)
    if shape is None:
        raise InvalidInput(f"--shape must be given with --{kinds[0]}, got none")
    if given.marker is None or not 0 < given.marker < square:
        raise InvalidInput(f"--marker must be more than 0 and less than --square, {square:g}, got {given.marker}")
    printed = Printed(kinds[0], shape, dictionary, given.marker / square)
    printed.check()
    return printed


def _write_files(found, seen, output: Path | None, residuals: Path | None) -> list[Path]:
    """The lens with its covariance beside it, and the picture, those that are wanted."""
    from validation.report import camera_table

    written = []
    if output is not None:
        written.append(output)
        _write(output, camera_table.lens_file(found))
        written.append(_beside(output, found.is_splined))
        _write(written[-1], camera_table.uncertainty_file(found))
    if residuals is not None:
        from validation.report import camera_figure  # matplotlib takes half a second to load

        written.append(residuals)
        camera_figure.draw(found, seen.boards, residuals)
    return written


def _show(found, seen, units: str, lines: str | None) -> None:
    from validation.report import camera_table

    shown = console()
    shown.print(camera_table.boards(found, seen, units))
    shown.print(camera_table.parameters(found))
    shown.print(camera_table.summary(found, units), highlight=False)
    if lines is not None:
        print(f"\n{lines}")


def _shape(text: str | None) -> tuple[int, int] | None:
    from measure.boards.chessboard import check_shape

    if text is None:
        return None
    try:
        columns, rows = (int(part) for part in text.lower().split("x"))
        return check_shape((columns, rows))
    except ValueError:
        raise InvalidInput(f"--shape must be columns x rows of inner corners as 9x6, got {text!r}") from None


def _beside(path: Path, is_splined: bool) -> Path:
    return path.with_name(f"{path.stem}_{'modes' if is_splined else 'covariance'}.json")


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text)
    except OSError as error:
        raise InvalidInput(f"--output must be a writable file, got {path} ({error.strerror})") from None
