"""How a photograph was recorded, as ``ice measure`` asks and tells it: tone curve, channel, noise, sharpness."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from scenes import InvalidInput
from scenes.photograph import Photograph
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure

Gamma = Annotated[
    str | None, typer.Option(metavar="VALUE|srgb|none", help="Tone curve to undo; as the file says if not given.")
]
Channel = Annotated[
    str | None, typer.Option(metavar="r|g|b|luminance", help="That of most contrast over noise if not given.")
]
Bayer = Annotated[
    str | None, typer.Option(metavar="RGGB|...", help="The photograph is a raw mosaic: its first pixels.")
]
_WITH_SIDES = ("quadrilateral", "tag")
Field = Annotated[
    Path | None,
    typer.Option(metavar="FILE.toml", help="Write how the blur varies over the field, as a scene's [camera] says it."),
]
Mtf = Annotated[Path | None, typer.Option(metavar="PNG", help="Draw edge spread and modulation transfer of each side.")]


def facts(photo: Photograph) -> dict[str, Any]:
    """Tone curve and channel."""
    return {"tone": photo.tone, "channel": photo.channel}


def text(photo: Photograph) -> str:
    """The same in words."""
    asked = "" if photo.tone_known else " assumed: the file does not say, and --gamma was not given"
    return f"{photo.tone}{asked}; channel: {photo.channel}"


def of_sides(found: measure.Quadrilateral) -> dict[str, Any]:
    """What measured, noise against level, blur of each side."""
    curve = found.curve
    return {
        "estimator": found.estimator,
        "noise_curve": {"dark_variance": curve.dark, "gain": curve.gain, "dark_level": curve.dark_level,
                        "rounding_step": curve.step},
        "side_blur_px": plain(found.side_blur_px),
    }  # fmt: skip


def of_sides_lines(found: measure.Quadrilateral) -> list[str]:
    """The same in words."""
    curve, blur = found.curve, found.side_blur_px
    grows = f" + {curve.gain:.3g} (level - {curve.dark_level:.0f})" if curve.gain else ""
    lines = [
        f"estimator {found.estimator}; noise variance {curve.dark:.3g}{grows} grey levels^2"
        + (", and rounding" if curve.step else "")
    ]
    if np.isfinite(blur).all():
        lines.append("blur of the sides " + ", ".join(f"{b:.2f}" for b in blur) + " px")
    return lines


def check_sides(kinds: tuple[str, ...] | None, option: str) -> None:
    """See that kinds of shapes that are sought, all if None, have sides.

    Raises
    ------
    InvalidInput
        If none has.
    """
    if kinds is not None and not {*kinds} & {*_WITH_SIDES}:
        raise InvalidInput(f"--kind must hold {' or '.join(_WITH_SIDES)} with {option}, got {','.join(kinds)}")


def sharpness(photo: Photograph, found: measure.Shapes, plot: Path) -> dict[str, Any]:
    """Modulation transfer of each side of the first quadrilateral, drawn to ``plot``; of none where none was measured.

    Raises
    ------
    InvalidInput
        If the file cannot be written.
    """
    from measure import mtf
    from validation.report import sharpness

    four = next((one for one in found.found if one.quadrilateral is not None and one.measured), None)
    if four is None:
        return {"mtf": []}
    sides, refused = [], []
    for side in range(4):
        try:
            sides.append((side + 1, mtf(photo, four.corners, side)))
        except InvalidInput as error:
            refused.append({"side": side + 1, "refused": str(error)})
    sharpness.write(plot, sides)
    told = [
        {"side": side, "direction_deg": one.direction_deg, "mtf50": plain(one.mtf50), "error": plain(one.mtf50_error)}
        for side, one in sides
    ]  # fmt: skip
    return {"mtf": told + refused}


def field(photo: Photograph, found: measure.Shapes, file: Path) -> measure.FittedField:
    """How the blur varies over the field, from all sides of what was measured; written to ``file``.

    Raises
    ------
    InvalidInput
        If the sides do not tell it, or the file cannot be written.
    """
    from measure import blurred_sides, fitted_field

    polygons = [one.corners for one in found.found if one.quadrilateral is not None and one.corners is not None]
    told = fitted_field(blurred_sides(photo, polygons), photo.levels.shape)
    try:
        file.write_text("\n".join([*told.lines(), ""]), encoding="utf-8")
    except OSError as error:
        raise InvalidInput(f"--blur-field must be a writable file, got {file} ({error.strerror})") from None
    return told


def field_facts(told: measure.FittedField) -> dict[str, Any]:
    """What it says."""
    table = [[height, times] for height, times in told.field.table]
    sides = zip(told.sides.ends.mean(1).tolist(), told.sides.sigma.tolist(), told.sides.error.tolist(),
                told.residual.tolist(), strict=True)  # fmt: skip
    return {"blur_field": {
        "blur_px": told.blur_px, "table": table, "sd": told.sd.tolist(), "covariance": told.covariance.tolist(),
        "p_value": told.p_value,
        "sides": [{"place": place, "blur_px": blur, "error": error, "residual": away}
                  for place, blur, error, away in sides],
    }}  # fmt: skip


def field_lines(told: measure.FittedField) -> list[str]:
    """The same in words."""
    sd, rows = told.sd, told.field.table
    outward = ", ".join(
        f"{times:.3f} +- {each:.3f} times that at {height:.2f}"
        for (height, times), each in zip(rows, sd[1:], strict=True)
    )
    return [
        f"blur over the field, of {told.sides.sigma.size} sides: {told.blur_px:.3f} +- {sd[0]:.3f} px in the middle,"
        f" {outward} of the half diagonal; chi-square probability {told.p_value:.2g}"
    ]


def sharpness_lines(told: dict[str, Any]) -> list[str]:
    """What `sharpness` says, in words."""
    lines = ["no quadrilateral was measured, so that no modulation transfer is drawn"] if told.get("mtf") == [] else []
    for one in told.get("mtf", ()):
        if "refused" in one:
            lines.append(one["refused"])
        elif one["mtf50"] is not None:
            lines.append(f"side {one['side']}: MTF50 {one['mtf50']:.4f} +- {one['error']:.4f} cycles/px")
    return lines
