"""An edge's image from cells of sensors, and what errors of its points make of quantities, enclosed.

All follows from where the eye stands, w = d n - s p away from a place p on the edge, n the axis, d the camera's
distance and s its share of perspective, lengths from the point that is looked at. With D = d - s n.p, an edge's unit
direction a, its length l and the focal length f in px, its image is f l h / (D_0 D_1) long, h^2 = |a x w|^2 - (n.(a x
w))^2, and a step x moves its line by f x.(a x w) / (D h). The double area of the triangle between the images of a
corner and of two places l_1 a_1 and l_2 a_2 from it is f^2 l_1 l_2 w.(a_1 x a_2) / (D_0 D_1 D_2). All are linear in
n or nearly so, and tightly enclosed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.features.locator import (
    FEWEST,
    MIN_USABLE,
    PIXEL_VARIANCE,
    SPACING,
    STEP,
    cubic_slope,
    lacking,
    located_kappa2,
    reach,
)
from imaging.geometry.visibility import boundaries
from imaging.models.along import NODE_WEIGHTS, NODES
from imaging.models.calibrated import POINT_WEIGHTS, POINTS, SHORT
from planner.certifying.enclosed import HUGE, Enclosed, either
from planner.certifying.series import bernstein, dot, with_last, within
from planner.certifying.view import View
from scenes import Edge, Scene

_PLACES = np.concatenate([[-1.0], NODES, [1.0]])  # of nodes, in half used lengths from the middle
_INSIDE = np.concatenate([[0.0], NODE_WEIGHTS, [0.0]])
UNEVEN = 2.5  # how much r^6 may change along an edge for its middle and its ends to be weighed at a glance
_ENDS = np.array([1.0] + [0.0] * len(NODE_WEIGHTS) + [1.0])
_COARSE = 1 + 2 / (FEWEST - 1) ** 2  # the fewest points' sum of t^2 over the integral of t^2
_LACKING = lacking(SPACING**2)[0]  # the most at an end


@dataclass(frozen=True, eq=False)
class Line:
    """An edge's image, and the part of it that is used, as `imaging.models.along.place_nodes` places its nodes.

    Attributes
    ----------
    view : View
    edge : Edge
    height, length : Enclosed, shape (n,)
        h, scene units, and the length of the image, px.
    divisors : tuple of Enclosed
        At both ends.
    clear : float
        What is left out at an end at least, px.
    is_short, is_long : ndarray of bool, shape (n,)
        Whether no more than that can be, and whether less cannot.
    wanted : pair of float
        The least and the greatest length, px, that is used by the poses that count.
    """

    view: View
    edge: Edge
    height: Enclosed
    length: Enclosed
    divisors: tuple[Enclosed, Enclosed]
    clear: float
    is_short: np.ndarray
    is_long: np.ndarray
    wanted: tuple[float, float] = (MIN_USABLE, HUGE)

    @classmethod
    def of(cls, view: View, edge: Edge, wanted: tuple[float, float] = (MIN_USABLE, HUGE)) -> Line:
        solid, camera = view.scene.solid, view.scene.camera
        ends = solid.vertices[list(edge.ends)]
        divisors = tuple(map(view.divisor, ends))
        size = camera.focal_px * float(np.linalg.norm(ends[1] - ends[0]))
        height, over = view.height(*ends), divisors[0] * divisors[1]
        clear = reach(view.scene.locator.scale_px, camera.most_blur_px)
        least = MIN_USABLE + 2 * clear  # px, of an edge of which anything is left
        length = height * size / over
        made = height.kept(least / size * over.low), length.kept(least)
        return cls(view, edge, *made, divisors, clear, length.high < least, length.low >= least, wanted)

    @cached_property
    def _trims(self) -> tuple[Enclosed, Enclosed]:
        """Shares of the length that are left out at both ends, as `projected_edges` does."""
        solid, found = self.view.scene.solid, []
        for end, here in enumerate(self.edge.ends):
            trim = self.length.inverse() * self.clear
            for other in solid.meeting[here]:
                if other is not self.edge and boundaries(solid, (other,), self.view.seen)[0]:
                    trim = trim.larger(self._beside(other, end, self.clear))
            found.append(self._framed(trim, end))
        return found[0], found[1]

    @cached_property
    def trims(self) -> tuple[Enclosed, Enclosed]:
        """The same of poses that can measure."""
        least = 1 - self.wanted[0] / self.length.high
        one, other = self._trims
        return one.kept(0.0, least - other.low), other.kept(0.0, least - one.low)

    def _framed(self, trim: Enclosed, end: int) -> Enclosed:
        """With what of an end lies outside the image or too near to its border (`projected_edges.within_image`)."""
        scene = self.view.scene
        margin = scene.locator.window_px + 4 * scene.locator.scale_px + 1
        here, there = (self.view.image(scene.solid.vertices[self.edge.ends[k]]) for k in (end, 1 - end))
        for size, own, other in zip((scene.camera.width, scene.camera.height), here, there, strict=True):
            for side in (-1.0, 1.0):
                beyond = own * side - ((size - 1) / 2 - margin)
                if (beyond.high > 0).any():
                    inward = (own - other) * side
                    trim = trim.larger(beyond.at_least(0.0) * inward.at_least(0.0).inverse())
        return trim

    def _beside(self, other: Edge, end: int, clear: float) -> Enclosed:
        """`imaging.features.projected_edges.trim_beside` over the length, beside a neighbour."""
        solid, camera, here = self.view.scene.solid, self.view.scene.camera, self.edge.ends[end]
        corner, far, next_ = (solid.vertices[k] for k in (here, self.edge.ends[1 - end],
                                                          other.ends[1 - other.ends.index(here)]))  # fmt: skip
        ways = [(place - corner) / np.linalg.norm(place - corner) for place in (far, next_)]
        near, there, aside = (self.view.divisor(place) for place in (corner, far, next_))
        over = self.view.over(corner, *ways, (self.edge, other)).absolute()
        size = self.view.height(corner, next_) * float(camera.focal_px * np.linalg.norm(next_ - corner))
        size = size / (near * aside)
        beside = self.view.height(corner, next_) * there * (clear / camera.focal_px / np.linalg.norm(far - corner))
        beside = beside / over
        apart = over * float(camera.focal_px * np.linalg.norm(next_ - corner)) / (self.height * aside)
        ahead = self._ahead(corner, far, next_)
        order = size * apart - ahead * clear  # not negative where the neighbour is nearest beside it
        past = (ahead + (-(apart.square()) + clear**2).sqrt()) / self.length
        found = either(order.low >= 0, order.high >= 0, beside, past, of_middle=order.middle >= 0)
        none = self.length.inverse() * clear
        found = either(ahead.low > 0, ahead.high > 0, found, none, of_middle=ahead.middle > 0)
        return found.known(clear / self.length.high, (size.high + clear) / self.length.low)

    def _ahead(self, corner: np.ndarray, far: np.ndarray, other: np.ndarray) -> Enclosed:
        """How far a neighbour's other end lies along the edge's image from their corner, px."""
        one, two = (self._shift(corner, place) for place in (far, other))
        return dot(one, two) / self.length

    def _shift(self, corner: np.ndarray, place: np.ndarray) -> list[Enclosed]:
        """From the image of a corner to that of another place, px, a vector across the axis."""
        view, way = self.view, place - corner
        away = corner - np.array(view.scene.camera.look_at)
        near, scale = view.divisor(corner), view.divisor(place).inverse() * view.scene.camera.focal_px
        lean = view.along(way) * view.scene.camera.perspective / near
        shift = [lean * float(own) + float(step) for own, step in zip(away, way, strict=True)]
        ahead = dot(shift, self.view.axis)
        return [(part - ahead * axis) * scale for part, axis in zip(shift, self.view.axis, strict=True)]

    @cached_property
    def share(self) -> Enclosed:
        """Of the length that is used."""
        least, most = self.wanted
        left = -(self.trims[0] + self.trims[1]) + 1.0
        return left.kept(least / self.length.high, np.minimum(most / self.length.low, 1.0))

    @property
    def lost(self) -> np.ndarray:
        """Where too little is left from all of a cell, bool (n,)."""
        left = -(self._trims[0] + self._trims[1]) + 1.0
        return self.is_short | ((left * self.length).high < MIN_USABLE)

    @property
    def sure(self) -> np.ndarray:
        """Where enough is left from all of a cell, bool (n,)."""
        left = -(self._trims[0] + self._trims[1]) + 1.0
        return self.is_long & (left.low * self.length.low >= MIN_USABLE)

    @cached_property
    def used(self) -> Enclosed:
        """Length that is used, px."""
        return (self.length * self.share).kept(*self.wanted)

    @property
    def is_wanted_long(self) -> bool:
        """Whether what is used by the poses that count is longer than `SHORT` scales, or shorter."""
        return self.wanted[0] >= SHORT * self.view.scene.locator.scale_px

    @cached_property
    def spatial(self) -> Enclosed:
        """Shares of the edge's length in space at which the nodes of a long part lie, the points of a short one,
        (n, j)."""
        places = _PLACES if self.is_wanted_long else POINTS
        middle = (self.trims[0] - self.trims[1] + 1.0) * 0.5
        at = within(middle.wide() + self.share.wide() * (places / 2))
        near, far = (each.wide() for each in self.divisors)
        return within(at * near / (far + at * (near - far)))

    @cached_property
    def kappa2(self) -> Enclosed | float:
        """Variance of an edge point at unit contrast and noise, `imaging.features.locator.located_kappa2`."""
        return _kappa2(self.view.scene, self.divisors, self.spatial)

    @cached_property
    def basis(self) -> Enclosed:
        """Bernstein's polynomials there, (n, j, DEGREE + 1)."""
        return bernstein(self.spatial)

    @cached_property
    def _spacing(self) -> Enclosed:
        """Of edge points, in lengths that are used (`imaging.features.locator.spacing`)."""
        steps = self.used * (1 / (SPACING * self.view.scene.locator.scale_px)) + 0.5
        return steps.at_least(FEWEST - 1.0).inverse()

    def factors(self, start: Enclosed, stop: Enclosed) -> tuple[Enclosed, np.ndarray, np.ndarray]:
        """As of `Terms`, (n, DEGREE + 3), its norms and what it spares, (n, 2) each, from derivatives over h by the
        displacement of both ends."""
        scale = self.view.scene.locator.scale_px
        skew = self.trims[1] - self.trims[0]
        lever = (stop * (skew + 1.0) - start * (-skew + 1.0)) * 0.5  # times the share that is used
        tilt = lever / self.share / (self._spacing.square() * 2.0 + 1.0)
        if self.is_wanted_long:
            found, spare = self._long((start + stop).wide() + tilt.wide() * (6 * _PLACES), tilt, scale)
            return found, self._least(start + stop, lever, scale), spare
        found, spare = self._short((start + stop).wide() + tilt.wide() * (6 * POINTS), scale)
        return found, self._norms(start + stop, lever, scale), spare

    def _least(self, offset: Enclosed, lever: Enclosed, scale: float) -> np.ndarray:
        """Of a long part, as of A d + B theta by points of equal noise, the least of what r^6 is multiplied with, where
        that is at the ends no more than `UNEVEN` times as large as at any place; and nothing taken away, (n, 2)."""
        spans = scale / np.stack([self.used.low, self.used.high])
        even = (2 * np.sqrt(np.pi) * spans - 2 * _LACKING * UNEVEN * spans**2).min(0)
        odd = (2 / 3 * np.sqrt(np.pi) * spans - 2 * _LACKING * UNEVEN * spans**2).min(0) / _COARSE
        kappa = self.kappa2.low.min(1) if isinstance(self.kappa2, Enclosed) else self.kappa2
        tilt = (lever / self.share).square().low
        found = (
            self.height.low**2 * kappa * (offset.square().low * np.maximum(even, 0) + 36 * tilt * np.maximum(odd, 0))
        )
        return np.stack([np.sqrt(found), np.zeros_like(found)], -1)

    def _norms(self, offset: Enclosed, lever: Enclosed, scale: float) -> np.ndarray:
        """Norms of A + 6 lambda x by exp(-(L (x - x') / 4 s)^2), whose means of 1 and of x x' / L^2 fall with L."""
        even, odd = _means(self.used.high / scale)
        flat = _means(self.used.low / scale)[0]
        height, kappa, lever = self.height, self.kappa2, lever * (1 / _COARSE)
        least, most = (kappa.low.min(1), kappa.high.max(1)) if isinstance(kappa, Enclosed) else (kappa, kappa)
        tilt = (lever * self.length).square().low * odd / scale**2
        norm = height.low * np.sqrt(least * (offset.square().low * even + 36 * tilt))
        sizes = [np.maximum(np.abs(part.low), np.abs(part.high)) for part in (offset, lever)]
        near, far = self.divisors
        bent = np.maximum(near.high, far.high) / np.minimum(near.low, far.low)  # a step in space over that in the image
        wide = height.high * np.sqrt(most * flat) * (sizes[0] * self.share.high + 6 * sizes[1])
        return np.stack([norm, wide * bent / 2], -1)

    def _long(self, weight: Enclosed, lever: Enclosed, scale: float) -> tuple[Enclosed, np.ndarray]:
        size, ends = self.view.scene.camera.focal_px, self.view.scene.solid.vertices[list(self.edge.ends)]
        size *= float(np.linalg.norm(ends[1] - ends[0]))
        over = self.divisors[0] * self.divisors[1] / (self.share * size)  # h / used
        share = (over * self.height).wide() * (np.sqrt(np.pi) * scale * _INSIDE)
        end, tilt = lacking((self._spacing * self.used / scale).square())
        less = (over.square() * end).wide() * (-(scale**2) * _ENDS)
        tilted = (lever / self.used).square() * over.square() * tilt * (72 * scale**4)
        coarse = (lever * self._spacing).square() * over * self.height * (24 * np.sqrt(np.pi) * scale)
        factor = weight.square() * (share + less) + (tilted + coarse).wide() * _INSIDE
        each = factor * self.kappa2
        values = each.wide() * self.basis
        spare = np.stack([np.zeros(len(each.high)), np.maximum(each.high, 0.0).sum(-1)], -1)
        return with_last(with_last(values.sum(-2), None), (weight.square() * less * self.kappa2).sum()), spare

    def _short(self, weight: Enclosed, scale: float) -> tuple[Enclosed, np.ndarray]:
        """The sum over points by r^3 r'^3 = (r^6 + r'^6) / 2 - (r^3 - r'^3)^2 / 2."""
        kappa = self.kappa2.sqrt() if isinstance(self.kappa2, Enclosed) else np.sqrt(self.kappa2)
        part = weight * (POINT_WEIGHTS / 2) * self.height.wide() * kappa
        apart = (self.used.square()[..., None, None]) * ((POINTS[:, None] - POINTS) / (4 * scale)) ** 2
        kernel = (-apart).of(np.exp, np.exp, rising=True)
        pairs = part[..., :, None] * part[..., None, :] * kernel
        crowd = pairs.sum()
        values = with_last((crowd.wide() * self.basis).sum(-2), pairs.absolute().sum().sum() * -0.5)
        spare = [np.maximum(-pairs.low, 0.0).sum((-1, -2)) / 2, np.maximum(crowd.high, 0.0).sum(-1)]
        return with_last(values, -((-crowd).at_least(0.0).sum())), np.stack(spare, -1)


def _kappa2(scene: Scene, divisors: tuple[Enclosed, Enclosed], spatial: Enclosed) -> Enclosed | float:
    camera, scale = scene.camera, scene.locator.scale_px
    steady = camera.blur_px**2 + PIXEL_VARIANCE
    if camera.aperture_radius == 0:
        return float(located_kappa2(scale, camera.blur_px))
    focus, share = camera.lens.focus or camera.distance, camera.perspective
    near, far = (over.wide() for over in divisors)
    over = near + spatial * (far - near)
    depth = (over - (1 - share) * camera.distance) / share
    radius = (-depth + focus) / over * (camera.aperture_radius * camera.focal_px / float(camera.divisor(focus)))
    ratio = (radius.square() * 0.25 + steady) / scale**2 + 1.0
    step = STEP**2 / (2 * scale**2)

    def variance(x):
        return 3 / 8 * x**3 / cubic_slope(scale**2 * x) ** 2

    def derivative(x):
        steeper = 4 * step / (3 * x**2) * (np.exp(-step / x) - np.exp(-4 * step / x))
        return variance(x) * (3 / x - 2 * steeper / cubic_slope(scale**2 * x))

    return ratio.of(variance, derivative, rising=True)


def _means(lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of the correlation and of x x' times it over the squared length, x and x' along edges so many scales long,
    each (n,); both fall with the length."""
    kernel = np.exp(-((lengths[:, None, None] * (POINTS[:, None] - POINTS) / 4) ** 2)) / 4
    flat = np.einsum("i,nij,j->n", POINT_WEIGHTS, kernel, POINT_WEIGHTS)
    tilted = np.einsum("i,nij,j->n", POINT_WEIGHTS * POINTS, kernel, POINT_WEIGHTS * POINTS)
    return flat, tilted / lengths**2
