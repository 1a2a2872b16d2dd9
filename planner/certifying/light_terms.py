"""What lights of a cell make of the variance, edge by edge: r^6 / K^2, and r^3 (K_1 + K_2) / 2 K^2 of shot noise.

r is the light's distance from a place on the edge, K_1 and K_2 the strengths of both sides, K their difference
(`imaging.light.edge_sides.side_strengths`). As polynomials of the place in Bernstein's basis; r^3, which is none, by
what is never more: x^3/2 = 1 + 3/2 z + 3/8 z^2 - 1/16 z^3 + R, x = 1 + z, where R = 3/128 z^4 y^-5/2 of a y between 1
and x.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import comb

import numpy as np

from imaging.light.edge_sides import whites
from imaging.pictures import Pictures
from imaging.sensor import headroom
from planner.certifying.enclosed import HUGE, Enclosed, variables
from planner.certifying.series import DEGREE, direction, dot, stacked, with_last
from scenes import Scene

SIDES = ((True, False), (False, True), (True, True))  # which of an edge's faces are seen


@dataclass(frozen=True, eq=False)
class LightTerms:
    """Makes them of a scene's lights, one free light a scene.

    Attributes
    ----------
    scene : Scene
    names : tuple of str
        The edges.
    """

    scene: Scene
    names: tuple[str, ...]

    @cached_property
    def power(self) -> float:
        """Irradiance times squared distance, over the camera's exposure."""
        return Pictures.of(self.scene, np.zeros(2), np.zeros(2)).emitters[0].power

    def of(self, polar: np.ndarray, azimuth: np.ndarray) -> tuple[Enclosed, np.ndarray, np.ndarray]:
        """Of cells (n, 2), (n, 2), rad: (n, E, `SIDES`, `DEGREE` + 3); by which share the square root of what it stands
        for changes along each edge at most, (n, E); and whether levels may be cut off at the end of the scale, bool
        (n,)."""
        axis = direction(*variables(polar, azimuth))
        hot, each, uneven = np.zeros(len(polar), bool), [], []
        for name in self.names:
            squares = self._squares(axis, name)
            sides = [self._strength(axis, face) for face in self.scene.solid.edge(name).faces]
            least = np.maximum(self._least(axis, name), np.minimum.reduce([part.low for part in squares]))
            most = np.maximum(*(side.high for side in sides))
            hot |= most > headroom(self.scene.noise) * np.maximum(least, 0.0) ** 1.5
            steps = [np.maximum(np.abs((b - a).low), np.abs((b - a).high)) for a, b in pairwise(squares)]
            uneven.append(3 * np.maximum(*steps) / np.maximum(least, 1e-300))
            each.append(stacked([self._of_side(squares, sides, seen) for seen in SIDES]))
        return stacked(each), np.stack(uneven, 1), hot

    def _of_side(self, squares: list[Enclosed], sides: list[Enclosed], seen: tuple[bool, bool]) -> Enclosed:
        """Noise over squared contrast along an edge, where some of its faces are seen."""
        one, other = (side * float(shown) for side, shown in zip(sides, seen, strict=True))
        contrast, noise = (one - other).square().inverse(), self.scene.noise
        found = sixth_power(squares) * contrast.wide() * noise.variance
        if noise.gain > 0:
            found = found + third_power(squares) * ((one + other) * contrast).wide() * (noise.shot_gain / 2)
        return found

    def _squares(self, axis: list[Enclosed], name: str) -> list[Enclosed]:
        """Bernstein's coefficients of r^2 along an edge, degree 2."""
        one, other = self._away(name)
        far = self.scene.lights[0].distance
        return [
            dot(axis, -far * (a + b)) + float(far**2 + a @ b) for a, b in ((one, one), (one, other), (other, other))
        ]

    def _least(self, axis: list[Enclosed], name: str) -> np.ndarray:
        """What r^2 is nowhere less than, by the furthest end alone."""
        far, most = self.scene.lights[0].distance, max(float(np.linalg.norm(end)) for end in self._away(name))
        return np.full(len(axis[0].middle), max(far - most, 0.0) ** 2)

    def _away(self, name: str) -> np.ndarray:
        """Both ends of an edge from the point around which the light stands, (2, 3)."""
        places = self.scene.solid.vertices[list(self.scene.solid.edge(name).ends)]
        return places - np.array(self.scene.camera.look_at)

    def _strength(self, axis: list[Enclosed], face: int) -> Enclosed:
        """Signal times r^3 on a face that is seen."""
        solid = self.scene.solid
        level = float(solid.normals[face] @ np.array(self.scene.camera.look_at) - solid.offsets[face])
        height = dot(axis, self.scene.lights[0].distance * solid.normals[face]) + level
        return height.at_least(0.0) * float(whites(self.scene)[face] * self.power)


def sixth_power(squares: list[Enclosed]) -> Enclosed:
    """r^6 from the coefficients of r^2, (n, `DEGREE` + 3): in Bernstein's basis, then as `Terms` has it."""
    low, high = _range(squares)
    whole = stacked(product(product(squares, squares), squares))
    return with_last(with_last(whole, _constant(whole, (high**1.5 - low**1.5) ** 2)), None)


def third_power(squares: list[Enclosed]) -> Enclosed:
    """r^3, or what it is never less than, alike."""
    low, high = _range(squares)
    about = squares[1].middle
    lean = [part * (1 / about) - 1.0 for part in squares]
    second = product(lean, lean)
    terms = zip(raised(lean), raised(second), product(second, lean), strict=True)
    root = stacked([(z * 1.5 + zz * 0.375 - zzz * 0.0625 + 1.0) * about**1.5 for z, zz, zzz in terms])
    with np.errstate(divide="ignore"):
        furthest = np.maximum(high / about - 1, 1 - low / about)
        rest = 3 / 128 * furthest**4 * np.minimum(low / about, 1.0) ** -2.5 * about**1.5
    root = with_last(root, _constant(root, (high**0.75 - low**0.75) ** 2))
    return with_last(root, _constant(root, rest))


def _range(squares: list[Enclosed]) -> tuple[np.ndarray, np.ndarray]:
    """The least and the greatest r^2, each (n,)."""
    low = np.minimum.reduce([part.low for part in squares])
    return np.maximum(low, 0.0), np.maximum.reduce([part.high for part in squares])


def product(one: list[Enclosed], other: list[Enclosed]) -> list[Enclosed]:
    """Of two polynomials in Bernstein's basis."""
    n, m = len(one) - 1, len(other) - 1
    found = []
    for k in range(n + m + 1):
        pairs = ((i, k - i) for i in range(max(0, k - m), min(n, k) + 1))
        parts = [one[i] * other[j] * (comb(n, i) * comb(m, j) / comb(n + m, k)) for i, j in pairs]
        found.append(sum(parts[1:], start=parts[0]))
    return found


def raised(one: list[Enclosed], degree: int = DEGREE) -> list[Enclosed]:
    """The same polynomial by coefficients of a higher degree."""
    n, m = len(one) - 1, degree - len(one) + 1
    found = []
    for k in range(degree + 1):
        parts = [one[i] * (comb(n, i) * comb(m, k - i) / comb(degree, k)) for i in range(max(0, k - m), min(n, k) + 1)]
        found.append(sum(parts[1:], start=parts[0]))
    return found


def _constant(like: Enclosed, values: np.ndarray) -> Enclosed:
    """A number of each cell, whatever the pose."""
    none = like[..., 0] * 0.0
    values = np.minimum(values, HUGE)
    return Enclosed(like.half, values, values, values, none.slope, none.spread)
