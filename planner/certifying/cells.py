"""Cells of poses of the sensor and of the light, and the lower bound of what is minimised in pairs of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np

from planner.certifying.enclosed import HUGE, ROUNDING, Enclosed
from planner.certifying.light_terms import LightTerms
from planner.certifying.lines import UNEVEN
from planner.certifying.sensor_terms import SensorTerms
from planner.certifying.series import DEGREE

_AT_ONCE = 256  # cells of which terms are made
_EDGE_ON = 1e-9  # of the distance: a face seen so nearly edge-on may be seen or not


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes of poses, rad.

    Attributes
    ----------
    polar, azimuth : ndarray, shape (n, 2)
        From and to.
    """

    polar: np.ndarray
    azimuth: np.ndarray

    @classmethod
    def over(cls, polar: tuple[float, float], azimuth: tuple[float, float], step: float) -> Boxes:
        """What covers a range, degrees, in boxes of at most ``step``."""
        parts = []
        for low, high in (polar, azimuth):
            count = max(int(np.ceil((high - low) / step - 1e-9)), 1)
            at = np.radians(np.linspace(low, high, count + 1))
            parts.append(np.column_stack([at[:-1], at[1:]]))
        pairs = np.array(list(product(*parts))).reshape(-1, 2, 2)
        return cls(pairs[:, 0], pairs[:, 1])

    @property
    def middles(self) -> np.ndarray:
        """Poses, degrees, (n, 2)."""
        return np.degrees(np.column_stack([self.polar.mean(1), self.azimuth.mean(1)]))

    @property
    def radii(self) -> np.ndarray:
        """How far, rad, no place of a box is from its middle, (n,): along the meridian and then around."""
        widest = np.where((self.polar[:, 0] <= np.pi / 2) & (self.polar[:, 1] >= np.pi / 2), 1.0,
                          np.sin(self.polar).max(1))  # fmt: skip
        return np.ptp(self.polar, axis=1) / 2 + widest * np.ptp(self.azimuth, axis=1) / 2

    def quarters(self, some: np.ndarray) -> Boxes:
        """The four parts of each of some boxes, one after the other, (4 k,)."""
        halves = []
        for part in (self.polar[some], self.azimuth[some]):
            middle = part.mean(1)
            halves.append([np.column_stack([part[:, 0], middle]), np.column_stack([middle, part[:, 1]])])
        both = [(one, other) for one in halves[0] for other in halves[1]]
        polar, azimuth = (np.stack([pair[k] for pair in both], 1).reshape(-1, 2) for k in (0, 1))
        return Boxes(polar, azimuth)

    def some(self, which: np.ndarray) -> Boxes:
        """Some of them."""
        return Boxes(self.polar[which], self.azimuth[which])


@dataclass(frozen=True, eq=False)
class Table:
    """Factors of the bound for n cells: arrays by name, along whose first axis the cells lie."""

    parts: dict[str, np.ndarray]

    @classmethod
    def of(cls, found: Enclosed, **others: np.ndarray) -> Self:
        """Middle, low and high, and times half the cells' widths the size of the slopes, ``tilt``, and how far these
        may be off, ``slack``, (n, 2, ...)."""
        half = found.half.reshape(2, -1, *(1,) * (found.middle.ndim - 1))
        tilt, slack = (np.moveaxis(part * half, 0, 1) for part in (found.slope, found.spread))
        parts = {"middle": found.middle, "low": found.low, "high": found.high, "tilt": tilt,
                 "slack": np.minimum(slack, HUGE)}  # fmt: skip
        return cls(parts | others)

    def __getattr__(self, name: str) -> np.ndarray:
        return self.parts[name]

    def some(self, which: np.ndarray) -> Self:
        """Of some cells."""
        return type(self)({name: part[which] for name, part in self.parts.items()})

    @classmethod
    def joined(cls, tables: Sequence[Self]) -> Self:
        """Of several, one after the other."""
        return cls({name: np.concatenate([each.parts[name] for each in tables]) for name in tables[0].parts})


class SensorCells:
    """Cells of sensors, each with the faces that all of it sees.

    Attributes
    ----------
    boxes : Boxes
    seen : ndarray of bool, shape (n, F)
        Of the faces that decide.
    sides : ndarray of int, shape (n, E)
        Which of `SIDES` each edge shows.
    table : Table
        (n, M, E, k); ``sure`` (n,).
    lost : ndarray of bool, shape (n,)
    """

    def __init__(self, terms: SensorTerms, boxes: Boxes) -> None:
        self.terms = terms
        which, seen = self._possible(boxes)
        self._parts: dict[int, np.ndarray] = {}
        self.boxes, self.seen = boxes.some(which), seen
        self.sides, self.table, self.lost = self._told(self.boxes, seen)

    def quarters(self, some: np.ndarray) -> dict[int, np.ndarray]:
        """The cells into which some are divided, found once."""
        new = np.array([each for each in np.unique(some) if each not in self._parts], int)
        if len(new):
            boxes, seen = self.boxes.quarters(new), np.repeat(self.seen[new], 4, axis=0)
            kept = self._is_possible(boxes, seen)
            parent, boxes, seen = np.repeat(new, 4)[kept], boxes.some(kept), seen[kept]
            first = len(self.lost)
            for each in new:
                self._parts[int(each)] = first + np.flatnonzero(parent == each)
            if not kept.any():  # no pose of theirs sees these faces
                return self._parts
            sides, table, lost = self._told(boxes, seen)
            self.boxes = _joined(self.boxes, boxes)
            self.seen, self.sides = np.concatenate([self.seen, seen]), np.concatenate([self.sides, sides])
            self.table, self.lost = Table.joined([self.table, table]), np.concatenate([self.lost, lost])
        return self._parts

    def _possible(self, boxes: Boxes) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of boxes, each as often as there are sets of faces that it may see, and these."""
        surely, maybe = self._faces(boxes)
        which, seen = [], []
        for k in range(len(boxes.polar)):
            ways = [(True, False) if m and not s else (bool(s),) for s, m in zip(surely[k], maybe[k], strict=True)]
            for way in product(*ways):
                which.append(k)
                seen.append(way)
        return np.array(which, int), np.array(seen, bool)

    def _faces(self, boxes: Boxes) -> tuple[np.ndarray, np.ndarray]:
        """Which faces all of a box sees, and which some of it may, (n, F)."""
        low, high = self.terms.heights(boxes.polar, boxes.azimuth)
        near = _EDGE_ON * self.terms.scene.camera.distance
        return low > near, high > 0

    def _is_possible(self, boxes: Boxes, seen: np.ndarray) -> np.ndarray:
        surely, maybe = self._faces(boxes)
        return np.where(seen, maybe, ~surely).all(1)

    def _told(self, boxes: Boxes, seen: np.ndarray) -> tuple[np.ndarray, Table, np.ndarray]:
        terms, solid = self.terms, self.terms.scene.solid
        place = {int(face): k for k, face in enumerate(terms.faces)}
        pairs = [[place[face] for face in solid.edge(name).faces] for name in terms.names]
        sides = np.stack([seen[:, one] + 2 * seen[:, two] - 1 for one, two in pairs], 1)
        found, lost, order = [], np.zeros(len(seen), bool), []
        for way in np.unique(seen, axis=0):
            here = np.flatnonzero((seen == way).all(1))
            for at in range(0, len(here), _AT_ONCE):
                some = here[at : at + _AT_ONCE]
                with np.errstate(all="ignore"):  # what is not bounded
                    made = terms.of(boxes.polar[some], boxes.azimuth[some], way)
                    found.append(Table.of(made.factors, long=made.long, brief=made.brief, norms=made.norms,
                                          spare=made.spare, sure=made.sure))  # fmt: skip
                lost[some] = made.lost
                order.append(some)
        return np.maximum(sides, 0), Table.joined(found).some(np.argsort(np.concatenate(order))), lost


class LightCells:
    """Cells of lights.

    Attributes
    ----------
    boxes : Boxes
    table : Table
        (n, E, `SIDES`, k).
    hot : ndarray of bool, shape (n,)
        Whether levels may be cut off at the end of the scale.
    """

    def __init__(self, terms: LightTerms, boxes: Boxes) -> None:
        self.terms, self.boxes = terms, boxes
        self._parts: dict[int, np.ndarray] = {}
        self.table, self.hot = self._told(boxes)

    def quarters(self, some: np.ndarray) -> dict[int, np.ndarray]:
        """The cells into which some are divided, found once."""
        new = np.array([each for each in np.unique(some) if each not in self._parts], int)
        if len(new):
            boxes, first = self.boxes.quarters(new), len(self.hot)
            table, hot = self._told(boxes)
            for k, each in enumerate(new):
                self._parts[int(each)] = first + 4 * k + np.arange(4)
            self.boxes, self.table = _joined(self.boxes, boxes), Table.joined([self.table, table])
            self.hot = np.concatenate([self.hot, hot])
        return self._parts

    def _told(self, boxes: Boxes) -> tuple[Table, np.ndarray]:
        with np.errstate(all="ignore"):  # what is not bounded
            found, uneven, hot = self.terms.of(boxes.polar, boxes.azimuth)
            return Table.of(found, uneven=uneven), hot


def _joined(one: Boxes, other: Boxes) -> Boxes:
    return Boxes(np.concatenate([one.polar, other.polar]), np.concatenate([one.azimuth, other.azimuth]))


def bounds(sensors: SensorCells, lights: LightCells, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower bound of what is minimised for pairs of cells (p, 2), and what of its distance from the value in the
    middle the sensors' cell and the lights' make, (p, 2)."""
    s, k = paired(sensors, lights, pairs)
    natural = _edge_by_edge(s, k.low, k.high, k.uneven).sum(-1)
    at_middle, by_sensor, by_light = leaning(s, k)
    leant = at_middle - by_sensor - by_light
    bound = np.fmax(np.fmax(natural, np.where(leant < HUGE, leant, 0.0)), 0.0) * (1 - ROUNDING)
    parts = np.stack([np.nan_to_num(part, nan=HUGE, posinf=HUGE).sum(-1) for part in (by_sensor, by_light)], -1)
    joined = sensors.terms.aim.joined(np.moveaxis(bound, -1, 0))
    return np.where(sensors.lost[pairs[:, 0]], HUGE, joined), parts


def paired(sensors: SensorCells, lights: LightCells, pairs: np.ndarray) -> tuple[Table, Table]:
    """Tables of pairs of cells (p, 2): the sensors', (p, M, E, k), and of the lights' what each edge shows of them,
    (p, 1, E, k)."""
    i, j = pairs.T
    k = lights.table.some(j).parts
    at = (np.arange(len(pairs))[:, None], np.arange(sensors.sides.shape[1]), sensors.sides[i])
    shown = {name: k[name][at][:, None] for name in ("middle", "low", "high")}
    leans = {name: np.moveaxis(np.moveaxis(k[name], 1, 0)[(slice(None), *at)], 0, 1)[:, :, None]
             for name in ("tilt", "slack")}  # fmt: skip
    return sensors.table.some(i), Table(shown | leans | {"uneven": k["uneven"][:, None]})


def leaning(s: Table, k: Table, last: int | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The sum over edges and their terms, the last of which may be left out, in the middle of pairs of cells, and how
    far from it the sensor's cell and the light's may make it, (p, M) each."""
    low, high, middle = (part[..., :last] for part in (k.low, k.high, s.middle))
    with np.errstate(all="ignore"):
        wide, centre, most = (high - low) / 2, (high + low) / 2, np.maximum(np.abs(low), np.abs(high))
        by_sensor, by_light = 0.0, 0.0
        for a in (0, 1):
            tilt, slack = s.tilt[:, a, ..., :last], s.slack[:, a, ..., :last]
            by_sensor = by_sensor + np.abs(_sum(tilt * centre)) + _sum(np.abs(tilt) * wide + slack * most)
            tilt, slack = k.tilt[:, a, ..., :last], k.slack[:, a, ..., :last]
            by_light = by_light + np.abs(_sum(middle * tilt)) + _sum(np.abs(middle) * slack)
        return _sum(middle * k.middle[..., :last]), by_sensor, by_light


def _edge_by_edge(s: Table, low: np.ndarray, high: np.ndarray, uneven: np.ndarray) -> np.ndarray:
    """Lower bound of each edge's part, (p, M, E), from the ranges of all factors alone; no edge takes away."""
    with np.errstate(all="ignore"):
        long, brief = (np.where(part >= 0, part * low, part * high).sum(-1) for part in (s.long, s.brief))
        norm = np.maximum(s.norms[..., 0] - uneven[..., None] * s.norms[..., 1], 0.0)
        glance = norm**2 * low[..., : DEGREE + 1].min(-1)[..., None]
        long = np.fmax(long, np.where((1 + uneven) ** 2 <= UNEVEN, glance[..., 0], 0.0))
        brief = np.fmax(brief, glance[..., 1])
    return np.fmax(np.minimum(np.fmax(long, 0.0), np.fmax(brief, 0.0)), 0.0)


def _sum(values: np.ndarray) -> np.ndarray:
    """Over the edges and their terms."""
    return values.sum((-1, -2))
