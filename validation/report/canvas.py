"""What all pictures share: a width at which text of 10 points is legible on a phone and in print."""

from __future__ import annotations

import io
import re
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # what draws all of them: to files, without a display
from markupsafe import Markup, escape
from matplotlib.text import Text

WIDTH = 5.2  # inches; shown 390 px wide, 10 points are 10 px high
TEXT = 10  # points: the least
_DPI = 160


def save(figure, path: Path) -> Path:
    """Write a figure to a file and forget it; the file's path.

    Texts are shown as they are, for names and titles are the user's: only powers along logarithmic axes are formulas.
    """
    _plain(figure)
    figure.savefig(path, dpi=_DPI)
    plt.close(figure)
    return path


def inline(figure, key: str, label: str) -> Markup:
    """A figure as SVG within a page, its text as text; the figure is forgotten.

    Parameters
    ----------
    key : str
        Tells its identifiers from those of the page's other pictures.
    label : str
        What a reader without eyes is told of it.
    """
    _plain(figure)
    written = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": key}):
        figure.savefig(written, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    plt.close(figure)
    drawn = written.getvalue()
    drawn = re.sub(r"<metadata>.*?</metadata>", "", drawn[drawn.index("<svg") :], flags=re.DOTALL)
    drawn = re.sub(r'(?<=\bid=")|(?<=href="#)|(?<=url\(#)', f"{key}-", drawn)
    return Markup(drawn.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1))


def _plain(figure) -> None:
    """No text of a figure is a formula, but powers along logarithmic axes."""
    axes = [axis for each in figure.axes for axis in (each.xaxis, each.yaxis) if axis.get_scale() == "log"]
    powers = {label for axis in axes for label in axis.get_ticklabels(which="both")}
    for text in figure.findobj(Text):
        text.set_parse_math(text in powers)


def legend_below(axis, columns: int = 1, **how) -> None:
    """A legend under an axis and its label, so that it covers no data."""
    axis.figure.legend(
        *axis.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=columns,
        frameon=False,
        fontsize=TEXT,
        **how,
    )
