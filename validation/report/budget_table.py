"""Uncertainty budgets in words: one table a measurand, for terminal and page, and the sentence that is signed."""

from __future__ import annotations

import math

from rich.table import Table

from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.budget import Budget, Contribution
from planner.uncertainty.conformity import COVERAGE
from scenes.status import doubt, is_trusted
from validation.report import cells

TERMS = (
    "u: standard uncertainty of a source; contribution = |sensitivity| u; share of u_c^2; A: from observations or the",
    "noise model, B: otherwise; dof: degrees of freedom, - : infinite. U = k u_c: the value lies within +- U with the",
    "probability given. TUR: half the tolerance over U. Cg, Cgk: capability of the gauge, from simulated repeats.",
)

COLUMNS = ["source", "u", "sensitivity", "contribution", "share", "type", "dof"]
_LEAST = 5e-4  # of the variance: sources below are one row


def table(budget: Budget) -> Table:
    """All contributions to one measurand, the largest first; the small ones together."""
    shown = cells.table(f"{budget.name} [{budget.unit}]", *COLUMNS, words=("source", "type"))
    rows = sorted(budget.contributions, key=lambda row: -row.share)
    rest = [row for row in rows if row.share < _LEAST]
    for row in rows[: len(rows) - len(rest)]:
        shown.add_row(*_row(row, cells.number(row.sensitivity), "-"))
    if rest:
        together = math.hypot(*(row.contribution for row in rest))
        share = sum(row.share for row in rest)
        shown.add_row(f"others ({len(rest)})", "", "", f"{together:.3g}", f"{100 * share:.2f} %", "", "")
    return shown


def lines(budget: Budget) -> list[list[str]]:
    """The same for a page, where nothing is left out."""
    return [_row(row, f"{row.sensitivity:.3g}", "") for row in sorted(budget.contributions, key=lambda row: -row.share)]


def _row(row: Contribution, sensitivity: str, infinite: str) -> list[str]:
    dof = infinite if math.isinf(row.dof) else f"{row.dof:.0f}"
    share = f"{100 * row.share:.1f} %"
    return [row.source, f"{row.u:.3g}", sensitivity, f"{row.contribution:.3g}", share, row.type, dof]


def note(found: SceneBudget, m: int) -> str:
    """Sum and sentence of the m-th measurand."""
    return f"{summary(found.measurands[m])}. {signed(found, m)}."


def summary(budget: Budget) -> str:
    """Its sum, and repeatability and accuracy apart."""
    dof = "infinite" if math.isinf(budget.dof) else f"{budget.dof:.0f}"
    return (
        f"u_c = {budget.u:.3g}, dof_eff = {dof}, k = {budget.k:.3g}, U = {budget.U:.3g} {budget.unit}"
        f" ({100 * budget.p:g} %); repeatability u = {budget.repeatability:.3g}, accuracy u = {budget.accuracy:.3g}"
    )


def signed(found: SceneBudget, m: int) -> str:
    """`sentence` of the m-th measurand."""
    u = 0.0 if found.unsure is None else found.u_bias[m]
    return sentence(found.measurands[m], found.picture.scene.quantities[m].kind, found.statuses[m], u)


def sentence(budget: Budget, kind: str, status: str, u_bias: float = 0.0) -> str:
    """What is signed: value and expanded uncertainty, to two digits of it; or that nothing is, and why.

    Parameters
    ----------
    budget : Budget
    kind, status : str
        Of the measurand.
    u_bias : float
        Standard uncertainty of its bias; 0 and infinite: not known.
    """
    places = decimals(budget.U)
    what = kind if budget.name == kind else f"{kind} {budget.name!r}"
    unit = budget.unit
    if not is_trusted(status):
        reach = f"{COVERAGE * u_bias:.1g} {unit}" if 0 < u_bias < math.inf else ""
        return f"The {what} is not signed: {doubt(status, reach)}"
    return f"The {what} is {budget.value:.{places}f} {unit} +- {budget.U:.{places}f} {unit}, k = {budget.k:.1f}"


def decimals(uncertainty: float) -> int:
    """Decimal places that show two digits of an uncertainty.

    >>> decimals(0.0058), decimals(0.012), decimals(3.0)
    (4, 3, 1)
    """
    return 4 if not uncertainty > 0 else max(0, min(12, 1 - math.floor(math.log10(uncertainty))))
