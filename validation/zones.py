"""Geometric tolerances of a measured picture: the size of zone that each needs, and the decision by its law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from uncertainties import covariance_matrix

from imaging.models.extremes import extremes_of
from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.conformity import Decision
from planner.uncertainty.extremes import ExtremeValue
from planner.uncertainty.forms import FormSize
from planner.uncertainty.material import MaterialSize
from planner.uncertainty.zones import ZoneSize
from scenes import status
from scenes.measurands.zone import Zone

if TYPE_CHECKING:
    import measure


@dataclass(frozen=True, eq=False)
class MeasuredZone:
    """A zone of several numbers, which decide together, or of all points of a feature.

    Attributes
    ----------
    zone : Zone
    size : ZoneSize or FormSize
        What is known of the size that the part needs, the scene's unit; NaN within where something is not measured.
    unit, status : str
        The worst status of its numbers.
    """

    zone: Zone
    size: ZoneSize | FormSize
    unit: str
    status: str

    @property
    def decision(self) -> Decision | None:
        """By the drawing's size (ISO 14253-1); None without one."""
        return None if self.zone.size is None else self.size.decide(self.zone.size, status=self.status)

    @property
    def bonus(self) -> float:
        """By how much the zone is larger than the drawing's size, for the feature is not at maximum material."""
        return self.size.departure if isinstance(self.size, MaterialSize) else 0.0

    @property
    def facts(self) -> dict[str, Any]:
        """For JSON and tables; None where nothing is measured."""
        known, size, bonus = self.size.is_known, self.size, self.bonus
        low, high = (each + bonus for each in size.interval()) if known else (None, None)
        return {
            "name": self.zone.name, "kind": self.zone.kind, "parts": list(self.zone.parts), "unit": self.unit,
            "value": size.value + bonus if known else None, "mean": size.mean + bonus if known else None,
            "u": size.u if known else None, "low": low, "high": high,
            "at_most": size.quantile(0.95) + bonus if known else None,
            "size": self._allowed, "decision": self.decision, "status": self.status,
            "maximum_material": self._material,
        }  # fmt: skip

    @property
    def _allowed(self) -> float | None:
        """The drawing's size, with the bonus where there is one; None without."""
        return None if self.zone.size is None else self.zone.size + (self.bonus if self.size.is_known else 0.0)

    @property
    def _material(self) -> dict[str, Any] | None:
        """With what its size has grown, and by how much."""
        material = self.zone.material
        if material is None:
            return None
        bonus = self.bonus if np.isfinite(self.bonus) else None
        return {"of": material.of, "limit": material.limit, "bonus": bonus, "drawn": self.zone.size}


def measured_zones(found: measure.Measurements, known: SceneBudget | None) -> tuple[MeasuredZone, ...]:
    """Those of one picture's geometric tolerances that no single normal number decides.

    ``known`` is the budget of what was measured; without it, or where it leaves out a number, nothing is known.
    """
    names, made = list(found.names), []
    for zone in found.picture.scene.zones:
        if zone.is_joint:
            rows = [names.index(name) for name in zone.numbers]
            size = _form(found, known, rows[0]) if zone.is_form else _joint(found, known, zone, rows)
            state = status.worst(*(str(found.status[k]) for k in rows))
            made.append(MeasuredZone(zone, size, found.units[rows[0]], state))
    return tuple(made)


def _size(zone: Zone, off: np.ndarray, last: float, covariance: np.ndarray) -> ZoneSize:
    """Of deviations of a zone's numbers; the last one, where it grows, is the value of the size with which it does."""
    if zone.material is None:
        return ZoneSize(off, covariance, zone.factor)
    signs = np.append(np.ones(len(zone.parts)), zone.material.sign)
    departure = zone.material.departure(float(last))
    return MaterialSize(off[:-1], covariance * np.outer(signs, signs), zone.factor, departure)


def measured_extremes(found: measure.Measurements, known: SceneBudget | None) -> dict[str, ExtremeValue]:
    """Of one picture's numbers those that are the largest or the smallest of others, by name."""
    told = {}
    for m, rows, sign in extremes_of(found.quantities):
        names = tuple(found.names[k] for k in rows)
        covariance = _covariance(found.covariance[np.ix_(rows, rows)], known, names)
        told[found.names[m]] = ExtremeValue(found.value[rows], covariance, sign)
    return told


def _joint(found: measure.Measurements, known: SceneBudget | None, zone: Zone, rows: list[int]) -> ZoneSize:
    covariance = _covariance(found.covariance[np.ix_(rows, rows)], known, zone.numbers)
    return _size(zone, (found.value - found.nominal)[rows], found.value[rows[-1]], covariance)


def _form(found: measure.Measurements, known: SceneBudget | None, row: int) -> FormSize:
    """Of the row-th number; the form's points, and what else is not exactly known."""
    name, value = found.names[row], float(found.value[row])
    (points,) = found.forms[name]
    if points is None or known is None or name not in {each.name for each in known}:
        return FormSize(value, np.nan, np.nan, None)
    u = known[name].u
    beside = float(np.sqrt(max(u**2 - float(found.covariance[row, row]), 0.0)))
    return FormSize(max(value, 0.0), u, points.size - float(found.bias[row]), points.law, beside)


def _covariance(noise: np.ndarray, known: SceneBudget | None, names: tuple[str, ...]) -> np.ndarray:
    """Of some values by all that is not exactly known: what a station's inputs move together, and the noise; NaN where
    it is not known."""
    if known is None or not set(names) <= {each.name for each in known}:
        return np.full_like(noise, np.nan)
    values = known.ufloats()
    shared = np.array(covariance_matrix([values[name] for name in names]))
    return shared + noise - np.diag(np.diag(noise))  # each value's own noise is in its budget
