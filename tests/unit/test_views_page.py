"""The page of a plan of several pictures."""

import math
import re

import pytest

import planner
import scenes
from tests.sides import sides
from validation.report import cells, views_page


@pytest.fixture(scope="module")
def around(tmp_path_factory):
    scene = sides(tmp_path_factory.mktemp("sides"), "front", "height", "top")
    return planner.plan_views(scene, 2, step_deg=30, refined=False)


def test_requirements_are_combined_by_inverse_variance(around):
    """1 / variance adds up over the pictures that a value is taken from; U is 1.96 sigma of that."""
    last = around.sets[-1]
    for m, each in enumerate(views_page.requirements(last)):
        used = [int(number) - 1 for number in re.findall(r"\d+", each.limits)]
        assert used
        whole = sum(1 / last.views[v].prediction.measurands[m].variance_object for v in used)
        assert each.sigma == pytest.approx(1 / math.sqrt(whole))
        assert pytest.approx(1.959964 * each.sigma) == each.U


def test_the_page_shows_each_picture_and_where_it_is_taken(around, tmp_path):
    last = around.sets[-1]
    written = views_page.write(around, tmp_path / "plan.html").read_text()
    assert written.count('<svg role="img"') == len(last.views) + 1
    for number, view in enumerate(last.views, 1):
        pose = f"({view.sensor.polar_deg:.1f}, {view.sensor.azimuth_deg:.1f})"
        assert f"{number}: camera {pose}" in written
        assert f"<td>{pose}</td>" in written
    for each in views_page.requirements(last):
        assert each.name in written
    identifiers = re.findall(r'id="([^"]*)"', written)
    assert len(set(identifiers)) == len(identifiers)


def test_each_lamp_of_two_lights_is_shown():
    found = planner.plan_views(scenes.load("two_lights"), 1, step_deg=60, refined=False)
    (view,) = found.sets[0].views
    drawn = str(views_page.sky(found.sets[0]))
    assert f"lamp {cells.pose(view.light[0])} {cells.pose(view.light[1])}" in drawn
