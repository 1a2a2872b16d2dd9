"""Rays of single fine pixels, traced as one array in a compiled variant of Mitsuba.

Where a ray goes within its fine pixel is random and independent, and the same wherever that pixel is traced: two
renders that mark different pixels have the same rays in those that they share. All that is random behind that (place
on the aperture and on the light, directions of reflected light) is the same in every pixel: a table of low-discrepancy
points, of which each fine pixel of a pixel has its own block. What such a table gets wrong it gets wrong nearly alike
on both sides of an edge and all along it, and in two renders of the same seed that differ in an effect.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

AT_ONCE = 1 << 24  # rays in one call, which bounds the memory
LARGE_AT_ONCE = 1 << 22  # the same beside a large image
SURFACES = 16  # that light may meet; in a bore four radii deep, of reflectance 0.9, 0.3 % of what is sent on is left
_DIMENSIONS = 4  # of a reflection: where on the light, which way to the next surface


@dataclass(frozen=True)
class Rays:
    """Random numbers of an image's rays.

    Attributes
    ----------
    mitsuba : module
        With a compiled variant set.
    supersample : int
        Fine pixels that divide a pixel, each way.
    most : int
        Rays of a fine pixel, at most.
    bounces : int
        Surfaces that light may meet before the one that is seen, less than `SURFACES`.
    seed : int
    at_once : int
        Rays in one call, which bounds the memory.
    shown : bool
        Whether a light itself is seen, and nothing else.
    sight : callable, optional
        (rows and columns of the crop's size, places, random numbers) to rays, where no sensor of Mitsuba has them.
    """

    mitsuba: Any
    supersample: int
    most: int
    bounces: int
    seed: int
    at_once: int = AT_ONCE
    shown: bool = False
    sight: Callable[[tuple[int, int], Any, Any], Any] | None = None

    def radiance(
        self, scene: Any, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int], samples: int
    ) -> np.ndarray:
        """Mean radiance of fine pixels of the sensor's crop.

        Parameters
        ----------
        scene : mitsuba.Scene
            With one sensor.
        rows, columns : ndarray of int, shape (n,)
        shape : tuple of int
            Rows and columns of the crop.
        samples : int
            Rays a fine pixel, a square number.

        Returns
        -------
        ndarray, shape (n,)
        """
        share = max(self.at_once // samples, 1)
        parts = [slice(first, first + share) for first in range(0, rows.size, share)]
        found = [self._part(scene, rows[part], columns[part], shape, samples) for part in parts]
        return np.concatenate(found) if found else np.zeros(0)

    def _part(self, scene, rows, columns, shape, samples: int) -> np.ndarray:
        import drjit as dr

        mi, k, side = self.mitsuba, self.supersample, math.isqrt(samples)
        index = dr.arange(mi.UInt32, rows.size * samples)
        pixel, number = index // samples, index % samples
        cells = (rows % k) * k + columns % k
        cell, x, y = (dr.gather(kind, kind(values), pixel) for kind, values in (
            (mi.UInt32, cells.astype(np.uint32)), (mi.Float, columns.astype(np.float32)),
            (mi.Float, rows.astype(np.float32)),
        ))  # fmt: skip
        stratum = dr.gather(mi.UInt32, mi.UInt32(self._strata(samples)), cell * samples + number)
        point = cell * self._block + number
        own, _ = mi.sample_tea_32(mi.UInt32(x) + shape[1] * mi.UInt32(y), dr.opaque(mi.UInt32, self.seed))
        across, down = (mi.Float(each >> 8) * 2.0**-24 for each in mi.sample_tea_32(own, number))
        place = mi.Point2f(
            (x + (mi.Float(stratum % side) + across) / side) / shape[1],
            (y + (mi.Float(stratum // side) + down) / side) / shape[0],
        )
        if self.sight is None:
            ray, weight = scene.sensors()[0].sample_ray(0.0, 0.5, place, self._pair(point, 0))
            radiance = weight[0] * self._follow(scene, ray, point)
        else:
            radiance = self._follow(scene, self.sight(shape, place, self._pair(point, 0)), point)
        return np.array(dr.block_sum(radiance, samples), float) / samples

    def _follow(self, scene, ray, point):
        """Light that comes along rays, the light itself left out: from the first surface, and by way of others."""
        import drjit as dr

        hit = scene.ray_intersect(ray)
        if self.shown:
            return hit.emitter(scene).eval(hit)[0]
        mi = self.mitsuba
        first = self._reflected(scene, ray, hit, point, mi.UInt32(2))
        if not self.bounces:
            return first

        def onward(alive, bounce, ray, hit, passed, total):
            column = 2 + _DIMENSIONS * bounce
            surface, numbers = hit.bsdf(ray), self._pair(point, column + 2)
            sent, value = surface.sample(mi.BSDFContext(), hit, 0.5, numbers, alive)
            passed = passed * value[0]
            ray = hit.spawn_ray(hit.to_world(sent.wo))
            hit = scene.ray_intersect(ray, alive & (passed > 0))
            total = total + passed * self._reflected(scene, ray, hit, point, column + _DIMENSIONS)
            return hit.is_valid() & (bounce + 1 < self.bounces), bounce + 1, ray, hit, passed, total

        start = hit.is_valid(), mi.UInt32(0), ray, hit, mi.Float(1.0), first  # compiled once for all bounces
        return dr.while_loop(start, lambda alive, *_: alive, onward)[-1]

    def _reflected(self, scene, ray, hit, point, column):
        """What the surfaces that rays meet send back of a light's; numbers from a column of the table on."""
        alive = hit.is_valid()
        light, arriving = scene.sample_emitter_direction(hit, self._pair(point, column), True, alive)
        lit = alive & (light.pdf != 0)
        return (hit.bsdf(ray).eval(self.mitsuba.BSDFContext(), hit, hit.to_local(light.d), lit) * arriving)[0]

    def _pair(self, point, column):
        """Two columns of the table, the first of them as it may differ from ray to ray."""
        import drjit as dr

        mi, length = self.mitsuba, self._table.shape[1]
        return mi.Point2f(*(dr.gather(mi.Float, self._numbers, (column + i) * length + point) for i in range(2)))

    @property
    def _block(self) -> int:
        return 1 << math.ceil(math.log2(self.most))

    @cached_property
    def _numbers(self):
        """The table on the variant's device, one column after the other."""
        return self.mitsuba.Float(self._table.ravel())

    @cached_property
    def _table(self) -> np.ndarray:
        """Sobol points, shape (dimensions, fine pixels of a pixel x block)."""
        from scipy.stats import qmc  # slow to load, and only needed to render

        power = math.ceil(math.log2(self.supersample**2 * self._block))
        dimensions = 2 + _DIMENSIONS * SURFACES  # whatever the bounces: the scrambling depends on their number
        points = qmc.Sobol(dimensions, rng=self.seed).random_base2(power)
        return np.minimum(points.T.astype(np.float32), np.float32(1) - np.finfo(np.float32).epsneg)

    def _strata(self, samples: int) -> np.ndarray:
        """Which stratum of its fine pixel each ray crosses: shuffled, as consecutive points are not independent."""
        rng = np.random.default_rng(self.seed)
        order = np.tile(np.arange(samples, dtype=np.uint32), (self.supersample**2, 1))
        return rng.permuted(order, axis=1).ravel()
