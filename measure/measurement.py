"""The measured distance between two corners or centres, in one image or in a stack."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from imaging.models.bias import bias
from imaging.pictures import Pictures
from measure.estimators.kinds import ESTIMATORS
from measure.estimators.registry import known_name
from measure.known_bias import Correction
from measure.quantities import MeasuredFeatures, find
from scenes import InvalidInput, Picture, Scene, status
from scenes.arrays import BRIGHTEST, grey_levels, numbers
from scenes.results import Shown, finite, value

DEFAULT_ESTIMATOR = "gradient"
_DARK = 1e-30  # squared grey levels


@dataclass(frozen=True, eq=False, repr=False)
class Measurement(Shown):
    """Distances measured in images of leading shape (...); one image has the shape ().

    Attributes
    ----------
    value_px : ndarray, shape (...)
        Distance, px; NaN where `status` is neither ``ok`` nor ``clutter`` nor ``misfit``.
    variance_px2 : ndarray, shape (...)
        Its variance (not sigma), px^2, from the estimator's own linear response at the contrast measured in the image.
    status : ndarray of str, shape (...)
        ``ok``, ``clutter``, ``misfit``, ``ambiguous``, ``short``, ``low_contrast``, ``sign_change``, ``not_visible`` or
        ``ill_conditioned``.
    bias_px : ndarray, shape (...)
        Predicted bias that has been subtracted from the distance, px; 0 where none was asked for.
    corners : ndarray, shape (..., 2, 2)
        Start and end corner or centre (x, y), px; (0, 0) is the centre of the first pixel.
    covariance : ndarray, shape (..., 4, 4)
        Joint covariance of start (x, y) and end (x, y), px^2.
    edge_names : tuple of str
    edge_status : ndarray of str, shape (..., E)
    edge_contrast : ndarray, shape (..., E)
        Measured contrast at the middle of the edge, grey levels.
    used, rejected : ndarray of int, shape (..., E)
        Number of edge points (pixels, for ``strip`` and ``arrangement``).
    p_value : ndarray, shape (...)
        Goodness of fit: probability of a residual at least as unlikely, if the image is what the model says and the
        noise the sensor's; NaN for estimators that have no model of the image.
    picture : Picture
        What the images are taken to show: scene, sensor, and the lights where they are known.
    """

    value_px: np.ndarray
    variance_px2: np.ndarray
    status: np.ndarray
    bias_px: np.ndarray
    corners: np.ndarray
    covariance: np.ndarray
    edge_names: tuple[str, ...]
    edge_status: np.ndarray
    edge_contrast: np.ndarray
    used: np.ndarray
    rejected: np.ndarray
    p_value: np.ndarray
    picture: Picture

    def as_rows(self) -> list[dict[str, Any]]:
        """One record an image: scene and poses, distance and its variance, px and px^2, status; None: no value."""
        where = self.picture.row
        columns = (self.value_px, self.variance_px2, self.bias_px, self.status, self.p_value)
        return [
            where
            | {
                "image": i,
                "value_px": finite(found),
                "variance_px2": finite(variance),
                "bias_px": float(shift),
                "status": str(state),
                "p_value": finite(p),
            }
            for i, (found, variance, shift, state, p) in enumerate(zip(*map(np.ravel, columns), strict=True))
        ]

    def _line(self) -> str:
        count, good = self.value_px.size, int((self.status == status.OK).sum())
        if count != 1:
            return f"{count} images, {good} ok"
        if not np.isfinite(self.value_px).all():
            return str(self.status.item())
        return f"{value(self.value_px.item(), self.variance_px2.item() ** 0.5, 'px')}, {self.status.item()}"


def distance(
    image: np.ndarray,
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    estimator: str = DEFAULT_ESTIMATOR,
    threshold: float | None = None,
    *,
    correct_bias: bool = False,
) -> Measurement:
    """Measure the task's distance, or the first measurand if that is one.

    Parameters
    ----------
    image : array_like, shape (..., height, width)
        One image or a stack, grey levels, float or integer.
    scene : Scene or Picture
        A picture has its poses; it is as if sensor and light were given.
    sensor : Pose or pair of float
        Where the image was taken from; edges are sought where this pose projects them, up to 4 px and 2 degrees away.
    light : Pose or pair of float, optional
        Where the light is, if known: then the shading of the faces is known, which helps ``strip`` and ``arrangement``.
    estimator : {"gradient", "isophote", "canny", "strip", "arrangement"}
        ``gradient``: zero crossing of the Gaussian second derivative. ``isophote``: where the smoothed image takes the
        mean of both sides' levels. ``canny``: the classic pipeline, edge pixels
        above a gradient threshold, each moved to where the gradient across the edge is largest. ``strip``: maximum
        likelihood along each edge. ``arrangement``: of all visible faces around the edges together; the most precise.
    threshold : float, optional
        Gradient threshold of ``canny``, grey levels a pixel; the scene's first when not given. ``low_contrast`` where
        noise decides whether more than a tenth of an edge passes it.
    correct_bias : bool
        Subtract the bias that the planner predicts from corners and distance (``gradient`` and ``canny``, the light
        being known). What was ``clutter`` for its bias is then ``ok``; where the bias is not to be trusted nothing is
        subtracted, and ``clutter`` stays.

    Raises
    ------
    InvalidInput
        If the image has not the camera's size or holds a number that is not finite, or another argument is bad.
    """
    picture = Picture.of(scene, sensor, light)
    if correct_bias:
        _check_known(picture, estimator)
    (found,) = distances(image, picture, ((estimator, threshold),))
    return _corrected(found, picture) if correct_bias else found


def _check_known(picture: Picture, estimator: str) -> None:
    if not picture.lights:
        raise InvalidInput("light must be a pose to correct the bias, got nothing")
    known = [name for name in ESTIMATORS if ESTIMATORS[name].bias_predicted]
    if estimator not in known:
        raise InvalidInput(f"estimator must be one of {', '.join(known)} to correct the bias, got {estimator!r}")


def _corrected(found: Measurement, picture: Picture) -> Measurement:
    """With the predicted bias subtracted, unless it is not to be trusted."""
    predicted = bias(Pictures.of(picture))
    if predicted.disturbed.any() or not np.isfinite(predicted.corners).all():
        return found
    corners = found.corners - predicted.corners
    value = separation(corners.reshape(-1, 2, 2))[0].reshape(found.value_px.shape)
    value = np.where(np.isnan(found.value_px), np.nan, value)
    return replace(
        found,
        value_px=value,
        bias_px=np.nan_to_num(found.value_px - value),
        corners=corners,
        status=np.where(found.status == status.CLUTTER, status.OK, found.status),
        edge_status=np.where(found.edge_status == status.CLUTTER, status.OK, found.edge_status),
    )


def distances(
    image: np.ndarray, picture: Picture, methods: Sequence[tuple[str, float | None]]
) -> tuple[Measurement, ...]:
    """The task's distance by several methods (estimator, threshold of ``canny``) in the same images, checked once.

    Parameters and errors are those of `distance`.
    """
    for name, threshold in methods:
        check_method(name, threshold)
    _check_distance(picture.scene)
    camera = picture.scene.camera
    images = checked_image(image, (camera.height, camera.width))
    return tuple(_by_method(images, picture, name, threshold) for name, threshold in methods)


def _check_distance(scene: Scene) -> None:
    if scene.quantities[0].kind != "distance":
        raise InvalidInput(
            f"the first measurand must be a distance for measure.distance, got {scene.quantities[0].kind} "
            "(measure.measure takes all kinds)"
        )


def check_same(correction: Correction, picture: Picture, estimator: str | None, threshold: float | None) -> None:
    """See that a correction is of what a picture is measured for, and how.

    Raises
    ------
    InvalidInput
        If not.
    """
    if correction.quantities != picture.scene.quantities:
        raise InvalidInput("correction must be of the same measurands, got one of others")
    for name, given, its in (
        ("estimator", estimator, correction.estimator),
        ("threshold", threshold, correction.threshold),
    ):
        if given is not None and given != its:
            raise InvalidInput(f"{name} must be that of the correction, {its}, got {given}")


def check_method(estimator: Any, threshold: Any) -> None:
    """Raise InvalidInput unless there is such an estimator and the threshold is none or a positive number."""
    if not isinstance(estimator, str):
        raise InvalidInput(f"estimator must be the name of one, got {type(estimator).__name__}")
    known_name(estimator)
    number = isinstance(threshold, int | float | np.number) and not isinstance(threshold, bool)
    if threshold is not None and not (number and 0 < threshold <= BRIGHTEST):
        wanted = "greater than 0" if number and threshold <= 0 else f"a number up to {BRIGHTEST:g}"
        raise InvalidInput(f"threshold must be {wanted}, got {threshold!r}")


def _by_method(images: np.ndarray, picture: Picture, estimator: str, threshold: float | None) -> Measurement:
    stack, lead = images.reshape(-1, *images.shape[-2:]), images.shape[:-2]
    return of_first(find(stack, picture, estimator, threshold), picture, lead)


def of_first(found: MeasuredFeatures, picture: Picture, lead: tuple[int, ...]) -> Measurement:
    """The first quantity, a distance, of what was found in images of leading shape ``lead``."""
    return Measurement(
        edge_names=found.names,
        picture=picture,
        **{key: column.reshape((*lead, *column.shape[1:])) for key, column in _columns(found).items()},
    )


def checked_image(image: Any, size: tuple[int, int]) -> np.ndarray:
    """The image or stack as float64.

    Raises
    ------
    InvalidInput
        If it has not the given (height, width), is empty, or holds a number that is not finite.
    """
    images = numbers(image, "image")
    if images.ndim < 2 or images.shape[-2:] != size or images.size == 0:
        raise InvalidInput(f"image must be of the camera's size {size[1]} x {size[0]}, got shape {images.shape}")
    with np.errstate(over="ignore", invalid="ignore"):
        total = images.reshape(-1) @ images.reshape(-1) if images.flags.c_contiguous else 0.0  # reads them once
    if _DARK < total < BRIGHTEST**2:
        return images
    return grey_levels(images)


def _columns(found: MeasuredFeatures) -> dict[str, np.ndarray]:
    """All columns of a Measurement, about the first quantity, for a stack (n, height, width)."""
    state, shape = found.status[:, 0], found.shape
    measured = np.isin(state, status.MEASURED)
    corners, covariance = found.ends()
    return {
        "value_px": np.where(measured, found.image.value[:, 0], np.nan),
        "variance_px2": np.where(measured, found.image.covariance[:, 0, 0], np.inf),
        "status": state,
        "bias_px": np.zeros(len(state)),
        "corners": np.where(measured[:, None, None], corners, np.nan),
        "covariance": np.where(measured[:, None, None], covariance, np.nan),
        "edge_status": shape.edge_status,
        "edge_contrast": shape.edge_contrast,
        "used": shape.used,
        "rejected": shape.rejected,
        "p_value": shape.p_value,
    }


def separation(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of two corners (n, 2, 2), px, and its derivative by (x, y) of both, (n, 4); 0 where there are none."""
    across = np.nan_to_num(corners[:, 1] - corners[:, 0])
    value = np.linalg.norm(across, axis=-1)
    unit = across / np.where(value > 0, value, 1)[:, None]
    return value, np.concatenate([-unit, unit], -1)
