"""Circles and ellipses in images: edge points along normals first, then maximum likelihood of the blurred picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure import status
from measure.estimators.estimate import noisy
from measure.estimators.gradient import gradient_along
from measure.features.blurred_ellipse import (
    LEAST_BLUR,
    ellipse_image,
    from_symmetric,
    outline,
    relative,
    to_symmetric,
)
from measure.features.calipers import MIN_POSITIONS
from measure.features.conic import UNITS, Ellipse, no_ellipse
from measure.features.optics import Optics
from planner.features.locator import CLEARANCE, MIN_CONTRAST, edge_blur

_MIN_FOUND = 0.5  # part of the outline on which there must be edge points
_SPACING = 2.0  # smoothing scales between edge points: between them errors are smooth
_START_STEPS = 4
_STEPS = 8
_SETTLED = 0.05  # px: after a smaller step the model, linear at where it began, is true to less than 0.001 px
_WIDEST = 4.0  # times the expected blur
_BAND = 3.0  # how far from the outline pixels are used, in units of where an edge's blur has ended


def find_ellipse(
    images: np.ndarray, expected: np.ndarray, optics: Optics, *, circle: bool = False, spacing: float = _SPACING
) -> Ellipse:
    """Find a uniform ellipse on a uniform background in images.

    Edge points along normals of the expected ellipse give a start; from there Fisher's scoring on the blurred picture,
    with both levels and the blur free, goes to the maximum of the likelihood. Only pixels near the outline count, and
    of these only where edge points were found.

    Parameters
    ----------
    images : ndarray, shape (..., height, width)
        Grey levels.
    expected : array_like, shape (5,)
        Parameters as in `Ellipse`, within ``optics.window_px`` of the truth; the axes may be equal.
    optics : Optics
        Blur (as a start), noise and scale.
    circle : bool
        Fit a circle.
    spacing : float
        Distance of the edge points in units of the smoothing scale.

    Returns
    -------
    Ellipse
        The covariance is that of the likelihood's maximum, at each image's own contrast and blur. Where the axes are
        equal the angle has no meaning, and its variance is infinite.
    """
    stack, lead = images.reshape(-1, *images.shape[-2:]), images.shape[:-2]
    start = to_symmetric(np.asarray(expected, float) / UNITS)
    angles, places, normals = _positions(start, optics, spacing)
    if len(angles) < max(MIN_POSITIONS, 5):
        return no_ellipse(lead, status.NOT_VISIBLE)
    found = gradient_along(optics, angles, places, normals).locate(stack)
    seen = (found.valid.mean(1) >= _MIN_FOUND) & (found.contrast > MIN_CONTRAST * np.sqrt(optics.noise_variance))
    starts, good = _start(places + found.offset[..., None] * normals, found.valid, start, circle)
    parameters, covariance = np.full((len(stack), 5), np.nan), np.full((len(stack), 5, 5), np.nan)
    for k in np.flatnonzero(seen & good):
        beside = None if found.valid[k].all() else angles[~found.valid[k]]
        fit = _likeliest(stack[k], starts[k], optics, circle, beside, angles)
        good[k] = fit is not None
        if fit is not None:
            parameters[k], covariance[k] = fit
    state = np.where(seen, np.where(good, status.OK, status.ILL_CONDITIONED), status.LOW_CONTRAST)
    return Ellipse(
        parameters.reshape(*lead, 5) * UNITS,
        covariance.reshape(*lead, 5, 5) * np.outer(UNITS, UNITS),
        state.reshape(lead),
    )


def _positions(shape: np.ndarray, optics: Optics, spacing: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outline parameters, places (m, 2) and outward unit normals (m, 2) about evenly spaced, where there is room."""
    fine = np.linspace(0, 2 * np.pi, 2001)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(outline(shape, fine)[0], axis=0), axis=1))])
    count = max(8, int(length[-1] / (spacing * optics.scale_px)))
    t = np.interp(length[-1] * np.arange(count) / count, length, fine)
    places, normals = outline(shape, t)
    margin = optics.window_px + 4 * optics.scale_px + 1
    inside = ((places >= margin) & (places <= np.array(optics.shape[::-1]) - 1 - margin)).all(1)
    return t[inside], places[inside], normals[inside]


def _start(points: np.ndarray, valid: np.ndarray, expected: np.ndarray, circle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Ellipses (n, 5) of least distances from points (n, m, 2), to first order in the distance; whether they exist."""
    shapes = np.tile(expected, (len(points), 1))
    good = valid.sum(1) >= 5
    free = _free(circle)
    for _ in range(_START_STEPS):
        size, unit, normal = relative(shapes, points)
        distance = (size - 1) / np.linalg.norm(normal, axis=-1)
        toward = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        (nx, ny), (u, v) = np.moveaxis(toward, -1, 0), np.moveaxis(unit, -1, 0)
        design = np.stack([nx, ny, nx * u, ny * v, nx * v + ny * u], -1) @ free * valid[..., None]
        gram = np.einsum("nmi,nmj->nij", design, design)
        good &= np.linalg.cond(gram) < 1e12
        gram[~good] = np.eye(free.shape[1])
        change = np.linalg.solve(gram, np.einsum("nmi,nm->ni", design, distance)[..., None])[..., 0]
        shapes = np.where(good[:, None], shapes + change @ free.T, shapes)
        good &= _is_ellipse(shapes)
        shapes[~good] = expected
    return shapes, good


def _free(circle: bool) -> np.ndarray:
    """The five symmetric parameters from those that the fit may change."""
    if not circle:
        return np.eye(5)
    return np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 0, 0.0]])


def _is_ellipse(shapes: np.ndarray) -> np.ndarray:
    """Whether both semi-axes are at least one pixel, (...)."""
    xx, yy, xy = np.moveaxis(shapes[..., 2:], -1, 0)
    return (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy) > 1.0


def _likeliest(image, start, optics: Optics, circle: bool, lost, angles):
    """Parameters (5,) and covariance (5, 5) of the blurred ellipse of maximum likelihood; None where it runs away."""
    shape, blur, free = start, max(optics.blur_px, LEAST_BLUR), _free(circle)
    for _ in range(_STEPS):
        model = _Linear.at(image, shape, blur, optics, free, lost, angles)
        if model is None:
            return None
        change = free @ model.change[: free.shape[1]]
        shape, wider = shape + change, model.change[free.shape[1]]
        blur = float(np.clip(blur + wider, LEAST_BLUR, _WIDEST * max(optics.blur_px, LEAST_BLUR)))
        if not _is_ellipse(shape) or np.abs(shape - start).max() > optics.window_px:
            return None
        if np.abs(change).max() < _SETTLED and abs(wider) < _SETTLED:
            return _reported(shape, free @ model.covariance(optics, image) @ free.T, circle)
    return None


def _reported(shape: np.ndarray, covariance: np.ndarray, circle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Axes and angle, and their covariance."""
    if circle:
        x, y, radius = shape[:3]
        axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 0, 0.0]])
        return np.array([x, y, radius, radius, 0.0]), axes @ covariance[:3, :3] @ axes.T
    parameters, derivative = from_symmetric(shape)
    if np.isfinite(derivative).all():
        return parameters, derivative @ covariance @ derivative.T
    derivative[4] = 0.0
    whole = derivative @ covariance @ derivative.T
    whole[4, 4] = np.inf
    return parameters, whole


@dataclass(frozen=True)
class _Linear:
    """The picture near an ellipse as a linear function of what is unknown.

    Attributes
    ----------
    pixels : ndarray of int
        Flat indices of the P pixels.
    design : ndarray, shape (P, k)
        Derivatives by the shape's k - 3 free parameters, the blur, the contrast and the background.
    inverse : ndarray, shape (k, k)
        Of the Fisher matrix for unit noise.
    change : ndarray, shape (k,)
        From the least squares: what to add to shape and blur, then contrast and background themselves.
    """

    pixels: np.ndarray
    design: np.ndarray
    inverse: np.ndarray
    change: np.ndarray

    @classmethod
    def at(cls, image, shape, blur: float, optics: Optics, free, lost, angles) -> _Linear | None:
        """Linear at an ellipse and a blur; None where the pixels do not determine all."""
        columns, rows, near = _near(shape, optics, lost, angles)
        coverage, derivatives = ellipse_image(shape, columns, rows, blur)
        flat = np.flatnonzero(near)
        moved = derivatives.reshape(6, -1)[:, flat]
        covered = coverage.ravel()[flat]
        used = image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].ravel()[flat]
        count = free.shape[1]
        design = np.concatenate([moved[:5].T @ free, moved[5:].T, covered[:, None], np.ones((flat.size, 1))], 1)
        gram, target = design.T @ design, design.T @ used
        if flat.size <= design.shape[1] or np.linalg.cond(gram) > 1e12:
            return None
        inverse = np.linalg.inv(gram)
        change = inverse @ target
        contrast = change[-2]
        if contrast == 0:
            return None
        change[: count + 1] /= contrast
        design[:, : count + 1] *= contrast
        inverse[: count + 1] /= contrast
        inverse[:, : count + 1] /= contrast
        y, x = np.divmod(flat, len(columns))
        return cls((rows[0] + y) * optics.shape[1] + columns[0] + x, design, inverse, change)

    def covariance(self, optics: Optics, image: np.ndarray) -> np.ndarray:
        """Of the shape's free parameters."""
        count = self.design.shape[1] - 3
        if optics.noise is None:
            return optics.noise_variance * self.inverse[:count, :count]
        found = noisy(self.inverse[:count] @ self.design.T, optics, image[None], self.pixels)
        return found.reshape(count, count)


def _near(shape: np.ndarray, optics: Optics, lost, angles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns (W,) and rows (H,) around an ellipse in the image, and which of their pixels are used, (H, W)."""
    band = _BAND * CLEARANCE * edge_blur(optics.blur_px)
    reach = np.array([np.hypot(shape[2], shape[4]), np.hypot(shape[3], shape[4])]) + band
    low = np.maximum(np.floor(shape[:2] - reach), 0).astype(int)
    high = np.minimum(np.ceil(shape[:2] + reach) + 1, optics.shape[::-1]).astype(int)
    columns, rows = np.arange(low[0], high[0]), np.arange(low[1], high[1])
    points = np.stack(np.broadcast_arrays(columns.astype(float), rows[:, None].astype(float)), -1)
    size, unit, normal = relative(shape[None], points.reshape(1, -1, 2))
    near = np.abs(size - 1) < band * np.linalg.norm(normal, axis=-1)
    if lost is not None:
        t = np.arctan2(unit[..., 1], unit[..., 0])[..., None]
        apart = [np.abs((t - at + np.pi) % (2 * np.pi) - np.pi).min(-1) for at in (lost, np.setdiff1d(angles, lost))]
        near &= apart[1] < apart[0]
    return columns, rows, near.reshape(len(rows), len(columns))
