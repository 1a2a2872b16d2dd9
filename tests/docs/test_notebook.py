"""The notebook of the documentation, `docs/notebook.ipynb`: it is what `python -m validation.report.executed` makes."""

import json
import re
import sys

import pytest

from tests.docs.pages import DOCS
from validation.report import executed

LESS = {"renders=200": "renders=8", "step_deg=15": "step_deg=30"}


def notebook():
    return json.loads((DOCS / "notebook.ipynb").read_text())


def kinds(found):
    """What each code cell shows: by kind of media, and whether there is a picture in it."""
    told = []
    for cell in found["cells"]:
        data = [out.get("data", {}) for out in cell.get("outputs", [])]
        told.append([(sorted(each), "<svg" in "".join(each.get("text/html", []))) for each in data])
    return told


def less(source):
    for much, little in LESS.items():
        source = source.replace(much, little)
    return source


def test_what_is_stored_shows_pictures():
    """Of a scene, a picture, a plan, a measurement, a budget and a run."""
    shown = [picture for cell in kinds(notebook()) for _, picture in cell]
    assert sum(shown) == 6


@pytest.mark.render
def test_the_notebook_runs_and_shows_what_is_stored():
    """With fewer pictures and a coarser grid; its text is the stored one, for only its outputs are written anew."""
    stored = notebook()
    assert all(any(much in "".join(cell["source"]) for cell in stored["cells"]) for much in LESS)
    found = executed.run(stored, less)
    assert kinds(found) == kinds(stored)
    assert [cell["source"] for cell in found["cells"]] == [cell["source"] for cell in stored["cells"]]


def test_the_notebook_names_no_folder_of_the_machine_that_it_was_run_on(tmp_path):
    """Files of this project are named as from its root."""
    assert not re.search(r"Path\('/", (DOCS / "notebook.ipynb").read_text(encoding="utf-8"))
    path, source = tmp_path / "small.ipynb", f"'{executed.ROOT}/scenes/plate.ply'"
    cell = {"cell_type": "code", "metadata": {}, "execution_count": None, "outputs": [], "source": [source]}
    path.write_text(json.dumps({"cells": [cell], "metadata": {}}))
    executed.write(path)
    assert json.loads(path.read_text())["cells"][0]["outputs"][0]["data"]["text/plain"] == ["'scenes/plate.ply'"]


def test_a_cell_shows_what_it_prints_and_what_its_last_line_is_worth(tmp_path):
    cells = [
        {"cell_type": "markdown", "metadata": {}, "source": ["# Title"]},
        {
            "cell_type": "code",
            "metadata": {},
            "execution_count": None,
            "outputs": [],
            "source": ["a = 2\n", "print(a)"],
        },
        {"cell_type": "code", "metadata": {}, "execution_count": None, "outputs": [], "source": ["a * 3"]},
        {"cell_type": "code", "metadata": {}, "execution_count": None, "outputs": [], "source": ["b = a"]},
    ]
    path = tmp_path / "small.ipynb"
    path.write_text(json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 4}))
    executed.write(path)
    found = json.loads(path.read_text())["cells"]
    assert found[1]["outputs"] == [{"output_type": "stream", "name": "stdout", "text": ["2\n"]}]
    assert found[2]["outputs"][0]["data"] == {"text/plain": ["6"]}
    assert [cell.get("execution_count") for cell in found] == [None, 1, 2, 3]
    assert found[3]["outputs"] == []


def test_as_a_page(monkeypatch):
    """Text as it is, source as Python, HTML as such, other outputs as text."""
    pytest.importorskip("myst_parser", reason="the extra 'docs' is not installed")
    monkeypatch.setattr(sys, "path", [str(DOCS / "_extensions"), *sys.path])
    from notebooks import as_markdown

    assert as_markdown({"cell_type": "markdown", "source": ["# A\n", "b"]}) == "# A\nb"
    cell = {"cell_type": "code", "source": ["a"], "outputs": [{"data": {"text/plain": ["1"]}}]}
    assert as_markdown(cell) == "````python\na\n````\n\n````text\n1\n````"
    cell["outputs"] = [{"data": {"text/plain": ["1"], "text/html": ["<b>1</b>"]}}]
    assert '<div class="output">\n<b>1</b>\n</div>' in as_markdown(cell)
