"""The tables of a validation, for a terminal."""

from __future__ import annotations

import math

from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from validate.result import Judged, Row, Validation

_UNIT = 1e-4  # px^2; what the measured variances are printed in


def console(*, stderr: bool = False) -> Console:
    """A console wide enough for the tables even where no terminal tells its width."""
    made = Console(stderr=stderr)
    return made if made.is_terminal else Console(stderr=stderr, width=132)


def report(found: Validation) -> Group:
    """Everything that ``ice validate`` prints."""
    parts = [Text(found.title, style="bold"), _variances(found), _ratios(found)]
    if found.search:
        parts.append(_search(found))
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


def _variances(found: Validation) -> Table:
    classic = [judged.method for judged in found.rows[0].classic]
    table = _table(
        "\nTable 3: variance of the distance",
        "sensor", "light", "paper\nICE", "ours\nICE", "ours/\npaper", "paper real\n12.0", "\n10.0",
        "predicted\ncalibrated", "\npropagated", "measured\ngradient", *(f"\n{name}" for name in classic),
        "Cramer-Rao\nbound",
        caption=(
            "paper, ours ICE: the paper's px^2, ours with one free scale for all rows. Others: 1e-4 px^2, absolute.\n"
            "- : the paper prints N/A, or nothing could be measured."
        ),
    )  # fmt: skip
    for row in found.rows:
        real = row.paper_real or (None, None)
        table.add_row(
            pose(row.sensor), pose(row.light), number(row.paper_ice), number(row.paper),
            number(row.paper / row.paper_ice if row.paper_ice else None), *map(number, real),
            small(row.calibrated), small(row.main.propagated), small(row.main.empirical),
            *(small(judged.empirical) for judged in row.classic), small(row.bound),
        )  # fmt: skip
    return table


def _ratios(found: Validation) -> Table:
    judged = [found.rows[0].main, *found.rows[0].classic]
    table = _table(
        "\nMeasured / propagated variance, with the 95 % chi-square interval",
        "sensor", "light", *(f"{j.method}" for j in judged), "n", "failed", "bias px", "status",
        caption=(
            "* : 1 lies outside the interval. Which pixels Canny picks is not linear in the noise; its prediction\n"
            "holds the choice fixed and is not exact. The verdict is about gradient. failed: one number a method."
        ),
    )  # fmt: skip
    for row in found.rows:
        methods = [row.main, *row.classic]
        table.add_row(
            pose(row.sensor), pose(row.light), *map(ratio, methods), str(row.main.n), failed(row),
            "-" if row.main.bias is None else f"{row.main.bias:+.4f}", row.main.status,
        )  # fmt: skip
    return table


def _search(found: Validation) -> Table:
    table = _table(
        "\nTable 1 of the paper (its search), same free scale", "sensor", "light", "paper ICE", "ours ICE", "ours/paper"
    )
    for _, sensor, light, theirs, ours in found.search:
        table.add_row(
            pose(sensor),
            pose(light),
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


def pose(pose: tuple[float, float]) -> str:
    return f"({pose[0]:g}, {pose[1]:g})"


def number(value: float | None, digits: int = 3) -> str:
    return "-" if value is None else "inf" if math.isinf(value) else f"{value:.{digits}f}"


def small(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else "inf" if math.isinf(value) else f"{value / _UNIT:#.3g}"


def ratio(judged: Judged) -> str:
    if judged.ratio is None:
        return f"- ({judged.status})"
    low, high = judged.ratio_interval
    return f"{judged.ratio:.3f} [{low:.3f}, {high:.3f}]{' ' if low <= 1 <= high else '*'}"


def failed(row: Row) -> str:
    return " ".join(str(judged.failed) for judged in (row.main, *row.classic))
