"""The bias of one picture, found by measuring simulated noise-free images of it, and what it is not sure of.

An estimator that is run on a noise-free image finds its own bias: the difference from the value that the scene has.
The images come in as arrays, from whatever renders them. What the scene is not sure of (what surfaces reflect, where
lights stand) is told by images in which it is changed by one standard uncertainty, the renderer's own noise by images
of other rays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce

import numpy as np
from scipy import sparse

from imaging.bundles.biases import FeatureBias
from imaging.colour import seen
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from measure.adjusting import adjustment
from measure.adjustment import Adjusted
from measure.known_bias import RENDERING, Correction
from measure.measurement import DEFAULT_ESTIMATOR, checked_image
from measure.propagation import PropagatedValues, propagate
from measure.quantities import MeasuredFeatures, find
from measure.render_noise import by_features, by_pixels
from measure.saturation import limits
from scenes import InvalidInput, Noise, Picture, status
from scenes.status import MEASURED

Pair = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Images:
    """Noise-free images of one picture, grey levels, each of shape (height, width).

    Attributes
    ----------
    renders : tuple of ndarray
        Of independent rays; the biases are the mean of theirs.
    changed : dict of str to csr_array, shape (k, height * width)
        By source: by how much the first render's pixels change, row by row, with one input each changed by one standard
        uncertainty.
    beside : tuple of ndarray
        Renders of other rays that say how large the renderer's noise is, and nothing of the bias.
    known : dict of str to pair of ndarray, shape (M,)
        Standard uncertainties of sources that need no image, in the object and in the image.
    of_features : dict of str to ndarray, shape (k, q)
        What one standard uncertainty of each input of such a source moves lines and circles by.
    by_pixel : bool
        Whether rays are random pixel by pixel, so that two renders' pixels tell how noisy they are.
    overall : ndarray, shape (2, 2 + k, height, width), or None
        Of few rays and all of the picture, as `measure.adjusting.adjustment` takes them: with the inputs changed of
        ``changed``, in their order.
    """

    renders: tuple[np.ndarray, ...]
    changed: Mapping[str, sparse.csr_array] = field(default_factory=dict)
    beside: tuple[np.ndarray, ...] = ()
    known: Mapping[str, Pair] = field(default_factory=dict)
    of_features: Mapping[str, np.ndarray] = field(default_factory=dict)
    by_pixel: bool = False
    overall: np.ndarray | None = None


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
        What `measure.propagate` says of the renders' mean by the same estimator, if it is known already.

    Raises
    ------
    InvalidInput
        If there is no render, an image or what is changed of it has not the camera's size, or the lights are not known.
    """
    if not images.renders:
        raise InvalidInput("renders must be at least one noise-free image, got none")
    if not picture.lights:
        raise InvalidInput("light must be a pose to correct the bias, got nothing")
    clean = mean_of(images.renders)  # noise of rays makes weak edges steeper where they cross zero, sigma less
    told = propagated or propagate(clean, picture, estimator=estimator, threshold=threshold).measurands
    levels = _levels(images, clean, picture)
    *values, found = _measured(levels, picture, estimator, threshold)
    renders, alike = len(images.renders), len(images.renders) + len(images.beside)
    known = measurands(Pictures.of(picture))
    bias, bias_image = (
        _without_noise(each[:renders], each[-1], found.on_forms) - true
        for each, true in zip(values, (known.value_object, known.value), strict=True)
    )
    noise = _noise(images, picture, told, levels[:alike], found, tuple(each[:alike] for each in values))
    names = tuple(name for name, some in images.changed.items() for _ in range(some.shape[0]))
    moved = [each[alike:-1] - each[0] for each in values]
    adjusted = _adjusted(images, picture, names, moved)
    object_, image = (
        {
            RENDERING: noise[k] / np.sqrt(renders),
            **(adjusted.sources(moved[k]) if adjusted else _by_steps(names, moved[k])),
            **{name: pair[k] for name, pair in images.known.items()},
        }
        for k in range(2)
    )
    ends = limits(images.renders[0], picture, estimator, threshold, np.sqrt(np.diag(told.covariance)))
    return Correction(
        picture.scene.quantities, estimator, threshold, bias, bias_image, object_, image,
        told.covariance, told.covariance_image, told.status, renders, max(len(images.beside), 1),
        ends, adjusted, _of_features(images, told, found, alike, names, ends),
    )  # fmt: skip


def _of_features(
    images: Images, told: PropagatedValues, found: MeasuredFeatures, alike: int, names: Sequence[str], limits: Pair
) -> FeatureBias | None:
    """Biases of lines and circles, found in renders, others, images of other inputs, and the renders' mean.

    None where nothing tells how well they are known.
    """
    if told.of_features is None or images.known.keys() - images.of_features.keys():
        return None
    off, renders = found.offsets, len(images.renders)
    steps, noise = off[alike:-1] - off[0], told.of_features
    lost = found.seen.features_of(~np.isfinite(np.diag(noise)))
    states = zip(found.states(-1), np.where(lost, status.ILL_CONDITIONED, status.OK), strict=True)
    least, most = limits
    return FeatureBias(
        bias=off[:renders].mean(0),
        moved={name: steps[[each == name for each in names]] for name in dict.fromkeys(names)}
        | dict(images.of_features),
        rendering=_by_rays(off[:alike], noise, by_features(found, alike) if alike > 1 else np.inf) / renders,
        errors=noise,
        states=tuple(status.worst(*map(str, both)) for both in states),
        saturated=(float(least.max()), float(most.min())),
    )


def _by_rays(off: np.ndarray, noise: np.ndarray, pooled: float) -> np.ndarray:
    """Covariance (q, q) by the noise of one render, of lines and circles found in some (n, q).

    As pixel noise has it, scaled to what all of them together tell, ``pooled`` in its standard deviations, and where
    one scatters more, to that.
    """
    if not np.isfinite(pooled):
        return np.full_like(noise, np.inf)
    known = np.where(np.isfinite(noise), noise, 0.0)
    own, sigma = np.nan_to_num(off.std(0, ddof=1)), np.sqrt(np.diag(known))
    part = np.fmax(np.divide(own, sigma, out=np.zeros_like(own), where=sigma > 0), pooled)
    return part[:, None] * known * part


def _adjusted(images: Images, picture: Picture, names: tuple[str, ...], moved: list[np.ndarray]) -> Adjusted | None:
    """None where nothing depends on inputs, or no images tell of them."""
    if images.overall is None or not names:
        return None
    found = adjustment(images.overall, picture)
    return None if found is None else Adjusted(found, names, *moved)


def mean_of(renders: Sequence[np.ndarray]) -> np.ndarray:
    """Mean of images, without a copy of all of them."""
    return reduce(np.add, renders) / len(renders)


def _levels(images: Images, clean: np.ndarray, picture: Picture) -> np.ndarray:
    """What the sensor records, (n, height, width): of renders, of others, of the first one changed by each input, and
    of the renders' mean."""
    noise, size = picture.scene.noise, (picture.scene.camera.height, picture.scene.camera.width)
    alike = *images.renders, *images.beside
    changes = [row for name, some in images.changed.items() for row in _rows(name, some, size)]
    levels = np.empty((len(alike) + len(changes) + 1, *size))
    for level, image in zip(levels, alike, strict=False):
        level[:] = seen(noise, checked_image(image, size)).level
    for level, change in zip(levels[len(alike) :], changes, strict=False):
        _change(level, images.renders[0], levels[0], change, noise)
    levels[-1] = seen(noise, clean).level
    return levels


def _rows(name: str, changed: sparse.csr_array, size: tuple[int, int]) -> list[sparse.csr_array]:
    """What each input of a source changes, (1, height * width) each."""
    if changed.shape[1] != size[0] * size[1]:
        raise InvalidInput(
            f"changed[{name!r}] must have {size[0] * size[1]} columns, a pixel each, got {changed.shape}"
        )
    return [changed[[k]] for k in range(changed.shape[0])]


def _change(level: np.ndarray, first: np.ndarray, recorded: np.ndarray, change: sparse.csr_array, noise: Noise) -> None:
    """Write what is recorded of the first render with a change into ``level``; ``recorded`` is that of the render."""
    some = change.indices
    changed = first.ravel()[some] + change.data
    if noise.colour is None:  # each pixel by itself
        level[:] = recorded
        level.ravel()[some] = seen(noise, changed).level
    else:
        level[:] = first
        level.ravel()[some] = changed
        level[:] = seen(noise, level).level


def _measured(
    levels: np.ndarray, picture: Picture, estimator: str, threshold: float | None
) -> tuple[np.ndarray, np.ndarray, MeasuredFeatures]:
    """Values (n, M) in n noise-free images, in the object and in the image, NaN where there is none, and features."""
    found = find(levels, picture, estimator, threshold, noiseless=True)
    measured = np.isin(found.status, MEASURED)
    return np.where(measured, found.plane.value, np.nan), np.where(measured, found.image.value, np.nan), found


def _without_noise(values: np.ndarray, of_mean: np.ndarray, on_forms: np.ndarray) -> np.ndarray:
    """Mean (M,) of values (n, M) in renders, ``of_mean`` (M,) in the renders' mean.

    A form is an extreme, which the renders' noise makes larger by its square: less so in their mean by 1 / n, and so
    it is taken off by the jackknife (Quenouille, Biometrika 43, 1956).
    """
    mean, count = values.mean(0), len(values)
    if count > 1:
        mean[on_forms] = (count * of_mean - mean)[on_forms] / (count - 1)
    return mean


def _noise(
    images: Images, picture: Picture, told: PropagatedValues, levels: np.ndarray, found: MeasuredFeatures, values: Pair
) -> Pair:
    """Standard deviations (M,) by the noise of one render, in the object and in the image.

    Parameters
    ----------
    levels : ndarray, shape (n, height, width)
        Of images that differ by rays alone.
    values : pair of ndarray, shape (n, M)
        Measured in them.
    """
    spreads, count = (told.covariance, told.covariance_image), len(levels)
    if count < 2:
        unknown = np.full(values[0].shape[1], np.inf)
        return unknown, unknown
    if images.by_pixel and told.response is not None and told.response_image is not None:
        blur, responses = picture.scene.camera.most_blur_px, (told.response, told.response_image)
        first, second = (by_pixels(levels, response, blur) for response in responses)
        for deviations, each in zip((first, second), values, strict=True):
            deviations[found.on_forms] = each.std(0, ddof=1)[found.on_forms]  # no pixel alone moves a form
        return _where_known(first, spreads[0]), _where_known(second, spreads[1])
    part = by_features(found, count)
    first, second = (
        _with_pooled(value, _where_known(part * _sigmas(spread), spread))
        for value, spread in zip(values, spreads, strict=True)
    )
    return first, second


def _with_pooled(values: np.ndarray, pooled: np.ndarray) -> np.ndarray:
    """Standard deviations of values (n, M).

    Few renders tell the scatter of one quantity badly: it counts as no less than what all lines and circles together
    tell, ``pooled`` (M,).
    """
    return np.fmax(values.std(0, ddof=1), pooled)


def _sigmas(covariance: np.ndarray) -> np.ndarray:
    """Standard deviations (M,) of a covariance; 1 where there is no value, whatever they are multiplied by.

    >>> np.inf * _sigmas(np.diag([4.0, np.inf]))
    array([inf, inf])
    """
    variance = np.diag(covariance)
    return np.sqrt(np.where(np.isfinite(variance), variance, 1.0))


def _where_known(deviations: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard deviations (M,); infinite where a covariance (M, M) has no value."""
    return np.where(np.isfinite(np.diag(covariance)), deviations, np.inf)


def _by_steps(names: Sequence[str], moved: np.ndarray) -> dict[str, np.ndarray]:
    """By source, the root sum square of what its inputs' steps move the values by, (k, M)."""
    return {name: np.sqrt((moved[[n == name for n in names]] ** 2).sum(0)) for name in dict.fromkeys(names)}
