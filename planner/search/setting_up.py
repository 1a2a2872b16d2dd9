"""Settings that can be set up: poses of the digits that are printed, and no cliff where they may really stand.

An optimum may lie where an edge is about to be hidden or to lose its contrast. Who sets sensor and light up reads their
angles to a tenth of a degree and errs by a little more; there, too, everything has to be measurable.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from imaging.models.errors import Errors
from planner.ranks import quantity_ranks
from planner.search.local import shifted
from planner.search.objective import SearchProblem
from scenes import Scene, status
from scenes.pose import DIGITS
from scenes.status import WORST_FIRST
from scenes.uncertain import Uncertain

AROUND = 0.2  # degrees: how far off everything has to be measurable, at least
_STEEPEST = 4.0  # times the variance that is lost by standing so far off: standard deviations are twice as large
_SHELLS = (0.4, 0.8, 1.6, 3.2)  # degrees from an optimum that cannot be set up
_PLACES, _SEED = 64, 1  # of each shell
_DOUBTFUL = WORST_FIRST.index(status.CLUTTER)  # what is measured, though it may be biased


@dataclass(frozen=True, eq=False)
class SettingUp:
    """How a search problem's sensor and lights are set up.

    Attributes
    ----------
    problem : SearchProblem
    held : pair of bool
        Whether the sensor and the lights stay as they are, with all their digits.
    """

    problem: SearchProblem
    held: tuple[bool, bool]

    def offers(self, sensor: np.ndarray, lights: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Settings near one that can be set up: the best of the nearest first, then of ever wider shells.

        Parameters
        ----------
        sensor, lights : ndarray, shape (2,), (2 F,)
            Degrees.
        """
        for sensors, places in (self._nearest(sensor, lights), *(self._shell(sensor, lights, r) for r in _SHELLS)):
            values = self.problem.feasible_values(sensors, places)
            for i in np.argsort(values, kind="stable"):
                if not np.isfinite(values[i]):
                    break
                pair = sensors[i], places[i]
                if self.problem.constraints.allows(self.problem.scene, *pair) and self.is_steady(*pair):
                    yield pair

    def is_steady(self, sensor: np.ndarray, lights: np.ndarray) -> bool:
        """Whether all is measurable there and around it, with a variance not more than four times as large."""
        sensors, places = self._around(sensor, lights)
        values = self.problem.values(sensors, places)
        return bool(_measurable(self.problem.errors(sensors, places)).all() and values.max() <= _STEEPEST * values[0])

    def steady(self, sensor: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """The same of each quantity, for one picture of several need not measure all; bool, shape (M,)."""
        errors = self.problem.errors(*self._around(sensor, lights))
        variances = errors.variances_object
        return _measurable(errors).all(0) & (variances.max(0) <= _STEEPEST * variances[0])

    def to_digits(self, sensors: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Settings (n, 2) and (n, 2 F) to the digits of poses, where that keeps the constraints; what is held stays."""
        scene, limits = self.problem.scene, self.problem.constraints
        near = sensors if self.held[0] else rounded(sensors), lights if self.held[1] else rounded(lights)
        keeps = limits.sensors(scene, near[0]) & limits.pairs(scene, *near)
        keeps &= limits.lights(near[1].reshape(-1, 2)).reshape(len(lights), -1).all(-1)
        kept = [np.where(keeps[:, None], one, other) for one, other in zip(near, (sensors, lights), strict=True)]
        return kept[0], kept[1]

    def _nearest(self, sensor: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The setting with its angles rounded up or down, (n, 2) and (n, 2 F)."""
        whole = np.concatenate([sensor, lights])
        step = 10.0**-DIGITS
        ways = [{round(float(up(angle / step)) * step, DIGITS) for up in (np.floor, np.ceil)} for angle in whole]
        angles = np.array(list(product(*map(sorted, ways))) if len(whole) <= 6 else [np.round(whole, DIGITS)])
        return self._kept(sensor, lights, angles[:, :2], angles[:, 2:])

    def _shell(self, sensor: np.ndarray, lights: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """Settings off by ``radius`` degrees in any way, to the digits of poses."""
        ways = np.random.default_rng(_SEED).normal(size=(_PLACES, 2 + lights.size))
        moves = radius * ways / np.linalg.norm(ways, axis=1, keepdims=True)
        return self._kept(sensor, lights, *map(rounded, _moved(sensor, lights, moves)))

    def _around(self, sensor: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The setting itself, then sensor and lights off by what is to be borne, one by one and together."""
        own, others = (how_far(self.problem.scene, role) for role in ("sensor", "light"))
        size = np.array([own, own, *[others] * lights.size])
        together = np.array(list(product((-1, 1), repeat=4)))[:, [0, 1, *(2, 3) * (lights.size // 2)]] / np.sqrt(2)
        single = np.concatenate([np.eye(size.size), -np.eye(size.size)])
        return _moved(sensor, lights, size * np.concatenate([np.zeros((1, size.size)), single, together]))

    def _kept(
        self, sensor: np.ndarray, lights: np.ndarray, sensors: np.ndarray, places: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Different poses (n, 2) and (n, 2 F), with what is held as it is."""
        sensors, places = rounded(sensors), rounded(places)
        if self.held[0]:
            sensors[:] = sensor
        if self.held[1]:
            places[:] = lights
        if self.problem.constraints.same_mount:
            places = np.tile(sensors, (1, lights.size // 2))
        both = np.unique(np.concatenate([sensors, places], axis=1), axis=0)
        return both[:, :2], both[:, 2:]


def _measurable(errors: Errors) -> np.ndarray:
    """Whether each quantity is measured at n settings, though it may be biased, bool (n, M)."""
    edges = np.zeros((len(errors.variances), len(errors.measurands.view.names)), bool)
    return quantity_ranks(errors, edges) >= _DOUBTFUL


def how_far(scene: Scene, role: str) -> float:
    """How far off, degrees, the sensor or the lights have to be able to stand: twice their uncertainty, if it is said.

    Examples
    --------
    >>> import scenes
    >>> how_far(scenes.load("task1"), "sensor")
    0.2
    """
    said: Uncertain | None = getattr(scene.uncertainty, f"{role}_deg")
    return max(AROUND, 2 * (getattr(scene.jitter, f"{role}_deg") if said is None else said.u))


def rounded(poses: np.ndarray) -> np.ndarray:
    """Poses (..., 2 k) of polar angles and azimuths to their digits, azimuths below 360 degrees.

    Examples
    --------
    >>> rounded(np.array([30.04, 359.96]))
    array([30.,  0.])
    """
    found = np.round(poses, DIGITS)
    found[..., 1::2] %= 360
    return found


def _moved(sensor: np.ndarray, lights: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A setting with its sensor and lights moved on their spheres by ``moves`` (n, 2 + 2 F), degrees."""
    sensors = np.array([shifted(sensor, move[:2]) for move in moves])
    parts = [
        np.array([shifted(lights[i : i + 2], move[2 + i : 4 + i]) for move in moves]) for i in range(0, lights.size, 2)
    ]
    return sensors, np.concatenate(parts, axis=1) if parts else np.zeros((len(moves), 0))
