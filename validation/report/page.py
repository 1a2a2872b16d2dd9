"""The report of a run: one self-contained HTML page, and the same tables as Markdown."""

from __future__ import annotations

import base64
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import jinja2
import numpy as np
from markupsafe import Markup, escape

from planner.budgeting.budgets import SceneBudget
from validation.batch.campaign import Campaign
from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.report import budget_figure, budget_section, budget_table, diagnostics, figures, guide, page_tables
from validation.report.page_tables import Table


@dataclass(frozen=True)
class Picture:
    """A PNG, base64, with its text alternative and caption."""

    data: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Section:
    heading: str
    tables: list[Table] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)


def write(campaign: Campaign, found: Validation, store: RunFile, directory: Path) -> list[Path]:
    """Write report.html and report.md to a directory; their paths."""
    context = {
        "name": found.scene,
        "title": found.title or found.scene,
        "verdict": found.verdict.text,
        "agrees": found.verdict.agrees,
        "sections": _sections(campaign, found, store),
    }
    loader = jinja2.PackageLoader("validation.report")
    paths = []
    for suffix, escaped in ((".html", True), (".md", False)):
        environment = jinja2.Environment(
            loader=loader, autoescape=escaped, trim_blocks=True, undefined=jinja2.StrictUndefined
        )
        environment.filters |= {"md": markdown, "words": words}
        paths.append(directory / f"report{suffix}")
        text = environment.get_template(f"report{suffix}.j2").render(context)
        paths[-1].write_text(text, encoding="utf-8")
    return paths


def words(text: str) -> Markup:
    """A text as HTML: commands between backticks as such, names with a hyphen not broken there.

    >>> words("`ice plan` of v3-v6 & more")
    Markup('<code>ice plan</code> of <span class="name">v3-v6</span> &amp; more')
    """
    shown = re.sub(r"`([^`]*)`", r"<code>\1</code>", str(escape(text))).replace(" %", "\N{NO-BREAK SPACE}%")
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


def _sections(campaign: Campaign, found: Validation, store: RunFile) -> list[Section]:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        drawn = figures.draw(campaign, found, store, folder)
        sections = [
            Section("Predicted against measured", [page_tables.ratios(found)], [_agreement(found, drawn[0])]),
            Section("In the scene's unit", [page_tables.units(found)]),
            Section("Variance in the image", [page_tables.variances(found)]),
            Section("Residuals", [], [_residuals(found, folder)]),
            Section("Distribution of the distances", [], [_distribution(found, store, folder)]),
            Section("Estimators", [page_tables.estimators(found)]),
        ]
        effects = page_tables.effects(found, store)
        if effects.rows:
            sections.append(Section("Effects, on and off", [effects]))
        if found.refused:
            sections.append(Section("Settings without a result", [page_tables.refused(found)]))
        sections += [_budget(each, folder) for each in budget_section.budgets_of(campaign.scenes)]
        sections.append(Section("What it cost", [], [_time(found, folder)]))
        sections.append(Section("The run", [page_tables.facts(found, store)]))
        sections.append(Section("Images and edge pixels", [], [_images(path) for path in drawn[1:]]))
    return sections


def _budget(found: SceneBudget, folder: Path) -> Section:
    scene = found.picture.scene
    tables = [
        Table(
            f"{each.name} [{each.unit}]",
            budget_table.COLUMNS,
            budget_section.cells(each),
            budget_section.note(found, m),
            advice=guide.advice(True)["budget"],
        )
        for m, each in enumerate(found)
    ]
    caption = f"Standard uncertainties of {scene.name}, sensor {found.picture.sensor}."
    drawn = budget_figure.draw(found.measurands, folder / f"budget_{scene.name}.png")
    return Section(f"Uncertainty budget of {scene.name}", tables, [_picture(drawn, caption, caption)])


def _agreement(found: Validation, path: Path) -> Picture:
    ratios = np.array([row.main.ratio for row in found.rows if row.main.ratio])
    spread = f", their ratio from {ratios.min():.2f} to {ratios.max():.2f}" if ratios.size else ""
    alt = (
        f"Measured against predicted variance of {ratios.size} settings{spread}; {found.verdict.inside} agree at 95 %."
    )
    return _picture(path, alt, "Measured against predicted variance, with 95 % intervals; below, their ratio.")


def _residuals(found: Validation, folder: Path) -> Picture:
    values = diagnostics.residuals(found)
    reach = f", from {values.min():+.1f} to {values.max():+.1f} standard errors" if values.size else ""
    caption = "ln(measured / predicted variance) over its standard error; dashed: beyond it the verdict rejects."
    path = diagnostics.draw_residuals(found, folder / "residuals.png")
    return _picture(path, f"Residuals of {values.size} settings{reach}.", caption)


def _distribution(found: Validation, store: RunFile, folder: Path) -> Picture:
    distances = diagnostics.Distances.of(found, store)
    path = diagnostics.draw_distribution(distances, folder / "distribution.png")
    alt = (
        f"Histogram and normal plot of {distances.total} distances: {distances.inside(1):.1%} lie within one predicted "
        f"sigma and {distances.inside(2):.1%} within two; a normal distribution has 68.3 % and 95.4 %."
    )
    return _picture(path, alt, "All distances, less their setting's mean, over the predicted sigma. " + alt)


def _time(found: Validation, folder: Path) -> Picture:
    spent = {name: value for name, value in found.seconds.items() if name not in ("wall", "workers")}
    images = sum(row.main.n for row in found.rows)
    total = sum(spent.values())
    alt = "Working seconds: " + ", ".join(f"{name} {value:.1f}" for name, value in spent.items()) + "."
    caption = f"{total:.1f} working seconds for {images} images: {1e3 * total / max(images, 1):.2f} ms an image."
    return _picture(diagnostics.draw_time(found, folder / "time.png"), alt, caption)


def _images(path: Path) -> Picture:
    parts = path.stem.split("_")
    kind = {"images": "Images", "edges": "Edge pixels of canny"}[parts[-1]]
    text = (
        f"{kind} from sensor ({parts[1]}, {parts[2]}), one a light{': ' if parts[3:-1] else ''}{' '.join(parts[3:-1])}"
    )
    return _picture(path, f"{text}.", text + ".")


def _picture(path: Path, alt: str, caption: str) -> Picture:
    return Picture(base64.b64encode(path.read_bytes()).decode("ascii"), alt, caption)
