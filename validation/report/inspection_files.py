"""An inspection handed on: a page with balloon picture and table, the table as CSV, the picture as SVG, and QIF."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scenes.results import finite
from scenes.status import is_trusted
from validation.inspection import Inspected, Inspection
from validation.report import cells, qif, station_sketch, station_view
from validation.report.budget_table import decimals
from validation.report.camera_words import told as camera
from validation.report.export import inert
from validation.report.grades import LOOKS, MEANS, Look
from validation.report.page import Section, budget_sections, environment
from validation.zones import MeasuredZone

COLUMNS = (
    "no.", "characteristic", "kind", "nominal", "lower limit", "upper limit", "value", "U", "decision", "status",
)  # fmt: skip
NOTE = (
    "value: as measured in this picture, the bias taken off that a simulation of it tells. U: expanded uncertainty "
    "(95 %) of noise, of the bias' correction and of all else that the scene says is not exactly known. decision (ISO "
    "14253-1): pass where the value keeps both limits by at least U, fail where it is beyond one by more than U; only "
    "a value whose status is ok is decided. A zone (of several numbers, without a balloon, or of all points of a "
    "form): the size that they need, how much larger it may be (95 %), decided by the law of that, which is not normal "
    "near 0; under the maximum material requirement (ISO 2692) its upper limit is the drawing's with what the measured "
    "size adds."
)


@dataclass(frozen=True)
class About:
    """What is said of an inspection beside its numbers: the part's serial number, empty if not known, and the picture's
    files' names, in their order."""

    serial: str
    files: tuple[str, ...]


def write(found: Inspection, images: Sequence[np.ndarray], about: About, directory: Path) -> list[Path]:
    """Write page, table, QIF and an SVG of each picture to a directory, which is made; their paths.

    Parameters
    ----------
    images : sequence of ndarray, shape (height, width)
        The pictures, grey levels.
    """
    directory.mkdir(parents=True, exist_ok=True)
    page, table, results = (directory / f"inspection.{ending}" for ending in ("html", "csv", "qif"))
    views = [balloons(found, number, image) for number, image in enumerate(images, 1)]
    context = _context(found, about) | {"views": list(zip(_taken(found, about), views, strict=True))}
    page.write_text(environment(True).get_template("inspection.html.j2").render(context), encoding="utf-8")
    write_csv(found, about, table)
    results.write_bytes(qif.document(found, about.serial))
    paths = [page, table, results]
    for number, drawn in enumerate(views, 1):
        paths.append(directory / f"inspection{f'_{number}' * (len(views) > 1)}.svg")
        paths[-1].write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{drawn}', encoding="utf-8")
    return paths


def balloons(found: Inspection, number: int, image: np.ndarray):
    """A picture, from 1, with what it tells: each characteristic's features, balloon, value and U, SVG."""
    rows = [row if row.picture == number else None for row in found.rows]
    forms = found.forms
    requirements = [row and row.requirement for row in rows]
    label = "What was measured: " + "; ".join(f"{each.number} {each.title}" for each in requirements if each)
    values = [_beside(row, forms.get(row.requirement.name)) if row else "" for row in rows]
    picture = found.taken[number - 1].found.picture
    return station_view.draw(picture, requirements, image, label, f"inspection-{number}", values)


def write_csv(found: Inspection, about: About, path: Path) -> None:
    """One line a characteristic, lengths in the scene's unit, angles in degrees; empty where there is no number."""
    rows = records(found, about)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows({key: inert(value) for key, value in row.items()} for row in rows)


def records(found: Inspection, about: About) -> list[dict[str, Any]]:
    """One a characteristic, with all that the table shows, unrounded."""
    told = []
    for m, row in enumerate(found.rows):
        each, u_bias = row.requirement, found.found(row).u_bias[m]
        low, high = row.limits or (None, None)
        told.append({
            "part": about.serial, "file": about.files[row.picture - 1], "number": each.number,
            "characteristic": each.name, "kind": each.kind, "unit": each.unit,
            "nominal": each.nominal, "lower": low, "upper": high, "value": row.value,
            "U": each.U, "sigma": finite(each.sigma), "u_bias": finite(u_bias),
            "decision": row.decision, "status": each.status, "reason": each.reason,
        })  # fmt: skip
    rows = {each["characteristic"]: each for each in told}
    for zone in found.zones:
        facts = zone.facts
        row = {
            "part": about.serial, "characteristic": facts["name"], "kind": facts["kind"], "unit": facts["unit"],
            "nominal": 0.0, "lower": 0.0, "upper": facts["size"], "value": facts["value"],
            "U": facts["at_most"] and facts["at_most"] - facts["value"], "decision": facts["decision"],
            "status": facts["status"],
        }  # fmt: skip
        if zone.zone.is_form:
            rows[facts["name"]].update(row)
        else:
            told.append(dict.fromkeys(told[0]) | row)
    return told


def sentence(found: Inspection) -> str:
    """What the inspection says of the part."""
    rows = [(row.decision, _number(row)) for row in found.rows]
    rows += [(each.decision, each.zone.name) for each in found.zones]
    if found.decision is None:
        return "No characteristic has a tolerance: nothing is decided."
    judged = [(decision, name) for decision, name in rows if decision is not None]
    if found.decision == "pass":
        many = f"all {len(judged)} characteristics keep their limits" if len(judged) > 1 else "it keeps its limits"
        return f"Pass: {many} by at least U (ISO 14253-1){_untold(found)}."
    parts = []
    if some := [name for decision, name in judged if decision == "fail"]:
        parts.append(f"Fail: {', '.join(some)} {'are' if len(some) > 1 else 'is'} beyond a limit by more than U")
    if some := [name for decision, name in judged if decision == "undecided"]:
        parts.append(f"{'undecided' if parts else 'Undecided'}: {', '.join(some)}")
    kept = sum(decision == "pass" for decision, _ in judged)
    return f"{'; '.join(parts)}; {kept} of {len(judged)} pass{_untold(found)}."


def _untold(found: Inspection) -> str:
    """Of those without a tolerance."""
    count = sum(row.requirement.tolerance is None for row in found.rows)
    return f"; {count} without a tolerance" if count else ""


def _number(row: Inspected) -> str:
    return f"{row.requirement.title} (no. {row.requirement.number})"


def _context(found: Inspection, about: About) -> dict[str, Any]:
    """What the page's template takes."""
    scene, several = found.taken[0].found.picture.scene, len(found.taken) > 1
    grades = dict.fromkeys(row.requirement.grade for row in found.rows)
    title = scene.title or scene.name
    return {
        "name": scene.name,
        "title": f"Inspection of part {about.serial}: {title}" if about.serial else f"Inspection: {title}",
        "decision": found.decision or "open",
        "sentence": sentence(found),
        "key": [(MEANS[grade], LOOKS[grade]) for grade in grades],
        "columns": (*COLUMNS, "picture") if several else COLUMNS,
        "rows": _lines(found),
        "note": NOTE,
        "why": [f"{row.requirement.title} (no. {row.requirement.number}), {row.requirement.status}: "
                f"{row.requirement.reason}" for row in found.rows if row.requirement.reason],
        "sections": _budgets(found),
        "agrees": found.decision == "pass",
    }  # fmt: skip


def _lines(found: Inspection) -> list[tuple[Look | None, str, tuple[str, ...]]]:
    """Of each characteristic its balloon's look, decision and cells.

    A form's are those of its zone; another zone, which has no balloon, stands below its parts.
    """
    lines, several, forms = [], len(found.taken) > 1, found.forms
    for row in found.rows:
        look, picture = LOOKS[row.requirement.grade], [str(row.picture)] * several
        if form := forms.get(row.requirement.name):
            lines.append((look, form.decision or "", (_cells(row)[0], *_zone_cells(form)[1:], *picture)))
            continue
        lines.append((look, row.decision or "", (*_cells(row), *picture)))
        after = (each for each in found.zones if each.zone.parts[-1] == row.requirement.name)
        lines += [(None, each.decision or "", (*_zone_cells(each), *["-"] * several)) for each in after]
    return lines


def _zone_cells(each: MeasuredZone) -> tuple[str, ...]:
    """As `COLUMNS`: the size that is needed, and by how much the true one may be larger (95 %)."""
    told = each.facts
    size = "-" if told["size"] is None else cells.united(f"{told['size']:.6g}", told["unit"])
    value = more = "-"
    if told["value"] is not None:
        places = decimals(told["u"])
        value = cells.united(f"{told['value']:.{places}f}", told["unit"])
        if is_trusted(each.status):
            more = cells.united(f"+{told['at_most'] - told['value']:.{places}f}", told["unit"])
    return "", told["name"], told["kind"], "0", "-", size, value, more, told["decision"] or "-", each.status


def _budgets(found: Inspection) -> list[Section]:
    """Where the uncertainty comes from, of each picture."""
    sections = []
    for number, each in enumerate(found.taken, 1):
        where = f", picture {number}" * (len(found.taken) > 1)
        sections += [replace(one, heading=f"{one.heading}{where}") for one in budget_sections(each.budget)]
    return sections


def _taken(found: Inspection, about: About) -> list[str]:
    """Of each picture its file, and where camera and lamps stood."""
    lines = []
    for file, taken in zip(about.files, found.taken, strict=True):
        picture, told = taken.found.picture, station_sketch.told(taken.found.picture)
        lines.append(f"Measured in {file}. {camera(picture.scene)}. {told[0].upper()}{told[1:]}.")
    return lines


def _cells(row: Inspected) -> tuple[str, ...]:
    """As `COLUMNS`."""
    each, places = row.requirement, _places(row)
    low, high = ("-" if limit is None else f"{limit:.6g}" for limit in row.limits or (None, None))
    value = "-" if row.value is None else f"{row.value:.{places}f}"
    whole = f"{each.U:.{places}f}" if each.U is not None and is_trusted(each.status) else "-"
    return (
        str(each.number), each.title, each.kind, cells.united(f"{each.nominal:.6g}", each.unit),
        cells.united(low, each.unit), cells.united(high, each.unit), cells.united(value, each.unit),
        cells.united(whole, each.unit), row.decision or "-", each.status,
    )  # fmt: skip


def _places(row: Inspected) -> int:
    """Decimal places of value and U: two digits of U."""
    return decimals(row.requirement.U) if row.requirement.U else 4


def _beside(row: Inspected, form: MeasuredZone | None = None) -> str:
    """What stands beside a balloon: the value, and below it U, or of a form what it is below, or why there is none."""
    each, places = row.requirement, _places(row)
    if form is not None and form.size.is_known and is_trusted(form.status):
        told = form.facts
        value, most = (f"{told[name]:.{places}f}" for name in ("value", "at_most"))
        return f"{cells.united(value, each.unit)}\n≤ {most}"
    if row.value is None or each.U is None or not is_trusted(each.status):
        return each.status if row.value is None else f"{row.value:.{places}f}\n{each.status}"
    return f"{cells.united(f'{row.value:.{places}f}', each.unit)}\n±{each.U:.{places}f}"
