"""A circle or an ellipse in a photograph, measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from measure.estimators.ellipse import EllipseFit
from measure.features.conic import UNITS, around
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.find.candidate import CIRCLE, ELLIPSE
from measure.find.ellipse import fitted_ellipse
from measure.photo.blur import side_blur
from measure.photo.edge_points import ellipse_by_points
from measure.photo.recording import Recording, recording
from measure.photo.residuals import ellipse_blur
from measure.photo.tone_curve import UNTOLD, ToneCurve, tone_curve
from scenes import status
from scenes.photograph import Photograph

_SAME = 3.0  # standard deviations up to which the axes count as equal
_LARGE = 150.0  # px, a semi-axis: beyond, edge points are as good for any purpose, and far quicker
_MARGIN = 24  # px around the ellipse that is looked at
_ALIKE = 0.05  # of a standard deviation: what correlated noise may change before the status says so
_ARCS = 24  # of a large outline that tell a tone curve


@dataclass(frozen=True, eq=False)
class MeasuredEllipse:
    """``kind`` "circle" or "ellipse"; parameters x, y, a, b, px, and angle, degrees, (5,), and their covariance (5, 5);
    the status; noise (standard deviation of a grey level) and lens blur (px) as estimated from the image."""

    kind: str
    parameters: np.ndarray
    covariance: np.ndarray
    status: str
    noise: float
    blur_px: float


def measure_ellipse(photo: Photograph, near: np.ndarray) -> MeasuredEllipse:
    """Measure the ellipse near x, y, a, b, angle; as a circle where its axes are equal within three sigma.

    Noise that is not each pixel's own is carried through what the estimator makes of pixels; the status is
    ``correlated`` where that changes a standard deviation by more than 5 %.
    """
    image, seen, blur = photo.levels, recording(photo), ellipse_blur(photo.levels, near)
    reach = near[2] + _MARGIN
    low = np.maximum(np.floor(near[:2] - reach), 0).astype(int)
    high = np.minimum(np.ceil(near[:2] + reach).astype(int) + 1, image.shape[::-1])
    part = image[low[1] : high[1], low[0] : high[0]]
    noise = max(float(np.sqrt(seen.curve.variance(part.mean()))), 1e-6 * float(np.ptp(image)) + 1e-12)
    optics = Optics(part.shape, blur, noise**2, max(1.0, blur), 3 + 2 * max(1.0, blur))
    start = near - [*low, 0, 0, 0]
    found, kind = _found(part, start, optics, seen, False), ELLIPSE
    if found.state in status.MEASURED and _round(found.parameters, found.covariance):
        found, kind = _found(part, start, optics, seen, True), CIRCLE
    state = found.state
    if state in status.MEASURED:
        said = status.OK if found.alike else status.CORRELATED
        state = status.worst(state, seen.status, said, found.tone.status(photo.tone_known))
    return MeasuredEllipse(kind, found.parameters + [*low, 0, 0, 0], found.covariance, state, noise, float(blur))


@dataclass(frozen=True, eq=False)
class _Found:
    """Parameters (5,), px and degrees, their covariance, the status, what is told of a tone curve, and whether
    correlation hardly changes the covariance."""

    parameters: np.ndarray
    covariance: np.ndarray
    state: str
    tone: ToneCurve
    alike: bool


def _found(image: np.ndarray, start: np.ndarray, optics: Optics, seen: Recording, circle: bool) -> _Found:
    """The most likely one; from edge points where it is large, or where the picture is not that of one blurred ellipse,
    for they tell how far it is from one."""
    if start[2] <= _LARGE:
        fit, state = fitted_ellipse(image, start, optics, circle)
        if fit is not None and state == status.OK:
            return _likeliest(image, fit, seen, circle)
    white = ellipse_by_points(image, start, optics, circle)
    state, tone = str(white.status), UNTOLD
    found, alike = white, True
    if state in status.MEASURED:
        tone = _arcs(image, white.parameters, optics, seen)
        if not seen.correlation.white:
            found = ellipse_by_points(image, start, optics, circle, seen)
            alike = _hardly(found.covariance, white.covariance)
    return _Found(found.parameters, found.covariance, str(found.status), tone, alike)


def _likeliest(image: np.ndarray, fit: EllipseFit, seen: Recording, circle: bool) -> _Found:
    sigma = np.sqrt(seen.curve.variance(image.flat[fit.pixels]))
    covariance = fit.covariance
    if not seen.correlation.white:
        covariance = seen.correlation.covariance(fit.rows, fit.pixels, sigma, image.shape[1])
        covariance[4, 4] = fit.covariance[4, 4] if np.isinf(fit.covariance[4, 4]) else covariance[4, 4]
    tone = tone_curve(fit.design, image.flat[fit.pixels] - fit.left, fit.left, 1 / sigma, 3 if circle else 5)
    alike = _hardly(covariance, fit.covariance)
    return _Found(fit.parameters * UNITS, covariance * np.outer(UNITS, UNITS), status.OK, tone, alike)


def _hardly(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two covariances have nearly the same standard deviations."""
    first, second = (np.diag(each)[:4] for each in (one, other))
    return bool(np.abs(np.sqrt(first / second) - 1).max() < _ALIKE)


def _arcs(image: np.ndarray, parameters: np.ndarray, optics: Optics, seen: Recording) -> ToneCurve:
    """What arcs of an outline tell of a tone curve: all of them move outwards together."""
    places, _ = around(parameters, _ARCS)
    told = side_blur(image, polygon_layout(places, optics), seen.curve).tone
    return replace(told, shift=told.shift * np.sqrt(_ARCS))


def _round(parameters: np.ndarray, covariance: np.ndarray) -> bool:
    difference = np.array([0, 0, 1.0, -1.0])
    return bool(abs(difference @ parameters[:4]) <= _SAME * np.sqrt(difference @ covariance[:4, :4] @ difference))
