"""What ``ice msa`` prints: the predicted measurement system, and a study beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from planner.uncertainty.msa import (
    COMPONENTS,
    LARGEST,
    Checked,
    Guard,
    Study,
    found_by,
    smallest_study,
    too_large,
)
from scenes.status import is_trusted, legend
from validation.msa import Predicted
from validation.report import cells

_TERMS = (
    " EV: from repeat to repeat. AV: from operator to operator, with parts, too. GRR: both. % of T: 6 GRR over the"
    " tolerance's whole width; % of TV: GRR over the whole spread, of the manufacture, too (process_sd). ndc: distinct"
    " categories. Cg, Cgk: of repeats on one part, Cgk with a bias of one standard uncertainty of what stays the same"
    " (constant), which no study shows. Customary limits: % at most 10 (30), ndc at least 5, Cg and Cgk at least 1.33."
)
_OF_STUDY = (
    " study / predicted: of each mean square over the one below it, 1 where the prediction is right, with its 95 %"
    " interval. p: probability of at least so much, were the prediction right."
)


def report(
    told: Sequence[Predicted],
    sizes: Mapping[str, tuple[int, int, int]],
    made: Mapping[str, Study],
    checks: Mapping[str, Sequence[Checked]],
    guards: Mapping[str, Guard | None],
) -> Group:
    """The prediction of each measurand, what a study says of it, and guard bands."""
    parts = [_predicted(told), Text(_TERMS), *(Text(f" {line}") for line in legend([each.status for each in told]))]
    parts += [Text("\n" + "\n".join(f" {power(each, sizes[each.name])}" for each in told))]
    for each in told:
        if each.name in made:
            parts += [_study(each, made[each.name], checks[each.name]), Text(f" {sentence(each, checks[each.name])}")]
    if made:
        parts.append(Text(_OF_STUDY))
    return Group(*parts, *_guards(told, guards))


def sentence(each: Predicted, rows: Sequence[Checked]) -> str:
    """Whether a study is as predicted, and what is too large where it is not."""
    wrong = too_large(tuple(rows))
    if not is_trusted(each.status):
        return f"{each.name}: nothing is said of the prediction, whose status is {each.status}."
    if wrong:
        return f"{each.name}: larger than predicted: {', '.join(wrong)}."
    return f"{each.name}: no component is larger than predicted beyond chance."


def power(each: Predicted, size: tuple[int, int, int]) -> str:
    """How likely a study of some size finds what is twice as large as predicted, and the smallest that finds it all."""
    likely, least = found_by(each.components, *size), smallest_study(each.components)
    if not likely:
        return f"{each.name}: nothing is predicted that a study could find."
    rates = ", ".join(f"{name} {cells.percent(float(p))}" for name, p in likely.items())
    needed = f"no study of up to {_sized(LARGEST)} names" if least is None else f"{_sized(least)} name"
    return f"{each.name}: {_sized(size)} name a component twice as large with: {rates}; {needed} each with 90 %."


def _sized(size: tuple[int, ...]) -> str:
    return "{} operators, {} parts, {} repeats".format(*size)


def _predicted(told: Sequence[Predicted]) -> Table:
    columns = ("measurand", "unit", "EV", "AV", "GRR", "constant", "% of T", "% of TV", "ndc", "Cg", "Cgk", "status")
    table = cells.table("Predicted measurement system", *columns, words=("measurand", "unit", "status"))
    for each in told:
        kept = each.components
        table.add_row(
            each.name, each.unit, *(f"{sigma:.2g}" for sigma in (kept.repeats, kept.appraisers, kept.grr)),
            f"{each.constant:.2g}", cells.percent(kept.grr_of(each.width)) if each.width else "-",
            "-" if kept.grr_of_total is None else cells.percent(kept.grr_of_total),
            "-" if kept.ndc is None else str(kept.ndc), cells.number(each.cg), cells.number(each.cgk), each.status,
        )  # fmt: skip
    return table


def _study(each: Predicted, study: Study, rows: Sequence[Checked]) -> Table:
    title = f"\n{each.name} [{each.unit}]: a study of {_sized(study.values.shape)}"
    table = cells.table(title, "component", "study", "predicted", "study / predicted", "p", words=("component",))
    seen, wanted = (
        dict(zip(COMPONENTS, (kept.repeats, kept.both, kept.operators, kept.parts), strict=True))
        for kept in (study.components, each.components)
    )
    checked = {row.name: row for row in rows}
    for name in COMPONENTS:
        row = checked.get(name)
        over = "-" if row is None else f"{row.ratio:.3g} [{row.low:.3g}, {row.high:.3g}]"
        table.add_row(
            name, cells.number(seen[name]), cells.number(wanted[name]), over, "-" if row is None else f"{row.p:.2g}"
        )
    return table


def _guards(told: Sequence[Predicted], guards: Mapping[str, Guard | None]) -> list[Text]:
    """A line for each guard band of least cost."""
    lines = []
    for each in told:
        guard = guards[each.name]
        if guard is not None:
            where = "inside" if guard.width >= 0 else "outside"
            lines.append(
                f" {each.name}: wrong decisions cost least, {guard.cost:.3g} a part, with a guard band of"
                f" {abs(guard.width):.2g} {each.unit} {where} both limits (U = {2 * each.u:.2g});"
                f" wrongly accepted {guard.risks.wrong_acceptance:.2g}, rejected {guard.risks.wrong_rejection:.2g}"
            )
    return [Text("\n" + "\n".join(lines))] if lines else []
