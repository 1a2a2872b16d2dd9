"""What was varied beside the poses, as a section of a plan's page."""

from __future__ import annotations

from planner import Varied
from validation.report import vary_table
from validation.report.page import Section
from validation.report.page_tables import Table
from validation.vary_check import VaryCheck


def section(varied: Varied, checked: VaryCheck | None) -> Section:
    """The choice that is shown above, beside the scene's own; ``checked``: what noisy pictures of both say."""
    table = Table(
        "Own and best choice", list(vary_table.COLUMNS), vary_table.choices(varied), " ".join(vary_table.TERMS.split()),
        chosen=2,
    )  # fmt: skip
    said = [] if checked is None else [f"Rendered and measured: {checked.verdict}"]
    points = [f"Held equal: {vary_table.HELD[varied.hold]}.", f"What is known: {varied.guarantee}.", *said]
    answer = f"Shown above: {vary_table.proposed(varied)}."
    return Section(f"What was varied: {', '.join(varied.vary)}", answer, tables=[table], points=points)
