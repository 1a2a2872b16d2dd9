"""Notebooks as pages: cells and their stored outputs become Markdown, so that nothing is run."""

from __future__ import annotations

import json
from typing import Any

from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx


class NotebookParser(MystParser):
    """Reads what `as_markdown` makes of a notebook."""

    supported = ("ipynb",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Fill the document with a notebook's cells."""
        super().parse("\n\n".join(map(as_markdown, json.loads(inputstring)["cells"])), document)


def as_markdown(cell: dict[str, Any]) -> str:
    """A cell: its text, or its source and what it shows, the HTML of it where there is some."""
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        return source
    return "\n\n".join([_fenced("python", source), *map(_output, cell["outputs"])])


def _output(found: dict[str, Any]) -> str:
    data = found.get("data", {})
    if "text/html" in data:
        shown = "".join(data["text/html"])
        return _fenced("{raw} html", f'<div class="output">\n{shown}\n</div>')
    return _fenced("text", "".join(data.get("text/plain", found.get("text", ""))))


def _fenced(kind: str, text: str) -> str:
    return f"````{kind}\n{text}\n````"


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the parser."""
    app.add_source_suffix(".ipynb", "ipynb")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
