"""What a proof measures: noise-free images whose noisy copies are measured, and as many that tell their biases."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from scipy.ndimage import binary_erosion

import measure
from measure import Correction, Images
from measure.known_bias import RENDERING
from measure.propagation import PropagatedValues
from render.build import MANY_WAYS
from render.large import near_required
from scenes import Picture
from validation.remeasured import Method
from validation.simulation.corrections import sure, told_by
from validation.simulation.how import How
from validation.simulation.images import completed
from validation.simulation.shown import Shown

_STILL = 0.07  # part of sigma, of what is measured and of what tells its bias: of their difference a tenth
_OTHERS = 1000  # where the seeds of renders begin that are measured, beside those that tell their biases
_MOST = 6  # of each


@dataclass(frozen=True, eq=False)
class Renders:
    """Noise-free images of a picture whose noisy copies are measured, and as many that tell their biases.

    Attributes
    ----------
    whole : ndarray, shape (height, width)
        Where nothing is measured, too.
    measured, others : tuple of ndarray, shape (height, width)
        Of other rays, each.
    """

    whole: np.ndarray
    measured: tuple[np.ndarray, ...]
    others: tuple[np.ndarray, ...]

    def mean(self, picture: Picture) -> np.ndarray:
        """Of what is measured; where nothing is, the whole image."""
        if self.measured[0] is self.whole:
            return self.whole
        camera = picture.scene.camera
        near = near_required(picture, (slice(0, camera.height), slice(0, camera.width)), 1)
        inner = binary_erosion(near, iterations=math.ceil(4 * camera.most_blur_px) + 1, border_value=1)
        return np.where(inner, np.mean(self.measured, 0), self.whole)


def steadied(picture: Picture, whole: np.ndarray, method: Method, how: How = How()) -> Renders:
    """A noise-free image and one of other rays; where the noise of their difference is above a tenth of sigma, as many
    of each as make it so little, six at most: what is measured with four times the rays, what tells its bias with light
    between faces gathered (`Quality.gathered`) where that can be.

    A camera's picture has no such noise, but what is measured in noisy copies of one render has an error of its own,
    which no number of copies averages out. Four times the rays leave some 0.4 of it for three times the time.

    Parameters
    ----------
    whole : ndarray, shape (height, width)
        What ``how`` makes, where nothing is measured, too.
    """
    renders = Renders(whole, (whole,), (how.image(picture, 1),))
    if not how.active(picture) & MANY_WAYS or _noise(picture, renders, method, how) <= _STILL:
        return renders
    ways = how.finer, how.quieter(picture)
    renders = Renders(whole, (ways[0].image(picture, _OTHERS),), (ways[1].image(picture, 1),))
    more = range(1, min(math.ceil((_noise(picture, renders, method, how) / _STILL) ** 2), _MOST))
    measured, others = (
        (first, *(way.image(picture, seed + i) for i in more))
        for way, first, seed in zip(ways, (renders.measured[0], renders.others[0]), (_OTHERS, 1), strict=True)
    )
    return Renders(whole, measured, others)


def _noise(picture: Picture, renders: Renders, method: Method, how: How) -> float:
    """Of one render, in parts of sigma, where it is largest; of two."""
    pair = *renders.measured, *renders.others
    found = measure.correction(Images(pair, by_pixel=how.by_pixel), picture, method.locator, method.threshold)
    known = np.isfinite(found.sigma) & (found.sigma > 0)  # what can be measured
    noise = np.sqrt(2) * found.sources[RENDERING][known] / found.sigma[known]
    return float(max(noise[np.isfinite(noise)], default=0.0))


def independent(
    picture: Picture,
    methods: tuple[Method, ...],
    renders: Renders,
    propagated: tuple[PropagatedValues, ...],
    how: How = How(),
) -> tuple[Correction, ...]:
    """Corrections by each method from renders of other rays than those whose mean's noisy copies are corrected.

    Parameters
    ----------
    renders : Renders
        Those (`steadied`).
    propagated : tuple of PropagatedValues
        What `measure.propagate` says of their mean, by method.
    """
    how = how.by(*methods, of=picture.scene).gathering
    images = completed(picture, renders.others, renders.measured, how)
    more, found = [cache(each) for each in Shown(picture, how, images).more_telling(images)], []
    for each, told in zip(methods, propagated, strict=True):
        of = partial(told_by, picture, each, told)
        found.append(sure(picture, of(images), of, more))
    return tuple(found)
