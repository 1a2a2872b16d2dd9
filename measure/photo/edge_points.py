"""A circle or an ellipse through edge points along its outline."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.special import chdtri

from imaging.features.locator import MIN_CONTRAST, edge_blur
from measure.estimators.crossing import CrossingLocator
from measure.estimators.gradient import gradient_along
from measure.features.conic import Ellipse, around, fit_ellipse, nearly_away, no_ellipse
from measure.features.optics import Optics
from measure.photo.recording import Recording
from scenes import status

_SPACING = 2.0  # smoothing scales between points: between them errors are smooth
_MOST, _LEAST = 800, 12  # points
_FOUND = 0.5  # part of the places at which there must be an edge point
_OUTLYING = 4.0  # times the median distance from the ellipse
_RARE = 1e-6  # chance that noise alone leaves as much
_ALLOWED = 1.1  # times the noise's variance, which is an estimate itself


def ellipse_by_points(
    image: np.ndarray, near: np.ndarray, optics: Optics, circle: bool, seen: Recording | None = None
) -> Ellipse:
    """Fit an ellipse to points where the second derivative across it is zero.

    Points farther off than four times the median are left out. The covariance is that of the points by the noise;
    where that does not explain their distances, it is enlarged by their chi-square over its degrees of freedom.

    Parameters
    ----------
    image : ndarray, shape (height, width)
    near : ndarray, shape (5,)
        x, y, a, b, px, angle, degrees, within ``optics.window_px`` of the truth.
    optics : Optics
    circle : bool
        Fit a circle.
    seen : Recording, optional
        Whose noise counts; white noise of the optics where not given.

    Returns
    -------
    Ellipse
        ``clutter`` where noise does not explain the points' distances from it.
    """
    length = np.pi * (near[2] + near[3])
    places, normals = around(near, int(np.clip(length / (_SPACING * optics.scale_px), 16, _MOST)))
    room = optics.has_room(places)
    places, normals = places[room], normals[room]
    if len(places) < _LEAST:
        return no_ellipse((), status.NOT_VISIBLE)
    locator = gradient_along(optics, np.arange(float(len(places))), places, normals)
    found = locator.locate(image[None])
    valid, contrast = found.valid[0], float(found.contrast[0])
    if valid.mean() < _FOUND or contrast <= MIN_CONTRAST * np.sqrt(optics.noise_variance):
        return no_ellipse((), status.LOW_CONTRAST)
    # on a curve the zero crossing lies inside the edge by half the curvature times the smoothed profile's variance
    inward = (optics.scale_px**2 + edge_blur(optics.blur_at(places)) ** 2) / 2 * _curvature(near, normals)
    points = places + (found.offset[0] + inward)[:, None] * normals
    covariance = _covariance(locator, image, optics, seen) / contrast**2
    return _fitted(points[valid], covariance[np.ix_(valid, valid)], circle)


def _covariance(locator: CrossingLocator, image: np.ndarray, optics: Optics, seen: Recording | None) -> np.ndarray:
    """Of the points at unit contrast, (m, m)."""
    if seen is None or seen.correlation.white:
        response = locator.unit_noise().response
        return optics.noise_variance * (response @ response.T).toarray()
    part = sparse.coo_array(locator.unit_response())
    rows = sparse.csr_array((part.data, (part.row, locator.pixels[part.col])), (part.shape[0], image.size))
    return seen.correlation.covariance_of_many(rows, np.sqrt(seen.curve.variance(image)))


def _fitted(points: np.ndarray, covariance: np.ndarray, circle: bool) -> Ellipse:
    """Through the points that are no outliers; whether noise explains how they lie."""
    fitted = fit_ellipse(points, covariance, circle=circle)
    if fitted.status not in status.MEASURED:
        return fitted
    away = nearly_away(points, fitted.parameters)
    kept = np.abs(away) <= _OUTLYING * np.median(np.abs(away)) + 1e-9
    if kept.sum() < _LEAST:
        return no_ellipse((), status.ILL_CONDITIONED)
    fitted = fit_ellipse(points[kept], covariance[np.ix_(kept, kept)], circle=circle)
    if fitted.status not in status.MEASURED:
        return fitted
    squares = float((nearly_away(points[kept], fitted.parameters) ** 2 / np.diag(covariance)[kept]).sum())
    freedom = int(kept.sum()) - 5
    if kept.mean() > 0.9 and squares / _ALLOWED < chdtri(freedom, _RARE):
        return fitted
    return Ellipse(fitted.parameters, fitted.covariance * max(squares / freedom, 1.0), np.array(status.CLUTTER))


def _curvature(parameters: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Of an ellipse where its unit normals are these (m, 2), 1/px."""
    _, _, a, b, angle = parameters
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    u, v = normals @ [cosine, sine], normals @ [-sine, cosine]
    return ((a * u) ** 2 + (b * v) ** 2) ** 1.5 / (a * b) ** 2
