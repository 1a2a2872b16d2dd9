"""The report of a run: one self-contained HTML page, and the same tables as Markdown."""

from __future__ import annotations

import base64
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import jinja2
import numpy as np

from planner.budgeting.budgets import SceneBudget
from validation.batch.campaign import Campaign
from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.batch.store import RunFile
from validation.report import budget_figure, budget_section, diagnostics, figures
from validation.report.table import errors, failed, far, names, number, ratio, shift, small
from validation.statistics import ALLOWANCE, LEVEL, Verdict

_ROWS = 64  # rows of the table of settings without a result


@dataclass(frozen=True)
class Table:
    """Columns and cells as text; ``words`` is a table of sentences rather than numbers."""

    label: str
    columns: list[str]
    rows: list[list[str]]
    note: str = ""
    words: bool = False


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
        environment.filters["md"] = markdown
        paths.append(directory / f"report{suffix}")
        text = environment.get_template(f"report{suffix}.j2").render(context)
        paths[-1].write_text(text, encoding="utf-8")
    return paths


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
            Section("Predicted against measured", [_ratios(found)], [_agreement(found, drawn[0])]),
            Section("Variance of the distance", [_variances(found)]),
            Section("Residuals", [], [_residuals(found, folder)]),
            Section("Distribution of the distances", [], [_distribution(found, store, folder)]),
            Section("Estimators", [_estimators(found)]),
        ]
        effects = _effects(store)
        if effects.rows:
            sections.append(Section("Effects, on and off", [effects]))
        if found.refused:
            sections.append(Section("Settings without a result", [_refused(found)]))
        sections += [_budget(each, folder) for each in budget_section.budgets_of(campaign.scenes)]
        sections.append(Section("What it cost", [], [_time(found, folder)]))
        sections.append(Section("The run", [_facts(found, store)]))
        sections.append(Section("Images and edge pixels", [], [_images(path) for path in drawn[1:]]))
    return sections


def _key(found: Validation, rows: list[Row]) -> tuple[list[str], dict[int, list[str]]]:
    """First columns of a table of settings, and their cells by setting."""
    headings, cells = names(found, rows)
    return ["setting", *headings], {index: [str(index + 1), *row] for index, row in cells.items()}


def _ratios(found: Validation) -> Table:
    rows, which = far(found)
    key, cells = _key(found, rows)
    columns = [
        *key,
        f"{rows[0].main.method}: measured / predicted [95 %]",
        "images",
        "failed",
        "bias, px: predicted",
        "measured",
        "rmse, px",
        "status",
    ]
    lines = [
        [
            *cells[row.index], ratio(row.main), str(row.main.n), failed(row),
            shift(row.main.predicted_bias), *errors(row.main), row.main.status,
        ]
        for row in rows
    ]  # fmt: skip
    note = (
        "* : 1 lies outside the chi-square interval. failed: one number for each estimator. "
        "rmse: root mean square error, sqrt(variance + bias^2). "
    )
    note += which
    return Table("Measured over predicted variance, by setting", columns, lines, note)


def _variances(found: Validation) -> Table:
    rows, which = far(found)
    key, cells = _key(found, rows)
    others = list(dict.fromkeys(judged.method for row in found.rows for judged in row.classic))
    columns = [
        *key, "paper ICE", "our ICE", "paper real 12", "paper real 10", "calibrated", "propagated",
        rows[0].main.method, *others, "Cramer-Rao",
    ]  # fmt: skip
    lines = []
    for row in rows:
        classic = {judged.method: judged for judged in row.classic}
        measured = [small(classic[name].empirical) if name in classic else "-" for name in others]
        lines.append([
            *cells[row.index], number(row.paper_ice), number(row.paper), *map(number, row.paper_real or (None, None)),
            small(row.calibrated), small(row.main.propagated), small(row.main.empirical), *measured, small(row.bound),
        ])  # fmt: skip
    note = (
        "ICE and real: the paper's px^2, our ICE with one free scale if the paper printed any. "
        "calibrated, propagated (predictions), each estimator (measured) and the bound: 1e-4 px^2."
    )
    return Table("Table 3: variance of the distance, by setting", columns, lines, f"{note} {which}")


def _estimators(found: Validation) -> Table:
    main = found.rows[0].main.method
    verdicts = {f"{main} (the verdict's)": found.verdict, **found.classic_verdicts}
    columns = [
        "estimator", "rows inside 95 %", "smallest p-value", "limit", "pooled ratio [95 %]", "p-value", "limit",
        "largest bias, sigma", "p-value", "limit", "not measured", "as predicted",
    ]  # fmt: skip
    note = (
        f"A row's variance (chi-square, Sidak over the rows), that of all rows pooled, and the mean error of rows that "
        f"are ok, of which {ALLOWANCE:g} sigma of one image is allowed; a method whose rows mostly could not be "
        f"measured is not as predicted. The three tests share a level of {LEVEL:g} (Bonferroni)."
    )
    return Table("Verdict on each estimator", columns, [[name, *_tests(v)] for name, v in verdicts.items()], note)


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


def _effects(store: RunFile) -> Table:
    lines = [(scene, effect) for scene, effects in store.fact("effects", {}).items() for effect in effects]
    keys = list(dict.fromkeys(key for _, effect in lines for key in effect))
    rows = [[scene, *(_word(effect.get(key, "")) for key in keys)] for scene, effect in lines]
    return Table("Effects, on and off", ["scene", *keys], rows, words=True)


def _budget(found: SceneBudget, folder: Path) -> Section:
    scene = found.picture.scene
    tables = [
        Table(
            f"{each.name} [{each.unit}]",
            budget_section.COLUMNS,
            budget_section.cells(each),
            budget_section.note(found, m),
        )
        for m, each in enumerate(found)
    ]
    caption = f"Standard uncertainties of {scene.name}, sensor {found.picture.sensor}."
    drawn = budget_figure.draw(found.measurands, folder / f"budget_{scene.name}.png")
    return Section(f"Uncertainty budget of {scene.name}", tables, [_picture(drawn, caption, caption)])


def _word(value: object) -> str:
    return ("on" if value else "off") if isinstance(value, bool) else str(value)


def _refused(found: Validation) -> Table:
    rows = [[str(index + 1), reason] for index, reason in list(found.refused.items())[:_ROWS]]
    note = f"{len(found.refused)} in all." if len(found.refused) > _ROWS else ""
    return Table("Settings without a result", ["setting", "why"], rows, note, words=True)


def _facts(found: Validation, store: RunFile) -> Table:
    identity, machine = store.identity(), store.fact("machine", {})
    facts = {
        "scenes": ", ".join(scene["name"] for scene in identity["campaign"]["scenes"]),
        "settings x images": f"{len(found.rows) + len(found.refused)} x {identity['renders']}",
        "seed": found.seed,
        "renderer's variant": found.variant,
        "versions": ", ".join(f"{name} {version}" for name, version in identity["versions"].items()),
        "digest of the code": identity["code"],
        "machine": ", ".join(f"{name} {value}" for name, value in machine.items()),
        "time": f"{found.seconds['wall']:.1f} s with {found.seconds['workers']} workers",
    }
    return Table(
        "Facts of the run", ["fact", "value"], [[name, str(value)] for name, value in facts.items()], words=True
    )


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
