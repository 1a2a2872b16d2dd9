"""The scene of a station that is made of a catalogue's parts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from planner.constraints import same_side
from planner.designing.optics import Settings
from scenes import Scene
from scenes.cameras import AnyCamera
from scenes.cameras.covariance import Covariance
from scenes.cameras.data_sheet import completed
from scenes.catalogue import ListedSensor
from scenes.uncertain import UncertainNumber

_CAMERA = TypeAdapter(AnyCamera)
_MOST_BITS = 16
_CLEAR = 6.0  # standard deviations of dark noise, by which darkness stays above 0
_RATIOS = ("exposure", "blur_px", "sigma", "dark_level", "gain", "dsnu")  # what is known as a part of itself
_CAMERAS = ("focal_px", "focal_length_mm", "pixel_pitch_um", "magnification", "distance", "working_distance_mm",
            "telecentricity_deg", "numerical_aperture", "wavelength_nm", "image_side_deg")  # fmt: skip


def station(scene: Scene, settings: Settings) -> Scene:
    """The scene with another camera, lens and light: its part, measurands and what is uncertain stay.

    Numbers that carry an uncertainty keep it as a part of themselves; a calibration stays as good in px of the image
    (`carried`); the camera's own distances keep their uncertainty in the scene's unit.
    """
    camera, noise = camera_of(scene, settings), noise_of(settings.sensor, scene.noise.prnu)
    changed: dict[str, Any] = {"camera": camera, "noise": noise, "settings": ()}
    if settings.light.kind is not None:  # else the scene's own stay
        changed |= {"light": settings.light.at(settings.light_mm, scene.units, behind(scene)), "lights": ()}
    changed["uncertain"] = _uncertain(scene, camera, noise, settings)
    told = scene.uncertainty.covariance
    if told is not None:
        uncertainty = scene.uncertainty.model_copy(update={"covariance": carried(told, scene.camera, camera)})
        changed["uncertainty"] = uncertainty
    return scene.with_(**changed)


def behind(scene: Scene) -> tuple[float, float]:
    """Where a backlight stands: opposite the side from which the scene is seen."""
    low, _ = same_side([each.sensor for each in scene.settings[:1]])
    return (0.0, 0.0) if low >= 90 else (180.0, 0.0)


def camera_of(scene: Scene, settings: Settings) -> Any:
    """The camera of a scene."""
    sensor, lens = settings.sensor, settings.lens
    columns, rows = sensor.resolution
    table: dict[str, Any] = {
        "width": columns, "height": rows, "pixel_pitch_um": sensor.pixel_pitch_um,
        "working_distance_mm": settings.distance_mm, "look_at": scene.camera.look_at,
        "roll_deg": _turn(settings.aspect.roll_deg), "blur_px": settings.blur_px,
        "exposure": settings.fill * sensor.saturation_capacity_e * gain_of(sensor),
    }  # fmt: skip
    if lens.is_telecentric:
        table |= {"kind": "telecentric", "magnification": lens.magnification}
    else:
        table |= {"focal_length_mm": lens.focal_length_mm}
    return _CAMERA.validate_python(completed(table, scene.units))


def gain_of(sensor: ListedSensor) -> float:
    """Grey levels an electron: as stated, or so that saturation is full scale above darkness."""
    if sensor.system_gain_e:
        return sensor.system_gain_e
    full = 2 ** min(sensor.bits, _MOST_BITS) - 1
    # K e_sat + 6 K sigma + 1 = full
    return (full - 1) / (sensor.saturation_capacity_e + _CLEAR * sensor.temporal_dark_noise_e)


def noise_of(sensor: ListedSensor, prnu: float) -> dict[str, Any]:
    """The sensor's noise in grey levels; the fixed pattern that is not stated is a scene's own part of the signal."""
    gain = gain_of(sensor)
    stated = None if sensor.prnu_percent is None else sensor.prnu_percent / 100
    return {
        "sigma": gain * sensor.temporal_dark_noise_e, "gain": gain, "bits": min(sensor.bits, _MOST_BITS),
        "dark_level": math.ceil(_CLEAR * gain * sensor.temporal_dark_noise_e) + 1.0,
        "prnu": prnu if stated is None else stated, "dsnu": gain * (sensor.dsnu_e or 0.0), "colour": sensor.filters,
    }  # fmt: skip


def carried(told: Covariance, before: Any, after: Any) -> Covariance:
    """A calibration's covariance for another camera that is calibrated as well: its errors at the corner stay in px.

    A stretch fx moves the corner by R / f, a principal point by 1, k1 by f (R / f)^3, k2 by f (R / f)^5, k3 by
    f (R / f)^7, p1 and p2 by f (R / f)^2.
    """
    orders = {"fx": 1, "fy": 1, "k1": 3, "k2": 5, "k3": 7, "p1": 2, "p2": 2}

    def moved(camera: Any, name: str) -> float:
        if name in ("cx", "cy"):
            return 1.0
        field = math.hypot(camera.width, camera.height) / 2 / camera.focal_px
        return field if name in ("fx", "fy") else camera.focal_px * field ** orders[name]

    factors = np.array([moved(before, name) / moved(after, name) for name in told.names])
    return Covariance(names=told.names, matrix=(np.array(told.matrix) * np.outer(factors, factors)).tolist())


def _turn(roll_deg: float) -> float:
    return (roll_deg + 180) % 360 - 180


def _uncertain(scene: Scene, camera: Any, noise: dict[str, Any], settings: Settings) -> tuple[UncertainNumber, ...]:
    """What is known of the camera's own numbers is of another camera; of brightness, blur and noise as a part of it."""
    kept = settings.light.kind is None
    told = (_scaled(each, scene, camera, noise, kept) for each in scene.uncertain)
    found = [each for each in told if each is not None]
    angle = settings.lens.telecentricity_deg
    if settings.lens.is_telecentric and angle:
        found.append(UncertainNumber(key="camera.telecentricity_deg", half_width=angle))
    return tuple(found)


def _scaled(
    told: UncertainNumber, scene: Scene, camera: Any, noise: dict[str, Any], own_light: bool
) -> UncertainNumber | None:
    table, _, name = told.key.partition(".")
    if table.startswith("light"):
        return told if own_light else None
    if table not in ("camera", "noise") or name.startswith("look_at"):
        return told
    if table == "camera" and name.startswith("lens"):
        return None
    if name not in _RATIOS:
        return _own(told, scene, camera) if table == "camera" and name in _CAMERAS else told
    before = getattr(scene.camera if table == "camera" else scene.noise, name)
    after = getattr(camera, name) if table == "camera" else noise[name]
    return _times(told, after / before if before else 1.0)


def _own(told: UncertainNumber, scene: Scene, camera: Any) -> UncertainNumber | None:
    """Of a number that both cameras have: a distance as it is, another as a part of itself."""
    name = told.key.removeprefix("camera.")
    before, after = getattr(scene.camera, name, None), getattr(camera, name, None)
    if not before or not after:
        return None
    return told if name in ("distance", "working_distance_mm") else _times(told, after / before)


def _times(told: UncertainNumber, factor: float) -> UncertainNumber:
    sizes = {name: getattr(told, name) for name in ("sd", "half_width")}
    return told.model_copy(update={name: size * factor for name, size in sizes.items() if size is not None})
