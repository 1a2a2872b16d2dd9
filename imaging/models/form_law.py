"""What noise does to the zone that the edge points of one feature seem to need (`scenes.measurands.form`).

The zone is a maximum less a minimum over m points, so that even a perfect feature seems to need one. The points' errors
are jointly normal: standard deviations from the image model, as of `imaging.models.calibrated`, and correlation
exp(-d^2 / (4 s^2)) of points d px apart along the edge, s the locator's smoothing scale. What the reference, a line or
circle by least squares, takes out of them is left out of the zone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from imaging.features.circles import HALF, LEAST_SEEN, RimImage, rim
from imaging.features.limb_outline import limb_outline, limb_places
from imaging.features.limbs import limb_rim
from imaging.features.locator import (
    MIN_CONTRAST,
    MIN_USABLE,
    MOST_PLACES,
    SPACING,
    correlation,
    kappa2,
    points_along,
)
from imaging.features.measurand import Measurands, measurands, normals
from imaging.features.rim_look import places_around
from imaging.geometry.projection import edge_points
from imaging.models.along import Along
from imaging.models.extremes import Extreme, Law, magnitude, spread
from imaging.pictures import Pictures
from scenes import Circle, Curved, Quantity
from scenes.measurands.features import place_of
from scenes.measurands.form import Reference, reference_of

CLEAREST = 2 * MIN_CONTRAST  # contrast / noise that a point needs: an extreme shows what in a mean averages out
LEAST_CLEAR = 0.5  # part of the places that must have it
_WORST = 8.0  # exponent of the mean of unequal standard deviations that an extreme of many points goes with
_GRID = np.unique(np.round(np.geomspace(5, 1200, 36)).astype(int))  # numbers of points of which laws are tabulated


@dataclass(frozen=True, eq=False)
class FormLaw:
    """Joint errors of the m points of a feature, and what they do to its zone.

    Attributes
    ----------
    covariance : ndarray, shape (m, m)
        Of the points' distances from their reference, the scene's unit squared.
    reference : {"line", "circle", "nominal"}
    at : ndarray, shape (m,)
        Where the points are: shares of an edge's length, or angles around a circle (`Circle.at`), rad.
    """

    covariance: np.ndarray
    reference: Reference
    at: np.ndarray

    @classmethod
    def beside(cls, covariance: np.ndarray, design: np.ndarray, reference: Reference, at: np.ndarray) -> FormLaw:
        """From errors of the points' places, of which a least-squares fit of a design (m, k) takes a part."""
        left = residues(design) if reference != "nominal" else np.eye(len(design))
        return cls(left @ covariance @ left.T, reference, at)

    @property
    def extreme(self) -> Extreme:
        """The zone that distances (..., m) need."""
        return needed(self.reference)

    @cached_property
    def noise(self) -> Law:
        """Of the zone of a feature without form error."""
        return self.of(np.zeros(len(self.covariance)))

    def of(self, form: np.ndarray) -> Law:
        """Of the zone of a feature whose points are truly so far from their reference, (m,)."""
        return Law.of(form, self.covariance, self.extreme)

    @cached_property
    def apart(self) -> float:
        """Largest standard deviation of the zone that two points alone need, or one about the nominal place.

        A zone seems smaller than it is by no more than its two outermost points' errors, whatever the feature's form.
        """
        squares = np.diag(self.covariance)
        if self.reference == "nominal":
            return 2 * float(np.sqrt(squares.max()))
        return float(np.sqrt(max((squares[:, None] + squares - 2 * self.covariance).max(), 0.0)))


def needed(reference: Reference) -> Extreme:
    """The zone that distances (..., m) need: their range, or about the nominal place twice the largest."""
    return magnitude if reference == "nominal" else spread


def residues(design: np.ndarray) -> np.ndarray:
    """What a least-squares fit of a design (m, k) leaves of m numbers, (m, m)."""
    basis = np.linalg.qr(design / np.linalg.norm(design, axis=0))[0]
    return np.eye(len(design)) - basis @ basis.T


def every(spacing: float, scale: float) -> int:
    """Which places so far apart, px, are points of a form: every so many-th."""
    return max(1, int(SPACING * scale / spacing + 1e-9)) if spacing > 0 else 1


def form_law(pictures: Pictures, quantity: Quantity) -> FormLaw | None:
    """Of one picture; None where the feature cannot be measured.

    Examples
    --------
    >>> import scenes
    >>> block = scenes.load("task1").with_(task=None, measurands=[
    ...     {"name": "front", "kind": "straightness", "features": [{"edge": "e7"}]}])
    >>> law = form_law(Pictures.of(block, (30, 135), (15, 315)), block.quantities[0])
    >>> print(f"a straight edge seems to need {law.noise.mean:.3f} cm, below {law.noise.quantile(0.95):.3f} in 95 %")
    a straight edge seems to need 0.008 cm, below 0.010 in 95 %
    """
    return pictures.once(("form", quantity), lambda: _law(pictures, quantity))


def form_variances(pictures: Pictures, known: Measurands, rims: list[RimImage]) -> tuple[np.ndarray, ...]:
    """Variance of each form's size (`Seen.forms`) by noise, where there is no form error, the scene's unit squared.

    Of one picture that of its `FormLaw`; of many that of as many points alike, of the mean of their variances.

    Parameters
    ----------
    rims : list of RimImage
        Of the circles of ``known``.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if pictures.closely:
            laws = (form_law(pictures, quantity) for quantity in known.seen.forms)
            return tuple(np.array(np.inf if law is None else law.noise.u**2) for law in laws)
        return tuple(_glanced(pictures, quantity, known, rims) for quantity in known.seen.forms)


def _glanced(pictures: Pictures, quantity: Quantity, known: Measurands, rims: list[RimImage]) -> np.ndarray:
    name = place_of(quantity.features[0])
    if name in known.circles:
        return _glanced_rim(pictures, quantity, rims[known.circles.index(name)])
    return _glanced_edge(pictures, quantity)


def _law(pictures: Pictures, quantity: Quantity) -> FormLaw | None:
    known, name = measurands(pictures), place_of(quantity.features[0])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _of_rim(pictures, quantity) if name in known.circles else _of_edge(pictures, quantity)


@dataclass(frozen=True, eq=False)
class _EdgeErrors:
    """Along the used part of one edge, of pictures (...): `EdgeNodes.t` and ``spatial`` (..., n), standard deviations
    of points there (..., n), the scene's unit, NaN without enough contrast, length of the part (...), ideal px, and
    recorded px for an ideal one."""

    t: np.ndarray
    spatial: np.ndarray
    sigma: np.ndarray
    length: np.ndarray
    along: np.ndarray


def _edge_errors(pictures: Pictures, quantity: Quantity) -> _EdgeErrors:
    scene, along = pictures.scene, Along.of(pictures, trimmed=True)
    known, nodes = along.measurands, along.nodes
    e = known.view.names.index(place_of(quantity.features[0]))
    noise = np.broadcast_to(along.noise_variance, along.squared.shape)[..., e, :]
    squared = along.squared[..., e, :]
    pick = [np.broadcast_to(part, nodes.t.shape)[..., e, :] for part in (nodes.blur, nodes.across, nodes.along)]
    variance = kappa2(scene.locator.scale_px, pick[0]) * np.square(pick[1]) * noise / squared
    places = edge_points(scene.solid, known.view.names, nodes.spatial)[..., e, :, :]
    unit = 1 / known.seen.per_unit(quantity.features[0], places, normals(known.view)[..., e, :])
    length = nodes.length[..., e, 0]
    clear = squared >= CLEAREST**2 * noise
    lost = (clear.mean(-1) < LEAST_CLEAR) | ~(length >= MIN_USABLE) | ~known.view.visible[..., e]
    sigma = np.where(clear, np.sqrt(variance) * unit, np.nan)
    own = nodes.t[..., e, :], nodes.spatial[..., e, :]
    return _EdgeErrors(*own, sigma, np.where(lost, np.nan, length), pick[2].mean(-1))


def _of_edge(pictures: Pictures, quantity: Quantity) -> FormLaw | None:
    found, scale = _edge_errors(pictures, quantity), pictures.scene.locator.scale_px
    if not np.isfinite(found.length):
        return None
    at = np.linspace(-found.length / 2, found.length / 2, points_along(float(found.length), scale))
    clear = np.isfinite(found.sigma)
    at = at[np.interp(at, found.t, 1.0 * clear) >= LEAST_CLEAR]
    sigma = np.interp(at, found.t[clear], found.sigma[clear])
    apart = correlation((at[:, None] - at) * found.along, scale)
    design, where = np.stack([np.ones(at.size), at], -1), np.interp(at, found.t, found.spatial)
    return FormLaw.beside(sigma[:, None] * sigma * apart, design, reference_of(quantity), where)


def _glanced_edge(pictures: Pictures, quantity: Quantity) -> np.ndarray:
    found, scale = _edge_errors(pictures, quantity), pictures.scene.locator.scale_px
    clear = np.isfinite(found.sigma)
    count = found.length * found.along * clear.mean(-1) / (SPACING * scale) + 1
    return _worst(found.sigma, clear) * _tabulated(count, reference_of(quantity), False)


def _of_rim(pictures: Pictures, quantity: Quantity) -> FormLaw | None:
    """As `measure.features.rims` and `limbs` place their points."""
    name, scene = place_of(quantity.features[0]), pictures.scene
    each, scale = scene.solid.round(name), scene.locator.scale_px
    image = limb_rim(pictures, each) if isinstance(each, Curved) else rim(pictures, each)
    if _is_lost(image):
        return None
    count = _places(pictures, each, image)
    used, sigma = _rim_errors(pictures, image)
    at = np.arange(count) * image.arc.size / count
    nearest = np.rint(at).astype(int) % image.arc.size
    arc = image.arc[nearest] * (image.arc.size / count)
    where = np.cumsum(arc) - arc
    step = every(float(arc[used[nearest]].mean()), scale)
    pick = np.flatnonzero(used[nearest])[::step]
    apart = np.abs(where[pick, None] - where[pick])
    apart = np.minimum(apart, arc.sum() - apart) if image.turn == 1 else apart
    design = np.stack([_between(column, used, at[pick]) for column in image.design.T[:3]], -1)
    sigma = _between(sigma, used, at[pick])
    covariance = sigma[:, None] * sigma * correlation(apart, scale)
    around = each.angles(count)[pick] if isinstance(each, Circle) else 2 * np.pi * pick / count
    return FormLaw.beside(covariance, design / design[:, 2:3], reference_of(quantity), around)


def _between(values: np.ndarray, used: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (n,) around a rim, of which some are known, at fractions of its places (m,)."""
    return np.interp(at, np.flatnonzero(used), values[used], period=used.size)


def _places(pictures: Pictures, each: Circle | Curved, image: RimImage) -> int:
    """How many places are measured around a rim."""
    scale = pictures.scene.locator.scale_px
    if isinstance(each, Curved):
        return limb_places(limb_outline(each, pictures.sensors, pictures.scene.camera), scale)
    return image.arc.size if each.ends is not None else places_around(pictures, each, SPACING * scale, MOST_PLACES)


def _rim_errors(pictures: Pictures, image: RimImage) -> tuple[np.ndarray, np.ndarray]:
    """Which points of a rim are used, and their standard deviations along the radius, the scene's unit, (..., n)."""
    scene = pictures.scene
    used = (image.share >= HALF) & (image.squared >= CLEAREST**2 * image.noise_variance)
    variance = kappa2(scene.locator.scale_px, image.blur) * image.noise_variance / image.squared
    return used, np.sqrt(variance) / np.abs(image.design[..., 2])


def _is_lost(image: RimImage) -> np.ndarray:
    """Where too little of a rim is there, or too much of it without contrast, bool (...)."""
    taken = image.share >= HALF
    weak = taken & (image.squared >= MIN_CONTRAST**2 * image.noise_variance)
    used = taken & (image.squared >= CLEAREST**2 * image.noise_variance)
    few = image.turn * used.mean(-1) < LEAST_SEEN
    return (image.left < LEAST_SEEN) | few | (used.mean(-1) < LEAST_CLEAR * weak.mean(-1))


def _glanced_rim(pictures: Pictures, quantity: Quantity, image: RimImage) -> np.ndarray:
    used, sigma = _rim_errors(pictures, image)
    count = np.where(used, image.arc, 0.0).sum(-1) / (SPACING * pictures.scene.locator.scale_px)
    found = _worst(sigma, used) * _tabulated(count, reference_of(quantity), image.turn == 1)
    return np.where(_is_lost(image) | ~np.isfinite(found), np.inf, found)


def _worst(sigma: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Mean of the squares of standard deviations (..., n) of the used points, of which the largest count most."""
    power = np.where(used, sigma, 0.0) ** _WORST
    return (power.sum(-1) / used.sum(-1)) ** (2 / _WORST)


def _tabulated(count: np.ndarray, reference: Reference, closed: bool) -> np.ndarray:
    """Variance of the zone of so many points (...) of variance 1, `SPACING` apart; infinite where there are none."""
    known = np.array([_unit_variance(int(m), reference, closed) for m in _GRID[: _last(count)]])
    told = np.interp(np.log(np.maximum(np.nan_to_num(count), 1.0)), np.log(_GRID[: known.size]), known)
    return np.where(np.isfinite(count), told, np.inf)


def _last(count: np.ndarray) -> int:
    """How many of `_GRID` are needed."""
    largest = np.nanmax(np.where(np.isfinite(count), count, 0.0), initial=0.0)
    return min(int(np.searchsorted(_GRID, largest)) + 1, _GRID.size)


@lru_cache(maxsize=256)
def _unit_variance(count: int, reference: Reference, closed: bool) -> float:
    at = np.arange(count)
    apart = np.abs(at[:, None] - at)
    apart = np.minimum(apart, count - apart) if closed else apart
    turn = 2 * np.pi * at / count
    design = np.stack([np.ones(count), at], -1)
    if reference == "circle":
        design = np.stack([np.cos(turn), np.sin(turn), np.ones(count)], -1)
    return FormLaw.beside(correlation(SPACING * apart, 1.0), design, reference, turn).noise.u ** 2
