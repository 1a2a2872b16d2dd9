"""The GUM's uncertainty budget: u_c^2 = c' V c, its rows, effective degrees of freedom, k and U = k u_c.

First order only: the higher-order terms of GUM 5.1.2 (note) are not included. Where they matter, the sensitivity of
a row is (near) 0 though the source is not harmless; `validate` shows it, as Monte Carlo has all orders.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special  # not stats, which takes longer to load than a budget to compute

from planner.uncertainty.checks import check_finite
from planner.uncertainty.groups import Group, Source, members
from scenes.arrays import number
from scenes.errors import InvalidInput
from scenes.results import Shown, value


@dataclass(frozen=True)
class Contribution:
    """A row of a budget.

    Attributes
    ----------
    source : str
    u : float
        Standard uncertainty of the input, in its unit; of a group its whole effect, in the measurand's.
    sensitivity : float
        d measurand / d input; 1 for a group.
    contribution : float
        Absolute sensitivity times u, in the measurand's unit.
    share : float
        Of the variance u_c^2; shares add to 1 (all 0 where u_c is 0).
    type : {"A", "B", "A+B"}
    dof : float
    kind : {"noise", "systematic"}
        Repeatability, or accuracy.
    members : tuple of Contribution
        The inputs of a group; their shares c_i (V c)_i / u_c^2 add to the group's, and can be negative.
    """

    source: str
    u: float
    sensitivity: float
    contribution: float
    share: float
    type: str
    dof: float
    kind: str
    members: tuple[Contribution, ...] = ()


@dataclass(frozen=True, repr=False)
class Budget(Shown):
    """Uncertainty of one measurand; made by `budget`.

    Attributes
    ----------
    name, unit : str
    value : float
    contributions : tuple of Contribution
    u : float
        Combined standard uncertainty u_c.
    dof : float
        Effective degrees of freedom (Welch-Satterthwaite, GUM G.4), a group counted as one term.
    k : float
        Student's factor for p at dof rounded down (GUM G.4.1).
    U : float
        k u.
    p : float
        Coverage probability.
    correlated : float
        Part of u^2 that correlations add (negative: take away).
    sources : tuple of Input or Group
    sensitivities : dict
    """

    name: str
    unit: str
    value: float
    contributions: tuple[Contribution, ...]
    u: float
    dof: float
    k: float
    U: float
    p: float
    correlated: float
    sources: tuple[Source, ...]
    sensitivities: dict[str, float]

    @property
    def repeatability(self) -> float:
        """Standard uncertainty by what differs in every repeat (kind "noise")."""
        return self._part("noise")

    @property
    def accuracy(self) -> float:
        """Standard uncertainty by what stays the same in repeats (kind "systematic")."""
        return self._part("systematic")

    @property
    def interval(self) -> tuple[float, float]:
        """value - U, value + U."""
        return self.value - self.U, self.value + self.U

    def of(self, source: str) -> Contribution:
        """The row of a source."""
        for row in self.contributions:
            if row.source == source:
                return row
        known = ", ".join(row.source for row in self.contributions)
        raise InvalidInput(f"source must be one of {known}, got {source}")

    def without(self, source: str) -> Budget:
        """The same budget less one row: that source exactly known."""
        self.of(source)
        return self.remade(each for each in self.sources if each.name != source)

    def remade(self, sources: Iterable[Source]) -> Budget:
        """The budget of other sources of known names, sensitivities as they are."""
        kept = tuple(sources)
        names = {each.name for source in kept for each in members(source)}
        sensitivities = {name: c for name, c in self.sensitivities.items() if name in names}
        return budget(self.name, self.unit, self.value, kept, sensitivities, self.p)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a row for JSON or CSV; infinite degrees of freedom are None (null, empty)."""
        keys = ("source", "u", "sensitivity", "contribution", "share", "type")
        return [
            {key: getattr(row, key) for key in keys} | {"dof": row.dof if math.isfinite(row.dof) else None}
            for row in self.contributions
        ]

    def _line(self) -> str:
        whole = value(self.value, self.U, self.unit)
        return f"{self.name} {whole}, k = {self.k:.2f}, {len(self.contributions)} sources"

    def _part(self, kind: str) -> float:
        return math.hypot(*(row.contribution for row in self.contributions if row.kind == kind))


def budget(
    name: str, unit: str, value: float, inputs: Iterable[Source], sensitivities: Mapping[str, float], p: float = 0.95
) -> Budget:
    """The budget of a measurand from its inputs.

    Parameters
    ----------
    name, unit, value
        Of the measurand.
    inputs : iterable of Input or Group
        Independent of each other, but within a group.
    sensitivities : mapping of str to float
        d measurand / d input, by the name of every input (those of groups too).
    p : float
        Coverage probability, between 0 and 1.

    Raises
    ------
    InvalidInput

    Examples
    --------
    >>> from planner.uncertainty.inputs import Input
    >>> repeats = Input("repeats", 0.0, 3.0, dof=9, type="A", kind="noise")
    >>> scale = Input.from_half_width("scale", 1.0, 0.04)
    >>> found = budget("width", "um", 200.0, [repeats, scale], {"repeats": 1.0, "scale": 200.0})
    >>> [round(x, 3) for x in (found.u, found.dof, found.k, found.U, found.of("scale").share)]
    [5.508, 102.235, 1.983, 10.924, 0.703]
    """
    sources, sensitivities = tuple(inputs), {key: float(c) for key, c in dict(sensitivities).items()}
    _check(sources, sensitivities, value, p)
    parts = [_variance(source, sensitivities) for source in sources]
    variance = math.fsum(parts)
    rows = tuple(_row(source, part, sensitivities, variance) for source, part in zip(sources, parts, strict=True))
    alone = math.fsum((sensitivities[x.name] * x.u) ** 2 for source in sources for x in members(source))
    dof = effective_dof([row.contribution for row in rows], [row.dof for row in rows])
    k, u = coverage_factor(p, dof), math.sqrt(variance)
    return Budget(name, unit, float(value), rows, u, dof, k, k * u, p, variance - alone, sources, sensitivities)


def effective_dof(contributions: Iterable[float], dof: Iterable[float]) -> float:
    """Welch-Satterthwaite: u_c^4 / sum of u_i^4 / dof_i (GUM eq. G.2b); infinite where no term is of finite dof.

    >>> round(effective_dof([25.0, 9.7, 2.9, 16.6], [18, 25.6, 50, 2]), 1)
    16.8
    """
    u, dof = np.array(list(contributions), float), np.array(list(dof), float)
    scale = u.max(initial=0.0)
    if scale == 0:
        return math.inf
    terms = float(((u / scale) ** 4 / dof).sum())
    return float(((u / scale) ** 2).sum()) ** 2 / terms if terms > 0 else math.inf


def coverage_factor(p: float, dof: float = math.inf) -> float:
    """k for a coverage probability p, two-sided, from Student's t at dof rounded down (GUM G.4.1, table G.2).

    >>> round(coverage_factor(0.99, 16.8), 2), round(coverage_factor(0.95), 2)
    (2.92, 1.96)
    """
    if not 0 < p < 1:
        raise InvalidInput(f"p must be between 0 and 1, got {p}")
    if not dof >= 1 - 1e-9:
        raise InvalidInput(f"dof must be at least 1, got {dof}")
    if math.isinf(dof):
        return float(special.ndtri((1 + p) / 2))
    whole = float(math.floor(dof * (1 + 1e-9)))  # a sum that rounds to 8.999... is 9
    return float(special.stdtrit(whole, (1 + p) / 2))


def _check(sources: tuple[Source, ...], sensitivities: dict[str, float], value: float, p: float) -> None:
    """Names are used once, every one has a finite sensitivity, p is a probability."""
    names = [each.name for source in sources for each in members(source)]
    for used in (names, [source.name for source in sources]):
        for name in used:
            if used.count(name) > 1:
                raise InvalidInput(f"inputs must be of different names, got {name} {used.count(name)} times")
    for name in names:
        if name not in sensitivities:
            raise InvalidInput(f"sensitivity of {name} must be given, got nothing")
        check_finite(f"sensitivity of {name}", sensitivities[name])
    if unknown := sorted(set(sensitivities) - set(names)):
        raise InvalidInput(f"sensitivities must be of known inputs, got {unknown[0]}")
    check_finite("value", value)
    if not 0 < number(p, "p") < 1:
        raise InvalidInput(f"p must be between 0 and 1, got {p}")


def _variance(source: Source, sensitivities: Mapping[str, float]) -> float:
    """c' V c of one row."""
    if not isinstance(source, Group):
        return (sensitivities[source.name] * source.u) ** 2
    c = np.array([sensitivities[each.name] for each in source.inputs])
    return max(float(c @ source.covariance @ c), 0.0)  # rounding, where correlation cancels all


def _row(source: Source, part: float, sensitivities: Mapping[str, float], variance: float) -> Contribution:
    share = part / variance if variance > 0 else 0.0
    if not isinstance(source, Group):
        c = sensitivities[source.name]
        return Contribution(source.name, source.u, c, abs(c) * source.u, share, source.type, source.dof, source.kind)
    c = np.array([sensitivities[each.name] for each in source.inputs])
    shares = c * (source.covariance @ c) / variance if variance > 0 else np.zeros(len(c))
    inner = tuple(
        Contribution(x.name, x.u, float(cx), abs(float(cx)) * x.u, float(s), x.type, x.dof, x.kind)
        for x, cx, s in zip(source.inputs, c, shares, strict=True)
    )
    types = "+".join(sorted({each.type for each in source.inputs}))
    return Contribution(
        source.name, math.sqrt(part), 1.0, math.sqrt(part), share, types, source.dof, source.kind, inner
    )
