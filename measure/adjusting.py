"""What renders tell of how a picture would tell of inputs that its scene is not sure of (`measure.adjustment`)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation, gaussian_gradient_magnitude, label, uniform_filter

from imaging.sensor import full_scale, recorded
from measure.adjustment import Adjustment, means
from scenes import Picture

_SIDE, _MOST = 8, 5000  # px of a block; of blocks: larger ones in larger images
_OF_RAYS = 1.5  # of one image's variance by rays: of two on the mean, and of a picture that is a render
_LEAST = 16  # blocks of a region, and that tell of an input
_NEAR = 5  # blocks a side over which rays scatter alike
_STEEP = 1.0  # change over a pixel, in the noise's standard deviation, that is an edge's
_NEAR_END = 4.0  # standard deviations of noise below the end of the scale
_ENOUGH = 4  # sums for each input, to tell it
_CHANCE = 5.0  # standard deviations of products of noise, which are no information


def adjustment(renders: np.ndarray, picture: Picture) -> Adjustment | None:
    """From two noise-free sets of images, of other rays.

    Their noise would tell of inputs what is not there: products of two sets have none on the mean.

    Parameters
    ----------
    renders : ndarray, shape (2, 2 + k, height, width)
        Of each set one for the levels, and of rays that are the same ones in all of them one as the scene says and
        with one input each changed.
    picture : Picture

    Returns
    -------
    Adjustment or None
        None where too few blocks show no edge.
    """
    noise, clean = picture.scene.noise, renders[:, 0].mean(0)
    side = _SIDE * math.ceil(math.sqrt(clean.size / _SIDE**2 / _MOST))
    level, variance = recorded(noise, clean)
    deviation = np.sqrt(np.broadcast_to(variance, clean.shape))
    steep = gaussian_gradient_magnitude(clean, 1.0) > _STEEP * deviation
    near = math.ceil(3 * picture.scene.camera.most_blur_px) + 1
    lost = binary_dilation(steep, iterations=near) | (level > full_scale(noise) - _NEAR_END * deviation)
    regions = _regions(means(lost[None], side)[0] == 0)
    at = np.argwhere(regions)
    if len(at) < _ENOUGH * renders.shape[1]:
        return None
    first, second = (means(each, side)[:, at[:, 0], at[:, 1]].T for each in renders)
    levels = (first[:, :1] + second[:, :1]) / 2 - noise.dark_level
    own = means(deviation[None] ** 2, side)[0, at[:, 0], at[:, 1]] / side**2
    region = regions[tuple(at.T)]
    own += _OF_RAYS * _nearby((first[:, 0] - second[:, 0]) ** 2 / 2, at, region, regions.shape)
    design = [each[:, 2:] - each[:, 1:2] for each in (first, second)]
    made = Adjustment(
        side, at, np.concatenate([(design[0] + design[1]) / 2, levels], 1), region, own, np.zeros(0), np.zeros(0),
        noise.dark_level,
    )  # fmt: skip
    asked = _by_many_blocks(made)
    one, other = (made.left(each) * asked for each in design)
    told = [_products(one[region == each], other[region == each]) for each in made.regions]
    normal, spread = (np.array(each) for each in zip(*told, strict=True))
    columns = np.concatenate([made.columns[:, :-1] * asked, levels], 1)
    return replace(made, columns=columns, normal=normal, spread=spread)


def _by_many_blocks(made: Adjustment) -> np.ndarray:
    """Whether what each block's region tells of each input is told by many blocks, bool (n, k): what a few tell is
    not asked, for they would fit whatever is wrong there."""
    squares = made.left(made.columns[:, :-1]) ** 2
    found = np.zeros(squares.shape, bool)
    for region in made.regions:
        some = made.region == region
        sums = squares[some].sum(0)
        found[some] = sums**2 > _LEAST * (squares[some] ** 2).sum(0)
    return found


def _products(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information, and its noise, (k, k) each, of columns (n, k) from two sets of rays."""
    by_chance = _CHANCE / math.sqrt(len(one)) * (one - other).T @ (one - other) / 2
    both = (one + other) / 2
    return _definite(one.T @ other - by_chance), both.T @ both


def _regions(flat: np.ndarray) -> np.ndarray:
    """Numbers of connected parts of an image of blocks, bool (rows, columns); 0 where it is not flat or a part is
    small."""
    regions, _ = label(flat)
    small = np.bincount(regions.ravel()) < _LEAST
    return np.where(small[regions], 0, regions)


def _nearby(values: np.ndarray, at: np.ndarray, region: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Means (n,) of values of blocks (n,) over those near each in its region: where faces light each other rays scatter
    more."""
    found = np.empty(len(values))
    for each in np.unique(region):
        some = region == each
        grid, count = np.zeros((2, *shape))
        grid[tuple(at[some].T)], count[tuple(at[some].T)] = values[some], 1.0
        sums, counts = (uniform_filter(image, _NEAR, mode="constant")[tuple(at[some].T)] for image in (grid, count))
        found[some] = sums / counts
    return found


def _definite(normal: np.ndarray) -> np.ndarray:
    """The nearest matrix that takes nothing from any input."""
    values, axes = np.linalg.eigh((normal + normal.T) / 2)
    return (axes * np.maximum(values, 0.0)) @ axes.T
