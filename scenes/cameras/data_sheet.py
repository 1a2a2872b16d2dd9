"""A camera as its data sheets say it: what the image model needs follows from pitch, focal length and distances."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from pydantic import ValidationError

from scenes.cameras.blur_field import BlurField
from scenes.cameras.kinds import CAMERAS
from scenes.cameras.pinhole import Camera
from scenes.cameras.pinhole import is_positive as _number
from scenes.units import Unit, in_unit

_AGREE = 1e-6  # of a value that is said twice
_SHEET = 0.02  # of a sensor's size: data sheets round it, and count rows that no picture shows


def completed(camera: dict[str, Any], unit: Unit) -> dict[str, Any]:
    """A camera's table with ``width``, ``height``, ``distance`` and ``focal_px`` as its data sheets say.

    A pinhole's lens is taken to be focused at the distance d: its image then lies f d / (d - f) behind it, not f, and
    ``focal_px`` is that over the pixel pitch. Of a telecentric lens it is the magnification over the pitch, times d.

    Parameters
    ----------
    camera : dict
        As in a scene's file. Values of the wrong kind are left to the model's own checks.
    unit : str
        Of ``distance``.

    Raises
    ------
    ValueError
        If what it says does not fit together, or is not enough.

    Examples
    --------
    >>> sheet = {"pixel_pitch_um": 3.45, "focal_length_mm": 25.0, "sensor_size_mm": [8.45, 7.07]}
    >>> camera = completed(sheet | {"working_distance_mm": 300.0}, "mm")
    >>> camera["width"], camera["height"], camera["distance"], round(camera["focal_px"], 1)
    (2449, 2049, 300.0, 7905.1)
    """
    pitch = _pitch(camera)
    camera = _with_size(camera, pitch)
    if _number(camera.get("working_distance_mm")):
        camera = _said(camera, "distance", in_unit(camera["working_distance_mm"], "mm", unit), "working_distance_mm")
    kind = camera.get("kind", "pinhole")
    if not isinstance(kind, str) or kind not in CAMERAS:
        return camera
    for key, (value, source) in derived(CAMERAS[kind], camera, unit, pitch).items():
        camera = _said(camera, key, value, source)
    return camera


def derived(
    kind: type[Camera], camera: dict[str, Any], unit: Unit, pitch_um: float | None
) -> dict[str, tuple[float, str]]:
    """What follows from a camera's table, of a kind: values by their keys, and from which key; of any kind the blur.

    Raises
    ------
    ValueError
        If it does not fit together, or is not enough.
    """
    found = kind.derived(camera, unit, pitch_um)
    blur_um = _middle_um(camera)
    if blur_um is None:
        return found
    if pitch_um is None:
        raise ValueError("camera.pixel_pitch_um must be given with blur_field.mtf, got nothing")
    return {**found, "blur_px": (blur_um / pitch_um, "blur_field.mtf")}


def _middle_um(camera: dict[str, Any]) -> float | None:
    """The blur in the image's middle that the modulation transfer of a field says, um; what is none is said later."""
    field = camera.get("blur_field")
    if isinstance(field, dict) and field.get("mtf"):
        try:
            field = BlurField.model_validate(field)
        except ValidationError:
            return None
    return field.middle_um() if isinstance(field, BlurField) else None


def not_derived(camera: dict[str, Any], given: Collection[str]) -> dict[str, Any]:
    """A completed camera's table of which some keys are given anew, without what follows from the sheet: it follows
    anew."""
    kind, follows = camera.get("kind", "pinhole"), set()
    for key, derived in CAMERAS[kind].follows.items() if isinstance(kind, str) and kind in CAMERAS else ():
        if camera.get(key) is not None:
            follows |= set(derived)
    if "working_distance_mm" in given and camera["working_distance_mm"] is not None:
        follows.add("distance")
    field = camera.get("blur_field")
    if field.get("mtf") if isinstance(field, dict) else isinstance(field, BlurField) and field.mtf:
        follows.add("blur_px")
    if camera.get("sensor_size_mm") is not None and {"sensor_size_mm", "pixel_pitch_um"} & set(given):
        follows |= {"width", "height"}
    return {key: value for key, value in camera.items() if key in given or key not in follows}


def _size(camera: dict[str, Any]) -> tuple[float, float] | None:
    size = camera.get("sensor_size_mm")
    return tuple(size) if isinstance(size, list | tuple) and len(size) == 2 and all(map(_number, size)) else None


def _pitch(camera: dict[str, Any]) -> float | None:
    """The pixel pitch, um; from the sensor's size where only that is given."""
    pitch, size, width = camera.get("pixel_pitch_um"), _size(camera), camera.get("width")
    if _number(pitch):
        return pitch
    return 1000 * size[0] / width if pitch is None and size and _number(width) else None


def _with_size(camera: dict[str, Any], pitch: float | None) -> dict[str, Any]:
    size = _size(camera)
    if size is None:
        return camera
    if pitch is None:
        raise ValueError("camera.pixel_pitch_um must be given with sensor_size_mm, or width and height, got nothing")
    for key, length in zip(("width", "height"), size, strict=True):
        pixels = 1000 * length / pitch
        if camera.get(key) is None:
            camera = {**camera, key: round(pixels) if pixels < 1e9 else pixels}
        elif _number(camera[key]) and abs(camera[key] - pixels) > _SHEET * pixels:
            raise ValueError(
                f"camera.{key} must be about {pixels:.0f}, as sensor_size_mm and pixel_pitch_um say, got {camera[key]}"
            )
    return camera


def _said(camera: dict[str, Any], key: str, value: float, source: str) -> dict[str, Any]:
    """With a value that another key says; what is said twice has to be the same."""
    given = camera.get(key)
    if given is None:
        return {**camera, key: value}
    if _number(given) and abs(given - value) > _AGREE * value:
        raise ValueError(f"camera.{key} must be {value:.9g}, as {source} says, got {given:g}")
    return camera
