"""How a photograph was recorded, as ``ice measure`` asks and tells it: tone curve, channel, noise, sharpness."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from scenes import InvalidInput
from scenes.photograph import Photograph

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
Mtf = Annotated[Path | None, typer.Option(metavar="PNG", help="Draw edge spread and modulation transfer of each side.")]


def refuse(options: dict[str, Any]) -> None:
    """Options that are about photographs.

    Raises
    ------
    InvalidInput
        If one is given.
    """
    for name, value in options.items():
        if value is not None:
            raise InvalidInput(f"{name} must be left out with a scene, got {value}")


def facts(photo: Photograph, found: measure.Quadrilateral, plot: Path | None) -> dict:
    """Tone curve, channel, noise against level, blur of each side; with ``plot`` the sharpness, drawn there, too."""
    curve = found.curve
    told = {
        "tone": photo.tone,
        "channel": photo.channel,
        "estimator": found.estimator,
        "noise_curve": {"dark_variance": curve.dark, "gain": curve.gain, "dark_level": curve.dark_level,
                        "rounding_step": curve.step},
        "side_blur_px": [float(b) if np.isfinite(b) else None for b in found.side_blur_px],
    }  # fmt: skip
    return told | ({"mtf": _sharpness(photo, found, plot)} if plot is not None else {})


def _sharpness(photo: Photograph, found: measure.Quadrilateral, plot: Path) -> list[dict]:
    from measure import mtf
    from validation.report import sharpness

    sides, refused = [], []
    for side in range(4 if found.measurands else 0):
        try:
            sides.append((side + 1, mtf(photo, found.corners, side)))
        except InvalidInput as error:
            refused.append({"side": side + 1, "refused": str(error)})
    sharpness.write(plot, sides)
    return [
        {
            "side": side,
            "direction_deg": one.direction_deg,
            "mtf50": _number(one.mtf50),
            "error": _number(one.mtf50_error),
        }
        for side, one in sides
    ] + refused


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


def text(told: dict) -> str:
    """The same in words."""
    curve = told["noise_curve"]
    grows = f" + {curve['gain']:.3g} (level - {curve['dark_level']:.0f})" if curve["gain"] else ""
    lines = [
        f"{told['tone']}; channel: {told['channel']}; measured by {told['estimator']}",
        f"noise variance {curve['dark_variance']:.3g}{grows} grey levels^2"
        + (", and rounding" if curve["rounding_step"] else ""),
    ]
    blur = told["side_blur_px"]
    if all(blur):
        lines.append("blur of the sides " + ", ".join(f"{b:.2f}" for b in blur) + " px")
    for one in told.get("mtf", ()):
        if "refused" in one:
            lines.append(one["refused"])
        elif one["mtf50"] is not None:
            lines.append(f"side {one['side']}: MTF50 {one['mtf50']:.4f} +- {one['error']:.4f} cycles/px")
    return "\n".join(lines)
