"""The tables of a run's report."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.batch.store import RunFile
from validation.report import guide
from validation.report.cells import placed
from validation.report.run_cells import (
    failed,
    far,
    is_printed,
    names,
    of_errors,
    of_measurand,
    of_paper,
    of_variances,
    ratio,
)
from validation.statistics import ALLOWANCE, LEVEL, Verdict

_ROWS = 64  # rows of the table of settings without a result


@dataclass(frozen=True)
class Table:
    """Columns and cells as text, terms and what to do next; ``words``: of sentences rather than numbers; ``chosen``:
    the row that stands out."""

    label: str
    columns: list[str]
    rows: list[list[str]]
    note: str = ""
    words: bool = False
    advice: str = ""
    chosen: int | None = None


def _key(found: Validation, rows: list[Row]) -> tuple[list[str], dict[int, list[str]]]:
    """First columns of a table of settings, and their cells by setting."""
    headings, cells = names(found, rows)
    return ["setting", *map(placed, headings)], {index: [str(index + 1), *row] for index, row in cells.items()}


def ratios(found: Validation, reasons: Mapping[str, str] = MappingProxyType({})) -> Table:
    """Ratios and errors of the first measurand in the image; ``reasons`` as of `validation.report.station.reasons`."""
    rows, which = far(found)
    key, cells = _key(found, rows)
    columns = [
        *key, f"{rows[0].main.method}: measured / predicted [95 %]", "images", "failed", "bias, px: taken off",
        "left", "rmse, px", "status",
    ]  # fmt: skip
    lines = [[*cells[row.index], ratio(row.main), str(row.main.n), failed(row), *of_errors(row)] for row in rows]
    terms = guide.ratio_terms(rows[0].main.method, 1 + len(rows[0].classic))
    note = " ".join([*terms, *guide.statuses((row.main.status for row in rows), reasons), which])
    return Table("Measured over predicted variance, by setting", columns, lines, note, advice=_advice(found, "ratios"))


def variances(found: Validation) -> Table:
    rows, which = far(found)
    key, cells = _key(found, rows)
    main, others, printed = rows[0].main.method, list(found.overview.methods), is_printed(found)
    paper = ["paper ICE", "ours ICE", "paper real 12.0", "paper real 10.0"] if printed else []
    columns = [*key, *paper, "calibrated", "propagated", f"measured: {main}", *others, "Cramer-Rao bound"]
    lines = [[*cells[row.index], *(of_paper(row) if printed else []), *of_variances(row, others)] for row in rows]
    terms = [*guide.paper_terms(found), *guide.variance_terms([main, *others], max(row.main.n for row in rows))]
    title = f"{'Table 3: variance' if printed else 'Variance'} of the first measurand in the image, by setting"
    return Table(title, columns, lines, " ".join([*terms, which]), advice=_advice(found, "variances"))


def units(found: Validation, reasons: Mapping[str, str] = MappingProxyType({})) -> Table:
    """Every measurand in the scene's unit; ``reasons`` as of `validation.report.station.reasons`."""
    rows, which = far(found)
    key, cells = _key(found, rows)
    columns = [
        *key, "measurand", "value", "unit", "sigma: calibrated", "propagated", "measured", "ratio of variances [95 %]",
        "bias left", "u(bias)", "status",
    ]  # fmt: skip
    lines = [[*cells[row.index], *of_measurand(each)] for row in rows for each in row.measurands]
    statuses = guide.statuses((each.status for row in rows for each in row.measurands), reasons)
    note = " ".join([*guide.unit_terms(any(len(row.measurands) > 1 for row in rows)), *statuses, which])
    return Table("All measurands in the scene's unit, by setting", columns, lines, note, advice=_advice(found, "units"))


def _advice(found: Validation, name: str) -> str:
    return guide.advice(found.verdict.agrees)[name]


def estimators(found: Validation) -> Table:
    main = found.rows[0].main.method
    verdicts = {f"{main} (the verdict's)": found.verdict, **found.classic_verdicts}
    columns = [
        "estimator", "rows inside 95 %", "smallest p-value", "limit", "pooled ratio [95 %]", "p-value", "limit",
        "largest bias, u", "p-value", "limit", "not measured", "as predicted",
    ]  # fmt: skip
    note = (
        f"A row's variance (chi-square, Sidak over the rows), that of all rows pooled, and the mean error of rows that "
        f"are ok, of which {ALLOWANCE:g} standard uncertainties u of one value are allowed; a method whose rows mostly "
        f"could not be measured is not as predicted. The three tests share a level of {LEVEL:g} (Bonferroni)."
    )
    lines = [[name, *_tests(v)] for name, v in verdicts.items()]
    return Table("Verdict on each estimator", columns, lines, note, advice=_advice(found, "estimators"))


def _tests(found: Verdict) -> list[str]:
    """Cells of a verdict, in the order of its tests."""
    pooled = bias = ["-"] * 3
    if found.pooled:
        low, high = found.pooled.interval
        pooled = [
            f"{found.pooled.ratio:.3f} [{low:.3f}, {high:.3f}]",
            *_level(found.pooled.p_value, found.pooled.limit),
        ]
    if found.bias:
        bias = [f"{found.bias.largest:.2f}", *_level(found.bias.smallest_p, found.bias.limit)]
    rows = f"{found.inside} of {found.rows}", *_level(found.smallest_p, found.limit)
    return [*rows, *pooled, *bias, str(found.not_measured), "yes" if found.agrees else "no"]


def _level(p_value: float, limit: float) -> tuple[str, str]:
    return f"{p_value:.2g}", f"{limit:.2g}"


def effects(found: Validation, store: RunFile) -> Table:
    lines = [(scene, effect) for scene, effects in store.fact("effects", {}).items() for effect in effects]
    keys = list(dict.fromkeys(key for _, effect in lines for key in effect))
    rows = [[scene, *(_word(effect.get(key, "")) for key in keys)] for scene, effect in lines]
    return Table("Effects, on and off", ["scene", *keys], rows, words=True, advice=_advice(found, "effects"))


def _word(value: object) -> str:
    return ("on" if value else "off") if isinstance(value, bool) else str(value)


def refused(found: Validation) -> Table:
    rows = [[str(index + 1), reason] for index, reason in list(found.refused.items())[:_ROWS]]
    note = f"{len(found.refused)} in all." if len(found.refused) > _ROWS else ""
    return Table("Settings without a result", ["setting", "why"], rows, note, True, _advice(found, "refused"))


def _command(found: Validation, identity: dict[str, Any]) -> str:
    """What does the same again, the scene's file being where it was."""
    photos = " --photos DIR" if identity.get("photos") else ""
    return f"`ice validate {shlex.quote(found.scene)} --renders {identity['renders']} --seed {found.seed}{photos}`"


def facts(found: Validation, store: RunFile) -> Table:
    identity, machines = store.identity(), store.fact("machines", [])
    facts = {
        "scenes": ", ".join(scene["name"] for scene in identity["campaign"]["scenes"]),
        "settings x images": f"{len(found.rows) + len(found.refused)} x {identity['renders']}",
        "seed": found.seed,
        "renderer's variant": found.variant,
        "versions": ", ".join(f"{name} {version}" for name, version in identity["versions"].items()),
        "digest of the code": identity["code"],
        "machine": "; continued on ".join(
            ", ".join(f"{key} {value}" for key, value in one.items()) for one in machines
        ),
        "time": f"{found.seconds['wall']:.1f} s with {found.seconds['workers']} workers",
        "working seconds": ", ".join(
            f"{name} {value:.1f}" for name, value in found.seconds.items() if name not in ("wall", "workers")
        ),
        "command": _command(found, identity),
    }
    lines = [[name, str(value)] for name, value in facts.items()]
    return Table("Facts of the run", ["fact", "value"], lines, words=True, advice=_advice(found, "facts"))
