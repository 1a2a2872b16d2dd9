"""Which maps a plan is drawn with."""

from types import SimpleNamespace

import pytest

from scenes import Pose
from validation.report import plan_figures

SENSOR, LIGHT = Pose(30, 135), Pose(15, 315)


@pytest.mark.parametrize(
    ("light", "roles"),
    [(LIGHT, ["light", "sensor"]), ((LIGHT, Pose(40, 20)), ["sensor"]), ((), ["sensor"])],
    ids=["one free light", "two", "none"],
)
def test_there_is_a_map_of_the_light_where_one_is_free(monkeypatch, light, roles):
    """The sensor is always somewhere."""
    monkeypatch.setattr(plan_figures, "_chart", lambda plan, role: role)
    assert list(plan_figures._charts(SimpleNamespace(sensor=SENSOR, light=light))) == roles


def test_what_is_held_is_said():
    plan = SimpleNamespace(sensor=SENSOR, light=LIGHT)
    assert plan_figures._held(plan, "light") == f", sensor at {plan_figures.short(SENSOR)}"
    assert plan_figures._held(plan, "sensor") == f", light at {plan_figures.short(LIGHT)}"
    assert plan_figures._held(SimpleNamespace(sensor=SENSOR, light=()), "sensor") == ""
