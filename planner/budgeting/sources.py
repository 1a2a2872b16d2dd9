"""The inputs of a scene that are uncertain: what each is called, how well it is known, what it moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np

from planner.budgeting.station import Station
from planner.uncertainty.inputs import Input
from scenes import Scene, Uncertain
from scenes.board import PITCH
from scenes.cameras import estimated
from scenes.cameras.lens_modes import LensMode
from scenes.cameras.splined import Splined
from scenes.numbers import number_at, with_number
from scenes.placement import COMPONENTS

Kind = Literal["geometry", "brightness"]
_GEOMETRY = (
    "focal_px", "focal_length_mm", "pixel_pitch_um", "distance", "working_distance_mm", "look_at", "lens.distortion",
    "lens.shear", "motion", "line_time_us", "magnification", "telecentricity_deg", "image_side_deg", "flange_mm",
)  # fmt: skip
_UNITS = {
    "focal_px": "px", "focal_length_mm": "mm", "pixel_pitch_um": "um", "working_distance_mm": "mm", "blur_px": "px",
    "flange_mm": "mm", "wavelength_nm": "nm", "line_time_us": "us", "shear": "px a row",
    "exposure": "levels", "sigma": "levels", "dark_level": "levels", "dsnu": "levels",
}  # fmt: skip
LENS_MODE = "lens mode"
_LENGTHS = ("pitch", "distance", "look_at", "radius", "aperture_radius", "focus", "offset", "height", "half_side")


@dataclass(frozen=True)
class Believed:
    """A number that a measured value depends on, as it is believed to be.

    Attributes
    ----------
    name : str
    value : float
        0 for a deviation.
    told : Uncertain
        How well it is known.
    unit : str
        Empty for a pure number.
    """

    name: str
    value: float
    told: Uncertain
    unit: str

    @property
    def as_input(self) -> Input:
        """The engine's."""
        told = self.told
        return Input(self.name, self.value, told.u, told.distribution_name, told.dof or np.inf, told.type, self.unit)


@dataclass(frozen=True)
class Source(Believed):
    """One uncertain input of a station.

    Attributes
    ----------
    name : str
        A key of the scene, or of its table ``uncertainty`` with the component: ``part_shift.x``.
    kind : {"geometry", "brightness"}
        Whether it moves places in the image, or levels alone.
    scale : float
        Size of a change that is small to it: what derivatives are taken over.
    moved : callable
        The station with this input changed by a step.
    """

    kind: Kind
    scale: float
    moved: Callable[[Station, float], Station]


def sources(scene: Scene) -> tuple[Source, ...]:
    """All inputs that move what a picture shows; temperature, rounding and the like are not among them."""
    of_camera = (*_calibrated(scene), *_modes(scene), *_estimated(scene))
    return (*_numbers(scene), *_poses(scene), *_carried(scene), *of_camera, *_influences(scene))


def _influences(scene: Scene) -> Iterator[Source]:
    """Those of a user's own kinds."""
    for each in scene.uncertainty.influences:
        yield Source(each.kind, 0.0, each, each.unit, each.moves, each.small, each.moved)


def _numbers(scene: Scene) -> Iterator[Source]:
    for each in scene.uncertain:
        value = number_at(scene, each.key)
        name = each.key.split("[")[0].split(".", 1)[1]
        geometric = each.key == PITCH or (each.key.startswith("camera.") and name in _GEOMETRY)
        kind: Kind = "geometry" if geometric else "brightness"
        last = name.rsplit(".", 1)[-1]
        unit = (
            f"{scene.units}/s"
            if last == "motion"
            else scene.units
            if last in _LENGTHS
            else _UNITS.get(last, "deg" if last.endswith("_deg") else "")
        )
        scale = 1e-2 if name in ("lens.distortion", "lens.shear") else abs(value) or 1.0
        if last == "look_at":
            scale = scene.camera.distance
        yield Source(each.key, value, each, unit, kind, scale, _number_moved(each.key))


def _number_moved(key: str) -> Callable[[Station, float], Station]:
    def moved(station: Station, step: float) -> Station:
        return replace(station, scene=with_number(station.scene, key, number_at(station.scene, key) + step))

    return moved


def _poses(scene: Scene) -> Iterator[Source]:
    said, near = scene.uncertainty, scene.camera.distance
    told = _or_jitter(said.sensor_deg, scene.jitter.sensor_deg)
    for i, part in enumerate(("polar", "azimuth")):
        yield from _one(f"sensor_deg.{part}", told, "deg", "geometry", 1.0, lambda s, d, i=i: s.sensor_moved(d, i))
    told = _or_jitter(said.light_deg, scene.jitter.light_deg)
    for k in scene.free:
        label = f"light_deg[{k}]" if len(scene.lights) > 1 else "light_deg"
        for i, part in enumerate(("polar", "azimuth")):
            move = _light_moved(k, i)
            yield from _one(f"{label}.{part}", told, "deg", "brightness", 1.0, move)
    yield from _one("sensor_roll_deg", said.sensor_roll_deg, "deg", "geometry", 1.0,
                    lambda s, d: replace(s, roll_deg=s.roll_deg + d))  # fmt: skip
    yield from _one("sensor_distance", said.sensor_distance, scene.units, "geometry", near,
                    _number_moved("camera.distance"))  # fmt: skip
    for i, (name, told) in enumerate(zip(COMPONENTS, said.of_part, strict=True)):
        unit, scale, attribute = (scene.units, near, "shift") if i < 3 else ("deg", 1.0, "tilt_deg")
        yield from _one(name, told, unit, "geometry", scale, _tuple_moved(attribute, i % 3))
    for i, (name, told) in enumerate(zip(COMPONENTS, said.of_board, strict=True)):
        unit, scale, attribute = (scene.units, near, "board_shift") if i < 3 else ("deg", 1.0, "board_tilt_deg")
        name = name.replace("part", "board")
        yield from _one(name, told, unit, "geometry", scale, _tuple_moved(attribute, i % 3))
    for i, axis in enumerate("xy"):
        move = _tuple_moved("principal_px", i)
        yield from _one(f"principal_point_px.{axis}", said.principal_point_px, "px", "geometry", 100.0, move)


def _carried(scene: Scene) -> Iterator[Source]:
    """Errors of what carries sensor or part."""
    for carrier in scene.uncertainty.carriers:
        for i, error in enumerate(carrier.errors):
            told = Uncertain(sd=error.u) if error.u > 0 else None
            unit, scale = (scene.units, scene.camera.distance) if error.unit == "length" else (error.unit, 1.0)
            yield from _one(error.name, told, unit, "geometry", scale, lambda s, d, c=carrier, i=i: s.carried(c, i, d))


def _calibrated(scene: Scene) -> Iterator[Source]:
    """The parameters of a calibration's covariance; ``fx`` alone stands for both focal lengths."""
    given = scene.uncertainty.covariance
    if given is None:
        return
    camera = scene.camera
    for name, sd in zip(given.names, given.sd, strict=True):
        told = Uncertain(sd=float(sd))
        if name in ("fx", "fy"):
            both = "fy" not in given.names
            move = _stretched(camera.focal_px, (0, 1) if both else (int(name == "fy"),))
            yield Source(name, camera.focal_px, told, "px", "geometry", camera.focal_px, move)
        elif name in ("cx", "cy"):
            move = _tuple_moved("principal_px", int(name == "cy"))
            yield Source(name, 0.0, told, "px", "geometry", 100.0, move)
        else:
            place = ("k1", "k2", "p1", "p2", "k3").index(name)
            key = f"camera.lens.distortion[{place}]"
            move = _number_moved(key)
            yield Source(name, number_at(scene, key), told, "", "geometry", 1e-2, move)


def _modes(scene: Scene) -> Iterator[Source]:
    """Errors of a splined lens."""
    for number, mode in enumerate(scene.uncertainty.lens_modes, 1):
        move = _lens_moved(mode, scene.camera.focal_px)
        yield Source(f"{LENS_MODE} {number}", 0.0, Uncertain(sd=1.0), "", "geometry", 1.0, move)


def _lens_moved(mode: LensMode, focal: float) -> Callable[[Station, float], Station]:
    stretched = _stretched(focal, (0, 1))

    def moved(station: Station, step: float) -> Station:
        camera = station.scene.camera
        lens = mode.moved(cast("Splined", camera.lens), step)
        scene = station.scene.tried(camera=camera.tried(lens=lens))
        return stretched(replace(station, scene=scene), step * mode.focal_px)

    return moved


def _estimated(scene: Scene) -> Iterator[Source]:
    """What a picture is to tell of the camera and the scene says nothing of before."""
    which, told = scene.placement.camera, Uncertain(sd=estimated.UNTOLD)
    for name, of_camera, untold in zip(estimated.names(which), which, estimated.is_untold(scene), strict=True):
        move = _stretched(1.0, (0, 1)) if of_camera == "focal" else _number_moved(estimated.K1)
        yield from _one(name, told if untold else None, "", "geometry", 1e-2, move)


def _stretched(focal: float, axes: tuple[int, ...]) -> Callable[[Station, float], Station]:
    def moved(station: Station, step: float) -> Station:
        for axis in axes:
            station = station.changed("stretch", axis, step / focal)
        return station

    return moved


def _tuple_moved(name: str, which: int) -> Callable[[Station, float], Station]:
    return lambda station, step: station.changed(name, which, step)


def _light_moved(light: int, which: int) -> Callable[[Station, float], Station]:
    return lambda station, step: station.light_moved(light, step, which)


def _one(
    name: str, told: Uncertain | None, unit: str, kind: Kind, scale: float, moved: Callable[[Station, float], Station]
) -> Iterator[Source]:
    if told is not None:
        yield Source(name, 0.0, told, unit, kind, scale, moved)


def _or_jitter(told: Uncertain | None, jitter: float) -> Uncertain | None:
    return Uncertain(sd=jitter) if told is None and jitter > 0 else told
