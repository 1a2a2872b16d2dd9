"""The grey level of a matt body beside its limb, ray by ray."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.contours.limb import Strand
from imaging.geometry.projection import rays, sensor_position
from scenes import Camera
from scenes.parts.surfaces import Surface


class Lamps(NamedTuple):
    """Points that shine: places (k, 3), and grey levels (k,) of a surface that faces one at unit distance."""

    at: np.ndarray
    power: np.ndarray


def lambert(surface: Surface, points: np.ndarray, lamps: Lamps) -> np.ndarray:
    """Level of points (..., 3) of a matt surface, its own attached shadow with it, grey levels, (...)."""
    toward = lamps.at - points[..., None, :]
    square = (toward**2).sum(-1)
    facing = np.maximum((surface.normals(points)[..., None, :] * toward).sum(-1), 0.0)
    return (lamps.power * facing / (square * np.sqrt(square))).sum(-1)


def levels_inside(
    surface: Surface, strand: Strand, sensor, camera: Camera, inside: np.ndarray, lamps: Lamps
) -> np.ndarray:
    """Exact level at distances (J,) px inside a strand's n points along the image's normal, (n, J); 0 past the body."""
    pose = np.array(list(sensor), float)
    eye = sensor_position(camera, pose)
    at = strand.at[:, None] - np.asarray(inside)[None, :, None] * strand.outward[:, None]
    way = rays(at, pose, camera)
    met = surface.intersections(eye, way)
    first = np.where(met > 0, met, np.inf).min(-1)
    hit = np.isfinite(first)
    points = eye + np.where(hit, first, 0.0)[..., None] * way
    found = np.zeros(hit.shape)
    found[hit] = lambert(surface, points[hit], lamps)
    return found
