"""The adjustment of several pictures: from what is found in each to the part's features in space, and measurands.

Features of picture v are found off what is expected by y_v = h_v(x) + e_v: x the `Unknowns`, e_v noise of a known
covariance, h_v exact projection (`imaging.geometry.projection`). The most likely x, given what is known before, is found
by Gauss-Newton steps with the derivatives at the part and the sensors as they are expected: there whatever the pictures
cannot tell (where all of it is, its scale where no sensor's place is known) is told by nothing exactly, and stays open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.bundles.in_space import InSpace
from imaging.bundles.told import Told
from imaging.bundles.unknowns import Freedom, Unknowns, rim, rim_moves
from imaging.features.measurand import measurands
from imaging.features.placing import around, by_place, of_circle, rim_fit, rim_normals, whitening
from imaging.features.seen import Seen
from imaging.geometry.projection import from_axis
from imaging.pictures import Pictures
from imaging.placed import turn
from scenes import InvalidInput, Picture, Quantity

_STEPS = 20
_SETTLED = 1e-9  # of a standard deviation of the noise, in any row


@dataclass(frozen=True, eq=False)
class Bundle:
    """V pictures of one part.

    Attributes
    ----------
    pictures : tuple of Picture
        As they are expected.
    freedom : Freedom
    unknowns : Unknowns
    seen : tuple of Seen
        What each is expected to show.
    moved : ndarray, shape (n,)
        What of the unknowns the expected pictures have already, beside what the scene says.
    """

    pictures: tuple[Picture, ...]
    freedom: Freedom
    unknowns: Unknowns
    seen: tuple[Seen, ...]
    moved: np.ndarray

    @classmethod
    def of(cls, pictures: Sequence[Picture], freedom: Freedom) -> Bundle:
        """Of pictures of one part with the same measurands.

        Raises
        ------
        InvalidInput
            If they are not, or what is measured is not of straight edges and circles.
        """
        pictures = tuple(pictures)
        _check(pictures)
        each = tuple(Pictures.of(picture) for picture in pictures)
        seen = tuple(measurands(one).seen for one in each)
        unknowns = Unknowns.of(pictures[0].scene, each, seen[0], freedom)
        return cls(pictures, freedom, unknowns, seen, np.zeros(unknowns.count))

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is measured."""
        return self.unknowns.scene.quantities

    @cached_property
    def designs(self) -> tuple[np.ndarray, ...]:
        """Derivatives (q, n) of each picture's lines and circles by the unknowns."""
        return tuple(_design(self.unknowns, seen, k) for k, seen in enumerate(self.seen, 1))

    def adjusted(self, errors: Sequence[np.ndarray]) -> Adjustment:
        """The adjustment of lines and circles of covariances (q, q), infinite on the diagonal of those that do not
        count."""
        whites = []
        for design, covariance in zip(self.designs, errors, strict=True):
            told = np.isfinite(np.diag(covariance)) & np.isfinite(design).all(1)
            whites.append(whitening(np.where(told[:, None] & told, covariance, 0.0)))
        return Adjustment(self, tuple(whites))

    def expected(self, numbers: np.ndarray) -> tuple[np.ndarray, ...]:
        """How far lines and circles (q,) of each picture are off by unknowns (n,) beside those of the pictures."""
        return tuple(_off(self.unknowns, seen, k, numbers) for k, seen in enumerate(self.seen, 1))

    def at(self, numbers: np.ndarray) -> InSpace:
        """The features with unknowns (n,) beside what the scene says."""
        return InSpace(self.unknowns, numbers, self.seen[0].viewpoint)

    @cached_property
    def nominal(self) -> tuple[np.ndarray, np.ndarray]:
        """Values (M,) of the part as the scene says it, and their derivatives (M, n) by the unknowns."""
        return self.at(np.zeros(self.unknowns.count)).evaluated(self.quantities)

    def values(self, numbers: np.ndarray) -> np.ndarray:
        """Values (M,) with unknowns (n,) beside what the scene says."""
        return self.at(numbers).aligned().evaluated(self.quantities)[0]


@dataclass(frozen=True, eq=False)
class Adjustment:
    """What pictures whose noise is known tell of the unknowns.

    Attributes
    ----------
    bundle : Bundle
    whites : tuple of ndarray, shape (q, q)
        Combinations of each picture's lines and circles of variance 1; rows of zeros of those that do not count.
    """

    bundle: Bundle
    whites: tuple[np.ndarray, ...]

    @cached_property
    def told(self) -> Told:
        """By all rows: those of the pictures, then what is known before."""
        rows = [white @ _finite(design) for white, design in zip(self.whites, self.bundle.designs, strict=True)]
        return Told(np.concatenate([*rows, self._priors[0]]), self.bundle.unknowns.units)

    @property
    def observations(self) -> slice:
        """The pictures' rows."""
        return slice(0, sum(len(white) for white in self.whites))

    @cached_property
    def is_told(self) -> np.ndarray:
        """Which values the rows tell, bool (M,)."""
        return self.told.is_told(self.bundle.nominal[1])

    @cached_property
    def covariance(self) -> np.ndarray:
        """Of the values by noise, (M, M); infinite on the diagonal of what is not told, NaN beside it."""
        return self._spread(self.observations)

    @cached_property
    def known_before(self) -> dict[str, np.ndarray]:
        """Covariance (M, M) of the values by what is not sure of each block before, by its name."""
        first = self.observations.stop
        return {name: self._spread(slice(first + part.start, first + part.stop)) for name, part in self._priors[1]}

    @property
    def placed(self) -> np.ndarray:
        """The same by all of them."""
        return sum(self.known_before.values(), np.zeros(self.covariance.shape))

    def solved(self, found: Sequence[np.ndarray]) -> tuple[np.ndarray, float]:
        """The unknowns (n,) beside those of the pictures, of lines and circles found (q,) off what is expected in each
        picture, and chi-square of the residuals."""
        numbers, priors = np.zeros(self.bundle.unknowns.count), self._priors[0]
        found = [np.where(white.any(0), np.nan_to_num(one), 0.0) for white, one in zip(self.whites, found, strict=True)]
        before = np.inf
        for _ in range(_STEPS):
            expected = self.bundle.expected(numbers)
            rows = [w @ _finite(one - h) for w, one, h in zip(self.whites, found, expected, strict=True)]
            left = np.concatenate([*rows, -priors @ (numbers + self.bundle.moved)])
            step = self.told.inverse @ left
            size = float(np.abs(self.told.rows @ step).max(initial=0.0))
            if size < _SETTLED or size >= before:
                break
            numbers, before = numbers + step, size
        return numbers, float(left @ left)

    def _spread(self, rows: slice) -> np.ndarray:
        gain = self.told.gain(self.bundle.nominal[1])[:, rows]
        lost = ~self.is_told
        nothing = np.where(np.eye(len(gain), dtype=bool), np.inf, np.nan)
        return np.where(lost[:, None] | lost, nothing, gain @ gain.T)

    @cached_property
    def _priors(self) -> tuple[np.ndarray, list[tuple[str, slice]]]:
        return self.bundle.unknowns.priors()


def _finite(rows: np.ndarray) -> np.ndarray:
    """Rows of features that do not count are anything."""
    return np.where(np.isfinite(rows), rows, 0.0)


def _design(unknowns: Unknowns, seen: Seen, number: int) -> np.ndarray:
    """Derivatives (q, n) of lines and circles of the picture of a number by the unknowns."""
    solid, lengths = seen.solid, np.linalg.norm(seen.along, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = by_place(seen, np.array(unknowns.scene.camera.look_at)) @ unknowns.basis("part")
        whole = whole - by_place(seen) @ unknowns.basis(f"sensor {number}")
        for e, name in enumerate(seen.names):
            ends = list(solid.edge(name).ends)
            slopes = np.einsum("i,nij->nj", seen.normals[e], seen.slopes(solid.vertices[ends]))
            first, last = (slope @ unknowns.basis(unknowns.vertex(end)) for slope, end in zip(slopes, ends, strict=True))
            whole[2 * e] += first
            whole[2 * e + 1] += (last - first) / lengths[e]
        for c, name in enumerate(seen.circles):
            circle = solid.circle(name)
            whole[seen.numbers(c)] += of_circle(seen, circle, rim_moves(circle)) @ unknowns.basis(name)
    return whole


def _off(unknowns: Unknowns, seen: Seen, number: int, numbers: np.ndarray) -> np.ndarray:
    """How far lines and circles (q,) are off in the picture of a number, by exact projection."""
    solid, off = seen.solid, np.zeros(seen.count)
    ends = np.array([_ends(unknowns, name, numbers) for name in seen.names]).reshape(-1, 2, 3)
    image = _projected(unknowns, seen, number, numbers, ends.reshape(-1, 3)).reshape(-1, 2, 2)
    off[: 2 * len(ends)] = seen.line_errors(image[:, 0], image[:, 1] - image[:, 0])
    for c, name in enumerate(seen.circles):
        circle = solid.circle(name)
        there = _projected(unknowns, seen, number, numbers, rim(circle, unknowns.full(name, numbers)))
        here = from_axis(circle.at(around(circle)), seen.sensors, seen.camera)
        normal = rim_normals(seen, circle)
        off[seen.numbers(c)] = rim_fit(seen, circle)[1] @ np.einsum("ni,ni->n", normal, there - here)
    return off


def _ends(unknowns: Unknowns, name: str, numbers: np.ndarray) -> np.ndarray:
    solid = unknowns.scene.solid
    ends = solid.edge(name).ends
    return np.array([solid.vertices[end] + unknowns.full(unknowns.vertex(end), numbers) for end in ends])


def _projected(
    unknowns: Unknowns, seen: Seen, number: int, numbers: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Image points (n, 2) of places (n, 3) on the part that is moved, before the sensor that is."""
    part, sensor = unknowns.full("part", numbers), unknowns.full(f"sensor {number}", numbers)
    pivot, own = np.array(unknowns.scene.camera.look_at), np.array(seen.camera.look_at)
    there = (points - pivot) @ turn(np.degrees(part[3:])).T + pivot + part[:3]
    before = (there - own - sensor[:3]) @ turn(np.degrees(sensor[3:])) + own
    return from_axis(before, seen.sensors, seen.camera)


def _check(pictures: tuple[Picture, ...]) -> None:
    if not pictures:
        raise InvalidInput("pictures must be at least one, got none")
    first = pictures[0].scene
    for each in pictures[1:]:
        if each.scene.quantities != first.quantities or each.scene.object != first.object:
            raise InvalidInput("pictures must be of one part with the same measurands, got others")
    if first.placement.board is not None:
        raise InvalidInput("placement.from must be known, uncertain or datums for several pictures, got 'board'")

