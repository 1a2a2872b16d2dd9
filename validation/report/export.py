"""A validation as CSV, JSON and Parquet, for those who go on elsewhere; written setting by setting."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from scenes import InvalidInput
from validation.batch.document import pieces
from validation.batch.result import Validation
from validation.batch.rows import Judged, Row

_PART = 10_000  # settings that become columns at a time


def write_csv(found: Validation, path: Path) -> Path:
    """One line a setting; variances in px^2, angles in degrees, empty where there is no number."""
    return _write(columns(found), lines(found), path)


def write_measurands(found: Validation, path: Path) -> Path:
    """One line a setting and measurand; variances in the scene's unit squared or degrees^2."""
    return _write(list(next(measurands(found))), measurands(found), path)


def _write(keys: list[str], lines: Iterator[dict[str, object]], path: Path) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=keys)
        writer.writerow({key: inert(key) for key in writer.fieldnames})
        writer.writerows({key: inert(value) for key, value in line.items()} for line in lines)
    return path


def inert(value: object) -> object:
    """A text that no spreadsheet takes for a formula: an apostrophe before what would begin one."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r", "\n")) else value


def write_json(found: Validation, path: Path) -> Path:
    """The document of ``ice validate --json``."""
    with path.open("w", encoding="utf-8") as file:
        file.writelines(pieces(found))
    return path


def check_parquet() -> None:
    """See that Parquet can be written.

    Raises
    ------
    InvalidInput
        If pyarrow, 170 MB and so an extra, is not installed.
    """
    if find_spec("pyarrow") is None:
        raise InvalidInput("--parquet must be used with the extra 'parquet' installed, got no package pyarrow")


def write_parquet(found: Validation, path: Path) -> Path:
    """The lines of `write_csv` as Parquet."""
    check_parquet()
    from pyarrow import Table, concat_tables, parquet

    every = lines(found)
    parts = iter(lambda: list(itertools.islice(every, _PART)), [])
    tables = [Table.from_pylist(part) for part in parts]
    parquet.write_table(concat_tables(tables, promote_options="permissive"), path)
    return path


def columns(found: Validation) -> list[str]:
    """The keys of every record."""
    return list(dict.fromkeys(key for row in found.overview.first for key in _line(row)))


def lines(found: Validation) -> Iterator[dict[str, object]]:
    """One flat record a setting, all with the same keys; None where there is no number."""
    keys = columns(found)
    for row in found.rows:
        line = _line(row)
        yield {key: line.get(key) for key in keys}


def _line(row: Row) -> dict[str, object]:
    real = row.paper_real or (None, None)
    line = {
        "index": row.index, "scene": row.scene,
        **{key: value if isinstance(value, int | float | str) else str(value) for key, value in row.parameters.items()},
        "sensor_polar": row.sensor[0], "sensor_azimuth": row.sensor[1],
        "light_polar": _angle(row.light, 0), "light_azimuth": _angle(row.light, 1),
        "paper_ice": row.paper_ice, "paper_real_12": real[0], "paper_real_10": real[1],
        "our_ice": row.paper, "calibrated": row.calibrated, "bound": row.bound,
    }  # fmt: skip
    for judged in (row.main, *row.classic):
        line |= {f"{judged.method}_{key}": value for key, value in _judged(judged).items()}
    return line


def _angle(light: tuple, which: int) -> float | str:
    """Of the one free light, or of all that are, with spaces between."""
    if light and not isinstance(light[0], tuple | list):
        return light[which]
    return " ".join(f"{pose[which]:g}" for pose in light)


def _judged(judged: Judged) -> dict[str, object]:
    low, high = judged.ratio_interval or (None, None)
    return {
        "propagated": judged.propagated, "empirical": judged.empirical, "n": judged.n, "failed": judged.failed,
        "ratio": judged.ratio, "ratio_low": low, "ratio_high": high, "bias_px": judged.bias,
        "predicted_bias_px": judged.predicted_bias, "rmse_px": judged.rmse, "status": judged.status,
        "correction_px": judged.correction, "u_bias_px": judged.u_bias,
    }  # fmt: skip


def measurands(found: Validation) -> Iterator[dict[str, object]]:
    """One flat record a setting and measurand, variances in the scene's unit squared or degrees^2."""
    for row in found.rows:
        place = {
            "index": row.index, "scene": row.scene, "sensor_polar": row.sensor[0], "sensor_azimuth": row.sensor[1],
            "light_polar": _angle(row.light, 0), "light_azimuth": _angle(row.light, 1),
        }  # fmt: skip
        yield from ({**place, **each.record} for each in row.measurands)
