"""The sharpest prediction: the estimator's linear response on the noise-free image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse

from imaging.colour import rows_by_raw, seen
from imaging.models.bias import MOST
from imaging.models.extremes import with_extremes
from imaging.row_noise import of_shared
from measure.estimators.arrangement import ArrangementEstimator
from measure.estimators.kinds import ESTIMATORS
from measure.estimators.separate import SeparateEstimator
from measure.features import arranged
from measure.features.board import BoardTool
from measure.features.layout import Layout, layout_of
from measure.features.line_noise import torn
from measure.features.rims import circle_response, tells_errors
from measure.features.shape import prepared
from measure.measurement import DEFAULT_ESTIMATOR, check_method, checked_image
from measure.nonlinear import are_nonlinear
from measure.quantities import MeasuredFeatures, find
from measure.unevenness import Unevenness
from scenes import Picture, Scene, status
from scenes.arrays import picture as one_picture
from scenes.measurands.features import is_line


@dataclass(frozen=True, eq=False)
class PropagatedValues:
    """Predicted errors of all M quantities of one setting.

    Attributes
    ----------
    value, value_image : ndarray, shape (M,)
        Measured in the noise-free image: the scene's unit, px; degrees. NaN where there is none.
    bias, bias_image : ndarray, shape (M,)
        That less the object's own value, and less the model's value in the image.
    covariance, covariance_image : ndarray, shape (M, M)
        Joint covariances: edges and circles that share pixels are correlated. Infinite on the diagonal where there is
        no value, NaN beside it.
    status : tuple of str
    texture_variance, texture_variance_image : ndarray, shape (M,), or None
        Predicted variances over parts by statistical textures, which are no part of the covariances: they do not
        average over pictures. NaN of a quantity that has no value; None where there are no textures, or the light is
        not known.
    response, response_image : csr_array, shape (M, height * width), or None
        Derivatives of the values by the pixels, of grey levels; none of a quantity that has no value.
    of_features : ndarray, shape (q, q), or None
        Covariance of lines and circles (`Seen`), infinite on the diagonal of those that have none.
    """

    value: np.ndarray
    value_image: np.ndarray
    bias: np.ndarray
    bias_image: np.ndarray
    covariance: np.ndarray
    covariance_image: np.ndarray
    status: tuple[str, ...]
    texture_variance: np.ndarray | None = None
    texture_variance_image: np.ndarray | None = None
    response: sparse.csr_array | None = None
    response_image: sparse.csr_array | None = None
    of_features: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Propagated:
    """Predicted errors of one setting: of its first measurand, and of all.

    Attributes
    ----------
    value_px : float
        The first measurand in the noise-free image, px (degrees, if it is an angle).
    bias_px : float
        That less the model's value.
    variance_px2 : float
        Its variance, px^2; infinite where `status` says it cannot be measured.
    covariance : ndarray, shape (4, 4)
        Joint covariance of start (x, y) and end (x, y) of a distance, px^2; NaN of other kinds.
    response : ndarray, shape (height, width)
        Derivative of its value by each pixel, px per grey level.
    status : str
        As `measure.distance` says; ``clutter`` too where the noise-free value is off by more than 0.3 standard
        deviations, by whatever estimator and for whatever reason; what statistical textures do to this part is known.
    measurands : PropagatedValues
        All of them, in the scene's unit, jointly.
    """

    value_px: float
    bias_px: float
    variance_px2: float
    covariance: np.ndarray
    response: np.ndarray
    status: str
    measurands: PropagatedValues


def propagate(
    clean: np.ndarray,
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    estimator: str = DEFAULT_ESTIMATOR,
    threshold: float | None = None,
    photographed: bool = False,
) -> Propagated:
    """Propagate pixel noise through lines, circles and corners to all measurands.

    On the noise-free image each line is linear in small noise, and so is all that follows; of circles, and of lines
    beside which another edge runs for a part, drawn noise is asked whether it is, and what needs one that is not has no
    value: ``ill_conditioned``, as is what bends where noise turns a line far (`measure.nonlinear`). With g the
    derivative of a value by the pixels, its variance is the sum of g^2 times each pixel's noise variance; neighbouring
    edge points share pixels, and so their correlation is in g. Of a colour sensor g is taken by the raw pixels, which
    are independent. Noise that rows and columns share is added by the sums of g over each.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
        Noise-free image, grey levels, not yet cut off at the end of the sensor's scale.
    scene, sensor, light, estimator, threshold
        As for `measure.distance`.
    photographed : bool
        The image is the mean of photographs of a camera that stands about where the scene says: how far its value is
        off the model's tells of the poses, and not of ``clutter``.
    """
    check_method(estimator, threshold)
    picture = Picture.of(scene, sensor, light)
    camera = picture.scene.camera
    sensor_noise = picture.scene.noise
    clean, noise = seen(sensor_noise, checked_image(one_picture(clean), (camera.height, camera.width)))
    noise = np.broadcast_to(noise, clean.shape).ravel()
    found = find(clean[None], picture, estimator, threshold, noiseless=True)
    rows, lost = _responses(clean, picture, found, estimator, threshold)
    state = [str(each) for each in found.status[0]]
    for m, gone in enumerate(((found.image.gradient[0] != 0) & lost).any(-1)):
        if gone and state[m] in status.MEASURED:  # noise decides which of two edges is found, or a wrong one was
            state[m] = status.ILL_CONDITIONED
    by_raw = rows_by_raw(sensor_noise, rows, clean.shape)
    errors = (by_raw.multiply(noise).tocsr() @ by_raw.T).toarray() + of_shared(sensor_noise, rows, clean.shape[1])
    errors[np.diag_indices(len(errors))] += _of_forms(found)
    for m in np.flatnonzero(are_nonlinear(found, layout_of(picture), errors)):
        state[m] = status.worst(state[m], status.ILL_CONDITIONED)
    gradients = [_of_measured(part.gradient[0], state) for part in (found.image, found.plane)]
    image, plane = (
        with_extremes(found.known.quantities, part.value[0], gradient, _covariance(gradient, errors, state))[1]
        for gradient, part in zip(gradients, (found.image, found.plane), strict=True)
    )
    responses = [sparse.csr_array(gradient) @ rows for gradient in gradients]
    uneven = Unevenness.about(picture, responses[1]) if picture.lights and picture.scene.textures else None
    shifts = np.zeros(len(state))
    if uneven is not None and uneven.change.any():
        even = find((clean - uneven.change)[None], picture, estimator, threshold, noiseless=True)
        shifts = np.nan_to_num(found.image.value[0] - even.image.value[0])
    values = _values(found, image, plane, state, not photographed, shifts)
    if uneven is not None:
        over_parts = [np.where(np.isin(state, status.MEASURED), uneven.variances(each), np.nan) for each in responses]
        values = replace(values, texture_variance_image=over_parts[0], texture_variance=over_parts[1])
    told = np.where(np.diag(lost), np.inf, errors)
    values = replace(values, response_image=responses[0], response=responses[1], of_features=told)
    return _of_first(found, rows, errors, values, clean.shape)


def _responses(
    clean: np.ndarray, picture: Picture, found: MeasuredFeatures, estimator: str, threshold: float | None
) -> tuple[sparse.csr_array, np.ndarray]:
    """Derivative of lines and circles (`Seen`) by the pixels, (q, pixels), and which of them have none, bool (q,)."""
    layout, parts = layout_of(picture), [sparse.csr_array((0, clean.size))]
    if layout.names:
        parts.append(_of_lines(clean, picture, layout, found, estimator, threshold))
    for name, circle in zip(found.known.circles, found.circles, strict=True):
        told = circle_response(clean, picture, name) if str(circle.state[0]) in status.MEASURED else None
        if told is None or not tells_errors(told, clean, picture, name):
            told = _none(circle.errors.shape[1], clean.size)
        parts.append(told)
    parts.append(sparse.csr_array((len(found.forms), clean.size)))  # an extreme has none: its variance is its law's
    if found.board is not None:
        parts.append(BoardTool(picture, found.known.placing.board).response(clean))
    rows = sparse.vstack(parts, format="csr")  # few of the pixels of a large image
    lost = np.array([not np.isfinite(rows.data[start:stop]).all() for start, stop in pairwise(rows.indptr)], bool)
    rows.data[np.repeat(lost, np.diff(rows.indptr))] = 0.0
    return rows, lost


def _of_forms(found: MeasuredFeatures) -> np.ndarray:
    """Variances (q,) of the sizes of forms in one image, by their laws; 0 of lines and circles."""
    own = np.zeros(found.seen.count)
    own[found.seen.of_forms] = [np.nan_to_num(form.variance[0]) for form in found.forms.values()]
    return own


def _none(rows: int, pixels: int) -> sparse.csr_array:
    """Rows that have no derivative: NaN by the first pixel."""
    return sparse.csr_array((np.full(rows, np.nan), np.zeros(rows, int), np.arange(rows + 1)), (rows, pixels))


def _of_lines(
    clean: np.ndarray,
    picture: Picture,
    layout: Layout,
    found: MeasuredFeatures,
    estimator: str,
    threshold: float | None,
) -> sparse.csr_array:
    """Of the lines, (2 E, pixels); NaN where there is none."""
    limit = picture.scene.locator.thresholds[0] if threshold is None else threshold
    tool = prepared(layout, estimator, limit)
    if isinstance(tool, ArrangementEstimator):
        counted = np.isin(found.shape.counted[0], status.MEASURED)
        if str(found.shape.whole[0]) not in status.MEASURED or not counted.any():
            return _none(2 * len(layout.names), clean.size)
        rows = arranged.line_response(tool, layout, clean)
        rows[np.repeat(~counted, 2)] = np.nan
        return sparse.csr_array(rows)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # of edges that are not measured
        if isinstance(tool, SeparateEstimator):
            near = tool.respond_within(clean, asked=_is_in_place(found, layout, estimator))
        else:
            near = tool.respond_within(clean)
    measured = np.isin(found.shape.edge_status[0], status.MEASURED)
    near[np.repeat(~measured, 2)] = np.nan
    if not tool.pixels.size:
        return _none(len(near), clean.size)
    rows = sparse.csr_array(near)
    rows = sparse.csr_array((rows.data, tool.pixels[rows.indices], rows.indptr), (len(near), clean.size))
    lost = np.repeat(np.repeat(torn(clean, layout, estimator, limit, rows), 2), np.diff(rows.indptr))
    rows.data[lost] = np.nan
    return rows


def _is_in_place(found: MeasuredFeatures, layout: Layout, estimator: str) -> bool:
    """Whether the lines are measured from where they are expected: else drawn noise there says nothing of them."""
    away = np.einsum("ei,eki->ek", found.shape.normals[0], layout.ends - found.shape.points[0][:, None])
    return bool((np.abs(away) <= ESTIMATORS[estimator].of(layout).capture_px).all())


def _of_measured(gradient: np.ndarray, state: list[str]) -> np.ndarray:
    """Derivatives of quantities by lines and circles, (M, q), 0 of those that have no value."""
    return np.where(np.isin(state, status.MEASURED)[:, None], np.nan_to_num(gradient), 0.0)


def _covariance(gradient: np.ndarray, errors: np.ndarray, state: list[str]) -> np.ndarray:
    measured = np.isin(state, status.MEASURED)
    lost = np.where(np.eye(len(state), dtype=bool), np.inf, np.nan)
    return np.where(measured[:, None] & measured, gradient @ errors @ gradient.T, lost)


def _values(
    found: MeasuredFeatures,
    image: np.ndarray,
    plane: np.ndarray,
    state: list[str],
    is_told: bool,
    shifts: np.ndarray,
) -> PropagatedValues:
    measured = np.isin(state, status.MEASURED)
    value, value_image = (np.where(measured, part.value[0], np.nan) for part in (found.plane, found.image))
    bias, bias_image = value - found.known.value_object, value_image - found.known.value
    unexplained = bias_image - shifts  # by textures
    for m in range(len(state)):
        if state[m] == status.OK and is_told and abs(unexplained[m]) > MOST * np.sqrt(image[m, m]):
            state[m] = status.CLUTTER
    return PropagatedValues(value, value_image, bias, bias_image, plane, image, tuple(state))


def _of_first(
    found: MeasuredFeatures,
    rows: sparse.csr_array,
    errors: np.ndarray,
    values: PropagatedValues,
    shape: tuple[int, int],
) -> Propagated:
    measured, quantity = values.status[0] in status.MEASURED, found.known.quantities[0]
    covariance = np.full((4, 4), np.inf)
    if measured:
        is_pair = len(quantity.features) == 2 and not any(map(is_line, quantity.features))
        covariance = found.with_errors(errors).ends()[1][0] if is_pair else np.full((4, 4), np.nan)
    return Propagated(
        float(values.value_image[0]),
        float(values.bias_image[0]),
        float(values.covariance_image[0, 0]),
        covariance,
        (found.image.gradient[0, 0] @ rows if measured else np.zeros(shape)).reshape(shape),
        values.status[0],
        values,
    )
