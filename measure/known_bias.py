"""Biases of a picture's values that a simulation told, to be subtracted, and how surely they are known.

How they are found: `measure.correction`. NumPy alone: a recipe (`validation.recipe`) has this file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from measure.adjustment import Adjusted, variance
from scenes.status import corrected as status_corrected

if TYPE_CHECKING:
    from imaging.bundles.biases import FeatureBias
    from scenes import Quantity

RENDERING, TEXTURE = "rendering", "texture"


@dataclass(frozen=True, eq=False)
class Correction:
    """Biases of all M quantities of one picture by one estimator, to be subtracted from what it measures.

    Attributes
    ----------
    quantities : tuple of Quantity
    estimator : str
    threshold : float or None
        Of ``canny``.
    bias, bias_image : ndarray, shape (M,)
        Mean of the noise-free values less the object's own: the scene's unit, px; degrees. NaN where there is none.
    sources, sources_image : dict of str to ndarray, shape (M,)
        Standard uncertainties (not variances) of the biases by what each source is not sure of.
    covariance, covariance_image : ndarray, shape (M, M)
        Of the values by noise, propagated in the noise-free image.
    simulated : tuple of str
        Statuses of the values there.
    renders : int
        How many independent renders the biases are the mean of.
    beside_renders : int
        How many the image is the mean of that is corrected, where that is one of renders.
    saturated : pair of ndarray, shape (M,), or None
        Least and most pixels at the end of the sensor's scale that a picture may have for the bias to be its own
        (`measure.saturation`); any number where nothing is told.
    adjusted : Adjusted, optional
        What a picture tells of inputs that the biases depend on. `bias` is that of the scene as it is, `sources` are
        those of a picture that agrees with it but for these inputs; `of_images` is of pictures that are there.
    features : FeatureBias, optional
        Of the lines and circles of which the values are made, where that is known: what `measure.bundle` takes off.
    """

    quantities: tuple[Quantity, ...]
    estimator: str
    threshold: float | None
    bias: np.ndarray
    bias_image: np.ndarray
    sources: Mapping[str, np.ndarray]
    sources_image: Mapping[str, np.ndarray]
    covariance: np.ndarray
    covariance_image: np.ndarray
    simulated: tuple[str, ...]
    renders: int = 1
    beside_renders: int = 1
    saturated: tuple[np.ndarray, np.ndarray] | None = None
    adjusted: Adjusted | None = None
    features: FeatureBias | None = None

    @cached_property
    def u_bias(self) -> np.ndarray:
        """Standard uncertainty of `bias`, shape (M,); infinite where it is not known."""
        return _together(self.sources, self.bias)

    @property
    def u_bias_image(self) -> np.ndarray:
        """The same in the image."""
        return _together(self.sources_image, self.bias_image)

    @property
    def beside(self) -> np.ndarray:
        """Standard deviations (M,) by the renderer's noise of what a corrected render's biases differ from `bias`
        by."""
        return self.sources[RENDERING] * np.sqrt(1 + self.renders / self.beside_renders)

    @property
    def beside_image(self) -> np.ndarray:
        """The same in the image."""
        return self.sources_image[RENDERING] * np.sqrt(1 + self.renders / self.beside_renders)

    @cached_property
    def sigma(self) -> np.ndarray:
        """Standard deviations by noise in the object, shape (M,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def status(self) -> tuple[str, ...]:
        """Of the values that the noise-free image has, once they are corrected (`scenes.status.corrected`)."""
        return tuple(self.status_of(self.simulated))

    def of_images(self, images: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Biases in the object and in the image, and the former's standard uncertainties, each of shape (n, M).

        Parameters
        ----------
        images : ndarray, shape (n, height, width)
            Grey levels, as recorded.
        """
        if self.adjusted is None:
            alike = np.ones((len(images), 1))
            return alike * self.bias, alike * self.bias_image, alike * self.u_bias
        others = {name: u for name, u in self.sources.items() if name not in self.adjusted.names}
        beside, rows = _together(others, self.bias), []
        for image in images:
            inputs, covariance = self.adjusted.adjustment.inputs(image)
            moved = self.adjusted.moved
            rows.append((
                self.bias + inputs @ moved, self.bias_image + inputs @ self.adjusted.moved_image,
                np.sqrt(beside**2 + variance(moved, covariance)),
            ))  # fmt: skip
        bias, bias_image, u = (np.array(each).reshape(len(images), -1) for each in zip(*rows, strict=True))
        return bias, bias_image, np.where(np.isfinite(u), u, np.inf)

    def is_of(self, saturated: np.ndarray) -> np.ndarray:
        """Whether the biases are those of pictures (n,) with so many pixels at the end of the scale, bool (n, M)."""
        if self.saturated is None:
            return np.ones((len(saturated), len(self.bias)), bool)
        least, most = self.saturated
        return (saturated[:, None] >= least) & (saturated[:, None] <= most)

    def status_of(
        self, found: Sequence[str], of: np.ndarray | bool = True, u_bias: np.ndarray | None = None
    ) -> list[str]:
        """The same of values whose statuses as measured are ``found``, (M,), of a picture that the biases are ``of``,
        and whose standard uncertainties are ``u_bias``, (M,), if it tells others.

        Textures scatter by what `measure.unevenness` tells, and where it does, count in `u_bias` alone.
        """
        told = self.u_bias if u_bias is None else u_bias
        with np.errstate(invalid="ignore"):  # infinite stays so
            left = np.where(of & np.isfinite(told), np.sqrt(np.maximum(told**2 - self._texture**2, 0.0)), np.inf)
        each = zip(found, self.simulated, left.tolist(), self.sigma.tolist(), self.quantities, strict=True)
        return [
            status_corrected(str(state), simulated, u, sigma, _half(quantity))
            for state, simulated, u, sigma, quantity in each
        ]

    @cached_property
    def _texture(self) -> np.ndarray | float:
        """What of the standard uncertainties is textures', (M,); 0 where that is not known."""
        return np.nan_to_num(self.sources[TEXTURE], posinf=0.0) if TEXTURE in self.sources else 0.0


def _together(sources: Mapping[str, np.ndarray], bias: np.ndarray) -> np.ndarray:
    squares = sum((np.square(u) for u in sources.values()), np.zeros(len(bias)))
    return np.where(np.isfinite(bias) & np.isfinite(squares), np.sqrt(squares), np.inf)


def _half(quantity: Quantity) -> float:
    return 0.0 if quantity.tolerance is None else quantity.tolerance.half
