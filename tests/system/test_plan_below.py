"""A part that is seen from below is planned from below."""

import json
from contextlib import nullcontext
from functools import partial

import numpy as np
import pytest
import trimesh

import planner
import scenes
from planner.constraints import same_side
from scenes import Pose
from tests.commands import ice

ASKED = """[[measurands]]
name = "length"
kind = "width"
features = [{{ edge = "{}" }}, {{ edge = "{}" }}]

[[settings]]
sensor = [{}, 20.0]
light = [{}, 60.0]
"""


@pytest.mark.parametrize(
    ("polar", "sides"),
    [([], (0, 90)), ([20, 90], (0, 90)), ([91, 160], (90, 180)), ([20, 91], (0, 180))],
)
def test_sides(polar, sides):
    assert same_side(Pose(each, 30.0) for each in polar) == sides


@pytest.mark.parametrize("above", [True, False])
def test_each_on_its_side(above):
    """What is not given is told by the scene's first setting, of each in its place; what is given stays."""
    scene = scenes.load("task1")
    below = scene.with_(settings=[{"sensor": (20 if above else 160, 30), "light": (150 if above else 30, 60)}])
    sides = (0, 90), (90, 180)
    limits = planner.Constraints().on_side_of(below)
    assert (limits.sensor_polar_deg, limits.light_polar_deg) == (sides if above else sides[::-1])
    assert planner.Constraints((5, 120), (7, 170)).on_side_of(below) == planner.Constraints((5, 120), (7, 170))


def test_the_lower_face_of_a_box(tmp_path):
    """Its ends are seen at once from below alone; a scene whose setting stands above is planned above, as ever."""
    trimesh.creation.box((2, 1, 1)).export(tmp_path / "box.stl")
    assert ice("new", "box.stl", "-o", "box.toml", cwd=tmp_path).returncode == 0
    text = (tmp_path / "box.toml").read_text().split("[[measurands]]")[0]
    solid = scenes.load(tmp_path / "box.toml").solid
    ends = {edge.name: solid.vertices[list(edge.ends)] for edge in solid.sharp}
    across = [name for name, at in ends.items() if np.ptp(at[:, 0]) == 0 and (at[:, 2] < 0).all()]
    found = {}
    for polar in (160.0, 20.0):
        (tmp_path / "asked.toml").write_text(text + ASKED.format(*across, polar, polar))
        found[polar] = ice("plan", "asked.toml", "--step", 30, "--no-check", "--json", cwd=tmp_path)
        scene = scenes.load(tmp_path / "asked.toml")
        for search in (planner.plan, partial(planner.plan_views, count=1)):
            about = nullcontext() if polar > 90 else pytest.raises(scenes.InvalidInput, match="leave a setting")
            with about:
                search(scene, step_deg=30)
    document = json.loads(found[160.0].stdout)
    # margin: on the lower side, by their kind
    assert min(document["sensor"][0], document["light"][0]) > 90
    assert found[20.0].returncode == 2
    assert "constraints must leave a setting that can measure" in found[20.0].stderr
