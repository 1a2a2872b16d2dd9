"""Cells of the tables of a run, for terminal and page."""

from __future__ import annotations

import math
from collections.abc import Iterable

from validation.batch.measurands import JudgedMeasurand
from validation.batch.result import Validation
from validation.batch.rows import Judged, Row
from validation.report.cells import pose

_UNIT = 1e-4  # px^2; what the measured variances are printed in


def far(found: Validation) -> tuple[list[Row], str]:
    """Rows to show, and which they are: all of them, or of many those that are farthest from their prediction."""
    rows = found.overview.farthest
    if len(rows) == len(found.rows):
        return list(found.rows), ""
    which = f"The {len(rows)} of {len(found.rows)} settings farthest from their prediction; all are in table.csv."
    return list(rows), which


def names(found: Validation, rows: list[Row]) -> tuple[list[str], dict[int, list[str]]]:
    """Headings of the columns that tell a run's settings apart, and the cells of some rows by setting."""
    keys, many = found.overview.swept, found.overview.has_several_scenes
    cells = {
        row.index: [
            *([row.scene] if many else []), *(str(row.parameters[key]) for key in keys),
            pose(row.sensor), pose(row.light),
        ]
        for row in rows
    }  # fmt: skip
    return [*(["scene"] if many else []), *keys, "sensor", "light"], cells


def small_sigma(variance: float | None) -> str:
    """Standard deviation of a variance."""
    return "-" if variance is None or not math.isfinite(variance) else f"{math.sqrt(variance):.3g}"


def shift(px: float | None) -> str:
    """A bias, px."""
    return "-" if px is None or math.isnan(px) else f"{px:+.4f}"


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


def other_methods(rows: Iterable[Row]) -> list[str]:
    """All methods but the verdict's."""
    return list(dict.fromkeys(judged.method for row in rows for judged in row.classic))


def is_printed(found: Validation) -> bool:
    """Whether the paper printed numbers for some settings."""
    return found.overview.prints_predictions or found.overview.prints_measurements


def of_paper(row: Row) -> list[str]:
    """What the paper predicted, our number for it, and what the paper measured by its two thresholds."""
    return [number(row.paper_ice), number(row.paper), *map(number, row.paper_real or (None, None))]


def of_variances(row: Row, others: list[str]) -> list[str]:
    """Predicted variances, those measured by the verdict's and the other methods, and the bound."""
    classic = {judged.method: judged.empirical for judged in row.classic}
    measured = (row.main.empirical, *(classic.get(name) for name in others))
    return [small(value) for value in (row.calibrated, row.main.propagated, *measured, row.bound)]


def of_errors(row: Row) -> list[str]:
    """Bias that was taken off, or where none was is predicted, and that is left, rms error, and status."""
    off = row.main.predicted_bias if row.main.u_bias is None else row.main.correction
    return [shift(off), *errors(row.main), row.main.status]


def of_measurand(each: JudgedMeasurand) -> list[str]:
    """A measurand in the scene's unit: value, standard deviations, ratio of variances, bias, its u, and status."""
    sigmas = (small_sigma(v) for v in (each.calibrated, each.predicted, each.empirical))
    bias = "-" if each.bias is None else f"{each.bias:+.2g}"
    u = "-" if each.u_bias is None else f"{each.u_bias:.2g}"
    return [each.name, f"{each.value:.6g}", each.unit, *sigmas, ratio(each), bias, u, each.status]
