"""What a run records of the renderer's effects, and how the report shows it."""

from types import SimpleNamespace

import render
from validate import report, work


def test_effects_are_recorded_and_shown(task1, monkeypatch):
    def effects(scene):
        assert scene is task1
        return [SimpleNamespace(effect=SimpleNamespace(name=n), on=n == "fog", reason="dim") for n in ("fog", "rain")]

    monkeypatch.setattr(render, "effects", effects, raising=False)
    recorded = work.effects(task1)
    assert recorded == [
        {"effect": "fog", "on": True, "reason": "dim"},
        {"effect": "rain", "on": False, "reason": "dim"},
    ]
    table = report._effects(SimpleNamespace(fact=lambda _key, _default: {"task1": recorded}))
    assert table.columns == ["scene", "effect", "on", "reason"]
    assert table.rows == [["task1", "fog", "on", "dim"], ["task1", "rain", "off", "dim"]]


def test_a_renderer_that_says_nothing(task1, monkeypatch):
    monkeypatch.setattr(render, "effects", None, raising=False)
    assert work.effects(task1) == []
