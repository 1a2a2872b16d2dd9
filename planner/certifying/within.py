"""The proof that all poses of a box keep a demand: cells of sensor and light, divided until each is proved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.certifying.cells import Boxes, LightCells, SensorCells
from planner.certifying.demand import Demand
from planner.certifying.light_terms import LightTerms
from planner.certifying.pairs import TRIED, bounded, divided, every, middles
from planner.certifying.pose_box import Ranges
from planner.certifying.search import LIGHTS, SENSORS
from planner.certifying.sensor_terms import SensorTerms
from planner.certifying.upper import upper_bounds
from planner.search.objective import Aim

Pair = tuple[np.ndarray, np.ndarray]  # of a sensor's pose (2,) and a light's, degrees


@dataclass(frozen=True, eq=False)
class Told:
    """What became of a proof.

    Attributes
    ----------
    proved : bool
    pairs : int
        Pairs of cells that were bounded.
    most : ndarray, shape (M,)
        What no U^2 of the pairs that are proved is above, over its limit's square.
    against : tuple of ndarray, shape (2,), or None
        A pose of sensor and light, degrees, that does not keep the demand.
    """

    proved: bool
    pairs: int
    most: np.ndarray
    against: Pair | None = None


class Within:
    """All poses of a box.

    Attributes
    ----------
    demand : Demand
    sensors : SensorCells
    lights : LightCells
    inputs : ndarray, shape (n, 2, M)
        Upper bounds of variances by inputs in the sensors' cells, and how far they are above those in the middle.
    """

    def __init__(self, demand: Demand, sensor: Ranges, light: Ranges) -> None:
        terms = SensorTerms(demand.scene, Aim("object", "minimax", np.ones(len(demand.limits))))
        self.demand = demand
        self.sensors = SensorCells(terms, Boxes.over(*sensor, SENSORS))
        self.lights = LightCells(LightTerms(demand.scene, terms.names), Boxes.over(*light, LIGHTS))
        self.inputs = np.zeros((0, 2, len(demand.limits)))

    def proved(self, most: int, report) -> Told:
        """Until every pair of cells keeps the demand, one of their poses does not, or ``most`` pairs were bounded."""
        pairs = every(np.arange(len(self.sensors.lost)), np.arange(len(self.lights.hot)))
        told = Told(False, 0, np.zeros(len(self.demand.limits)))
        while len(pairs):
            if told.pairs + len(pairs) > most:
                return told
            u2, parts = self._bounded(pairs)
            open_ = ~self.demand.is_kept(u2)
            told = replace(
                told, pairs=told.pairs + len(pairs), most=np.maximum(told.most, u2[~open_].max(0, initial=0))
            )
            report("proving cells of poses", told.pairs, told.pairs + 4 * int(open_.sum()))
            if (against := self._against(pairs[open_], u2[open_])) is not None:
                return replace(told, against=against)
            pairs = self._divided(pairs[open_], parts[open_])
        return replace(told, proved=True)

    def _bounded(self, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Upper bounds of `Demand.u2` (p, M), and what sensors' and lights' cells make of them (p, 2)."""
        new = np.arange(len(self.inputs), len(self.sensors.lost))
        if len(new):
            boxes = self.sensors.boxes.some(new)
            found = np.stack(self.demand.inputs.of(boxes.polar, boxes.azimuth), 1)
            self.inputs = np.concatenate([self.inputs, found])
        noise, parts = bounded(upper_bounds, self.sensors, self.lights, pairs)
        most, off = np.moveaxis(self.inputs[pairs[:, 0]], 1, 0)
        parts[:, 0] += off.sum(-1)
        return self.demand.u2(noise, most), parts

    def _against(self, pairs: np.ndarray, u2: np.ndarray) -> Pair | None:
        """The middle of one of the pairs that looks worst, if that does not keep the demand."""
        if not len(pairs):
            return None
        worst = pairs[np.argsort(-u2.max(-1))[:TRIED]]
        s, k = middles(self.sensors, self.lights, worst)
        wrong = np.flatnonzero(~self.demand.is_met(s, k))
        return (s[wrong[0]], k[wrong[0]]) if len(wrong) else None

    def _divided(self, pairs: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """The pairs of which one cell is cut in four: that which makes the bound worse."""
        return divided(self.sensors, self.lights, pairs, parts[:, 0] >= parts[:, 1])
