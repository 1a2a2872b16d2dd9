"""What a run prints tells a stranger its terms, where the files are and what to do next."""

from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

import scenes
import validation
from scenes.status import MEANINGS, REMEDIES
from validation.report import guide, table

pytestmark = pytest.mark.render


@pytest.fixture(scope="module")
def found(small_toml, tmp_path_factory):
    small = scenes.load(small_toml)
    scene = small.model_copy(update={"settings": small.settings[:2]})
    return validation.run(scene, renders=30, seed=1, out=tmp_path_factory.mktemp("guide"), workers=1)


def printed(found, explained=False):
    console = Console(width=150)
    with console.capture() as text:
        console.print(table.report(found, explained))
    return text.get()


def test_only_columns_that_are_there_are_explained(found):
    text = printed(found)
    for term in ("calibrated:", "propagated:", "gradient:", "canny:", "Cramer-Rao bound:", "failed: those", '"0 0 0"'):
        assert term in text
    assert all((row.paper_ice is None) == ("paper ICE:" not in text) for row in found.rows)
    assert "misfit:" not in text
    assert "How to read this" not in text
    assert "How to read this" in printed(found, explained=True)


def test_a_status_that_occurs_is_explained(found):
    rows = [replace(found.rows[0], main=replace(found.rows[0].main, status="misfit")), found.rows[1]]
    text = " ".join(printed(replace(found, rows=rows)).split())
    assert f"misfit: {MEANINGS['misfit']}; {REMEDIES['misfit']}." in text


def test_results_in_the_scenes_unit(found):
    row = found.rows[0].measurands[0]
    line = next(line for line in printed(found).splitlines() if f" {row.value:.6g} " in line)
    assert f" {row.unit} " in line
    assert f" {row.empirical**0.5:.3g} " in line


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"agrees": True}, "`ice plan 'a b.toml'` looks for better places"),
        ({"agrees": False, "reasons": ("rows",)}, "`ice effects 'a b.toml' --check` tells whether"),
        (
            {"agrees": False, "reasons": ("not measured",)},
            "`ice plan 'a b.toml'` proposes settings that can be measured",
        ),
    ],
)
def test_what_to_try_next(found, change, said):
    judged = replace(found, verdict=replace(found.verdict, **change))
    line = guide.next_line(judged, "a b.toml", Path("runs/x"))
    assert line.startswith("Next: look at runs/x/report.html; ")
    assert said in line
    assert guide.next_line(judged, None, Path("runs/x")) == "Next: look at runs/x/report.html."
