"""A dossier as a page for print: one column, a heading a page, each claim with the command that shows it."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

from scenes.status import MEANINGS
from validation.batch.store import RunFile
from validation.dossier import Dossier
from validation.dossier.asked import ASKED
from validation.dossier.dossier import RUN
from validation.dossier.limits import LIMITS
from validation.report import cells, page
from validation.report.page import Section, budget_sections
from validation.report.page_tables import Table

HEADINGS = {
    "task": "The measuring task",
    "identity": "Versions, inputs, seeds",
    "budget": "The uncertainty budget",
    "agreement": "Agreement of prediction and rendered pictures",
    "alarms": "False alarms",
    "controls": "Negative controls",
    "coverage": "Coverage of the stated intervals",
    "hard": "Hard cases",
    "limits": "Known limits",
    "laboratory": "What is left to the laboratory",
    "repeat": "How to repeat and check this dossier",
}
_ASKED = (
    "ISO/IEC 17025:2017 by its clauses; ISO/TS 15530-4:2008, whose text is not public, by the subjects of its "
    "published abstract. No conformity with either is claimed: an assessor decides that."
)
_RULE = (
    "U is the expanded uncertainty, k u, of 95 % coverage probability. Decisions follow ISO 14253-1: a value passes "
    "where it keeps both limits by at least U, fails where it breaks one by more than U, and is undecided between. "
    "The risk of accepting a bad part, or rejecting a good one, follows from the spread of the manufacture "
    "(`uncertainty.process_sd`), which `ice budget` and `ice msa` tell of. Only a value whose status is ok is decided."
)
_OPEN = {True: "yes", False: "no", None: "not shown"}


def write(found: Dossier, directory: Path) -> Path:
    """Write dossier.html beside the run's directory; its path."""
    store = RunFile.reopen(directory / RUN)
    try:
        context = _context(found, store)
    finally:
        store.close()
    path = directory / "dossier.html"
    path.write_text(page.environment(True).get_template("dossier.html.j2").render(context), encoding="utf-8")
    return path


def _context(found: Dossier, store: RunFile) -> dict[str, Any]:
    scene, station = found.scene, found.station
    part, first = scene.title or scene.name, page.first_screen(station)
    claims = [
        {"name": each.name, "says": each.says, "holds": each.holds, "word": _OPEN[each.holds], "command": each.command,
         "heading": each.heading, "number": _numbered(each.heading)}
        for each in found.claims
    ]  # fmt: skip
    return {
        "name": scene.name, "title": f"Dossier of the measurement software: {part}", "agrees": found.run.verdict.agrees,
        "station": first, "task_station": first | {"simulated": ""}, "task": _numbered("task"),
        "task_command": found.command("budget", found.at_station),
        "rule": f"Measured by the estimator {found.estimator}, which `ice measure` takes for this scene. {_RULE}",
        "about": f"What a laboratory shows of ICE {found.versions['ice-vision']} for the scene {scene.name}: evidence "
                 "that the uncertainties it predicts are true, and all that is needed to judge and to repeat it.",
        "sentence": _sentence(found), "holds": found.holds, "claims": claims, "asked_note": _ASKED,
        "asked": [{"standard": each.standard, "clause": each.clause, "asks": each.asks, "laboratory": each.laboratory,
                   "headings": [(key, _number(key)) for key in each.headings]} for each in ASKED],
        "headings": list(HEADINGS.items()), "sections": _sections(found, store),
    }  # fmt: skip


def _number(key: str) -> int:
    return 1 + list(HEADINGS).index(key)


def _numbered(key: str) -> str:
    return f"{_number(key)} {HEADINGS[key]}"


def _sentence(found: Dossier) -> str:
    """What is made of all claims."""
    wrong = [each for each in found.claims if not each.holds]
    if not wrong:
        return f"All {len(found.claims)} claims hold."
    told = "; ".join(f"{each.name} ({_OPEN[each.holds]})" for each in wrong)
    return f"{len(wrong)} of {len(found.claims)} claims are not shown: {told}."


def _sections(found: Dossier, store: RunFile) -> list[Section]:
    commands = {each.heading: each.command for each in found.claims}
    made = {
        "identity": _identity(found), "budget": _budget(found), "agreement": _agreement(found, store),
        "alarms": _alarms(found), "controls": _controls(found), "coverage": _coverage(found), "hard": _hard(found),
        "limits": _limits(), "laboratory": _laboratory(), "repeat": _repeat(found),
    }  # fmt: skip
    commands |= {"identity": found.again, "budget": found.command("budget", found.at_station)}
    return [
        replace(section, heading=_numbered(key), key=key, command=commands.get(key, ""))
        for key, section in made.items()
    ]


def _identity(found: Dossier) -> Section:
    answer = (
        f"All random numbers have the root {found.seed}: of the pictures by setting and batch, of the stations, of "
        "the controls, of the tables of false alarms. The same versions, inputs and seed on the same kind of "
        "processor give this dossier again, byte by byte; on another processor numbers may differ in their last "
        "digits."
    )
    told = [list(each) for each in found.versions.items()]
    code = "code: all Python files of the program, in order. Libraries: all that it needs."
    versions = Table("Versions", ["what", "version"], told, code, words=True)
    where = Table("Processor", ["what", "which"], [list(each) for each in found.processor.items()],
                  "Instruction sets and kernels that are taken decide the last digits.", words=True)  # fmt: skip
    read = [[each.what, each.name, each.sha256 or "not read"] for each in found.files]
    files = Table(
        "Inputs", ["what", "name", "SHA-256"], read,
        "scene as read: the file scene.json of this folder, with all defaults and all that the scene took from other "
        "files; parts and textures in it as their content.", words=True,
    )  # fmt: skip
    return Section("", answer, tables=[files, versions, where])


def _budget(found: Dossier) -> Section:
    sections = budget_sections(found.station.budget)
    if not sections:
        return Section("", "Nothing can be measured at this station, so there is no budget.")
    (only,) = sections
    answer = (
        "Every source that the scene states, noise, bias, temperature and rounding, combined as the GUM (JCGM 100) "
        "has it. Sensitivities are derivatives of the closed-form projection and of the values' formulas."
    )
    return replace(only, answer=answer, tables=only.folded, folded=[])


def _agreement(found: Dossier, store: RunFile) -> Section:
    told = page.proof(found.campaign, found.run, store)
    tables = [table for table in told.folded if not table.label.startswith(("Variance", "Table 3"))]
    failed = Counter(status for row in found.run.rows for status in row.main.failures)
    refused = [[str(index + 1), reason] for index, reason in found.run.refused.items()]
    tables += [Table("Settings without a result", ["setting", "why"], refused, words=True)] * bool(refused)
    lost = "; ".join(f"{state} in {count} settings" for state, count in failed.items()) or "none"
    return replace(
        told, answer=f"Are the predicted uncertainties true? {told.answer}", tables=tables, folded=[],
        points=[f"Pictures without a value, by status: {lost}.",
                "A failed picture is a row of the run with its status; none is left out silently."],
    )  # fmt: skip


def _alarms(found: Dossier) -> Section:
    rows = [
        [how, str(told.tables), str(told.pictures), str(told.alarms),
         f"{100 * told.rate:.2g} %" if told.tables else "-",
         f"{100 * told.low:.2g} to {100 * told.high:.2g} %", f"{100 * told.stated:g} %"]
        for how, told in (("tables drawn as if all predictions were true", found.drawn),
                          ("blocks of the run's own pictures", found.blocks))
    ]  # fmt: skip
    answer = (
        "The test that judges this run is tried where the prediction is right: on tables whose variances and mean "
        "errors are drawn from their laws, rows independent of each other; and on blocks of the run's pictures, each "
        "judged as if it were the run."
    )
    columns = ["tried on", "verdicts", "pictures a row", "contradicted", "rate", "95 % interval", "stated, at most"]
    note = "The claim is about the drawn tables; the blocks are too few to tell a rate of 1 % by themselves."
    return Section("", answer, tables=[Table("Verdicts on predictions that are right", columns, rows, note)])


def _controls(found: Dossier) -> Section:
    number = found.station.number
    if not found.controls:
        return Section("", f"No value of setting {number} may be relied on, so nothing planted can be found.")
    rows = [
        [each.name, each.planted, " or ".join(each.wanted) or "nothing", " and ".join(each.found) or "nothing",
         cells.number(each.pooled), cells.number(each.mean, ".2f"), "yes" if each.holds else "no"]
        for each in found.controls
    ]  # fmt: skip
    answer = (
        f"Of setting {number} the noise-free picture is exposed and measured anew, {found.size.exposures} times each: "
        "first as the scene says, then with one parameter wrong. The predictions stay those of the scene; the verdict "
        "has to contradict them, by the test that the parameter concerns. What is planted is as large as so many "
        "exposures have to find: seven standard errors, for mean errors beyond the 0.3 standard uncertainties of one "
        "value that the verdict allows."
    )
    columns = ["wrong parameter", "planted", "to be found by", "found by", "variance, measured / predicted",
               "largest mean error, u", "as it has to be"]  # fmt: skip
    note = (
        "rows: a row's variance. pooled: all variances together. bias: a mean error. u: standard uncertainty of one "
        "value."
    )
    return Section("", answer, tables=[Table("Parameters planted wrong", columns, rows, note)])


def _coverage(found: Dossier) -> Section:
    rows = [
        [cells.name(each.name), each.unit, f"{100 * each.held:.1f} % [{100 * each.low:.1f}, {100 * each.high:.1f}] %",
         f"{100 * each.stated:g} %", f"{each.sigma / each.u:.3f}", f"{(each.mean - each.true) / each.u:+.3f}",
         str(each.n), str(each.failed), each.status]
        for each in found.coverage
    ]  # fmt: skip
    answer = (
        f"{found.size.stations} stations are simulated, each with errors of its own, drawn as the scene states its "
        f"inputs, and each measured by who believes the scene. How: {found.chain or 'nothing could be measured'}. "
        "Stated is that value +- U holds the true value."
    )
    columns = ["requirement", "unit", "held [95 %]", "stated", "scatter / u", "mean error / u", "stations",
               "without a value", "status"]  # fmt: skip
    note = (
        "scatter / u: standard deviation over all stations, over the stated standard uncertainty; 1 where that is "
        "true. An interval holds the claim as long as the stated probability is not above what was found beyond "
        "chance."
    )
    return Section("", answer, tables=[Table("Stations whose interval holds the true value", columns, rows, note)])


def _hard(found: Dossier) -> Section:
    areas = dict.fromkeys(row.area for row in found.hard)
    rows = []
    for area in areas:
        some = [row for row in found.hard if row.area == area]
        told = Counter(row.verdict for row in some)
        parts = [row.error / row.tolerance for row in some if row.verdict == "right" and row.error and row.tolerance]
        kinds = ", ".join(dict.fromkeys(row.kind for row in some))
        rows.append([area, str(len(some)), *(str(told[name]) for name in ("right", "refused", "WRONG")),
                     cells.number(max(parts, default=None), ".2g"), kinds])  # fmt: skip
    wrong = [[row.name, row.measurand, cells.number(row.ours), cells.number(row.reference), row.reason or "-"]
             for row in found.hard if row.verdict == "WRONG"]  # fmt: skip
    columns = ["area", "cases", "right", "refused", "wrong", "largest error / allowed", "references"]
    answer = (
        "Questions that are ill-conditioned in floating point, beside references that share no code with the answers. "
        "Right: within the tolerance that the condition number allows. Refused: no number, with a reason, where none "
        "can be had. dossier.json has every case."
    )
    tables = [Table("Hard cases by area", columns, rows)]
    if wrong:
        tables.append(Table("Wrong answers", ["case", "asked", "ours", "reference", "reason"], wrong, words=True))
    return Section("", answer, tables=tables)


def _limits() -> Section:
    limits = Table("What is not modelled", ["about", "what is missing", "what to do about it"],
                   [list(each) for each in LIMITS], words=True)  # fmt: skip
    states = Table("Statuses, the worst first", ["status", "meaning"], [list(each) for each in MEANINGS.items()],
                   "Only a value that is ok is decided upon, signed, or counted as shown.", words=True)  # fmt: skip
    return Section("", "What the numbers of this dossier do not cover, and how a value says that it may not be relied "
                       "on.",
                   tables=[limits, states])  # fmt: skip


def _laboratory() -> Section:
    points = [f"{each.standard}, {each.clause}: {each.laboratory}." for each in ASKED if each.laboratory]
    return Section("", "What no software can show of itself:", points=points)


def _repeat(found: Dossier) -> Section:
    rows = [
        ["dossier.html, dossier.json", "this page, and its facts with all rows"],
        ["scene.json", "the scene as it was read"],
        ["table.csv, measurands.csv", "the run's rows: each setting, each measurand"],
        [
            f"{RUN}/",
            "the run itself, every measured value: `ice report` writes its own page; a stopped dossier continues",
        ],
        ["made.json", "when and where it was made, and how long it took: the one file that differs from time to time"],
        ["SHA256SUMS", "of all of them but the run and made.json: `sha256sum -c SHA256SUMS` checks the folder"],
    ]
    answer = (
        f"`{found.again}` makes it again; --out names another folder to compare with. After a change of version, "
        "scene or part file it has to be made anew: the listed digests tell whether anything changed."
    )
    return Section("", answer, tables=[Table("Files of this folder", ["file", "what it holds"], rows, words=True)])
