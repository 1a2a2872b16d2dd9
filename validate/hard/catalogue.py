"""The whole catalogue."""

from __future__ import annotations

from validate.hard import fit_cases, measure_cases, planner_cases, reflectance_cases
from validate.hard.case import Case


def catalogue() -> list[Case]:
    """All hard cases, in the order of the table."""
    return reflectance_cases.cases() + planner_cases.cases() + fit_cases.cases() + measure_cases.cases()
