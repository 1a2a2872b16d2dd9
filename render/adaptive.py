"""Many rays only where an edge crosses: fine pixels that differ from a neighbour are rendered again."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

_STEP = 0.01  # part of the brightest pixel that a neighbour must differ by; shading varies by less over a fine pixel
_TILE = 8  # fine pixels
_AT_ONCE = 1 << 25  # rays in one call, which bounds the memory


def crossed(fine: np.ndarray) -> np.ndarray:
    """Fine pixels that differ from one of their eight neighbours, as a mask.

    >>> crossed(np.array([[0.0, 0, 0, 1, 1, 1]])).astype(int)
    array([[0, 0, 1, 1, 0, 0]])
    """
    span = maximum_filter(fine, 3, mode="nearest") - minimum_filter(fine, 3, mode="nearest")
    return span > _STEP * max(float(fine.max()), np.finfo(float).tiny)


def refine(
    mitsuba: Any,
    scene: Any,
    sensor: Callable[[int, tuple[slice, slice]], dict],
    fine: np.ndarray,
    samples: int,
    seed: int,
) -> np.ndarray:
    """The image with its crossed fine pixels rendered again, ``samples`` (a square number) stratified rays each.

    Compiled variants trace all rays as one array. A scalar one can only render rectangles: tiles that hold a crossed
    pixel.

    Parameters
    ----------
    scene : mitsuba.Scene
    sensor : callable
        ``sensor(samples, crop)`` describes the sensor for rows and columns of ``fine``.
    fine : ndarray
        The image as rendered so far.
    samples, seed : int
    """
    if "scalar" in mitsuba.variant():
        return _tiles(mitsuba, scene, sensor, fine, samples, seed)
    rows, columns = np.nonzero(crossed(fine))
    result, share = fine.copy(), max(_AT_ONCE // samples, 1)
    for first in range(0, rows.size, share):
        part = slice(first, first + share)
        result[rows[part], columns[part]] = _radiance(
            mitsuba, scene, rows[part], columns[part], fine.shape, samples, seed + 1 + first
        )
    return result


def _tiles(mitsuba, scene, sensor, fine: np.ndarray, samples: int, seed: int) -> np.ndarray:
    """The image with every tile that holds a crossed pixel rendered again."""
    result, marked = fine.copy(), crossed(fine)
    for top in range(0, fine.shape[0], _TILE):
        for left in range(0, fine.shape[1], _TILE):
            tile = slice(top, min(top + _TILE, fine.shape[0])), slice(left, min(left + _TILE, fine.shape[1]))
            if marked[tile].any():
                seed += 1
                view = mitsuba.load_dict(sensor(samples, tile))
                result[tile] = np.array(mitsuba.render(scene, sensor=view, seed=seed), float)[:, :, 0]
    return result


def _radiance(mitsuba, scene, rows, columns, shape, samples: int, seed: int) -> np.ndarray:
    """Mean radiance of single fine pixels of the crop, shape (n,)."""
    import drjit as dr

    side = math.isqrt(samples)
    sensor, ray_index = scene.sensors()[0], dr.arange(mitsuba.UInt32, rows.size * samples)
    pixel, stratum = ray_index // samples, ray_index % samples
    sampler = mitsuba.load_dict({"type": "independent"})
    sampler.seed(seed, rows.size * samples)
    x, y = (dr.gather(mitsuba.Float, mitsuba.Float(axis.astype(np.float32)), pixel) for axis in (columns, rows))
    jitter = sampler.next_2d()
    place = mitsuba.Point2f(
        (x + (mitsuba.Float(stratum % side) + jitter.x) / side) / shape[1],
        (y + (mitsuba.Float(stratum // side) + jitter.y) / side) / shape[0],
    )
    ray, weight = sensor.sample_ray(0.0, sampler.next_1d(), place, sampler.next_2d())
    radiance, _, _ = scene.integrator().sample(scene, sampler, ray)
    total = dr.zeros(mitsuba.Float, rows.size)
    dr.scatter_reduce(dr.ReduceOp.Add, total, (weight * radiance)[0], pixel)
    return np.array(total, float) / samples
