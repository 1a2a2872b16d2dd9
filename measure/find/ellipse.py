"""Circles and ellipses in images: edge points along normals first, then maximum likelihood of the blurred picture."""

from __future__ import annotations

import numpy as np

from imaging.features.locator import MIN_CONTRAST, edge_blur
from measure.estimators.ellipse import EllipseFit, Sought, free_parameters, is_ellipse, likeliest_ellipse
from measure.estimators.gradient import gradient_along
from measure.features.blurred_ellipse import curvature, outline, relative, to_symmetric
from measure.features.calipers import MIN_POSITIONS
from measure.features.conic import UNITS, Ellipse, no_ellipse
from measure.features.optics import Optics
from scenes import InvalidInput, status
from scenes.arrays import finite, grey_levels

_MIN_FOUND = 0.5  # part of the outline on which there must be edge points
_SPACING = 2.0  # smoothing scales between edge points: between them errors are smooth
_START_STEPS = 4
_MOST_INWARD = 0.3  # px up to which the first order in the curvature is good for a start
_LARGEST = 1e5  # px; of an ellipse that an image shows
_LEAST_CONTRAST = 2.5  # contrast / noise below which the start is not near enough


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

    Raises
    ------
    InvalidInput
        If the images are none, or the expected ellipse is none.

    Returns
    -------
    Ellipse
        The covariance is that of the likelihood's maximum, at each image's own contrast and blur. Where the axes are
        equal the angle has no meaning, and its variance is infinite. The status is ``clutter`` where the picture has
        more beside the ellipse than the noise explains: the parameters may be biased.
    """
    images = grey_levels(images, "images")
    stack, lead = images.reshape(-1, *images.shape[-2:]), images.shape[:-2]
    found = _found(stack, expected, optics, circle, spacing)
    if found is None:
        return no_ellipse(lead, status.NOT_VISIBLE)
    fits, state = found
    parameters, covariance = np.full((len(stack), 5), np.nan), np.full((len(stack), 5, 5), np.nan)
    for k, fit in enumerate(fits):
        if fit is not None:
            parameters[k], covariance[k] = fit.parameters, fit.covariance
    return Ellipse(
        parameters.reshape(*lead, 5) * UNITS,
        covariance.reshape(*lead, 5, 5) * np.outer(UNITS, UNITS),
        state.reshape(lead),
    )


def fitted_ellipse(
    image: np.ndarray, expected: np.ndarray, optics: Optics, circle: bool
) -> tuple[EllipseFit | None, str]:
    """As `find_ellipse` of one image (height, width): the fit itself, None where there is none, and the status."""
    found = _found(image[None], expected, optics, circle, _SPACING)
    return (None, status.NOT_VISIBLE) if found is None else (found[0][0], str(found[1][0]))


def _found(
    stack: np.ndarray, expected: np.ndarray, optics: Optics, circle: bool, spacing: float
) -> tuple[list[EllipseFit | None], np.ndarray] | None:
    """Fits and statuses (n,) of a stack; None where the outline has no room."""
    expected = finite(expected, "expected")
    if stack.shape[-2:] != optics.shape:
        raise InvalidInput(f"images must be of the optics' shape {optics.shape}, got {stack.shape}")
    if expected.shape != (5,) or not (expected[2:4] > 0).all() or np.abs(expected).max() > _LARGEST:
        raise InvalidInput(f"expected must be x, y, a, b and angle of an ellipse, got {expected}")
    if circle:
        radius = expected[2:4].mean()
        expected = np.array([*expected[:2], radius, radius, 0.0])
    start = to_symmetric(expected / UNITS)
    angles, places, normals = _positions(start, optics, spacing)
    if len(angles) < max(MIN_POSITIONS, 5):
        return None
    found = gradient_along(optics, angles, places, normals).locate(stack)
    seen = found.valid.mean(1) >= _MIN_FOUND
    # on a curve the zero crossing lies inside the edge by half the curvature times the variance of the smoothed profile
    inward = (optics.scale_px**2 + edge_blur(optics.blur_at(places)) ** 2) / 2 * curvature(start, angles)
    offset = found.offset + np.minimum(inward, _MOST_INWARD)
    starts, good = _start(places + offset[..., None] * normals, found.valid, start, circle)
    fits: list[EllipseFit | None] = [None] * len(stack)
    clean, noise = np.ones(len(stack), bool), np.sqrt(optics.noise_variance)
    for k in np.flatnonzero(seen & good):
        fit = likeliest_ellipse(stack[k], starts[k], optics, circle, Sought(angles, found.valid[k]))
        good[k] = fit is not None
        seen[k] = found.contrast[k] > MIN_CONTRAST * noise if fit is None else fit.contrast > _LEAST_CONTRAST * noise
        if good[k] and seen[k]:
            fits[k], clean[k] = fit, fit.fits
    measured = np.where(clean, status.OK, status.CLUTTER)
    return fits, np.where(seen, np.where(good, measured, status.ILL_CONDITIONED), status.LOW_CONTRAST)


def _positions(shape: np.ndarray, optics: Optics, spacing: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outline parameters, places (m, 2) and outward unit normals (m, 2) about evenly spaced, where there is room."""
    fine = np.linspace(0, 2 * np.pi, 2001)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(outline(shape, fine)[0], axis=0), axis=1))])
    count = max(8, int(length[-1] / (spacing * optics.scale_px)))
    t = np.interp(length[-1] * np.arange(count) / count, length, fine)
    places, normals = outline(shape, t)
    inside = optics.has_room(places)
    return t[inside], places[inside], normals[inside]


def _start(points: np.ndarray, valid: np.ndarray, expected: np.ndarray, circle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Ellipses (n, 5) of least distances from points (n, m, 2), to first order in the distance; whether they exist."""
    shapes = np.tile(expected, (len(points), 1))
    good = valid.sum(1) >= 5
    free = free_parameters(circle)
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
        good &= is_ellipse(shapes)
        shapes[~good] = expected
    return shapes, good
