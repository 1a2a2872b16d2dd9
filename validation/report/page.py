"""One page a station: how well each requirement is measured, the proof, and how it was done; the tables as Markdown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from planner.budgeting.budgets import SceneBudget
from validation.batch.campaign import Campaign
from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.report import (
    budget_figure,
    budget_table,
    camera_words,
    cells,
    guide,
    page_tables,
    proof_figures,
    settings_table,
    station_sketch,
    station_table,
    station_view,
    time_figure,
)
from validation.report.grades import LOOKS, MEANS
from validation.report.page_tables import Table
from validation.report.requirements import Requirement
from validation.report.run_cells import far
from validation.report.station import Station, halves_of, reasons
from validation.report.wording import Need, need, next_step, nothing_wrong, sentence, what, wrong

SIMULATED = (
    "Simulated: how precisely this camera would measure the part. No camera was used; nothing is said of any real part."
)


@dataclass(frozen=True)
class Plot:
    """A picture, SVG, and its caption."""

    drawn: Markup
    caption: str


@dataclass(frozen=True)
class Section:
    """A heading and what is below it: an answer in words, the verdict, plots, points, tables, and tables to unfold;
    ``key`` is what links to it name, ``command`` what shows it."""

    heading: str
    answer: str = ""
    verdict: str = ""
    plots: list[Plot] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    folded: list[Table] = field(default_factory=list)
    key: str = ""
    command: str = ""


def write(campaign: Campaign, found: Validation, store: RunFile, station: Station, directory: Path) -> list[Path]:
    """Write report.html and report.md of a run to a directory; their paths."""
    shown = station if len(found.rows) > 1 else replace(station, number=None)
    first = _of_run(first_screen(shown, not store.identity().get("photos")), found, station)
    sections = [proof(campaign, found, store), *budget_sections(station.budget)]
    if len(found.rows) > 1:
        sections.insert(0, _settings(campaign, found, station, bool(first["simulated"])))
    if found.refused:
        sections.append(Section("Settings without a result", tables=[page_tables.refused(found)]))
    sections.append(_done(found, store))
    name, title = station.picture.scene.name, _title(found, station)
    context = {"name": name, "title": title, "sections": sections, "station": first, "agrees": found.verdict.agrees}
    paths = [directory / "report.html", directory / "report.md"]
    paths[0].write_text(environment(True).get_template("page.html.j2").render(context), encoding="utf-8")
    paths[1].write_text(environment(False).get_template("report.md.j2").render(context), encoding="utf-8")
    return paths


def write_station(station: Station, title: str, path: Path, more: Sequence[Section] = ()) -> Path:
    """Write the page of a station that was not rendered: its first screen, sections of one's own, and its budget."""
    sections = [*more, *budget_sections(station.budget)]
    return write_page(first_screen(station), station.picture.scene.name, title, sections, path)


def write_page(first: dict[str, Any], name: str, title: str, sections: list[Section], path: Path) -> Path:
    """Write a page with a first screen and sections of one's own."""
    context = {"name": name, "title": title, "sections": sections, "station": first, "agrees": True}
    path.write_text(environment(True).get_template("page.html.j2").render(context), encoding="utf-8")
    return path


def environment(escaped: bool) -> jinja2.Environment:
    """Of the templates; ``escaped``: for HTML."""
    loader = jinja2.PackageLoader("validation.report")
    made = jinja2.Environment(loader=loader, autoescape=escaped, trim_blocks=True, undefined=jinja2.StrictUndefined)
    made.filters |= {"md": markdown, "words": words, "linked": linked}
    return made


def first_screen(station: Station, is_simulated: bool = True) -> dict[str, Any]:
    """What the template of a page's first screen takes; of photographs nothing is simulated."""
    found, picture = station.requirements, station.picture
    told, camera = station_sketch.told(picture), camera_words.told(picture.scene)
    placed = f"Setting {station.number}: " if station.number else ""
    how = f"{_shown(station, is_simulated)}{station_view.enlarged(picture)}"
    named = "; ".join(f"{each.number} {each.title}: {each.grade}" for each in found)
    table = station_table.table(found)
    return {
        "what": f"{what(found)}, numbered in the picture, from one picture of one camera",
        **said(found),
        "simulated": SIMULATED if is_simulated else "",
        "is_sky": False,
        "sketch": station_sketch.draw(picture),
        "view": station_view.draw(picture, found, station.image, f"What is measured{how} {named}."),
        "places": f"{camera}. {told[0].upper()}{told[1:]}. {station_sketch.AZIMUTH}",
        "sketched": "",
        "caption": f"What is measured{how}",
        "columns": station_table.COLUMNS,
        "above": station_table.ABOVE,
        "note": station_table.note(found),
        "section": Section("Requirements", answer=f"{placed}{told}. Camera: {camera}.", tables=[table]),
    }


def said(found: Sequence[Requirement]) -> dict[str, Any]:
    """What a first screen says of requirements, wherever they are measured from."""
    grades = dict.fromkeys(each.grade for each in found)
    return {
        "simulated": SIMULATED,
        "sentence": sentence(found),
        "wrong": wrong(found),
        "nothing": nothing_wrong(found),
        "next": next_step(found),
        "need": need(found),
        "checked": "",
        "key": [(MEANS[grade], LOOKS[grade]) for grade in grades],
        "lines": station_table.lines(found),
    }


def _shown(station: Station, is_simulated: bool) -> str:
    """In which picture what is measured is shown, the end of a sentence."""
    where = f" of setting {station.number}" if station.number else ""
    if station.image is not None:
        return f", in the {'rendered picture' if is_simulated else 'photograph'}{where}."
    return f", in a drawing from the model{where}: no shadows, no light between surfaces."


def _title(found: Validation, station: Station) -> str:
    """Of a run its own, or the part's with the name of the campaign that has none."""
    scene = station.picture.scene
    part = scene.title or scene.name
    if found.title:
        return found.title
    return part if found.scene == scene.name else f"{part} (campaign {found.scene})"


def _of_run(first: dict[str, Any], found: Validation, station: Station) -> dict[str, Any]:
    """The first screen with what a run says of it: whether it agrees, and what is not proven elsewhere."""
    wrong, after = first["wrong"], guide.elsewhere(found, station.number)
    if len(found.rows) > 1:
        first = first | {"what": f"{first['what']}. {guide.tried(found, station.number)}"}
    if found.verdict.agrees:
        return first | {"checked": guide.checked(found, bool(first["simulated"])), "wrong": wrong + after}
    steps = [guide.why_not(found), first["next"] if wrong else ""]
    return first | {
        "wrong": [guide.contradiction(found), *wrong, *after],
        "next": " ".join(step for step in steps if step) or first["next"],
        "need": Need.ACT,
    }


def linked(text: str, numbers: Sequence[int]) -> Markup:
    """A text as `words`, in which the numbers of requirements lead to their rows.

    >>> linked("Slot (no. 4) & no. 9", [4])
    Markup('Slot (<a href="#requirement-4">no.\\xa04</a>) &amp; no. 9')
    """

    def link(found: re.Match[str]) -> str:
        known = int(found.group(1)) in numbers
        shown = found.group().replace(" ", "\N{NO-BREAK SPACE}")
        return f'<a href="#requirement-{found.group(1)}">{shown}</a>' if known else found.group()

    def all_links(found: re.Match[str]) -> str:
        return re.sub(r"(?:no\. )?(\d+)", link, found.group())

    return Markup(re.sub(r"\bno\. \d+(?:, \d+)*(?: and \d+)?", all_links, words(text)))


def words(text: str) -> Markup:
    """A text as HTML: commands between backticks as such, names with a hyphen not broken there, nor numbers after what
    they count.

    >>> words("`ice plan` of v3-v6 & more")
    Markup('<code>ice plan</code> of <span class="name">v3-v6</span> &amp; more')
    >>> words("of setting 12: 5 %")
    Markup('of setting\\xa012: 5\\xa0%')
    """
    shown = re.sub(r"`([^`]*)`", r"<code>\1</code>", str(escape(text))).replace(" %", "\N{NO-BREAK SPACE}%")
    shown = re.sub(r"\b([Ss]etting|[Pp]icture) (?=\d)", "\\g<1>\N{NO-BREAK SPACE}", shown)
    return Markup(re.sub(r"(?<![\w&;<-])\w[\w.]*(?:-[\w.]*\w)+(?!\w)", r'<span class="name">\g<0></span>', shown))


def markdown(text: str) -> str:
    """A text that Markdown shows as it is: no HTML, no link, no code, no table's bar, one line.

    >>> markdown("a|b <script>[x](y)`")
    'a\\\\|b &lt;script&gt;[x]\\\\(y)\\\\`'
    """
    for plain, shown in (
        ("\\", "\\\\"), ("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("|", "\\|"), ("`", "\\`"), ("](", "]\\("),
    ):  # fmt: skip
        text = text.replace(plain, shown)
    return " ".join(text.split())


def _settings(campaign: Campaign, found: Validation, station: Station, is_simulated: bool) -> Section:
    table = settings_table.table(found, halves_of(campaign), station.number)
    done = "simulated and measured" if is_simulated else "measured"
    many = f"{found.overview.images} {'noisy pictures' if is_simulated else 'photographs'} of each"
    shown = f"shown above is setting {station.number}, the best"
    answer = f"{len(found.rows)} settings were {done}, {many}; {shown}."
    return Section("All settings, the best first", answer, tables=[table])


def proof(campaign: Campaign, found: Validation, store: RunFile) -> Section:
    """Whether the uncertainties of a run are true: measured beside predicted, in figures and tables."""
    lines = proof_figures.lines_of(found, halves_of(campaign))
    forest, bias = proof_figures.forest(lines), proof_figures.bias(lines)
    many = proof_figures.grouped_told(lines)
    some = "" if len(found.rows) <= proof_figures.MOST else f" Of {proof_figures.MOST} of {len(found.rows)} settings."
    read = many + some
    plots = [
        Plot(forest, "Scatter of the measured values against the predicted one. Dots: 1 lies inside the interval; "
             "diamonds: it does not, as happens by chance in one of 20; crosses: not proven, so not judged." + read),
        Plot(bias, proof_figures.bias_told(lines) + many),
        Plot(proof_figures.distributions(found, store),
             "All measured values of each requirement (bars) against what is predicted (line)."),
    ]  # fmt: skip
    why = reasons(campaign, far(found)[0])
    folded = [page_tables.ratios(found, why), page_tables.units(found, why), page_tables.variances(found),
              page_tables.estimators(found)]  # fmt: skip
    answer = guide.plain_verdict(found, "photographs" if store.identity().get("photos") else "simulated noisy pictures")
    return Section("Are these uncertainties true?", answer, found.verdict.text, plots, folded=folded)


def budget_sections(found: SceneBudget | None) -> list[Section]:
    """Where the uncertainty comes from, as a picture and a table a measurand; none without a budget."""
    if found is None:
        return []
    caption = (
        "Each bar is U of a requirement, divided by what its sources add to the variance: the longest part is the one "
        "to improve. `ice budget SCENE --reach U` says how well a source must be known for a wanted U."
    )
    folded = [
        Table(f"{cells.name(each.name)} [{each.unit}]", budget_table.COLUMNS, budget_table.lines(each),
              budget_table.note(found, m))
        for m, each in enumerate(found)
    ]  # fmt: skip
    plots = [Plot(budget_figure.drawn(found), caption)]
    return [
        Section("Where the uncertainty comes from", plots=plots, points=budget_figure.improved(found), folded=folded)
    ]


def _done(found: Validation, store: RunFile) -> Section:
    folded = [page_tables.facts(found, store)]
    effects = page_tables.effects(found, store)
    plots = [Plot(time_figure.drawn(found.seconds, store.images()), "Where the time went.")]
    return Section("How it was done", plots=plots, folded=folded + [effects] * bool(effects.rows))
