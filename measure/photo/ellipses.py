"""A circle or an ellipse in a photograph, measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure import status
from measure.features.conic import Ellipse
from measure.features.optics import Optics
from measure.find.candidate import CIRCLE, ELLIPSE
from measure.find.ellipse import find_ellipse
from measure.photo.edge_points import ellipse_by_points
from measure.photo.recording import recording
from measure.photo.residuals import ellipse_blur
from scenes.photograph import Photograph

_SAME = 3.0  # standard deviations up to which the axes count as equal
_LARGE = 150.0  # px, a semi-axis: beyond, edge points are as good for any purpose, and far quicker
_MARGIN = 24  # px around the ellipse that is looked at


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

    Noise that is not each pixel's own is not carried through: the status tells of it.
    """
    image, seen, blur = photo.levels, recording(photo), ellipse_blur(photo.levels, near)
    reach = near[2] + _MARGIN
    low = np.maximum(np.floor(near[:2] - reach), 0).astype(int)
    high = np.minimum(np.ceil(near[:2] + reach).astype(int) + 1, image.shape[::-1])
    part = image[low[1] : high[1], low[0] : high[0]]
    noise = max(float(np.sqrt(seen.curve.variance(part.mean()))), 1e-6 * float(np.ptp(image)) + 1e-12)
    optics = Optics(part.shape, blur, noise**2, max(1.0, blur), 3 + 2 * max(1.0, blur))
    start = near - [*low, 0, 0, 0]
    found, kind = _found(part, start, optics, False), ELLIPSE
    if found.status in status.MEASURED and _round(found.parameters, found.covariance):
        found, kind = _found(part, start, optics, True), CIRCLE
    state = str(found.status)
    if state in status.MEASURED:
        state = status.worst(state, seen.status, status.OK if seen.correlation.white else status.CORRELATED)
    return MeasuredEllipse(kind, found.parameters + [*low, 0, 0, 0], found.covariance, state, noise, float(blur))


def _found(image: np.ndarray, start: np.ndarray, optics: Optics, circle: bool) -> Ellipse:
    """The most likely one; from edge points where it is large, or where the picture is not that of one blurred ellipse,
    for they tell how far it is from one."""
    if start[2] <= _LARGE:
        found = find_ellipse(image, start, optics, circle=circle)
        if found.status == status.OK:
            return found
    return ellipse_by_points(image, start, optics, circle)


def _round(parameters: np.ndarray, covariance: np.ndarray) -> bool:
    difference = np.array([0, 0, 1.0, -1.0])
    return bool(abs(difference @ parameters[:4]) <= _SAME * np.sqrt(difference @ covariance[:4, :4] @ difference))
