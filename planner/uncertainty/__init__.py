"""Metrology of a measured quantity, free of images and scenes: budgets, Monte Carlo, capability, what to improve.

GUM (JCGM 100) for the budget, JCGM 101 for Monte Carlo and the comparison, JCGM 106 and ISO 14253-1 for decisions.

>>> repeats = Input("repeats", 0.0, 1.2, dof=9, type="A", kind="noise")
>>> focal = Input.from_half_width("focal length", 25.0, 0.002, unit="mm")
>>> found = budget("diameter", "um", 12004.0, [repeats, focal], {"repeats": 1.0, "focal length": 480.0})
>>> print(f"{found.value:.0f} um +- {found.U:.1f} um, k = {found.k:.2f}")
12004 um +- 2.9 um, k = 2.16
"""

from planner.uncertainty.budget import Budget, Contribution, budget, coverage_factor, effective_dof
from planner.uncertainty.capability import Gauge, gauge, tur
from planner.uncertainty.conformity import decide
from planner.uncertainty.groups import Group, Source, draw, members
from planner.uncertainty.improve import Improvement, Needed, improvements, needed, scaled
from planner.uncertainty.inputs import Input
from planner.uncertainty.monte_carlo import (
    Enough,
    MonteCarlo,
    monte_carlo,
    monte_carlo_all,
    numerical_tolerance,
    shortest_interval,
)  # fmt: skip
from planner.uncertainty.risks import Limits, Risks, global_risks, nonconforming_probability
from planner.uncertainty.ufloats import as_ufloats
from planner.uncertainty.validation import Validation, validate

__all__ = [
    "Budget", "Contribution", "Enough", "Gauge", "Group", "Improvement", "Input", "Limits", "MonteCarlo", "Needed",
    "Risks", "Source", "Validation", "as_ufloats", "budget", "coverage_factor", "decide", "draw", "effective_dof",
    "gauge", "global_risks", "improvements", "members", "monte_carlo", "monte_carlo_all", "needed",
    "nonconforming_probability", "numerical_tolerance", "scaled", "shortest_interval", "tur",
    "validate",
]  # fmt: skip
