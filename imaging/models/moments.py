"""Moments of the paper's weighted edge points along each edge, the part of its model that takes all the time.

On a convex diffuse solid a point's weight is a number an edge over r^2, r its distance from the light, and its place
in the image is a fraction tau z_B / z of the edge, z its depth. So r^2 depends on the light alone, z on the sensor
alone, both are one matrix product for all poses, and so are the sums.
"""

from __future__ import annotations

import numpy as np

from imaging.features.projected_edges import image_fractions
from imaging.geometry.projection import direction, edge_points
from imaging.light.appearance import is_separable
from imaging.light.edge_sides import paper_contrast2, paper_step
from imaging.pictures import Pictures

_BLOCK = 256  # poses at a time, so that their points stay in the processor's cache


def moments(pictures: Pictures, names: tuple[str, ...], count: int):
    """Sum, mean and variance of the edge points' places with their squared contrasts as weights.

    Parameters
    ----------
    names : tuple of str
        E edges, with ``count`` points each, equally spaced in space.

    Returns
    -------
    total, mean, spread, counted : ndarray, shape (..., E)
        Sum of the weights, grey levels^2; mean and variance of the fractions of the image's length; number of points
        with any weight.
    """
    scene, sensors = pictures.scene, pictures.sensors
    lights = pictures.lights[0]
    if is_separable(scene) and names and 1 in (sensors.ndim, lights.ndim):
        strength = paper_step(pictures, names) ** 2
        if sensors.ndim == 1:
            parts = _many_lights(scene, names, sensors, lights.reshape(-1, 2), count)
            shape = lights.shape[:-1]
        else:
            parts = _many_sensors(scene, names, sensors.reshape(-1, 2), lights, count)
            shape = sensors.shape[:-1]
        zeroth, first, second = (part.reshape(*shape, len(names)) for part in parts)
        mean = first / zeroth
        return strength * zeroth, mean, second / zeroth - mean**2, np.full(strength.shape, count)
    fractions = np.linspace(0, 1, count)
    squared = paper_contrast2(pictures, names, fractions)
    u = image_fractions(scene, names, sensors, fractions)
    total = squared.sum(-1)
    mean = np.einsum("...n,...n->...", squared, u) / total
    spread = np.einsum("...n,...n->...", squared, (u - mean[..., None]) ** 2) / total
    return total, mean, spread, np.count_nonzero(squared, axis=-1)


def _many_lights(scene, names, sensor, lights, count):
    """Sums of 1/r^2 times powers 0, 1, 2 of the image's fraction, each (poses, E)."""
    fractions = np.linspace(0, 1, count)
    u = image_fractions(scene, names, sensor, fractions)
    powers = np.stack([np.ones_like(u), u, u * u], -1)
    points = edge_points(scene.solid, names, fractions).reshape(-1, 3)
    points = points - np.array(scene.camera.look_at)
    plan = np.vstack([-2 * points.T, (points**2).sum(1) + scene.lights[0].distance ** 2])
    found = np.empty((3, len(lights), len(names)))
    for at in range(0, len(lights), _BLOCK):
        inverse = _inverse(scene.lights[0].distance * direction(lights[at : at + _BLOCK]), plan)
        for e in range(len(names)):
            found[:, at : at + _BLOCK, e] = (inverse[:, e * count : (e + 1) * count] @ powers[e]).T
    return found


def _many_sensors(scene, names, sensors, light, count):
    """The same sums for one light and many sensors."""
    fractions = np.linspace(0, 1, count)
    points = edge_points(scene.solid, names, fractions) - np.array(scene.camera.look_at)
    weights = 1 / ((scene.lights[0].distance * direction(light) - points) ** 2).sum(-1)
    plan = np.vstack(
        [-scene.camera.perspective * points.reshape(-1, 3).T, np.full(points.shape[0] * count, scene.camera.distance)]
    )
    found = np.empty((3, len(sensors), len(names)))
    found[0] = weights.sum(-1)
    for at in range(0, len(sensors), _BLOCK):
        inverse = _inverse(direction(sensors[at : at + _BLOCK]), plan)
        for e in range(len(names)):
            part = inverse[:, e * count : (e + 1) * count]
            last = 1 / part[:, -1]
            found[1, at : at + _BLOCK, e] = last * (part @ (weights[e] * fractions))
            part *= part
            found[2, at : at + _BLOCK, e] = last**2 * (part @ (weights[e] * fractions**2))
    return found


def _inverse(vectors: np.ndarray, plan: np.ndarray) -> np.ndarray:
    """1 / (vectors . plan[:3] + plan[3]), shape (poses, points)."""
    values = vectors @ plan[:3]
    values += plan[3]
    return np.reciprocal(values, out=values)
