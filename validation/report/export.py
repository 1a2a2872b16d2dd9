"""A validation as CSV, JSON and Parquet, for those who go on elsewhere."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from scenes import InvalidInput
from validation.batch.measurands import JudgedMeasurand
from validation.batch.result import Judged, Row, Validation


def write_csv(found: Validation, path: Path) -> Path:
    """One line a setting; variances in px^2, angles in degrees, empty where there is no number."""
    return _write(table(found), path)


def write_measurands(found: Validation, path: Path) -> Path:
    """One line a setting and measurand; variances in the scene's unit squared or degrees^2."""
    return _write(measurands(found), path)


def _write(lines: list[dict[str, object]], path: Path) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(lines[0]))
        writer.writerow({key: _inert(key) for key in lines[0]})
        writer.writerows({key: _inert(value) for key, value in line.items()} for line in lines)
    return path


def _inert(value: object) -> object:
    """A text that no spreadsheet takes for a formula: an apostrophe before what would begin one."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r", "\n")) else value


def write_json(found: Validation, path: Path) -> Path:
    """The document of ``ice validate --json``."""
    path.write_text(json.dumps(found.to_json(), indent=1), encoding="utf-8")
    return path


def write_parquet(found: Validation, path: Path) -> Path:
    """The lines of `write_csv` as Parquet.

    Raises
    ------
    InvalidInput
        If pyarrow, 170 MB and so an extra, is not installed.
    """
    try:
        from pyarrow import Table, parquet
    except ImportError:
        raise InvalidInput(
            "--parquet must be used with the extra 'parquet' installed, got no package pyarrow"
        ) from None
    parquet.write_table(Table.from_pylist(table(found)), path)
    return path


def table(found: Validation) -> list[dict[str, object]]:
    """One flat record a setting, all with the same keys; None where there is no number."""
    lines = [_line(row) for row in found.rows]
    keys = dict.fromkeys(key for line in lines for key in line)
    return [{key: line.get(key) for key in keys} for line in lines]


def _line(row: Row) -> dict[str, object]:
    real = row.paper_real or (None, None)
    line = {
        "index": row.index, "scene": row.scene,
        **{key: value if isinstance(value, int | float | str) else str(value) for key, value in row.parameters.items()},
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
        "ratio": judged.ratio, "ratio_low": low, "ratio_high": high, "bias_px": judged.bias,
        "predicted_bias_px": judged.predicted_bias, "rmse_px": judged.rmse, "status": judged.status,
    }  # fmt: skip


def measurands(found: Validation) -> list[dict[str, object]]:
    """One flat record a setting and measurand, variances in the scene's unit squared or degrees^2."""
    return [
        {"index": row.index, "scene": row.scene, "sensor_polar": row.sensor[0], "sensor_azimuth": row.sensor[1],
         "light_polar": row.light[0], "light_azimuth": row.light[1], **_flat(each)}
        for row in found.rows for each in row.measurands
    ]  # fmt: skip


def _flat(each: JudgedMeasurand) -> dict[str, object]:
    low, high = each.ratio_interval or (None, None)
    return {key: value for key, value in vars(each).items() if key != "ratio_interval"} | {
        "ratio_low": low,
        "ratio_high": high,
    }
