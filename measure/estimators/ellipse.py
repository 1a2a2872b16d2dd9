"""Maximum likelihood of one blurred ellipse in Gaussian noise, from a start within a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from imaging.features.locator import CLEARANCE, edge_blur
from measure.estimators.estimate import noisy
from measure.features.blurred_ellipse import LEAST_BLUR, ellipse_image, from_symmetric, relative
from measure.features.optics import Optics

_STEPS = 8
_SETTLED = 0.1  # px: after a smaller step the model, linear at where it began, is true to 0.001 px
_WIDEST = 4.0  # times the expected blur
_BAND = 3.0  # how far from the outline pixels are used, in units of where an edge's blur has ended
_SINGULAR = 1e12
_ALLOWED = 1.1  # times the noise's variance, which may itself be an estimate
_RARE = 1e-6  # chance that noise alone leaves a residual as large as one that is refused


@dataclass(frozen=True, eq=False)
class EllipseFit:
    """One blurred ellipse.

    Attributes
    ----------
    parameters, covariance : ndarray, shapes (5,) and (5, 5)
        x, y, a, b, angle in rad.
    contrast : float
        Grey levels.
    fits : bool
        Whether noise explains what the picture has beside the model.
    rows, pixels : ndarray, shapes (5, P) and (P,)
        Derivatives of the parameters by the pixels, and their flat indices.
    design, left : ndarray, shapes (P, k) and (P,)
        Derivatives of the pixels by what was fitted, the shape first, and what the fit leaves of them, grey levels.
    """

    parameters: np.ndarray
    covariance: np.ndarray
    contrast: float
    fits: bool
    rows: np.ndarray
    pixels: np.ndarray
    design: np.ndarray
    left: np.ndarray


@dataclass(frozen=True, eq=False)
class Sought:
    """Where on the outline edge points were sought: its parameters t (m,), and whether they were found, bool (m,)."""

    angles: np.ndarray
    found: np.ndarray

    def near(self, t: np.ndarray) -> np.ndarray:
        """Whether the nearest of the places to outline parameters t (...) showed an edge point."""
        if self.found.all():
            return np.ones(t.shape, bool)
        order = np.argsort(self.angles % (2 * np.pi))
        angles = self.angles[order] % (2 * np.pi)
        halves = (angles + np.append(angles[1:], angles[0] + 2 * np.pi)) / 2  # between each place and the next
        around = np.searchsorted(halves, t % (2 * np.pi)) % len(angles)
        first = t % (2 * np.pi) < halves[-1] - 2 * np.pi
        return self.found[order[np.where(first, len(angles) - 1, around)]]


def likeliest_ellipse(
    image: np.ndarray, start: np.ndarray, optics: Optics, circle: bool, seen: Sought
) -> EllipseFit | None:
    """Fisher's scoring with shape, both levels and the blur free; None where it runs away or has no maximum.

    Parameters
    ----------
    image : ndarray, shape (height, width)
    start : ndarray, shape (5,)
        Symmetric parameters (`blurred_ellipse`).
    optics : Optics
    circle : bool
    seen : Sought
        Pixels beside other parts of the outline do not count.
    """
    shape, blur, free = start, max(float(optics.blur_at(start[:2])), LEAST_BLUR), free_parameters(circle)
    widest = _WIDEST * blur
    for _ in range(_STEPS):
        model = _Linear.at(image, shape, blur, optics, free, seen)
        if model is None:
            return None
        change, wider = free @ model.change[: free.shape[1]], model.change[free.shape[1]]
        shape, blur = shape + change, float(np.clip(blur + wider, LEAST_BLUR, widest))
        if not is_ellipse(shape) or np.abs(shape - start).max() > optics.window_px:
            return None
        if max(np.abs(change).max(), abs(wider)) < _SETTLED:
            found = _with_axes(shape, free @ model.covariance(optics, image) @ free.T, circle)
            rows = _known(_axes(shape, circle)[1]) @ free @ model.inverse[: free.shape[1]] @ model.design.T
            return EllipseFit(
                *found, abs(float(model.change[-2])), model.fits(optics, image), rows, model.pixels, model.design,
                model.residual,
            )  # fmt: skip
    return None


def free_parameters(circle: bool) -> np.ndarray:
    """The five symmetric parameters from those that the fit may change."""
    if not circle:
        return np.eye(5)
    return np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 0, 0.0]])


def is_ellipse(shapes: np.ndarray) -> np.ndarray:
    """Whether both semi-axes are at least one pixel, (...)."""
    xx, yy, xy = np.moveaxis(shapes[..., 2:], -1, 0)
    return (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy) > 1.0


def _with_axes(shape: np.ndarray, covariance: np.ndarray, circle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Axes and angle with their covariance; of a circle both axes are the radius."""
    parameters, derivative = _axes(shape, circle)
    whole = _known(derivative) @ covariance @ _known(derivative).T
    if not np.isfinite(derivative).all():
        whole[4, 4] = np.inf
    return parameters, whole


def _axes(shape: np.ndarray, circle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Axes and angle, and their derivative by the shape (5, 5)."""
    if not circle:
        return from_symmetric(shape)
    x, y, radius = shape[:3]
    same = np.zeros((5, 5))
    same[[0, 1, 2, 3], [0, 1, 2, 2]] = 1
    return np.array([x, y, radius, radius, 0.0]), same


def _known(derivative: np.ndarray) -> np.ndarray:
    """0 for the angle of a circle, which has no meaning."""
    return np.nan_to_num(derivative, posinf=0.0, neginf=0.0)


@dataclass(frozen=True, eq=False)
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
    residual : ndarray, shape (P,)
        What is left of the picture, grey levels.
    """

    pixels: np.ndarray
    design: np.ndarray
    inverse: np.ndarray
    change: np.ndarray
    residual: np.ndarray

    @classmethod
    def at(cls, image, shape, blur: float, optics: Optics, free, seen: Sought) -> _Linear | None:
        """Linear at an ellipse and a blur; None where the pixels do not determine all."""
        columns, rows, near = _near(shape, optics, seen)
        coverage, derivatives = ellipse_image(shape, columns, rows, blur)
        flat = np.flatnonzero(near)
        moved = derivatives.reshape(6, -1)[:, flat]
        covered = coverage.ravel()[flat]
        used = image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].ravel()[flat]
        count = free.shape[1]
        design = np.concatenate([moved[:5].T @ free, moved[5:].T, covered[:, None], np.ones((flat.size, 1))], 1)
        gram, target = design.T @ design, design.T @ used
        if flat.size <= design.shape[1] or np.linalg.cond(gram) > _SINGULAR:
            return None
        inverse = np.linalg.inv(gram)
        change = inverse @ target
        contrast, residual = change[-2], used - design @ change
        if contrast == 0 or not np.isfinite(contrast):
            return None
        change[: count + 1] /= contrast
        design[:, : count + 1] *= contrast
        inverse[: count + 1] /= contrast
        inverse[:, : count + 1] /= contrast
        y, x = np.divmod(flat, len(columns))
        return cls((rows[0] + y) * optics.shape[1] + columns[0] + x, design, inverse, change, residual)

    def covariance(self, optics: Optics, image: np.ndarray) -> np.ndarray:
        """Of the shape's free parameters."""
        count = self.design.shape[1] - 3
        if optics.noise is None:
            return optics.noise_variance * self.inverse[:count, :count]
        found = noisy(self.inverse[:count] @ self.design.T, optics, image[None], self.pixels)
        return found.reshape(count, count)

    def fits(self, optics: Optics, image: np.ndarray) -> bool:
        """Whether the residual is noise, by its chi-square."""
        variance = optics.noise_at(image.ravel()[self.pixels])
        variance = optics.noise_variance if variance is None else variance
        freedom = self.design.shape[0] - self.design.shape[1]
        return bool((self.residual**2 / variance).sum() / _ALLOWED < chdtri(freedom, _RARE))


def _near(shape: np.ndarray, optics: Optics, seen: Sought) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns (W,) and rows (H,) around an ellipse in the image, and which of their pixels are used, (H, W)."""
    band = _BAND * CLEARANCE * edge_blur(optics.most_blur_px)
    reach = np.array([np.hypot(shape[2], shape[4]), np.hypot(shape[3], shape[4])]) + band
    low = np.maximum(np.floor(shape[:2] - reach), 0).astype(int)
    high = np.minimum(np.ceil(shape[:2] + reach) + 1, optics.shape[::-1]).astype(int)
    columns, rows = np.arange(low[0], high[0]), np.arange(low[1], high[1])
    points = np.stack(np.broadcast_arrays(columns.astype(float), rows[:, None].astype(float)), -1)
    size, unit, normal = relative(shape[None], points.reshape(1, -1, 2))
    near = np.abs(size - 1) < band * np.linalg.norm(normal, axis=-1)
    near &= seen.near(np.arctan2(unit[..., 1], unit[..., 0]))
    return columns, rows, near.reshape(len(rows), len(columns))
