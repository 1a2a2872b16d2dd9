"""What a scene's tables may say otherwise: numbers with an uncertainty, data sheets, binned sensors, older keys."""

from __future__ import annotations

from typing import Any

from scenes.cameras.binning import binned
from scenes.cameras.colour import Colour
from scenes.cameras.data_sheet import completed
from scenes.measurands.measurands import Locator
from scenes.uncertain import taken_out
from scenes.units import UNITS

Tables = dict[str, Any]


def in_full(tables: Tables) -> Tables:
    """A scene's tables as its records hold them.

    Raises
    ------
    ValueError
        If two of them contradict each other; the records say what else is wrong.
    """
    plain = binned(taken_out(tables))  # first of all numbers are plain ones, for whatever looks at them next
    return _with_one_dark_level(_with_noise_of_its_locator(_with_data_sheet(plain)))


def _with_data_sheet(tables: Tables) -> Tables:
    """What a camera's data sheets say of its focal length in px, its width, height and distance."""
    camera, unit = tables.get("camera"), tables.get("units", "cm")
    if not isinstance(camera, dict) or unit not in UNITS:
        return tables
    return {**tables, "camera": completed(camera, unit)}


def _with_noise_of_its_locator(tables: Tables) -> Tables:
    """What demosaiced noise is told for: `Locator.scale_px`."""
    noise, locator = tables.get("noise"), tables.get("locator")
    colour = noise.get("colour") if isinstance(noise, dict) else getattr(noise, "colour", None)
    if not isinstance(colour, dict | Colour):
        return tables
    scale = locator.get("scale_px") if isinstance(locator, dict) else getattr(locator, "scale_px", None)
    scale = Locator().scale_px if scale is None else scale
    if isinstance(colour, dict) and colour.get("scale_px", scale) != scale:
        raise ValueError(
            f"noise.colour.scale_px must be locator.scale_px ({scale}) or left out, got {colour['scale_px']}"
        )
    told = {**colour, "scale_px": scale} if isinstance(colour, dict) else colour.tried(scale_px=scale)
    noise = {**noise, "colour": told} if isinstance(noise, dict) else noise.tried(colour=told)
    return {**tables, "noise": noise}


def _with_one_dark_level(tables: Tables) -> Tables:
    """Older files call the level of darkness ``camera.black_level``."""
    camera, noise = tables.get("camera"), tables.get("noise")
    if not (isinstance(camera, dict) and isinstance(noise, dict) and "black_level" in camera):
        return tables
    level = camera["black_level"]
    if noise.get("dark_level", level) != level:
        raise ValueError(f"noise.dark_level must be camera.black_level ({level}), got {noise['dark_level']}")
    rest = {key: value for key, value in camera.items() if key != "black_level"}
    return {**tables, "camera": rest, "noise": {**noise, "dark_level": level}}
