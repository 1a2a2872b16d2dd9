"""What a run records of the renderer's effects, and how the report shows it."""

from types import SimpleNamespace

import pytest

from render.phenomena import EFFECTS
from scenes import InvalidInput
from validation import run
from validation.batch import work
from validation.batch.work import Rendering
from validation.report import page_tables as report


def test_effects_are_recorded_and_shown(task1):
    recorded = work.effects(task1)
    assert {line["effect"]: line["on"] for line in recorded}["floor"] is False
    found = SimpleNamespace(verdict=SimpleNamespace(agrees=True))
    table = report.effects(found, SimpleNamespace(fact=lambda _key, _default: {"task1": recorded[:2]}))
    assert table.columns == ["scene", "effect", "on", "reason"]
    assert [row[:3] for row in table.rows] == [["task1", "attached_shadow", "on"], ["task1", "cast_shadow", "off"]]


def test_effects_that_were_asked_for_are_recorded_as_such(task1):
    every = work.effects(task1, Rendering(effects="all"))
    assert all(line["on"] for line in every)
    assert len(every) == len(EFFECTS)
    named = {line["effect"]: line["on"] for line in work.effects(task1, Rendering(effects="floor,lens_blur"))}
    assert {name for name, on in named.items() if on} == {"floor", "lens_blur"}


def test_an_unknown_effect_is_refused_before_anything_is_written(task1, tmp_path):
    with pytest.raises(InvalidInput, match=r"effects must be auto, all or some of .* got 'fog'"):
        run(task1, 2, out=tmp_path / "run", effects="fog")
    assert not (tmp_path / "run").exists()
