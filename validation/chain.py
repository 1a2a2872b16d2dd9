"""From drawn inputs to measured values: in closed form, to second order, or through pictures.

The closed form moves every feature as the true station records it and evaluates it as the scene says, both exactly and
not linear in anything; pixel noise, fixed pattern, model error and rounding are added as drawn. Its second-order
expansion in the inputs costs microseconds a draw, so that JCGM 101's many draws are cheap; what it misses is measured
at some draws and told. Pictures have everything in themselves: noise, pattern and the estimator as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from measure import best_estimator, locate, measure
from measure.believed import believed
from planner.budgeting.budgets import SceneBudget
from planner.budgeting.station import Station
from planner.budgeting.terms import BIAS, EXPANSION, MODEL, NOISE, PATTERN, ROUNDING, TEMPERATURE, TOGETHER
from planner.uncertainty.groups import draw
from scenes import Picture
from scenes.cameras import estimated
from scenes.placement import COMPONENTS
from scenes.status import is_trusted
from validation.stations import exposed

if TYPE_CHECKING:
    from validation.remeasured import MeasuredValues

_AT_ONCE = 64  # pictures, or stations, in memory
_IN_A_PICTURE = (NOISE, PATTERN, MODEL, ROUNDING)


@dataclass(frozen=True, eq=False)
class Chain:
    """The model that a scene's budget linearises.

    Attributes
    ----------
    budget : SceneBudget
    """

    budget: SceneBudget

    @cached_property
    def here(self) -> Station:
        """The station as the scene says it."""
        return Station.nominal(self.budget.features.pictures)

    def deviations(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Drawn errors of the sources, in their order, shape (count, n)."""
        return self._errors(draw(self.budget.shared, rng, count), count)

    def _errors(self, drawn: dict[str, np.ndarray], count: int) -> np.ndarray:
        columns = [drawn[source.name] - source.value for source in self.budget.sources]
        return np.stack(columns, -1) if columns else np.zeros((count, 0))

    def model(self, m: int) -> Callable[[dict[str, np.ndarray]], np.ndarray]:
        """The m-th value as a function of drawn inputs by name, each (n,), to second order: what the engine draws."""

        def values(drawn: dict[str, np.ndarray]) -> np.ndarray:
            count = len(next(iter(drawn.values())))
            return self.expanded(self._errors(drawn, count), m) + self.added(m, drawn)

        return values

    def station(self, errors: np.ndarray) -> Station:
        """The station of one draw (n,)."""
        station = self.here
        for source, error in zip(self.budget.sources, errors, strict=True):
            if error != 0:
                station = source.moved(station, float(error))
        return station

    def exact(self, errors: np.ndarray) -> np.ndarray:
        """Values (count, M) of draws (count, n) without what is added; bias by levels, and what datums leave of the
        part's place and of the camera, to first order."""
        budget = self.budget
        first = np.array([source.kind == "brightness" or source.name in self._told for source in budget.sources], bool)
        placed = np.where(first, 0.0, errors)
        some = (placed[k : k + _AT_ONCE] for k in range(0, len(placed), _AT_ONCE))
        found = np.concatenate([budget.features.errors([self.station(row) for row in rows]) for rows in some])
        return believed(budget.picture, found) + errors[:, first] @ budget.sensitivities[:, first].T

    @property
    def _told(self) -> tuple[str, ...]:
        """Inputs that a picture tells itself, wherever the part lies: a measurement begins anew from there."""
        placement = self.budget.picture.scene.placement
        return (*COMPONENTS, *estimated.inputs(placement.camera)) if placement.is_estimated else ()

    @cached_property
    def expansion(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Value (M,), slopes (M, n) and curvatures (M, n, n) for draws in standard uncertainties."""
        u = np.array([source.told.u for source in self.budget.sources])
        count, spread = len(u), np.diag(u)
        rows = [np.zeros(count)]
        pairs = [(i, j) for i in range(count) for j in range(i)]
        for i in range(count):
            rows += [spread[i], -spread[i]]
        for i, j in pairs:
            rows += [spread[i] + spread[j], -spread[i] - spread[j]]
        values = self.exact(np.array(rows))
        middle, single, double = values[0], values[1 : 1 + 2 * count], values[1 + 2 * count :]
        ahead, behind = single[0::2], single[1::2]
        curved = np.zeros((len(middle), count, count))
        bent = ahead + behind - 2 * middle
        for i in range(count):
            curved[:, i, i] = bent[i]
        for k, (i, j) in enumerate(pairs):
            both = double[2 * k] + double[2 * k + 1] - 2 * middle
            curved[:, i, j] = curved[:, j, i] = (both - bent[i] - bent[j]) / 2
        return middle, ((ahead - behind) / 2).T, curved

    def expanded(self, errors: np.ndarray, m: int) -> np.ndarray:
        """The m-th value of draws (count, n) to second order, shape (count,)."""
        u = np.array([source.told.u or 1.0 for source in self.budget.sources])
        middle, slopes, curved = self.expansion
        x = errors / u
        return middle[m] + x @ slopes[m] + ((x @ curved[m]) * x).sum(-1) / 2

    def missed(self, rng: np.random.Generator, count: int = 50) -> np.ndarray:
        """Root mean square of what the expansion misses over the standard uncertainty, from some draws, shape (M,)."""
        errors = self.deviations(rng, count)
        exact = self.exact(errors)
        off = [self.expanded(errors, m) - exact[:, m] for m in range(exact.shape[1])]
        return np.array([np.sqrt(np.mean(o**2)) / b.u for o, b in zip(off, self.budget.measurands, strict=True)])

    def added(self, m: int, drawn: dict[str, np.ndarray], *, pictured: bool = False) -> np.ndarray:
        """What drawn terms add to the m-th value, (n,); without those that a picture has in itself.

        What inputs do together is in the inputs' own second order.
        """
        total, by_name = np.zeros(1), {term.name: term for term in self.budget.terms[m]}
        for name, term in by_name.items():
            if name not in (TEMPERATURE, EXPANSION, TOGETHER) and not (
                pictured and (name in _IN_A_PICTURE or name.startswith(BIAS))
            ):
                total = total + term.sensitivity * (drawn[name] - term.value)
        if EXPANSION in by_name:
            nominal = by_name[TEMPERATURE].value * by_name[EXPANSION].value
            excess = drawn[TEMPERATURE] * drawn[EXPANSION] - nominal
            total = total - self.budget.measurands[m].value * excess
        return total

    def pictured(
        self, rng: np.random.Generator, count: int, estimator: str | None = None, report=lambda done: None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Values (count, M) measured in one picture of each drawn station, and statuses; plain scenes only."""
        from validation.remeasured import Method, batches, remeasured

        stations, picture = map(self.station, self.deviations(rng, count)), self.budget.picture

        def exposures() -> Iterator[np.ndarray]:
            done = 0
            for size in batches(count, _AT_ONCE):
                yield exposed(itertools.islice(stations, size), rng)
                done += size
                report(done)

        if picture.scene.placement.is_estimated:
            found = _located(picture, exposures(), estimator)
        else:
            (found,) = remeasured(picture, exposures(), (Method(estimator or best_estimator(picture)),))
        for m, rows in enumerate(self.budget.terms):
            drawn = draw([row.as_input for row in rows], rng, count)
            found.object[:, m] += self.added(m, drawn, pictured=True)
        return self._rounded(found.object), found.status

    def _rounded(self, values: np.ndarray) -> np.ndarray:
        said = self.budget.picture.scene.uncertainty
        for m, each in enumerate(self.budget.measurands):
            step = said.rounding_deg if each.unit == "degrees" else said.rounding
            if step > 0:
                values[:, m] = np.round(values[:, m] / step) * step
        return values


def _located(picture: Picture, exposures: Iterable[np.ndarray], estimator: str | None) -> MeasuredValues:
    """What is measured where each image shows the part; no value where it is not found."""
    from validation.remeasured import MeasuredValues

    values, states = [], []
    for image in itertools.chain.from_iterable(exposures):
        where = locate(image, picture, estimator=estimator)
        if not is_trusted(where.status):
            values.append(np.full((2, len(picture.scene.quantities)), np.nan))
            states.append(np.full(len(picture.scene.quantities), where.status))
            continue
        told = measure(image, where.picture, estimator=estimator)
        values.append(np.stack([told.value_image, told.value]))
        states.append(told.status)
    in_image, in_object = np.swapaxes(values, 0, 1)
    return MeasuredValues(in_image, in_object, np.array(states))
