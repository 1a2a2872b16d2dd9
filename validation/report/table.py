"""The tables of a validation, for a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from rich.console import Group
from rich.table import Table
from rich.text import Text

from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.report import guide
from validation.report.cells import pose
from validation.report.cells import table as _table
from validation.report.run_cells import (
    failed,
    far,
    is_printed,
    names,
    number,
    of_errors,
    of_measurand,
    of_paper,
    of_variances,
    other_methods,
    ratio,
    small_sigma,
)


def report(found: Validation, explained: bool = False, reasons: Mapping[str, str] = MappingProxyType({})) -> Group:
    """Everything that ``ice validate`` prints, each table with its terms; ``explained``: all of them at length.

    ``reasons`` says by status what decided it, as of `validation.report.station.reasons`.
    """
    parts = [Text(found.title, style="bold"), *_variances(found), *_ratios(found, reasons)]
    parts += _measurands(found, reasons)
    if found.search:
        parts.append(_search(found))
    if found.refused:
        index, reason = next(iter(found.refused.items()))
        parts.append(Text(f"\n{len(found.refused)} settings without a result, the first ({index + 1}): {reason}"))
    parts += [
        *_correlations(found),
        _time(found),
        Text(f"\n{guide.plain_verdict(found)}"),
        Text(found.verdict.text, style="bold green" if found.verdict.agrees else "bold red"),
        _lines(guide.verdict_terms()),
    ]
    if explained:
        parts.append(Text("\n" + guide.EXPLAINED))
    return Group(*parts)


def _lines(lines: list[str]) -> Text:
    """What is said below a table."""
    return Text("\n".join(f" {line}" for line in lines if line))


def _several(found: Validation) -> bool:
    """Whether a row that is shown has several measurands."""
    return any(len(row.measurands) > 1 for row in far(found)[0])


def _what(found: Validation) -> str:
    """What the tables in px are about."""
    return (
        f"the first measurand, {found.rows[0].measurands[0].name}, in the image" if _several(found) else "the distance"
    )


def _variances(found: Validation) -> list[Table | Text]:
    rows, which = far(found)
    headings, cells = names(found, rows)
    main, others, printed = rows[0].main.method, other_methods(rows), is_printed(found)
    paper = ["paper\nICE", "ours\nICE", "ours/\npaper", "paper real\n12.0", "\n10.0"] if printed else []
    table = _table(
        f"\n{'Table 3: variance' if printed else 'Variance'} of {_what(found)}", *headings, *paper,
        "predicted\ncalibrated", "\npropagated", f"measured\n{main}", *(f"\n{name}" for name in others),
        "Cramer-Rao\nbound",
    )  # fmt: skip
    for row in rows:
        table.add_row(*cells[row.index], *(_paper(row) if printed else []), *of_variances(row, others))
    images = max(row.main.n for row in rows)
    return [table, _lines([*guide.paper_terms(found), *guide.variance_terms([main, *others], images), which])]


def _paper(row: Row) -> list[str]:
    """What the paper printed, and our number for it."""
    theirs, ours, *real = of_paper(row)
    return [theirs, ours, number(row.paper / row.paper_ice if row.paper_ice else None), *real]


_PARTS = (
    "parts: the textures' standard deviation over parts. It does not average over pictures; pred. and meas. have the",
    "shift of the one part that the seeds roll, and the difference of the two is judged.",
)


def _ratios(found: Validation, reasons: Mapping[str, str]) -> list[Table | Text]:
    rows, which = far(found)
    headings, cells = names(found, rows)
    main, others = rows[0].main.method, other_methods(rows)
    uneven = any(row.texture is not None for row in rows)
    table = _table(
        "\nMeasured / propagated variance, with the 95 % chi-square interval",
        *headings, main, *others, "n", "failed", *["parts px\nsigma"] * uneven, "bias px\noff", "\nleft", "rmse px",
        "status",
    )  # fmt: skip
    for row in rows:
        judged = {j.method: j for j in (row.main, *row.classic)}
        each = [ratio(judged[name]) if name in judged else "-" for name in (main, *others)]
        parts = [small_sigma(row.texture)] * uneven
        table.add_row(*cells[row.index], *each, str(row.main.n), failed(row), *parts, *of_errors(row))
    terms = guide.ratio_terms(main, 1 + len(others)) + guide.statuses((row.main.status for row in rows), reasons)
    return [table, _lines([*terms, *(_PARTS if uneven else ()), which])]


def _measurands(found: Validation, reasons: Mapping[str, str]) -> list[Table | Text]:
    """Every measurand of the rows that are shown, in the scene's unit."""
    rows, which = far(found)
    headings, cells = names(found, rows)
    table = _table(
        "\nAll measurands, in the scene's unit" if _several(found) else "\nThe same in the scene's unit of length",
        *headings, "measurand", "value", "unit", "sigma\ncalibrated", "\npropagated", "\nmeasured", "variances'\nratio",
        "bias\nleft", "\nu(bias)", "status",
    )  # fmt: skip
    for row in rows:
        for each in row.measurands:
            table.add_row(*cells[row.index], *of_measurand(each))
    statuses = guide.statuses((each.status for row in rows for each in row.measurands), reasons)
    return [table, _lines([*guide.unit_terms(_several(found)), *statuses, which])]


def _search(found: Validation) -> Table:
    columns = ("sensor", "light", "paper ICE", "ours ICE", "ours/paper")
    rows = [
        (pose(sensor), pose(light), number(theirs, 4), number(ours, 4), number(ours / theirs if theirs else None))
        for _, sensor, light, theirs, ours in found.search
    ]
    return _table("\nTable 1 of the paper (its search), same free scale", *columns, rows=rows)


_PAIRS = {
    "paper_with_empirical": "our ICE, measured",
    "calibrated_with_empirical": "calibrated, measured",
    "propagated_with_empirical": "propagated, measured",
    "printed_ice_with_empirical": "the paper's ICE column, our measured",
    "printed_ice_with_printed_real_12": "the paper's ICE and real columns as printed, threshold 12",
    "printed_ice_with_printed_real_10": "the paper's ICE and real columns as printed, threshold 10",
}


def _correlations(found: Validation) -> list[Table | Text]:
    claimed = found.correlation.get("claimed_by_paper")
    table = _table("\nCorrelation of variances", "", "Pearson", "Spearman", "rows", words=("",))
    for key, words in _PAIRS.items():
        pair = found.correlation.get(key)
        if pair:
            table.add_row(words, f"{pair['pearson']:.3f}", f"{pair['spearman']:.3f}", str(pair["rows"]))
    if not table.row_count:
        return []
    paper = f"The paper claims {claimed} for its own columns; it does not follow from them as printed."
    return [table, _lines([*guide.correlation_terms(), paper if claimed else ""])]


def _time(found: Validation) -> Text:
    spent = dict(found.seconds)
    wall, workers = spent.pop("wall"), spent.pop("workers")
    parts = ", ".join(f"{name} {value:.1f}" for name, value in spent.items())
    return Text(
        f"\nTime: {wall:.1f} s with {workers} worker{'s' * (workers > 1)} on {found.variant}. Working seconds: {parts}."
    )
