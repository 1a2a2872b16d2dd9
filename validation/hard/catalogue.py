"""The whole catalogue."""

from __future__ import annotations

from validation.hard import fit_cases, limb_cases, measure_cases, planner_cases, reflectance_cases, render_cases
from validation.hard.case import Case


def catalogue() -> list[Case]:
    """All hard cases, in the order of the table."""
    areas = (reflectance_cases, planner_cases, limb_cases, fit_cases, measure_cases, render_cases)
    return [case for area in areas for case in area.cases()]
