"""The adjustment of several pictures: from what is found in each to the part's features in space, and measurands.

Features of picture v are found off what is expected by y_v = h_v(x) + e_v: x the `Unknowns`, e_v noise of a known
covariance, h_v exact projection (`imaging.geometry.projection`). The most likely x, given what is known before, is
found by Gauss-Newton steps with the derivatives at the part and the sensors as they are expected: there whatever the
pictures cannot tell (where all of it is, its scale where no sensor's place is known) is told by nothing exactly, and
stays open.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from imaging.boards.seen import SeenBoard
from imaging.bundles import rows
from imaging.bundles.in_space import InSpace
from imaging.bundles.told import Told
from imaging.bundles.unknowns import Freedom, Unknowns, in_rad
from imaging.features.displaced import steps
from imaging.features.measurand import measurands
from imaging.features.placing import whitening
from imaging.features.seen import Seen
from imaging.pictures import Pictures
from imaging.placed import combined, difference, placed
from scenes import InvalidInput, Picture, Quantity, Wall
from scenes.measurands.form import forms_of
from scenes.measurands.kinds import MEASURANDS

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
    boards : tuple of SeenBoard or None
        The same of a board beside the part.
    moved : ndarray, shape (n,)
        What of the unknowns the expected pictures have already, beside what the scene says.
    before : ndarray, shape (n,)
        The same as it is expected before a picture is seen (`scenes.Placement.expected`).
    placement : ndarray, shape (6 + c,)
        Of what they have already, where the part lies and what is estimated of the first camera, as of
        `measure.Located`.
    """

    pictures: tuple[Picture, ...]
    freedom: Freedom
    unknowns: Unknowns
    seen: tuple[Seen, ...]
    boards: tuple[SeenBoard | None, ...]
    moved: np.ndarray
    before: np.ndarray
    placement: np.ndarray

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
        return cls._of(pictures, freedom)

    @classmethod
    def _of(cls, pictures: tuple[Picture, ...], freedom: Freedom) -> Bundle:
        each = tuple(Pictures.of(picture) for picture in pictures)
        known = [measurands(one) for one in each]
        seen, boards = tuple(one.seen for one in known), tuple(one.board for one in known)
        unknowns = Unknowns.of(pictures[0].scene, each, seen[0], freedom)
        mean = pictures[0].scene.placement.mean
        known = np.zeros(unknowns.count), _of_placement(unknowns, mean), np.zeros(mean.size)
        return cls(pictures, freedom, unknowns, seen, boards, *known)

    def moved_by(self, numbers: np.ndarray) -> Bundle:
        """The same with part, sensors and what is estimated of the camera expected elsewhere, by the unknowns (n,);
        lights go with the sensors."""
        moved, pictures = np.zeros(self.unknowns.count), []
        for k, picture in enumerate(self.pictures, 1):
            sensor = _in_degrees(self.unknowns.sensor(k) @ numbers)
            there = placed(picture, _in_degrees(self.unknowns.placement(k) @ numbers))
            pictures.append(placed(there, difference(np.zeros(6), sensor)))
        many = range(1, len(pictures) + 1)
        own = (*(f"sensor {k}" for k in many), *self.unknowns.all_estimated)
        for name in ("part", *own, *self.unknowns.carried):
            moved[self.unknowns.slices[name]] = numbers[self.unknowns.slices[name]]
        there = Bundle._of(tuple(pictures), self.freedom)
        return replace(there, moved=self.moved + moved, before=self.before, placement=self.placement_by(numbers))

    def placement_by(self, numbers: np.ndarray) -> np.ndarray:
        """Where the part lies and what is estimated of the first camera, (6 + c,), with unknowns (n,) beside those of
        the pictures; beside what the scene says."""
        return combined(self.placement, _in_degrees(self.unknowns.placement(1) @ numbers))

    def placed_at(self, placement: np.ndarray, by_sensor: Mapping[int, np.ndarray]) -> Bundle:
        """The same with the part, and what is estimated of the camera, at a placement (6 + c,) in all pictures, and the
        sensors of some numbers where its place in their pictures alone is another one."""
        full = {}
        for k, there in by_sensor.items():
            sensor = difference(np.zeros(6), difference(there[:6], placement[:6]))
            full[f"sensor {k}"] = in_rad(sensor)
        return self.moved_by(_of_placement(self.unknowns, placement) + self.unknowns.numbers(full))

    def reach(self, numbers: np.ndarray) -> float:
        """How far unknowns (n,) of the part and the sensors move what is seen of it at most, px."""
        points, found = self.at(np.zeros(len(numbers))).places(), [0.0]
        for k, seen in enumerate(self.seen, 1):
            turned = steps(points, np.array(seen.camera.look_at))
            full = self.unknowns.full("part", numbers) - self.unknowns.sensor(k) @ numbers
            found.append(float(np.linalg.norm(seen.slopes(points) @ (turned @ full)[..., None], axis=-2).max()))
        return max(found)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is measured."""
        return self.unknowns.scene.quantities

    @cached_property
    def designs(self) -> tuple[np.ndarray, ...]:
        """Derivatives (q, n) of each picture's lines and circles, and board, by the unknowns."""
        both = enumerate(zip(self.seen, self.boards, strict=True), 1)
        return tuple(rows.design(self.unknowns, seen, board, k) for k, (seen, board) in both)

    def adjusted(
        self,
        errors: Sequence[np.ndarray],
        counts: Sequence[np.ndarray] | None = None,
        doubts: Sequence[np.ndarray] | None = None,
    ) -> BundleAdjustment:
        """The adjustment of lines and circles whose noise has covariances (q, q), infinite on the diagonal of those
        that are not found; of those alone that count, bool (q,), where that is said.

        They are weighed by that and the covariances (q, q) of their biases' correction, ``doubts``.
        """
        whites, told = [], []
        for k, (design, covariance) in enumerate(zip(self.designs, errors, strict=True)):
            some = np.isfinite(np.diag(covariance)) & np.isfinite(design).all(1)
            some = some if counts is None else some & counts[k]
            told.append(np.where(some[:, None] & some, covariance, 0.0))
            beside = 0.0 if doubts is None else np.where(some[:, None] & some, doubts[k], 0.0)
            whites.append(whitening(told[-1] + beside))
        return BundleAdjustment(self, tuple(whites), tuple(told))

    def expected(self, numbers: np.ndarray) -> tuple[np.ndarray, ...]:
        """How far lines and circles, and a board, (q,) of each picture are off by unknowns (n,) beside those of the
        pictures."""
        both = enumerate(zip(self.seen, self.boards, strict=True), 1)
        return tuple(rows.off(self.unknowns, seen, board, k, numbers) for k, (seen, board) in both)

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
class BundleAdjustment:
    """What pictures whose noise is known tell of the unknowns.

    Attributes
    ----------
    bundle : Bundle
    whites : tuple of ndarray, shape (q, q)
        Combinations of each picture's lines and circles of variance 1, by noise and what is not sure of their biases;
        rows of zeros of those that do not count.
    errors : tuple of ndarray, shape (q, q)
        Their covariances by noise; 0 of those that do not count.
    """

    bundle: Bundle
    whites: tuple[np.ndarray, ...]
    errors: tuple[np.ndarray, ...]

    @cached_property
    def told(self) -> Told:
        """By all rows: those of the pictures, then what is known before."""
        whitened = [white @ _finite(design) for white, design in zip(self.whites, self.bundle.designs, strict=True)]
        return Told(np.concatenate([*whitened, self._priors[0]]), self.bundle.unknowns.units)

    @cached_property
    def is_told(self) -> np.ndarray:
        """Which values the rows tell, bool (M,)."""
        return self.told.is_told(self.bundle.nominal[1])

    @cached_property
    def by_features(self) -> tuple[np.ndarray, ...]:
        """Derivatives (M, q) of the values by the lines and circles of each picture; of what is not told without
        meaning."""
        ends = np.cumsum([0, *(len(white) for white in self.whites)])
        parts = [self._gain[:, i:j] for i, j in pairwise(ends)]
        return tuple(part @ white for part, white in zip(parts, self.whites, strict=True))

    @cached_property
    def by_priors(self) -> dict[str, np.ndarray]:
        """Derivatives (M, k) of the values by what is not sure before of each block, in units of its standard
        uncertainty, by its name."""
        first = sum(len(white) for white in self.whites)
        return {name: self._gain[:, first + part.start : first + part.stop] for name, part in self._priors[1]}

    @cached_property
    def covariance(self) -> np.ndarray:
        """Of the values by noise, (M, M); infinite on the diagonal of what is not told, NaN beside it."""
        parts = zip(self.by_features, self.errors, strict=True)
        return lost(sum(pull @ error @ pull.T for pull, error in parts), self.is_told)

    @property
    def known_before(self) -> dict[str, np.ndarray]:
        """Standard uncertainties (M,) of the values by what is not sure of each block before; infinite of what is not
        told."""
        told = self.by_priors.items()
        return {name: np.where(self.is_told, np.linalg.norm(pull, axis=1), np.inf) for name, pull in told}

    def solved(self, found: Sequence[np.ndarray]) -> tuple[np.ndarray, float]:
        """The unknowns (n,) beside those of the pictures, of lines and circles found (q,) off what is expected in each
        picture, and chi-square of the residuals."""
        numbers, priors = np.zeros(self.bundle.unknowns.count), self._priors[0]
        found = [np.where(white.any(0), np.nan_to_num(one), 0.0) for white, one in zip(self.whites, found, strict=True)]
        before = np.inf
        for _ in range(_STEPS):
            expected = self.bundle.expected(numbers)
            off = [w @ _finite(one - h) for w, one, h in zip(self.whites, found, expected, strict=True)]
            left = np.concatenate([*off, priors @ (self.bundle.before - self.bundle.moved - numbers)])
            step = self.told.inverse @ left
            size = float(np.abs(self.told.rows @ step).max(initial=0.0))
            if size < _SETTLED or size >= before:
                break
            numbers, before = numbers + step, size
        return numbers, float(left @ left)

    @cached_property
    def u_placement(self) -> np.ndarray:
        """Standard uncertainties (not variances) of the part's place, along its own axes, and of what is estimated of
        the first camera, (6 + c,): the scene's unit, degrees; infinite of what is left open."""
        rows = self.bundle.unknowns.placement(1)
        return _in_degrees(np.where(self.told.is_told(rows), np.linalg.norm(self.told.gain(rows), axis=1), np.inf))

    @cached_property
    def _gain(self) -> np.ndarray:
        return self.told.gain(self.bundle.nominal[1])

    @cached_property
    def _priors(self) -> tuple[np.ndarray, list[tuple[str, slice]]]:
        return self.bundle.unknowns.priors()


def _of_placement(unknowns: Unknowns, placement: np.ndarray) -> np.ndarray:
    """Unknowns (n,) of a part, and of what is estimated of all cameras, at a placement (6 + c,)."""
    cameras = dict.fromkeys(unknowns.all_estimated, placement[6:])
    return unknowns.numbers({"part": in_rad(placement[:6])} | cameras)


def lost(covariance: np.ndarray, is_told: np.ndarray) -> np.ndarray:
    """A covariance (M, M), infinite on the diagonal of what is not told, NaN beside it."""
    nothing = np.where(np.eye(len(is_told), dtype=bool), np.inf, np.nan)
    return np.where(is_told[:, None] & is_told, covariance, nothing)


def _finite(rows: np.ndarray) -> np.ndarray:
    """Rows of features that do not count are anything."""
    return np.where(np.isfinite(rows), rows, 0.0)


def _in_degrees(numbers: np.ndarray) -> np.ndarray:
    """A shift, a turn in rad, and other numbers."""
    return np.concatenate([numbers[:3], np.degrees(numbers[3:6]), numbers[6:]])


def _check(pictures: tuple[Picture, ...]) -> None:
    if not pictures:
        raise InvalidInput("pictures must be at least one, got none")
    first = pictures[0].scene
    for each in pictures[1:]:
        if each.scene.quantities != first.quantities or each.scene.object != first.object:
            raise InvalidInput("pictures must be of one part with the same measurands, got others")
        if each.scene.placement != first.placement:
            raise InvalidInput("pictures must be of one placement, as the scene says it, got others")
    for each in first.quantities:
        curved = any(isinstance(feature, Wall) for feature in each.basic)
        if curved or MEASURANDS[each.kind].extreme or forms_of((each,)):
            raise InvalidInput(
                f"measurands must be of straight edges and circles for several pictures, got {each.name}"
            )
