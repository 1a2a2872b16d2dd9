"""What a lens makes of a part on a sensor: distance, magnification, blur, light; for one pair or arrays of pairs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.features.locator import kappa2
from planner.designing.aspects import Aspect
from planner.designing.wishes import Wishes
from scenes.cameras.diffraction import airy_um
from scenes.catalogue import ListedLens, ListedLight, ListedSensor
from scenes.catalogue.photometry import photons_per_joule

_ROUNDED = 1.02  # of an image circle, that a diagonal may be
LONGEST_S = 1.0  # exposure, where neither camera nor part asks for a shorter one
MOUNT, CIRCLE, FIELD, DISTANCE, BLUR, TIME, WAY, ROLLING = (
    "mount", "image circle", "field of view", "working distance", "depth of field", "exposure time", "light in the way",
    "rolling shutter",
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """How camera, lens and light of a catalogue are set up for a part seen from a pose.

    Attributes
    ----------
    sensor, lens, light
        Entries of the catalogue.
    aspect : Aspect
    distance_mm, light_mm : float
        Of the camera, which is the lens' working distance, and of the light, from the reference point.
    f_number, working_f_number : float
        As it is set, and for the distance.
    magnification, pixel_mm : float
        At the reference point; a pixel there.
    blur_px : float
        Standard deviation, all together.
    exposure_s : float or None
        None where the light's brightness is not known.
    fill : float
        Of the saturation capacity, of a white surface.
    """

    sensor: ListedSensor
    lens: ListedLens
    light: ListedLight
    aspect: Aspect
    distance_mm: float
    light_mm: float
    f_number: float
    working_f_number: float
    magnification: float
    blur_px: float
    exposure_s: float | None
    fill: float

    @property
    def pixel_mm(self) -> float:
        """A pixel on the part, at the reference point."""
        return self.sensor.pixel_pitch_um / 1000 / self.magnification


@dataclass(frozen=True)
class Focused:
    """A lens before a sensor, in focus on a part: what does not depend on the light.

    Attributes
    ----------
    distance_mm, magnification : float
    """

    distance_mm: float
    magnification: float


def focused(sensor: ListedSensor, lens: ListedLens, aspect: Aspect, wishes: Wishes) -> Focused | str:
    """Where the camera stands, as near as it can; or what keeps it from it."""
    if not sensor.takes(lens.mount):
        return MOUNT
    if not is_covered(sensor.diagonal, lens.circle_mm):
        return CIRCLE
    half = np.array(sensor.size_mm) / 2
    if lens.is_telecentric:
        if not aspect.fits(half, np.array(lens.magnification)):
            return FIELD
        far, scale = lens.working_distance_mm, lens.magnification
    else:
        focal = lens.focal_length_mm
        far = float(aspect.distance(half, np.array(focal)))
        far = max(far, lens.minimum_object_distance_mm or 0.0, wishes.nearest_mm)
        scale = focal / (far - focal)
    most = min(wishes.farthest_mm, math.inf if lens.is_telecentric else lens.maximum_object_distance_mm or math.inf)
    if not max(wishes.nearest_mm, aspect.nearest_mm) <= far <= most:
        return DISTANCE
    return Focused(far, scale)


def working(lens: ListedLens, stop: float, magnification: float) -> float:
    """F-number as it counts for light and blur: that of an entocentric lens grows with the magnification."""
    return stop if lens.is_telecentric else stop * (1 + magnification)


def blur_um(
    lens: ListedLens, stop: float, at: Focused, aspect: Aspect, wavelength_nm: float, otherwise_um: float
) -> float:
    """Standard deviation of the blur on the sensor: diffraction, the lens' own, and defocus at the ends of the depth.

    A telecentric lens' stated depth of field, where that is wider, is what its maker counts as sharp: it bounds z.
    """
    number = working(lens, stop, at.magnification)
    own = lens.aberrations_um(wavelength_nm, number)
    defocus = defocus_um(at.magnification, aspect.half_depth_mm, number)
    return math.hypot(airy_um(wavelength_nm, number), otherwise_um if own is None else own, defocus)


def defocus_um(magnification: Any, depth_mm: float, number: Any) -> Any:
    """Standard deviation along a line of the disc that a point so far out of focus is, m^2 z / N wide; broadcast."""
    return 1000 * magnification**2 * depth_mm / number / 4


def is_covered(diagonal_mm: Any, circle_mm: Any) -> Any:
    """Whether an image circle covers a sensor: formats are named by rounded diagonals; broadcast."""
    return diagonal_mm <= _ROUNDED * circle_mm


def longest_s(sensor: ListedSensor, at: Focused, wishes: Wishes) -> float:
    """Longest exposure that the camera, the rate of parts and their motion leave."""
    times = [LONGEST_S, *([sensor.exposure_max_us * 1e-6] if sensor.exposure_max_us else [])]
    if wishes.rate_hz:
        times.append(1 / wishes.rate_hz)
    if wishes.speed_mm_s:
        pixel = sensor.pixel_pitch_um / 1000 / at.magnification
        times.append(wishes.motion_px * pixel / wishes.speed_mm_s)
    return min(times)


def electrons_per_s(sensor: ListedSensor, lens: ListedLens, number: float, light: ListedLight, far_mm: float) -> float:
    """Of a white diffuse surface under the light, in a pixel: pi L tau p^2 eta / (4 N^2); NaN where not known.

    The quantum efficiency counts at all wavelengths as at the one at which it was measured.
    """
    irradiance = None if light.kind is None else light.irradiance_at(far_mm)
    if irradiance is None:
        return math.nan
    on_sensor = irradiance * (lens.transmission or 1.0) / (4 * number**2)
    area = (sensor.pixel_pitch_um * 1e-6) ** 2
    return on_sensor * area * photons_per_joule(light.photon_nm) * sensor.best_efficiency


def light_distance(
    light: ListedLight, at: Focused, aspect: Aspect, telecentric: bool, default_mm: float
) -> float | None:
    """From the reference point; None where it would stand in the way of the camera.

    The hole of a light at the camera has to show all that is measured; it stands as near to the middle of the distances
    that it is made for as that allows.
    """
    if light.kind is None:  # the scene's own stand as they do
        return 0.0
    near, far = light.reach_mm
    if light.kind == "backlight":  # not nearer than what it shows is wide, so that it shines on no side of the part
        away = min(max(near, aspect.half_diagonal_mm), far)
        return float(-aspect.towards.min()) + away
    if light.kind == "dome":
        near = far = middle = math.sqrt(light.area_mm2 / math.pi + ((light.inner_diameter_mm or 0.0) / 2) ** 2)
    else:
        middle = (near + far) / 2 if math.isfinite(far) else max(near, min(default_mm, 0.9 * at.distance_mm))
    if light.kind in ("bar", "spot"):
        return middle
    hole, need = (light.inner_diameter_mm or 0.0) / 2, aspect.half_diagonal_mm
    least = 0.0 if hole >= need else math.inf if telecentric else at.distance_mm * (1 - hole / need)
    found = max(middle, least)
    in_place = aspect.nearest_mm < found <= min(far, 0.95 * at.distance_mm)
    return found if in_place else None


def chosen(
    sensor: ListedSensor, lens: ListedLens, light: ListedLight, aspect: Aspect, wishes: Wishes, scale_px: float,
    otherwise_um: float, default_mm: float, at: Focused | None = None,
) -> Settings | str:  # fmt: skip
    """The aperture and exposure of the least variance of an edge point, kappa^2 s_n^2 / C^2; or what keeps from any."""
    at = at or focused(sensor, lens, aspect, wishes)
    if isinstance(at, str):
        return at
    if wishes.speed_mm_s and sensor.shutter == "rolling":  # its rows see a moving part at other times: sheared
        return ROLLING
    far = light_distance(light, at, aspect, lens.is_telecentric, default_mm)
    if far is None:
        return WAY
    if wishes.rate_hz and sensor.frame_rate_hz and wishes.rate_hz > sensor.frame_rate_hz:
        return TIME
    longest, found = longest_s(sensor, at, wishes), []
    for stop in lens.stops:
        number = working(lens, stop, at.magnification)
        rate = electrons_per_s(sensor, lens, number, light, far)
        if math.isnan(rate) and wishes.timed:
            return TIME
        whole = wishes.fill * sensor.saturation_capacity_e
        time = None if math.isnan(rate) else min(whole / rate, longest)
        fill = wishes.fill if time is None else wishes.fill * min(1.0, rate * time / whole)
        moved = wishes.speed_mm_s * (time or 0.0) * at.magnification * 1000
        blur = math.hypot(blur_um(lens, stop, at, aspect, light.photon_nm, otherwise_um), moved / math.sqrt(12))
        blur_px = blur / sensor.pixel_pitch_um
        if blur_px > wishes.blur_px:
            continue
        worth = kappa2(scale_px, blur_px) * noise_to_signal(sensor, fill)
        found.append((worth, Settings(sensor, lens, light, aspect, at.distance_mm, far, stop, number, at.magnification,
                                      blur_px, time, fill)))  # fmt: skip
    return min(found, key=lambda each: each[0])[1] if found else BLUR


def noise_to_signal(sensor: ListedSensor, fill: float) -> float:
    """s_n^2 / C^2 of an edge between a white surface and darkness, its noise the mean of both sides'."""
    signal, filters = fill * sensor.saturation_capacity_e, sensor.filters
    dark, shot = (1.0, 1.0) if filters is None else (filters.noise_factor(2), filters.noise_factor(1))
    return (dark * sensor.temporal_dark_noise_e**2 + shot * signal / 2) / signal**2
