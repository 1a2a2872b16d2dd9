"""The bias of one picture, found by measuring simulated noise-free images of it, and what it is not sure of.

An estimator that is run on a noise-free image finds its own bias: the difference from the value that the scene has.
The images come in as arrays, from whatever renders them. What the scene is not sure of (what surfaces reflect, where
lights stand) is told by images in which it is changed by one standard uncertainty, the renderer's own noise by images
of other rays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from imaging.sensor import recorded
from measure.measurement import DEFAULT_ESTIMATOR, checked_image
from measure.propagation import PropagatedValues, propagate
from measure.quantities import Found, find
from scenes import InvalidInput, Picture, Quantity
from scenes.status import MEASURED
from scenes.status import corrected as status_corrected

RENDERING, TEXTURE = "rendering", "texture"
Pair = tuple[np.ndarray, np.ndarray]


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

    @property
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

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations by noise in the object, shape (M,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def status(self) -> tuple[str, ...]:
        """Of the values that the noise-free image has, once they are corrected (`scenes.status.corrected`)."""
        return tuple(self.status_of(self.simulated))

    def status_of(self, found: Sequence[str]) -> list[str]:
        """The same of values whose statuses as measured are ``found``, (M,).

        Textures scatter by what a closed form tells, and where it does, count in `u_bias` alone.
        """
        doubts = {name: np.where(np.isfinite(u) & (name == TEXTURE), 0.0, u) for name, u in self.sources.items()}
        told = zip(found, self.simulated, _together(doubts, self.bias), self.sigma, self.quantities, strict=True)
        return [
            status_corrected(str(state), simulated, float(u), float(sigma), _half(quantity))
            for state, simulated, u, sigma, quantity in told
        ]


@dataclass(frozen=True, eq=False)
class Images:
    """Noise-free images of one picture, grey levels, each of shape (height, width).

    Attributes
    ----------
    renders : tuple of ndarray
        Of independent rays; the biases are the mean of theirs.
    changed : dict of str to tuple of ndarray
        By source: the first render with one input each changed by one standard uncertainty.
    beside : tuple of ndarray
        Renders of other rays that say how large the renderer's noise is, and nothing of the bias.
    known : dict of str to pair of ndarray, shape (M,)
        Standard uncertainties of sources that need no image, in the object and in the image.
    """

    renders: tuple[np.ndarray, ...]
    changed: Mapping[str, tuple[np.ndarray, ...]] = field(default_factory=dict)
    beside: tuple[np.ndarray, ...] = ()
    known: Mapping[str, Pair] = field(default_factory=dict)


def correction(
    images: Images,
    picture: Picture,
    estimator: str = DEFAULT_ESTIMATOR,
    threshold: float | None = None,
    propagated: PropagatedValues | None = None,
) -> Correction:
    """What an estimator finds in noise-free images of a picture, less what is there, with its uncertainty.

    Parameters
    ----------
    images : Images
    picture : Picture
        Whose lights are known.
    estimator, threshold
        As for `measure.distance`.
    propagated : PropagatedValues, optional
        What `measure.propagate` says of a render by the same estimator, if it is known already.

    Raises
    ------
    InvalidInput
        If there is no render, an image has not the camera's size, or the lights are not known.
    """
    if not images.renders:
        raise InvalidInput("renders must be at least one noise-free image, got none")
    if not picture.lights:
        raise InvalidInput("light must be a pose to correct the bias, got nothing")
    told = propagated or propagate(images.renders[0], picture, estimator=estimator, threshold=threshold).measurands
    steps = [(name, image) for name, some in images.changed.items() for image in some]
    stack = [*images.renders, *images.beside, *(image for _, image in steps)]
    value, value_image, found = _measured(stack, picture, estimator, threshold)
    renders, alike = len(images.renders), len(images.renders) + len(images.beside)
    known = measurands(Pictures.of(picture))
    bias, bias_image = value[:renders].mean(0) - known.value_object, value_image[:renders].mean(0) - known.value
    noise = _noise_of_renders(found, alike)
    object_, image = (
        {
            **_by_rays(each[:alike], renders, _scaled(noise, spread)),
            **_by_steps([name for name, _ in steps], each[alike:] - each[0]),
            **{name: pair[k] for name, pair in images.known.items()},
        }
        for k, (each, spread) in enumerate(((value, told.covariance), (value_image, told.covariance_image)))
    )
    return Correction(
        picture.scene.quantities, estimator, threshold, bias, bias_image, object_, image,
        told.covariance, told.covariance_image, told.status, renders, max(len(images.beside), 1),
    )  # fmt: skip


def _measured(
    stack: list[np.ndarray], picture: Picture, estimator: str, threshold: float | None
) -> tuple[np.ndarray, np.ndarray, Found]:
    """Values (n, M) in n noise-free images, in the object and in the image, NaN where there is none, and features."""
    camera, noise = picture.scene.camera, picture.scene.noise
    size = camera.height, camera.width
    found = find(
        np.stack([recorded(noise, checked_image(image, size))[0] for image in stack]), picture, estimator, threshold
    )
    measured = np.isin(found.status, MEASURED)
    return np.where(measured, found.plane.value, np.nan), np.where(measured, found.image.value, np.nan), found


def _by_rays(values: np.ndarray, renders: int, pooled: np.ndarray) -> dict[str, np.ndarray]:
    """Standard uncertainty of the mean of the first ``renders`` of values (n, M) by the renderer's noise.

    Few renders tell the scatter of one quantity badly: it counts as no less than what all lines and circles together
    tell, ``pooled`` (M,).
    """
    if len(values) < 2:
        return {RENDERING: np.full(values.shape[1], np.inf)}
    return {RENDERING: np.fmax(values.std(0, ddof=1), pooled) / np.sqrt(renders)}


def _scaled(noise: float, covariance: np.ndarray) -> np.ndarray:
    """A part of the standard deviations of a covariance (M, M); infinite where there is no value."""
    variance = np.diag(covariance)
    known = np.isfinite(variance)
    return np.where(known, noise * np.sqrt(np.where(known, variance, 1.0)), np.inf)


def _noise_of_renders(found: Found, alike: int) -> float:
    """Scatter of lines and circles over the first images, which differ by rays alone, over that by the camera's noise.

    Root mean square of all their parameters, each feature's made independent by its own covariance; 0 of one image,
    infinite where no feature is found in all of them.
    """
    shape, features = found.shape, []
    across = np.stack([-shape.normals[..., 1], shape.normals[..., 0]], -1)
    offset = np.einsum("nej,ej->ne", shape.points - shape.points[0], shape.normals[0])
    turn = np.einsum("nej,ej->ne", shape.normals, across[0])
    for e in range(shape.normals.shape[1]):
        some = slice(2 * e, 2 * e + 2)
        features.append((np.stack([offset[:, e], turn[:, e]], -1), shape.lines[0, some, some]))
    features += [(circle.errors, circle.covariance[0]) for circle in found.circles]
    squares, count = 0.0, 0
    for moved, covariance in features:
        if alike > 1 and np.isfinite(moved[:alike]).all() and np.isfinite(covariance).all():
            away = moved[:alike] - moved[:alike].mean(0)
            squares += float(np.einsum("ni,ij,nj", away, np.linalg.pinv(covariance, hermitian=True), away))
            count += away.shape[1] * (alike - 1)
    return float(np.sqrt(squares / count)) if count else (0.0 if alike == 1 else np.inf)


def _by_steps(names: list[str], moved: np.ndarray) -> dict[str, np.ndarray]:
    """By source, the root sum square of what its inputs' steps move the values by, (k, M)."""
    return {name: np.sqrt((moved[[n == name for n in names]] ** 2).sum(0)) for name in dict.fromkeys(names)}


def _together(sources: Mapping[str, np.ndarray], bias: np.ndarray) -> np.ndarray:
    squares = sum((np.square(u) for u in sources.values()), np.zeros(len(bias)))
    return np.where(np.isfinite(bias) & np.isfinite(squares), np.sqrt(squares), np.inf)


def _half(quantity: Quantity) -> float:
    return 0.0 if quantity.tolerance is None else quantity.tolerance.half
