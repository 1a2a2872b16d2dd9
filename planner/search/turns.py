"""Several lights, one moved after the other: no guarantee, for whatever a mixture of contrasts does not tell of."""

from __future__ import annotations

import numpy as np

from planner.search.aim import Aim
from planner.search.constraints import Constraints
from planner.search.exhaustive import Found, Report, evaluate_pairs
from planner.search.shares import with_shares
from planner.search.sharing import BETTER, Alone, Shared
from scenes import Scene


def by_turns(
    scene: Scene, sensors: np.ndarray, places: np.ndarray, model: str, aim: Aim,
    constraints: Constraints, report: Report, shares: tuple[tuple[float, ...], ...],
) -> Shared:  # fmt: skip
    """The sensor, each free light and the shares moved in turn to the best of all, until none of them has a better one.

    Begins from the best of a coarse sample with all lights at one place: with the first and the last of the shares, and
    those in the middle.
    """
    starts = dict.fromkeys((shares[0], shares[len(shares) // 2], shares[-1]))
    turns = _Turns(scene, sensors, places, model, aim, constraints, shares)
    ends = []
    for done, share in enumerate(starts):
        report("turns", done, len(starts))
        ends.append(turns.run(share))
    report("turns", len(starts), len(starts))
    _, share, _, lights = min(ends, key=lambda end: end[0])
    alone = [end for end in turns.alone if np.isfinite(end[0])]
    table = np.tile(lights, (len(sensors), 1))
    other = with_shares(scene, share)
    least = _values(other, sensors, table, model, aim, constraints)
    at = int(least.argmin())
    which = np.where(np.isfinite(least), np.arange(len(sensors)), -1)
    found = Found(at, at, float(least[at]), turns.evaluated, turns.evaluated, which, least, guaranteed=False)
    return Shared(other, table, found, Alone(*min(alone, key=lambda end: end[0])) if alone else None)


class _Turns:
    """Moves one thing at a time; remembers where one light had all."""

    def __init__(self, scene, sensors, places, model, aim, constraints, shares) -> None:
        self.scene, self.how, self.shares = scene, (model, aim, constraints), shares
        self.free = len(scene.free)
        self.sensors, self.places = sensors, places if self.free else np.zeros((1, 0))
        self.evaluated, self.alone = 0, []

    def _tried(self, share, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        self.evaluated += len(sensors)
        return _values(with_shares(self.scene, share), sensors, lights, *self.how)

    def run(self, share: tuple[float, ...]) -> tuple:
        """Value, shares, sensor and lights where it stops."""
        some = [poses[:: max(1, len(poses) // 40)] for poses in (self.sensors, self.places)]
        pairs = [(s, np.tile(k, self.free)) for s in some[0] for k in some[1]]
        values = self._tried(share, *(np.array(part) for part in zip(*pairs, strict=True)))
        best, (sensor, lights) = float(values.min()), pairs[int(values.argmin())]
        better = np.isfinite(best)
        while better:
            better = False
            for role in range(self.free + 1):
                tried = self.sensors if role == 0 else self.places
                s, k = np.tile(sensor, (len(tried), 1)), np.tile(lights, (len(tried), 1))
                (s if role == 0 else k[:, 2 * role - 2 : 2 * role])[:] = tried
                values = self._tried(share, s, k)
                if values.min() < best * BETTER:
                    at, better = int(values.argmin()), True
                    best, sensor, lights = float(values[at]), s[at], k[at]
            for other in self.shares:
                (value,) = self._tried(other, sensor[None], lights[None])
                if value < best * BETTER:
                    best, share, better = float(value), other, True
            if max(share) == 1 and len(share) > 1:
                self.alone.append((best, share, sensor, lights))
        return best, share, sensor, lights


def _values(scene, sensors, lights, model, aim, constraints: Constraints) -> np.ndarray:
    values = evaluate_pairs(scene, sensors, lights, model, aim)
    return np.where(constraints.pairs(scene, sensors, lights), values, np.inf) if constraints.on_pairs else values
