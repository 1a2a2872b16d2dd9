"""Budgets as numbers of the `uncertainties` package, for further calculation with what they have in common."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import uncertainties

from planner.uncertainty.groups import Group, Source
from scenes.errors import InvalidInput

if TYPE_CHECKING:
    from planner.uncertainty.budget import Budget


def as_ufloats(budgets: Iterable[Budget]) -> dict[str, uncertainties.UFloat]:
    """One number a measurand, by its name: value with standard uncertainty u (not U).

    Sources of the same name are one variable in all budgets, so that what is calculated from several measurands knows
    their correlation. Degrees of freedom and distributions are not carried: the package knows standard deviations
    alone.

    Raises
    ------
    InvalidInput
        Where two budgets mean different things by a name.

    Examples
    --------
    >>> from planner.uncertainty import Input, budget
    >>> scale = Input("scale", 1.0, 0.001)
    >>> pair = [budget(name, "mm", x, [scale], {"scale": x}) for name, x in (("width", 30.0), ("depth", 10.0))]
    >>> found = as_ufloats(pair)
    >>> print(f"{found['width']:.3f}", f"{(found['width'] - 3 * found['depth']).s:.3f}")
    30.000+/-0.030 0.000
    """
    budgets = tuple(budgets)
    known: dict[str, Source] = {}
    owners: dict[str, str] = {}
    variables: dict[str, uncertainties.UFloat] = {}
    for each in budgets:
        for source in each.sources:
            if known.setdefault(source.name, source) != source:
                raise InvalidInput(f"{source.name} must be the same input in every budget, got two different ones")
            made = _variables(source)
            for name in made:
                if owners.setdefault(name, source.name) != source.name:
                    raise InvalidInput(f"{name} must be in the same group in every budget, got two different ones")
                variables.setdefault(name, made[name])
    names = [each.name for each in budgets]
    if len(set(names)) < len(names):
        raise InvalidInput(f"budgets must be of different names, got {', '.join(names)}")
    return {
        each.name: each.value + sum((c * variables[name] for name, c in each.sensitivities.items()), start=0.0)
        for each in budgets
    }


def _variables(source: Source) -> dict[str, uncertainties.UFloat]:
    """Errors of the inputs (mean 0) by name."""
    if not isinstance(source, Group):
        return {source.name: uncertainties.ufloat(0.0, source.u, tag=source.name)}
    names = [each.name for each in source.inputs]
    pairs = [(0.0, each.u) for each in source.inputs]
    made = uncertainties.correlated_values_norm(pairs, source.correlation, tags=names)
    return dict(zip(names, made, strict=True))
