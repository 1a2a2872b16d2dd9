"""Pairs of cells, divided until no pose of any of them can be better by more than a share (branch and bound)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from imaging.geometry.projection import direction
from planner.certifying.cells import Boxes, LightCells, SensorCells, bounds
from planner.certifying.enclosed import HUGE
from planner.certifying.light_terms import LightTerms
from planner.certifying.pairs import TRIED, bounded, divided, every, middles
from planner.certifying.sensor_terms import SensorTerms
from planner.search.objective import Report, SearchProblem, cut_off

SENSORS, LIGHTS = 7.5, 10.0  # degrees, of the first cells
_ALONE = np.radians(1.0)  # radius down to which sensors' cells are divided before there are any of lights
_FINE = 0.125  # of a light's cell: the sensor's is divided first until it is so small, where its slopes are not bounded


@dataclass(frozen=True, eq=False)
class Found:
    """What a search by cells knows, as it goes on.

    Attributes
    ----------
    value : float
        The least value of a pose.
    sensor, light : ndarray, shape (2,)
        Where, degrees.
    least : float
        What no pose of the cells that were excluded is below.
    pairs : int
        Pairs of cells that were bounded.
    within_scale : bool
        Whether this is of poses alone whose levels the end of the scale does not cut off.
    """

    value: float
    sensor: np.ndarray
    light: np.ndarray
    least: float = np.inf
    pairs: int = 0
    within_scale: bool = False


class Search:
    """Of all poses of the constraints' ranges.

    Attributes
    ----------
    problem : SearchProblem
    sensors : SensorCells
    lights : LightCells
    found : Found
    share : float
        By which a pose would have to be better.
    most : int
        Pairs of cells, at most.
    """

    def __init__(
        self, problem: SearchProblem, sensors: SensorCells, lights: LightCells, found: Found, share: float, most: int
    ) -> None:
        self.problem, self.sensors, self.lights = problem, sensors, lights
        self.found, self.share, self.most = found, share, most

    @classmethod
    def of(cls, problem: SearchProblem, found: Found, boxes: tuple[Boxes, Boxes], share: float, most: int) -> Search:
        """From what is known, and boxes that cover all poses of sensor and light."""
        terms = SensorTerms(problem.scene, problem.objective)
        lights = LightCells(LightTerms(problem.scene, terms.names), boxes[1])
        return cls(problem, SensorCells(terms, boxes[0]), lights, found, share, most)

    def run(self, report: Report) -> Found:
        """Until nothing is open, or as many pairs were bounded."""
        pairs = self._first()
        while len(pairs):
            bound, parts = self._bounded(pairs)
            open_ = bound < (1 - self.share) * self.found.value
            self._excluded(bound[~open_])
            self._try(pairs[open_], bound[open_])
            if self.found.pairs + 4 * open_.sum() > self.most:
                self._excluded(bound[open_])
                break
            report("excluding cells of poses", self.found.pairs, self.found.pairs + 4 * int(open_.sum()))
            pairs = self._divided(pairs[open_], parts[open_])
        return replace(self.found, within_scale=bool(self.lights.hot.any()))

    def _excluded(self, bound: np.ndarray) -> None:
        """What no pose is below of cells that are left."""
        self.found = replace(self.found, least=min(self.found.least, float(bound.min(initial=np.inf))))

    def _first(self) -> np.ndarray:
        """Pairs of the first cells; sensors that no light makes good enough are left out."""
        terms, whole = self.lights.terms, self.lights.boxes
        root = Boxes(*(np.array([[part.min(), part.max()]]) for part in (whole.polar, whole.azimuth)))
        one, kept, open_ = LightCells(terms, root), [], np.arange(len(self.sensors.lost))
        while len(open_):
            pairs = np.column_stack([open_, np.zeros(len(open_), int)])
            bound = self._bounded(pairs, one)[0]
            out = bound >= (1 - self.share) * self.found.value
            self._excluded(bound[out])
            fine = (self.sensors.boxes.radii[open_] < _ALONE) | (bound > 0.1 * self.found.value)
            kept.append(open_[~out & fine])
            wide = open_[~out & ~fine]
            parts = self.sensors.quarters(wide)
            open_ = np.concatenate([np.zeros(0, int), *(parts[int(each)] for each in wide)])
        return every(np.concatenate(kept), np.arange(len(self.lights.hot)))

    def _bounded(self, pairs: np.ndarray, lights: LightCells | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of pairs; `HUGE` of those that no constraint allows."""
        bound, parts = bounded(bounds, self.sensors, lights or self.lights, pairs)
        self.found = replace(self.found, pairs=self.found.pairs + len(pairs))
        return (bound, parts) if lights else (np.where(self._is_allowed(pairs), bound, HUGE), parts)

    def _is_allowed(self, pairs: np.ndarray) -> np.ndarray:
        """Whether bodies may be clear of each other, bool (p,)."""
        limits, scene = self.problem.constraints, self.problem.scene
        most = limits.largest_cosine(scene, scene.free[0])
        if most >= 1:
            return np.ones(len(pairs), bool)
        sides = [cells.boxes.some(pairs[:, k]) for k, cells in enumerate((self.sensors, self.lights))]
        cosine = np.einsum("pi,pi->p", *(direction(each.middles) for each in sides))
        apart = np.arccos(np.clip(cosine, -1, 1)) + sides[0].radii + sides[1].radii
        return apart >= np.arccos(most) * (1 - 1e-9)

    def _try(self, pairs: np.ndarray, bound: np.ndarray) -> None:
        """Evaluate the middles of the most promising."""
        best = pairs[np.argsort(bound)[:TRIED]]
        problem, found = self.problem, self.found
        s, k = middles(self.sensors, self.lights, best)
        if not len(best):
            return
        values = np.where(problem.constraints.allowed(problem.scene, s, k), problem.values(s, k), np.inf)
        values = np.where(cut_off(problem.errors(s, k)), np.inf, values)
        i = int(np.argmin(values))
        if values[i] < found.value:
            self.found = replace(found, value=float(values[i]), sensor=s[i], light=k[i])

    def _divided(self, pairs: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """The pairs of which one cell is cut in four: that which makes the bound worse."""
        size = [cells.boxes.radii[pairs[:, k]] for k, cells in enumerate((self.sensors, self.lights))]
        wild = parts[:, 0] >= 1e30  # slopes of the sensor's terms are not bounded
        by_sensor = np.where(wild, size[0] > _FINE * size[1], parts[:, 0] >= parts[:, 1])
        return divided(self.sensors, self.lights, pairs, by_sensor)
