"""A validation as CSV, for those who go on elsewhere."""

from __future__ import annotations

import csv
from pathlib import Path

from validate.result import Judged, Row, Validation


def write_csv(found: Validation, path: Path) -> Path:
    """One line a setting; variances in px^2, angles in degrees, empty where there is no number."""
    lines = [_line(row) for row in found.rows]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(lines[0]))
        writer.writeheader()
        writer.writerows(lines)
    return path


def _line(row: Row) -> dict[str, object]:
    real = row.paper_real or (None, None)
    line = {
        "sensor_polar": row.sensor[0], "sensor_azimuth": row.sensor[1],
        "light_polar": row.light[0], "light_azimuth": row.light[1],
        "paper_ice": row.paper_ice, "paper_real_12": real[0], "paper_real_10": real[1],
        "our_ice": row.paper, "calibrated": row.calibrated, "bound": row.bound,
    }  # fmt: skip
    for judged in (row.main, *row.classic):
        line |= {f"{judged.method}_{key}": value for key, value in _judged(judged).items()}
    return line


def _judged(judged: Judged) -> dict[str, object]:
    low, high = judged.ratio_interval or (None, None)
    return {
        "propagated": judged.propagated, "empirical": judged.empirical, "n": judged.n, "failed": judged.failed,
        "ratio": judged.ratio, "ratio_low": low, "ratio_high": high, "bias_px": judged.bias, "status": judged.status,
    }  # fmt: skip
