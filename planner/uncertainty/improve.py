"""What to improve next: which source, halved, reduces U most, and how well a source must be known for a wanted U."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy import special

from planner.uncertainty.budget import Budget, coverage_factor, effective_dof
from planner.uncertainty.checks import check_not_negative, check_positive
from planner.uncertainty.groups import Group, Source


@dataclass(frozen=True)
class Improvement:
    """What a source of `factor` times its u (a group: all of its members) makes of u_c and U, and what is gained."""

    source: str
    factor: float
    u: float
    U: float
    gain: float
    """Share of U that is saved, 1 - U / U before."""


@dataclass(frozen=True)
class Needed:
    """What one source must be for a wanted U, the others as they are.

    Attributes
    ----------
    source : str
    U_wanted : float
    reachable : bool
    u : float or None
        Largest standard uncertainty of the source (of a group: of its whole effect) that reaches it; None where it is
        not reachable, or where the source does not matter.
    factor : float or None
        The same, over what it is today; None as `u`, and where it is 0 today.
    floor : float
        U that is left when the source is exactly known.
    reason : str
        In words.
    """

    source: str
    U_wanted: float
    reachable: bool
    u: float | None
    factor: float | None
    floor: float
    reason: str


def scaled(budget: Budget, source: str, factor: float) -> Budget:
    """The budget with one source of `factor` times its standard uncertainty."""
    check_not_negative("factor", factor)
    budget.of(source)
    return budget.remade(_scaled(each, factor) if each.name == source else each for each in budget.sources)


def improvements(budget: Budget, factor: float = 0.5) -> tuple[Improvement, ...]:
    """Every source improved alone, the most useful first.

    Examples
    --------
    >>> from planner.uncertainty import Input, budget
    >>> found = budget("width", "um", 0.0, [Input("noise", 0, 3), Input("scale", 0, 4)], {"noise": 1, "scale": 1})
    >>> [(each.source, round(each.u, 3), round(each.gain, 2)) for each in improvements(found)]
    [('scale', 3.606, 0.28), ('noise', 4.272, 0.15)]
    """
    found = []
    for row in budget.contributions:
        better = scaled(budget, row.source, factor)
        gain = 1 - better.U / budget.U if budget.U > 0 else 0.0
        found.append(Improvement(row.source, factor, better.u, better.U, gain))
    return tuple(sorted(found, key=lambda each: -each.gain))


def needed(budget: Budget, U_wanted: float, source: str) -> Needed:
    """How well a source must be known so that U becomes U_wanted (the question backwards).

    u = sqrt((U_wanted / k)^2 - u_others^2) / abs(c) where no source has finite degrees of freedom. Otherwise k changes
    with u, and u is found by bisection; U never exceeds U_wanted at the result.

    Raises
    ------
    InvalidInput

    Examples
    --------
    >>> from planner.uncertainty import Input, budget
    >>> found = budget("width", "um", 0.0, [Input("noise", 0, 3), Input("scale", 0, 4)], {"noise": 1, "scale": 2})
    >>> answer = needed(found, 10.0, "scale")
    >>> round(answer.u, 3), answer.reason
    (2.063, 'u(scale) of at most 2.06 reaches U = 10 um')
    >>> needed(found, 5.0, "scale").reason
    'not reachable: U is 5.88 um with scale exactly known'
    """
    check_positive("U_wanted", U_wanted)
    row = budget.of(source)
    floor, unit = budget.without(source).U, f" {budget.unit}" if budget.unit else ""
    reachable = floor <= U_wanted
    if not reachable:
        reason = f"not reachable: U is {floor:.3g}{unit} with {source} exactly known"
        return Needed(source, U_wanted, False, None, None, floor, reason)
    c = abs(row.sensitivity)
    if c == 0 or (row.members and row.contribution == 0):
        reason = f"{source} does not change U, which is {floor:.3g}{unit}"
        return Needed(source, U_wanted, True, None, None, floor, reason)
    u = _largest(budget, row.source, U_wanted) / c
    reason = f"u({source}) of at most {u:.3g} reaches U = {U_wanted:.3g}{unit}"
    return Needed(source, U_wanted, True, u, u / row.u if row.u > 0 else None, floor, reason)


def _largest(budget: Budget, source: str, U_wanted: float) -> float:
    """Largest contribution |c| u of a source that keeps U within U_wanted."""
    kept = [row for row in budget.contributions if row.source != source]
    others, dofs = [row.contribution for row in kept], [row.dof for row in kept]
    rest, own = math.hypot(*others), budget.of(source).dof
    most = math.sqrt(max((U_wanted / special.ndtri((1 + budget.p) / 2)) ** 2 - rest**2, 0.0))
    if math.isinf(own) and all(math.isinf(dof) for dof in dofs):
        return most

    def reached(x: float) -> bool:
        k = coverage_factor(budget.p, effective_dof([*others, x], [*dofs, own]))
        return k * math.hypot(rest, x) <= U_wanted

    low, high = 0.0, most
    if reached(high):
        return high
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (middle, high) if reached(middle) else (low, middle)
    return low


def _scaled(source: Source, factor: float) -> Source:
    if isinstance(source, Group):
        return replace(source, inputs=tuple(replace(each, u=factor * each.u) for each in source.inputs))
    return replace(source, u=factor * source.u)
