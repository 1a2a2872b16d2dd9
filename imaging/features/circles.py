"""A circular edge as the sensor sees it, and how well the circle is found from its rim.

The pose tells in which plane the circle lies, so its parameters are three: two shifts of its centre in that plane and
the change of its radius. A point's residual is its distance from the rim's image along the normal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erfc

from imaging.features.locator import reach
from imaging.features.rim_look import look
from imaging.features.rim_sides import (
    RIM_POINTS,
    clearance,
    contrast_along,
    outward_normals,
    seen_along,
    shading_shift,
    steady,
    within_ends,
)
from imaging.geometry.blur import blur_at
from imaging.geometry.projection import depth, project
from imaging.pictures import Pictures
from scenes import Circle

LEAST_CLEAR = 0.25  # part of the seen rim that must be undisturbed, or all of it is taken and its circle is `clutter`
LEAST_SEEN = 0.1  # of a whole turn: what of a rim must have contrast; an arc is too short where less lies off its ends
HALF = 0.5  # so much a place must count to be one that is undisturbed
_FAR = 4.0  # smoothing scales: beyond, errors are independent


@dataclass(frozen=True, eq=False)
class RimImage:
    """Points on the image of a circle, for settings of leading shape (...).

    Attributes
    ----------
    design : ndarray, shape (..., n, p)
        Derivative of each point's place along its normal by the circle's three parameters (`imaging.features.seen`;
        a cone's four), px for the scene's unit.
    arc : ndarray, shape (..., n)
        Length of image that each point stands for, px.
    squared : ndarray, shape (..., n)
        Squared contrast, 0 at hidden points.
    noise_variance : ndarray, shape (..., n), or float
        Mean of both sides, grey levels^2.
    known : ndarray, shape (..., n)
        How much what the locator finds there is known, 0 to 1. In one picture `RimLook.share`; in many whether it is
        undisturbed: the far rim of the wall beside, where the wall is seen, the straight edges around the circle's
        face, and jumps of the contrast along the rim are `locator.reach` away.
    turn : float
        How much of a whole turn the points stand for, 1 but for arcs.
    off_ends : ndarray of bool, shape (..., n), optional
        Which points of an arc are `locator.reach` off its ends; others have no contrast.
    blur : ndarray, shape (..., n), or float
        Standard deviation of the lens' blur there, px.
    place, normal : ndarray, shape (..., n, 2), optional
        Where they are, px, and unit normals.
    """

    design: np.ndarray
    arc: np.ndarray
    squared: np.ndarray
    noise_variance: np.ndarray | float
    known: np.ndarray
    turn: float = 1.0
    off_ends: np.ndarray | None = None
    blur: np.ndarray | float = 0.0
    place: np.ndarray | None = None
    normal: np.ndarray | None = None

    @property
    def left(self) -> np.ndarray:
        """Part of a whole turn that lies off the ends of an arc, shape (...); 1 of what has no ends."""
        if self.off_ends is None:
            return np.ones(self.squared.shape[:-1])
        return np.broadcast_to(self.turn * self.off_ends.mean(-1), self.squared.shape[:-1])

    @property
    def clear(self) -> np.ndarray:
        """Which points are undisturbed, bool, shape (..., n)."""
        return self.known >= HALF

    @property
    def share(self) -> np.ndarray:
        """How much points count, shape (..., n): what is known there, or all where too little is."""
        return np.where(self.crowded[..., None], 1.0, self.known)

    @property
    def crowded(self) -> np.ndarray:
        """Whether so little of what is seen is undisturbed that all of it has to be taken, bool, shape (...)."""
        seen = self.squared > 0
        clear = (seen & self.clear).mean(-1)
        found = clear < LEAST_CLEAR * np.maximum(seen.mean(-1), LEAST_CLEAR)
        return found if self.off_ends is None else found | (self.turn * clear < LEAST_SEEN)

    @property
    def counted(self) -> np.ndarray:
        """Which points have any contrast."""
        return self.squared > 0


def rim(pictures: Pictures, circle: Circle, *, fall_off: bool = True) -> RimImage:
    """Sample a circular edge at equal angles.

    One picture is looked at (`imaging.features.rim_look`), as a measurement does; of many the levels at the rim and
    rules about what is near stand for that.
    """
    scene = pictures.scene
    seen = look(pictures, circle) if fall_off and pictures.closely else None
    angle = circle.angles(RIM_POINTS if seen is None else seen.shift.size)
    one, two = circle.axes
    radial = circle.spokes(angle)
    normal, slope, speed = outward_normals(pictures, circle, angle)
    across = np.einsum("...ni,...nij->...nj", normal, slope)
    design = np.stack([across @ one, across @ two, np.einsum("...nj,nj->...n", across, radial)], -1)
    arc, far = speed * circle.turn / angle.size, reach(scene.locator.scale_px, scene.camera.most_blur_px)
    turn = circle.turn / (2 * np.pi)
    off_ends = None if circle.ends is None else within_ends(pictures, circle, angle)
    away = depth(circle.at(angle), pictures.sensors, scene.camera)
    place = project(circle.at(angle), pictures.sensors, scene.camera)
    blur = blur_at(scene.camera, away, place)
    if seen is not None:
        squared = np.where(seen_along(pictures, circle, angle), seen.squared, 0.0)
        squared = _off(squared, off_ends)
        return RimImage(design, arc, squared, seen.noise_variance, seen.share, turn, off_ends, blur, place, normal)
    squared, noise = contrast_along(pictures, circle, angle, fall_off=fall_off)
    shift = shading_shift(pictures, circle, angle) if fall_off else np.zeros(1)
    clear = (clearance(pictures, circle, angle) >= far) & steady(squared, shift, arc, far)
    return RimImage(design, arc, _off(squared, off_ends), noise, clear, turn, off_ends, blur, place, normal)


def _off(squared: np.ndarray, off_ends: np.ndarray | None) -> np.ndarray:
    """Squared contrast, none near an arc's ends."""
    return squared if off_ends is None else np.where(off_ends, squared, 0.0)


def fisher_circle(circle: RimImage, weights: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    """Covariance of the three parameters from independent points of the given inverse variances (..., n), unit^2."""
    information = _weighted(weights, circle.design)
    enough = circle.left >= LEAST_SEEN
    return _covariance(information, enough if counted is None else enough & (counted.sum(-1) > 3))


def calibrated_circle(
    circle: RimImage,
    kappa2: np.ndarray | float,
    scale: float,
    weakest: float,
    shared: np.ndarray | None = None,
) -> np.ndarray:
    """Covariance of the three parameters by weighted least squares from dense points with correlated errors, unit^2.

    Points weigh as they count (`RimImage.share`) times the squared contrast over the noise's variance. ``kappa2``,
    (..., n) or one number, is a point's variance over that of the noise at unit contrast, and errors d px apart
    correlate as exp(-d^2 / (4 scale^2)): the variance is 2 sqrt(pi) scale times that of independent points a px, less
    what correlation lacks at the ends of pieces that are used and wherever else a point's part changes along the rim
    (`_lacking`); infinite where the pieces are so short that this would not be positive. Disturbed points and those of
    a squared contrast below ``weakest`` times the noise's variance are left out; a tenth of a turn must be left.
    ``shared``, (..., n, n), is what the points' errors have in common at unit contrast (`imaging.row_noise.of_points`).
    """
    ratio = circle.squared / circle.noise_variance
    share = np.where(ratio >= weakest, circle.share, 0.0)
    information, along = (
        _weighted(np.where(share > 0, weight * ratio, 0.0), circle.design)
        for weight in (share * circle.arc, kappa2 * share**2 * circle.arc)
    )
    pull = share[..., None] * np.sqrt(np.where(share > 0, kappa2 * ratio, 0.0))[..., None] * circle.design
    scatter = 2 * np.sqrt(np.pi) * scale * along - 2 * scale**2 * _lacking(pull, circle.arc / scale)
    enough = circle.turn * (share >= HALF).mean(-1) >= LEAST_SEEN
    inverse = _covariance(information, enough & _positive(scatter))
    good = np.isfinite(inverse).all((-1, -2))[..., None, None]
    known = np.where(good, inverse, 0.0)
    if shared is not None:
        level = np.where(share > 0, share * circle.arc * np.sqrt(circle.squared) / circle.noise_variance, 0.0)
        level = level[..., None] * circle.design
        scatter = scatter + np.einsum("...ni,...nm,...mj->...ij", level, np.nan_to_num(shared), level, optimize=True)
    return np.where(good, known @ scatter @ known, inverse)


def _weighted(weights: np.ndarray, design: np.ndarray) -> np.ndarray:
    """Sums of the products of two columns of designs (..., n, p) over the places, weighted (..., n): (..., p, p)."""
    parts = design.shape[-1]
    products = (design[..., :, None] * design[..., None, :]).reshape(*design.shape[:-1], parts**2)
    found = (weights[..., None, :] @ products)[..., 0, :]
    return found.reshape(*found.shape[:-1], parts, parts)


def _lacking(pull: np.ndarray, arc: np.ndarray) -> np.ndarray:
    """What correlation lacks where points' parts change, (..., p, p), of parts (..., n, p).

    A part w(x) that changes in steps d_k at places x_k has, for errors that correlate as exp(-u^2 / 4), a double
    integral of 2 sqrt(pi) times that of w^2, less 2 sum d_k d_l f(x_k - x_l), f(u) = exp(-u^2 / 4) - sqrt(pi) u / 2
    erfc(u / 2): 1 for each hard end, as good as nothing where it changes slowly. ``arc`` (..., n) is in smoothing
    scales.
    """
    steps = np.roll(pull, -1, -2) - pull
    onward, count = steps / 2, steps.shape[-2]
    around = np.concatenate([steps, steps], -2)
    nearest = max(float(np.nanmin(arc, initial=_FAR)), 1e-300)
    for k in range(1, min(int(_FAR / nearest), count // 2) + 1):
        half = k * arc / 2
        share = np.exp(-(half**2)) - np.sqrt(np.pi) * half * erfc(half)
        onward += share[..., None] * around[..., k : k + count, :]
    found = np.swapaxes(steps, -1, -2) @ onward
    return found + np.swapaxes(found, -1, -2)


def _positive(matrices: np.ndarray) -> np.ndarray:
    """Which symmetric matrices (..., p, p) are positive definite by more than rounding, bool, shape (...)."""
    size = np.sqrt(np.maximum(np.diagonal(matrices, axis1=-2, axis2=-1), 0.0))
    good = np.isfinite(matrices).all((-1, -2)) & (size > 0).all(-1)
    found, size = np.zeros(good.shape, bool), size[good]
    found[good] = np.linalg.eigvalsh(matrices[good] / (size[..., None] * size[..., None, :]))[..., 0] > 1e-10
    return found


def _covariance(information: np.ndarray, enough: np.ndarray) -> np.ndarray:
    """The inverse; infinite diagonal where singular."""
    enough, same = enough & _positive(information), np.eye(information.shape[-1])
    size = np.where(enough[..., None], np.sqrt(np.abs(np.diagonal(information, axis1=-2, axis2=-1))), 1.0)
    scaled = np.where(enough[..., None, None], information / (size[..., None] * size[..., None, :]), same)
    inverse = np.linalg.inv(scaled) / (size[..., None] * size[..., None, :])
    return np.where(enough[..., None, None], inverse, np.diag(np.full(len(same), np.inf)))
