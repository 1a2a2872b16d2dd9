"""What a picture itself tells of inputs that its scene is not sure of: what surfaces reflect, where lights stand.

A face beside a wall that reflects more is brighter near its foot, one under a lamp that stands elsewhere shades
otherwise. Means of square blocks of pixels that show no edge, less those of the simulated picture, are adjusted by
least squares: the inputs' standard uncertainties are observations beside them (Mikhail and Ackermann, Observations and
Least Squares, 1976). The brightness of each region that edges bound is free: no two faces of a part reflect quite
alike. Where blocks of a region do not fit, whatever is wrong counts as noise of theirs: as much as it makes sums of
neighbouring blocks scatter more than noise does, for it goes together over faces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation, gaussian_gradient_magnitude, label, uniform_filter

from imaging.sensor import full_scale, recorded
from scenes import Picture

_SIDE, _MOST = 8, 5000  # px of a block; of blocks: larger ones in larger images
_OF_RAYS = 1.5  # of one image's variance by rays: of two on the mean, and of a picture that is a render
_LEAST = 16  # blocks of a region, and that tell of an input
_NEAR = 5  # blocks a side over which rays scatter alike
_STEEP = 1.0  # change over a pixel, in the noise's standard deviation, that is an edge's
_NEAR_END = 4.0  # standard deviations of noise below the end of the scale
_GROUPS = 1, 2, 4, 8, 16  # blocks a side whose sums tell whether they fit
_ENOUGH = 4  # sums for each input, to tell it
_TIMES = 3  # that regions' misfits are found anew
_CHANCE = 5.0  # standard deviations of products of noise, which are no information
_LINEAR = 0.3  # of what a standard uncertainty does, that is not told by a multiple of it, or by noise of rays missed


@dataclass(frozen=True, eq=False)
class Adjustment:
    """Of k inputs, in their standard uncertainties, by n blocks.

    Attributes
    ----------
    side : int
        Of a block, px.
    at : ndarray of int, shape (n, 2)
        Row and column of each, counted in blocks.
    columns : ndarray, shape (n, k + 1)
        What one standard uncertainty of each input changes of their mean levels, and the levels, above darkness.
    region : ndarray of int, shape (n,)
        Which region of the image each is in.
    variance : ndarray, shape (n,)
        Of the means by noise.
    normal, spread : ndarray, shape (R, k, k)
        Of each region. Products of blocks and columns are the former times the inputs' errors, on the mean, with the
        latter as their covariance: the same, but for the noise of rays in the columns, which is no information.
    dark : float
        Level without light.
    """

    side: int
    at: np.ndarray
    columns: np.ndarray
    region: np.ndarray
    variance: np.ndarray
    normal: np.ndarray
    spread: np.ndarray
    dark: float

    @classmethod
    def of(cls, renders: np.ndarray, picture: Picture) -> Adjustment | None:
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
        regions = _regions(_means(lost[None], side)[0] == 0)
        at = np.argwhere(regions)
        if len(at) < _ENOUGH * renders.shape[1]:
            return None
        first, second = (_means(each, side)[:, at[:, 0], at[:, 1]].T for each in renders)
        levels = (first[:, :1] + second[:, :1]) / 2 - noise.dark_level
        own = _means(deviation[None] ** 2, side)[0, at[:, 0], at[:, 1]] / side**2
        region = regions[tuple(at.T)]
        own += _OF_RAYS * _nearby((first[:, 0] - second[:, 0]) ** 2 / 2, at, region, regions.shape)
        design = [each[:, 2:] - each[:, 1:2] for each in (first, second)]
        made = cls(
            side, at, np.concatenate([(design[0] + design[1]) / 2, levels], 1), region, own, np.zeros(0), np.zeros(0),
            noise.dark_level,
        )  # fmt: skip
        asked = made._by_many_blocks()
        one, other = (made._left(each) * asked for each in design)
        told = [_products(one[region == each], other[region == each]) for each in made.regions]
        normal, spread = (np.array(each) for each in zip(*told, strict=True))
        columns = np.concatenate([made.columns[:, :-1] * asked, levels], 1)
        return replace(made, columns=columns, normal=normal, spread=spread)

    def _by_many_blocks(self) -> np.ndarray:
        """Whether what each block's region tells of each input is told by many blocks, bool (n, k): what a few tell is
        not asked, for they would fit whatever is wrong there."""
        squares = self._left(self.columns[:, :-1]) ** 2
        found = np.zeros(squares.shape, bool)
        for region in self.regions:
            some = self.region == region
            sums = squares[some].sum(0)
            found[some] = sums**2 > _LEAST * (squares[some] ** 2).sum(0)
        return found

    @property
    def regions(self) -> np.ndarray:
        """Their numbers, (R,)."""
        return np.unique(self.region)

    def _left(self, told: np.ndarray) -> np.ndarray:
        """What of changes (n, m) each region's brightness does not explain, in standard deviations of noise."""
        weight = 1 / np.sqrt(self.variance)
        told, level = told * weight[:, None], self.columns[:, -1] * weight
        for region in self.regions:
            some = self.region == region
            bright = level[some] / max(float(np.linalg.norm(level[some])), np.finfo(float).tiny)  # or dark all over
            told[some] -= np.outer(bright, bright @ told[some])
        return told

    @property
    def covariance(self) -> np.ndarray:
        """Of the inputs (k, k) once a picture is seen that is as its scene says but for them."""
        return self._solved(np.ones(len(self.normal)))[1]

    def inputs(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the inputs (k,) that a picture (height, width) shows, and their covariance (k, k)."""
        seen = _means(image[None], self.side)[0, self.at[:, 0], self.at[:, 1]] - self.dark
        left = self._left(np.concatenate([(seen - self.columns[:, -1])[:, None], self.columns[:, :-1]], 1))
        off, columns, misfit = left[:, 0], left[:, 1:], np.ones(len(self.normal))
        products = np.array([columns[self.region == r].T @ off[self.region == r] for r in self.regions])
        for _ in range(_TIMES):
            gain, covariance = self._solved(misfit)
            found = gain @ (products / misfit[:, None]).sum(0)
            misfit = self._misfit(off - columns @ found)
        return found, covariance

    def _solved(self, misfit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the sum of products over misfits (R,) is multiplied with, so that inputs err least, and their
        covariance."""
        normal, spread = ((each / misfit[:, None, None]).sum(0) for each in (self.normal, self.spread))
        inputs = np.eye(len(normal))
        gain = normal @ np.linalg.inv(normal @ normal + spread + np.finfo(float).eps * inputs)
        return gain, (1 - _LINEAR**2) * (inputs - gain @ normal) + _LINEAR**2 * inputs

    def _misfit(self, left: np.ndarray) -> np.ndarray:
        """By how much more what is left (n,), in its standard deviations, scatters in each region than noise, as a
        variance (R,); 1 at least."""
        found, inputs = np.ones(len(self.normal)), self.columns.shape[1] - 1
        for k, region in enumerate(self.regions):
            some = self.region == region
            free = 1 + inputs * some.mean()
            for size in _GROUPS:
                _, group = np.unique(self.at[some] // size, axis=0, return_inverse=True)
                sums, counts = np.bincount(group.ravel(), left[some]), np.bincount(group.ravel())
                if len(sums) >= 2 * free:
                    found[k] = max(found[k], float((sums**2 / counts).sum() / (len(sums) - free)))
        return found


def _products(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information, and its noise, (k, k) each, of columns (n, k) from two sets of rays."""
    by_chance = _CHANCE / math.sqrt(len(one)) * (one - other).T @ (one - other) / 2
    both = (one + other) / 2
    return _definite(one.T @ other - by_chance), both.T @ both


@dataclass(frozen=True, eq=False)
class Adjusted:
    """How M values follow from inputs that a picture tells.

    Attributes
    ----------
    adjustment : Adjustment
        Of the inputs.
    names : tuple of str, k
        The source of uncertainty that each is of.
    moved, moved_image : ndarray, shape (k, M)
        What one standard uncertainty of each moves the values by, in the object and in the image.
    """

    adjustment: Adjustment
    names: tuple[str, ...]
    moved: np.ndarray
    moved_image: np.ndarray

    def sources(self, moved: np.ndarray) -> dict[str, np.ndarray]:
        """Standard uncertainties (M,) by source; together they are that of the joint covariance."""
        covariance = self.adjustment.covariance
        groups = {name: [i for i, each in enumerate(self.names) if each == name] for name in dict.fromkeys(self.names)}
        own = {name: variance(moved[some], covariance[np.ix_(some, some)]) for name, some in groups.items()}
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.sqrt(variance(moved, covariance) / sum(own.values()))
            return {name: np.where(each > 0, np.sqrt(each) * part, np.sqrt(each)) for name, each in own.items()}


def variance(moved: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Variances (M,) of values that k inputs with a covariance (k, k) move by so much, (k, M)."""
    return np.einsum("im,ij,jm->m", moved, covariance, moved)


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


def _means(images: np.ndarray, side: int) -> np.ndarray:
    """Of whole blocks of images (m, height, width), shape (m, rows, columns)."""
    rows, columns = images.shape[1] // side, images.shape[2] // side
    cut = images[:, : rows * side, : columns * side].reshape(len(images), rows, side, columns, side)
    return cut.mean((2, 4))


def _definite(normal: np.ndarray) -> np.ndarray:
    """The nearest matrix that takes nothing from any input."""
    values, axes = np.linalg.eigh((normal + normal.T) / 2)
    return (axes * np.maximum(values, 0.0)) @ axes.T
