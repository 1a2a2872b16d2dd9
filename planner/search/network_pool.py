"""Pictures of a grid of poses as candidates of a network: glanced at, and those that are chosen looked at closely."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.bundles.bundle import Bundle
from imaging.bundles.unknowns import Freedom
from imaging.features.placing import whitening
from imaging.features.seen import Seen
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.bundles import states_of
from planner.ranks import feature_ranks
from planner.search.candidates import SettingUp
from planner.search.grid import Grid, as_poses
from planner.search.networks import Network, of_one, of_shared, scale_of
from planner.search.objective import Report, SearchProblem
from planner.search.sets import better
from scenes import Picture, status

_ENOUGH = 5  # settings: what is clutter in all of them that show it is taken to be so elsewhere, until it is looked at
_OK = status.WORST_FIRST.index(status.OK)


@dataclass(frozen=True, eq=False)
class Glance:
    """What lines and circles tell in pictures from one sensor with each of L lights, by fast evaluation.

    Attributes
    ----------
    bundle : Bundle
        Of one of the pictures.
    covariance : ndarray, shape (L, q, q)
    shown : ndarray of bool, shape (L, F)
        Which edges and circles are seen well, where a light is allowed.
    """

    bundle: Bundle
    covariance: np.ndarray
    shown: np.ndarray

    @cached_property
    def whites(self) -> np.ndarray:
        """Independent combinations (L, q, q) of variance 1 of what is shown."""
        return _whites(self.bundle, self.covariance, self.shown)

    @cached_property
    def told(self) -> np.ndarray:
        """Of what all pictures share, (L, n, n)."""
        return of_one(self.bundle, self.whites)

    @cached_property
    def most(self) -> tuple[np.ndarray, float]:
        """What is told with no light more than, whatever it is, (n, n), and its scale."""
        root, _ = self._most
        return of_one(self.bundle, root), scale_of(self.bundle, root)

    @property
    def best(self) -> list[int]:
        """Lights that show what is worst, and all on average, best; none where nothing is shown."""
        _, parts = self._most
        return sorted({int(parts.min(1).argmax()), int(parts.mean(1).argmax())}) if parts.size else []

    @cached_property
    def _most(self) -> tuple[np.ndarray, np.ndarray]:
        """Combinations (q, q) at least as well known as with any light, and which part (L, f) of that is told of each
        edge and circle that is shown.

        Features are independent. Of each the information with all lights together, times the least number that makes it
        no less than with any one of them (Loewner's order).
        """
        told = np.swapaxes(self.whites, -1, -2) @ self.whites
        root, parts = np.zeros(told.shape[1:]), []
        for part in _parts(self.bundle.seen[0]):
            own = told[:, part, part]
            sizes, axes = np.linalg.eigh(own.sum(0))
            some = sizes > 1e-12 * sizes.max(initial=0.0)
            if not some.any():
                continue
            unit = (axes[:, some] / np.sqrt(sizes[some])).T
            shares = unit @ own @ unit.T
            largest = np.linalg.eigvalsh(shares).max()
            root[part, part][some] = (axes[:, some] * np.sqrt(largest * sizes[some])).T
            parts.append(np.einsum("lnn->l", shares) / (largest * some.sum()))
        return root, np.stack(parts, 1) if parts else np.zeros((len(told), 0))


def _parts(seen: Seen) -> list[slice]:
    """Which numbers are those of each line and circle, and of a board."""
    lines = [slice(2 * e, 2 * e + 2) for e in range(len(seen.names))]
    return [*lines, *map(seen.numbers, range(len(seen.circles))), *([seen.of_board] if seen.board else [])]


class NetworkPool:
    """Candidates, rows of ``poses``; grows where another light is found for a sensor.

    Attributes
    ----------
    poses : list of tuple of ndarray
        Sensor (2,) and free lights (2 F,), degrees, to the digits at which they are set up.
    looked : dict of int to Picture
        Rows that were looked at closely.
    most : Network
        Of each sensor of the grid what no light makes more than.
    """

    def __init__(self, problem: SearchProblem, freedom: Freedom, grid: Grid, report: Report) -> None:
        self.problem, self.freedom, self.grid = problem, freedom, grid
        self.poses: list[tuple[np.ndarray, np.ndarray]] = []
        self.looked: dict[int, Picture] = {}
        self._ways, self._told, self._shown = SettingUp(problem, grid.held), [], []
        self._firm: dict[int, np.ndarray] = {}
        self._numbers: dict[tuple[int, int], int] = {}
        self._sensors: list[int] = []
        self._glanced: list[tuple[Bundle, np.ndarray, np.ndarray]] = []
        self._kept: dict[tuple[int, bytes], np.ndarray] = {}
        self._lights: dict[int, Glance] = {}
        most, shown, scale = [], [], 0.0
        for s, glance in enumerate(self._glances(grid.sensors, report)):
            most.append(glance.most[0])
            scale = max(scale, glance.most[1])
            shown.append(glance.shown.any(0))
            for light in glance.best:
                self._add(s, light, glance)
        seen, scene = glance.bundle.seen[0], problem.scene
        before, gradient = of_shared(glance.bundle)
        datums = set(scene.placement.features)
        needed = [[name in datums and name in q.edges for name in (*seen.names, *seen.circles)]
                  for q in scene.quantities]  # fmt: skip
        pictures, needs = (_twice(np.array(most)), _twice(np.array(shown))), np.array(needed, bool)
        self.most = Network(pictures[0], before, gradient, pictures[1], needs, problem.objective, scale)

    def _glances(self, sensors: np.ndarray, report: Report) -> Iterator[Glance]:
        """From each of some sensors (n, 2), with all lights of the grid."""
        for part, errors, allowed in self.problem.table(sensors, self.grid.lights, report):
            ranks = feature_ranks(errors, np.zeros(errors.contrast.shape, bool))
            shown = (ranks >= _OK) & np.broadcast_to(allowed, ranks.shape[:-1])[..., None]
            for sensor, covariance, each in zip(sensors[part], errors.of_features, shown, strict=True):
                bundle = Bundle.of([self._picture(sensor, self.grid.lights[0])], self.freedom)
                yield Glance(bundle, covariance, each)

    def network(self) -> Network:
        """All rows: as they were looked at, else by a glance, with what has been clutter wherever it was looked at."""
        doubted, told, shown = self._doubted, list(self._told), list(self._shown)
        for row in range(len(told)) if doubted.any() else ():
            if row not in self.looked:
                shown[row] = shown[row] & np.stack([~doubted, np.ones(len(doubted), bool)])
                told[row] = np.stack([self._without(row, doubted), told[row][1]])
        return self.most.with_pictures(np.stack(told, 1), np.stack(shown, 1))

    def known(self) -> tuple[np.ndarray, Network, Network]:
        """Rows that were looked at, what they tell, and what they tell of features that are seen around them, too."""
        rows, whole = np.array(sorted(self.looked), int), self.network()
        known = self.most.with_pictures(whole.told[:, rows], whole.shown[:, rows])
        return rows, known, known.with_pictures(np.stack([self._firm[row] for row in rows], 1), known.shown)

    def lit(self, row: int, rest: tuple[int, ...]) -> int:
        """The row of the light that is best for a row's sensor beside other rows; of those alike the row itself."""
        s, others, whole = self._sensors[row], list(rest), self.network()
        if s not in self._lights:
            (self._lights[s],) = self._glances(self.grid.sensors[[s]], lambda *_: None)
        glance, doubted = self._lights[s], self._doubted
        told, shown = map(_twice, (glance.told, glance.shown))
        if doubted.any():
            shown[0] &= ~doubted
            told[0] = of_one(glance.bundle, _whites(glance.bundle, glance.covariance, shown[0]))
        for (sensor, light), looked in self._numbers.items():
            if sensor == s and looked in self.looked:
                told[:, light], shown[:, light] = self._told[looked], self._shown[looked]
        some = [*others, row]
        beside = whole.with_pictures(
            np.concatenate([whole.told[:, some], told], 1), np.concatenate([whole.shown[:, some], shown], 1)
        )
        score = beside.with_each(tuple(range(len(others))))
        best = score.best()
        if best <= len(others) or not better(score.at(best), score.at(len(others))):
            return row
        return self._add(s, best - len(some), glance)

    @property
    def _doubted(self) -> np.ndarray:
        """Which edges and circles, bool (F,), were seen in enough settings and never without clutter."""
        looked = np.array([self._shown[row] for row in self.looked], bool).reshape(-1, *self._shown[0].shape)
        return (looked[:, 1].sum(0) >= _ENOUGH) & ~looked[:, 0].any(0)

    def _without(self, row: int, some: np.ndarray) -> np.ndarray:
        """What a row tells by a glance, (n, n), without some edges and circles, bool (F,)."""
        key = row, some.tobytes()
        if key not in self._kept:
            bundle, covariance, shown = self._glanced[row]
            self._kept[key] = of_one(bundle, _whites(bundle, covariance[None], (shown & ~some)[None])[0])
        return self._kept[key]

    def look(self, row: int) -> None:
        """At a row closely: rays are traced, and what is ``clutter`` tells nothing."""
        sensor, light = self.poses[row]
        picture = self._picture(sensor, light)
        errors, bundle = variance_model(self.problem.model)(Pictures.of(picture)), Bundle.of([picture], self.freedom)
        states = states_of(errors, picture, close=True)
        shown = np.stack([states == status.OK, np.isin(states, [status.OK, status.CLUTTER])])
        around = self.problem.errors(*self._ways.around(sensor, light))
        firm = (feature_ranks(around, np.zeros(around.contrast.shape, bool)) >= _OK).all(0) & shown
        covariance = np.broadcast_to(errors.of_features, (2, *errors.of_features.shape))
        for some, kept in ((shown, self._told), (firm, self._firm)):
            kept[row] = of_one(bundle, _whites(bundle, covariance, some))
        self._shown[row], self.looked[row] = shown, picture

    def _add(self, s: int, light: int, glance: Glance) -> int:
        """The row of a sensor and a light of the grid."""
        if (s, light) not in self._numbers:
            self._numbers[s, light] = len(self.poses)
            sensor, place = self._ways.to_digits(self.grid.sensors[[s]], self.grid.lights[[light]])
            self.poses.append((sensor[0], place[0]))
            self._sensors.append(s)
            self._glanced.append((glance.bundle, glance.covariance[light], glance.shown[light]))
            self._told.append(_twice(of_one(glance.bundle, glance.whites[light])))
            self._shown.append(_twice(glance.shown[light]))
        return self._numbers[s, light]

    def _picture(self, sensor: np.ndarray, light: np.ndarray) -> Picture:
        return Picture.of(self.problem.scene, tuple(sensor.tolist()), as_poses(light))


def _whites(bundle: Bundle, covariance: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Combinations (L, q, q) of lines and circles of covariances (L, q, q), of those that are shown, bool (L, F)."""
    some = np.array([bundle.seen[0].counted(each) for each in shown])
    some &= np.isfinite(np.einsum("lqq->lq", covariance)) & np.isfinite(bundle.designs[0]).all(1)
    return whitening(np.where(some[:, :, None] & some[:, None, :], covariance, 0.0))


def _twice(told: np.ndarray) -> np.ndarray:
    """Without and with clutter, of which a glance knows nothing."""
    return np.stack([told, told])
