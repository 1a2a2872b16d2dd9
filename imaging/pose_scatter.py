"""What it costs to set the sensor's pose with a ruler: the values in the image change with it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imaging.features.kinds import on_plane
from imaging.features.measurand import Measurands, measurands
from imaging.features.seen import Seen, half_angle_of
from imaging.pictures import Pictures
from scenes import Centre, Circle, Curved, Scene, Wall

LEAST_SINE = 1e-2  # beside the pole a step along the circle of latitude would turn the azimuth without end


class PoseScatter(NamedTuple):
    """Joint covariance (S, M, M) of all quantities as poses scatter, in the image and as they are then measured in the
    object by who trusts the pose, and bias (S, M) in the image (at most)."""

    covariance: np.ndarray
    covariance_object: np.ndarray
    bias: np.ndarray


def pose_scatter(scene: Scene, sensors: np.ndarray) -> PoseScatter:
    """How all quantities scatter over poses that are off as `scenes.Jitter` says.

    The light's pose changes contrasts alone, which is left out.

    Parameters
    ----------
    scene : Scene
    sensors : ndarray, shape (S, 2)
        Polar angles and azimuths, degrees.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1").with_(jitter={"sensor_deg": 0.1})
    >>> pose_scatter(task1, np.array([[30.0, 135.0]])).covariance[:, 0, 0].round(4)
    array([0.0137])
    """
    count, sigma = len(scene.quantities), scene.jitter.sensor_deg
    covariance = np.zeros((2, len(sensors), count, count))
    bias = np.zeros((len(sensors), count))
    if sigma == 0:
        return PoseScatter(*covariance, bias)
    step = max(sigma, 1e-3)
    here = measurands(Pictures.of(scene, sensors))
    sine = np.maximum(np.sin(np.radians(sensors[:, 0])), LEAST_SINE)
    for axis in (np.stack([np.ones_like(sine), 0 * sine], -1), np.stack([0 * sine, 1 / sine], -1)):
        ahead, behind = (measurands(Pictures.of(scene, sensors + sign * step * axis)) for sign in (1, -1))
        moved = [(a - b) / 2 * (sigma / step) for a, b in zip(_both(here, ahead), _both(here, behind), strict=True)]
        covariance += np.einsum("ksm,ksn->ksmn", moved, moved)
        bias += np.abs(ahead.value - 2 * here.value + behind.value) / 2 * (sigma / step) ** 2
    return PoseScatter(*covariance, bias)


def _both(here: Measurands, there: Measurands) -> tuple[np.ndarray, np.ndarray]:
    """Values in the image of another pose, and what they are in the object to who believes in this one, (S, M)."""
    found = replace(there.seen, sensors=here.seen.sensors, expected=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = [on_plane(_with_circles(here, there, found), q).value for q in here.quantities]
    return there.value, np.stack(plane, -1)


def _with_circles(here: Measurands, there: Measurands, found: Seen) -> Seen:
    """What is found, circles too: their centres sought along the rays, their radii by the scale there."""
    if not found.circles:
        return found
    centres, radii, angles = [], [], []
    for c, name in enumerate(found.circles):
        centre, each = here.seen.centres[..., c, :], found.solid.round(name)
        feature = Wall(surface=name) if isinstance(each, Curved) else Centre(circle=name)
        image = there.seen.point(feature, None)
        towards = here.seen.viewpoint.towards(centre)
        sight = -towards if isinstance(each, Curved) else np.broadcast_to(each.axis, centre.shape)
        plane = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
        seen = found.onto(image, plane, each.centre).at
        over = there.seen.divisor(there.seen.centres[..., c, :]), found.divisor(seen)
        centres.append(seen)
        radii.append(found.radii[..., c] * over[1] / over[0])
        angles.append(_half_angle(here.seen, there.seen, each))
    return replace(found, centres=np.stack(centres, -2), radii=np.stack(radii, -1), half_angles=np.stack(angles, -1))


def _half_angle(here: Seen, there: Seen, each: Circle | Curved) -> np.ndarray:
    """Of a cone, rad, to who believes in another pose; 0 of what is none.

    From afar the sine of half the angle between both limbs is that of the half angle over that between axis and sight.
    """
    if half_angle_of(each) == 0:
        return np.zeros(there.eye.shape[:-1])
    sines = []
    for seen in (here, there):
        sight = -seen.viewpoint.towards(each.centre)
        sines.append(np.linalg.norm(np.cross(sight, each.surface.axis), axis=-1) / np.linalg.norm(sight, axis=-1))
    return np.arcsin(np.clip(np.sin(each.half_angle) * sines[0] / sines[1], -1, 1))
