"""The tables of a validation, for a terminal."""

from __future__ import annotations

import heapq
import math

from rich.console import Group
from rich.table import Table
from rich.text import Text

from scenes import shown
from validation.batch.result import Validation
from validation.batch.rows import Judged, Row

_ROWS = 64  # of a table; table.csv has all
_UNIT = 1e-4  # px^2; what the measured variances are printed in


def report(found: Validation) -> Group:
    """Everything that ``ice validate`` prints."""
    parts = [Text(found.title, style="bold"), _variances(found), _ratios(found)]
    if _several(found):
        parts.append(_measurands(found))
    if found.search:
        parts.append(_search(found))
    if found.refused:
        index, reason = next(iter(found.refused.items()))
        parts.append(Text(f"\n{len(found.refused)} settings without a result, the first ({index + 1}): {reason}"))
    parts += [
        _correlations(found),
        _time(found),
        Text(),
        Text(found.verdict.text, style="bold green" if found.verdict.agrees else "bold red"),
    ]
    return Group(*parts)


def _table(title: str, *columns: str, caption: str | None = None) -> Table:
    table = Table(
        title=title,
        caption=caption,
        title_justify="left",
        caption_justify="left",
        box=None,
        padding=(0, 1),
        title_style="bold",
    )
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def far(found: Validation) -> tuple[list[Row], str]:
    """Rows to show, and which they are: all of them, or of many those that are farthest from their prediction."""
    if len(found.rows) <= _ROWS:
        return list(found.rows), ""
    rows = heapq.nsmallest(_ROWS, found.rows, key=lambda row: -abs(math.log(row.main.ratio or 1.0)))
    return rows, f"The {_ROWS} of {len(found.rows)} settings farthest from their prediction; all are in table.csv."


def names(found: Validation, rows: list[Row]) -> tuple[list[str], dict[int, list[str]]]:
    """Headings of the columns that tell a run's settings apart, and the cells of some rows by setting."""
    first = found.rows[0]
    swept, many = dict.fromkeys(first.parameters, False), False
    for row in found.rows:
        many = many or row.scene != first.scene
        for key, value in row.parameters.items():
            swept[key] = swept[key] or str(value) != str(first.parameters[key])
    keys = [key for key, several in swept.items() if several]
    cells = {
        row.index: [
            *([row.scene] if many else []), *(str(row.parameters[key]) for key in keys),
            shown(row.sensor), shown(row.light),
        ]
        for row in rows
    }  # fmt: skip
    return [*(["scene"] if many else []), *keys, "sensor", "light"], cells


def _several(found: Validation) -> bool:
    """Whether a row that is shown has several measurands."""
    return any(len(row.measurands) > 1 for row in far(found)[0])


def _what(found: Validation) -> str:
    """What the tables in px are about."""
    return (
        f"the first measurand, {found.rows[0].measurands[0].name}, in the image" if _several(found) else "the distance"
    )


def _variances(found: Validation) -> Table:
    rows, which = far(found)
    headings, cells = names(found, rows)
    others = list(dict.fromkeys(judged.method for row in rows for judged in row.classic))
    printed = any(row.paper_ice or row.paper_real for row in found.rows)
    paper = ["paper\nICE", "ours\nICE", "ours/\npaper", "paper real\n12.0", "\n10.0"] if printed else []
    captions = [
        "paper, ours ICE: the paper's px^2, ours with one free scale for all rows. Others: 1e-4 px^2, absolute."
    ]
    captions = [*(captions if printed else ["1e-4 px^2, absolute."]), which]
    table = _table(
        f"\nTable 3: variance of {_what(found)}", *headings, *paper, "predicted\ncalibrated", "\npropagated",
        f"measured\n{rows[0].main.method}", *(f"\n{name}" for name in others), "Cramer-Rao\nbound",
        caption="\n".join([*filter(None, captions), "- : the paper prints N/A, or nothing could be measured."]),
    )  # fmt: skip
    for row in rows:
        classic = {judged.method: judged.empirical for judged in row.classic}
        table.add_row(
            *cells[row.index], *(_paper(row) if printed else []), small(row.calibrated), small(row.main.propagated),
            small(row.main.empirical), *(small(classic.get(name)) for name in others), small(row.bound),
        )  # fmt: skip
    return table


def _paper(row: Row) -> list[str]:
    """What the paper printed, and our number for it."""
    against = number(row.paper / row.paper_ice if row.paper_ice else None)
    return [number(row.paper_ice), number(row.paper), against, *map(number, row.paper_real or (None, None))]


_PARTS = (
    "parts: the textures' standard deviation over parts. It does not average over pictures; pred. and meas. have the\n"
    "shift of the one part that the seeds roll, and the difference of the two is judged."
)


def _ratios(found: Validation) -> Table:
    rows, which = far(found)
    headings, cells = names(found, rows)
    main, others = rows[0].main.method, list(dict.fromkeys(j.method for row in rows for j in row.classic))
    caption = (
        f"* : 1 lies outside the interval. failed: one number a method.\nThe verdict is about {main}, as are bias "
        "(mean error) and rmse, sqrt(variance + bias^2)."
    )
    uneven = any(row.texture is not None for row in rows)
    table = _table(
        "\nMeasured / propagated variance, with the 95 % chi-square interval",
        *headings, main, *others, "n", "failed", *["parts px\nsigma"] * uneven, "bias px\npred.", "\nmeas.", "rmse px",
        "status", caption="\n".join(filter(None, [caption, _PARTS * uneven, which])),
    )  # fmt: skip
    for row in rows:
        judged = {j.method: j for j in (row.main, *row.classic)}
        each = [ratio(judged[name]) if name in judged else "-" for name in (main, *others)]
        parts = [small_sigma(row.texture)] * uneven
        shifts = shift(row.main.predicted_bias), *errors(row.main)
        table.add_row(*cells[row.index], *each, str(row.main.n), failed(row), *parts, *shifts, row.main.status)
    return table


def _measurands(found: Validation) -> Table:
    """Every measurand of the rows that are shown, in the scene's unit."""
    rows, which = far(found)
    headings, cells = names(found, rows)
    table = _table(
        "\nAll measurands, in the scene's unit (1 sigma)",
        *headings, "measurand", "value", "unit", "calibrated", "propagated", "measured", "ratio", "bias", "status",
        caption="\n".join(filter(None, ["ratio: of variances, measured / propagated; all are judged.", which])),
    )  # fmt: skip
    for row in rows:
        for each in row.measurands:
            sigmas = (small_sigma(v) for v in (each.calibrated, each.predicted, each.empirical))
            bias = "-" if each.bias is None else f"{each.bias:+.2g}"
            about = each.name, f"{each.value:.6g}", each.unit
            table.add_row(*cells[row.index], *about, *sigmas, ratio(each), bias, each.status)
    return table


def small_sigma(variance: float | None) -> str:
    """Standard deviation of a variance."""
    return "-" if variance is None or not math.isfinite(variance) else f"{math.sqrt(variance):.3g}"


def shift(px: float | None) -> str:
    """A bias, px."""
    return "-" if px is None or math.isnan(px) else f"{px:+.4f}"


def _search(found: Validation) -> Table:
    table = _table(
        "\nTable 1 of the paper (its search), same free scale", "sensor", "light", "paper ICE", "ours ICE", "ours/paper"
    )
    for _, sensor, light, theirs, ours in found.search:
        table.add_row(
            shown(sensor),
            shown(light),
            number(theirs, 4),
            number(ours, 4),
            number(ours / theirs if theirs else None),
        )
    return table


_PAIRS = {
    "paper_with_empirical": "our ICE, measured",
    "calibrated_with_empirical": "calibrated, measured",
    "propagated_with_empirical": "propagated, measured",
    "printed_ice_with_empirical": "the paper's ICE column, our measured",
    "printed_ice_with_printed_real_12": "the paper's ICE and real columns as printed, threshold 12",
    "printed_ice_with_printed_real_10": "the paper's ICE and real columns as printed, threshold 10",
}


def _correlations(found: Validation) -> Table:
    claimed = found.correlation.get("claimed_by_paper")
    caption = (
        f"The paper claims {claimed} for its own columns; it does not follow from them as printed." if claimed else None
    )
    table = _table("\nCorrelation of variances", "", "Pearson", "Spearman", "rows", caption=caption)
    table.columns[0].justify = "left"
    for key, words in _PAIRS.items():
        pair = found.correlation.get(key)
        if pair:
            table.add_row(words, f"{pair['pearson']:.3f}", f"{pair['spearman']:.3f}", str(pair["rows"]))
    return table


def _time(found: Validation) -> Text:
    spent = dict(found.seconds)
    wall, workers = spent.pop("wall"), spent.pop("workers")
    parts = ", ".join(f"{name} {value:.1f}" for name, value in spent.items())
    return Text(f"\nTime: {wall:.1f} s with {workers} workers on {found.variant}. Working seconds: {parts}.")


def number(value: float | None, digits: int = 3) -> str:
    return "-" if value is None else "inf" if math.isinf(value) else f"{value:.{digits}f}"


def small(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else "inf" if math.isinf(value) else f"{value / _UNIT:#.3g}"


def ratio(judged: Judged) -> str:
    if judged.ratio is None:
        return f"- ({judged.status})"
    low, high = judged.ratio_interval
    return f"{judged.ratio:.3f} [{low:.3f}, {high:.3f}]{' ' if low <= 1 <= high else '*'}"


def errors(judged: Judged) -> tuple[str, str]:
    """Bias and root mean square error, px."""
    bias = "-" if judged.bias is None else f"{judged.bias:+.4f}"
    return bias, number(judged.rmse, 4)


def failed(row: Row) -> str:
    return " ".join(str(judged.failed) for judged in (row.main, *row.classic))
