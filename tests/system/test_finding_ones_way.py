"""``ice new``, ``ice show`` and ``ice scenes``: from a part's file to a scene that runs."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import measure
import planner
import render
import scenes
from imaging.geometry.projection import project
from tests.parts import Hole, bracket, prism, unevenly
from validation.cli.main import app

ICE = CliRunner()


def ice(*arguments):
    return ICE.invoke(app, list(map(str, arguments)))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a part and what `ice new` makes of it."""
    folder = tmp_path_factory.mktemp("part")
    bracket(24).export(folder / "part.stl")
    done = ice("new", folder / "part.stl", "-o", folder / "part.toml")
    assert done.exit_code == 0
    return folder


@pytest.fixture
def part(made, monkeypatch):
    monkeypatch.chdir(made)
    return Path("part.stl")


def test_a_new_scene_runs(part):
    """What it measures is seen, lit, sharp and in the picture; its field of view holds the part."""
    scene = scenes.load("part.toml")
    assert scene.units == "mm"
    assert max(np.ptp(scene.solid.vertices, axis=0)) == pytest.approx(60)
    assert 60 < min(scene.camera.field_of_view) < 180  # margin: the part's 60 mm, less than three times as wide
    (setting,) = scene.settings
    found = planner.predict(scene, setting.sensor, setting.light)
    assert found.status == "ok"
    assert len(found.measurands) > 2
    assert {each.kind for each in found.measurands} > {"diameter"}
    assert found.worst_ratio < 0.1
    ends = scene.solid.vertices[[end for name in scene.required for end in _ends(scene.solid, name)]]
    assert (np.abs(project(ends, list(setting.sensor), scene.camera) - [639.5, 511.5]) < [640, 512]).all()
    text = (part.parent / "part.toml").read_text()
    assert text.count("#") > 10


def _ends(solid, name):
    return next((each.ends for each in solid.edges if each.name == name), ())


@pytest.mark.render
@pytest.mark.parametrize("case", range(2))
def test_random_parts_from_a_file_to_a_measured_value(case, tmp_path):
    """A plate and a bracket with a hole, all sizes known: read, predicted, rendered, measured to 4 sigma."""
    rng = np.random.default_rng(case)
    length, width, height = rng.uniform([40, 25, 6], [120, 80, 20])
    step, low = (0.6 * length, 0.5 * height) if case else (length, height)
    profile = [(0, 0), (length, 0), (length, low), *([(step, low), (step, height)] if case else []), (0, height)]
    hole = Hole(step / 2, width / 2, 0.2 * min(step, width), unevenly(rng, 40), 0.0, height)
    prism(profile, width, [hole], seed=case).export(tmp_path / "part.stl")
    assert ice("new", tmp_path / "part.stl", "-o", tmp_path / "part.toml").exit_code == 0
    scene = scenes.load(tmp_path / "part.toml")
    (setting,) = scene.settings
    predicted = planner.predict(scene, setting.sensor, setting.light)
    assert predicted.status == "ok"
    sides = (length, width, height, step, low, length - step, height - low, 2 * hole.radius)
    for each in predicted.measurands:
        assert min(abs(each.value_object - side) for side in sides) < 1e-4, each.name
    clean = render.image(scene, setting.sensor, setting.light)
    image = render.expose(clean, scene.noise, rng, 1)[0]
    found = measure.measure(image, scene, setting.sensor, setting.light, "gradient")
    for value, each in zip(found.value, predicted.measurands, strict=True):
        assert abs(value - each.value_object) < 4 * np.sqrt(each.variance_object)


@pytest.mark.parametrize("units", ["inch", "m"])
def test_a_new_scene_in_other_units(units, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((60, 40, 12)).export("part.stl")
    assert ice("new", "part.stl", "--units", units, "-o", "other.toml").exit_code == 0
    scene = scenes.load("other.toml")
    assert scene.units == units
    assert 60 < min(scene.camera.field_of_view) < 180  # margin: the part's 60 mm, less than three times as wide


def test_what_new_refuses(part):
    for arguments, line in [
        (("new", part), "--output must be a new file, got part.toml, which exists"),
        (("new", part, "--units", "ft", "-o", "x.toml"), "--units must be one of mm, cm, m, inch, got 'ft'"),
        (("new", "none.stl", "-o", "x.toml"), "object.file must be a readable mesh"),
    ]:
        result = ice(*arguments)
        assert isinstance(result.exception, scenes.InvalidInput)
        assert str(result.exception).startswith(line)


def test_show_lists_and_draws(part):
    """Names, places and lengths are those that the part was made with."""
    result = ice("show", "part.toml", "--sensor", "40,210", "-o", "part.png", "--json")
    facts = json.loads(result.stdout)
    assert {edge["name"]: edge["length"] for edge in facts["edges"]}["e3"] == pytest.approx(60, abs=1e-5)
    assert {v["name"]: v["at"] for v in facts["vertices"]}["v8"] == pytest.approx([35, 0, 12], abs=1e-5)
    assert [round(circle["diameter"], 4) for circle in facts["circles"]] == [8, 8, 10, 10]
    assert [edge["name"] for edge in facts["edges"] if not edge["convex"]] == ["e13"]
    assert (part.parent / "part.png").stat().st_size > 20_000
    text = ice("show", "part.toml").stdout
    assert "Edges, mm" in text
    assert "v13" in text


def test_show_of_a_bundled_scene_and_the_list_of_them():
    facts = json.loads(ice("show", "task1", "--json").stdout)
    assert (len(facts["vertices"]), len(facts["edges"]), facts["circles"]) == (8, 12, [])
    listed = json.loads(ice("scenes", "--json").stdout)["scenes"]
    assert tuple(row["name"] for row in listed) == scenes.names()
    assert {row["name"]: row["units"] for row in listed}["bracket_mm"] == "mm"
