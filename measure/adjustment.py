"""What a picture itself tells of inputs that its scene is not sure of: what surfaces reflect, where lights stand.

A face beside a wall that reflects more is brighter near its foot, one under a lamp that stands elsewhere shades
otherwise. Means of square blocks of pixels that show no edge, less those of the simulated picture, are adjusted by
least squares: the inputs' standard uncertainties are observations beside them (Mikhail and Ackermann, Observations and
Least Squares, 1976). The brightness of each region that edges bound is free: no two faces of a part reflect quite
alike. Where blocks of a region do not fit, whatever is wrong counts as noise of theirs: as much as it makes sums of
neighbouring blocks scatter more than noise does, for it goes together over faces. What is made once of renders:
`measure.adjusting`. NumPy alone: a recipe (`validation.recipe`) has this file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_GROUPS = 1, 2, 4, 8, 16  # blocks a side whose sums tell whether they fit
_TIMES = 3  # that regions' misfits are found anew
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

    @property
    def regions(self) -> np.ndarray:
        """Their numbers, (R,)."""
        return np.unique(self.region)

    def left(self, told: np.ndarray) -> np.ndarray:
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
        seen = means(image[None], self.side)[0, self.at[:, 0], self.at[:, 1]] - self.dark
        left = self.left(np.concatenate([(seen - self.columns[:, -1])[:, None], self.columns[:, :-1]], 1))
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


def means(images: np.ndarray, side: int) -> np.ndarray:
    """Of whole blocks of images (m, height, width), shape (m, rows, columns)."""
    rows, columns = images.shape[1] // side, images.shape[2] // side
    cut = images[:, : rows * side, : columns * side].reshape(len(images), rows, side, columns, side)
    return cut.mean((2, 4))
