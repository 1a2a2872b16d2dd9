"""What a scene file may say, and the one line that a bad one gives."""

import re

import numpy as np
import pytest

import scenes
from scenes import InvalidInput, Pose, block
from scenes.load import BUNDLED

TASK1 = (BUNDLED / "task1.toml").read_text()


def broken(tmp_path, old, new):
    assert old in TASK1
    path = tmp_path / "bad.toml"
    path.write_text(TASK1.replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("width = 256", "width = 256\nzoom = 2", r"camera\.zoom must be a known key, got 2"),
        ("size = [12.5,", "size = [-12.5,", r"object(\.block)?\.size\[0\] must be at least 1e-12, got -12\.5"),
        ("focal_px = 800.0\n", "", r"camera\.focal_px must be given, got nothing"),
        ("sigma = 2.4", "sigma = nan", r"noise\.sigma must be a finite number, got nan"),
        ("exposure = 200.0", "exposure = inf", r"camera\.exposure must be a finite number, got inf"),
        ("bits = 8", "bits = 8.5", r"noise\.bits must be a whole number, got 8\.5"),
        ("bits = 8", "bits = 'x'", r"noise\.bits must be a whole number, got 'x'"),
        ("sensor = [30, 90]", "sensor = [300, 90]", r"settings\[0\]\.sensor: polar_deg must be between 0 and 180, got"),
        ("sensor = [30, 90]", "sensor = [30]", r"settings\[0\]\.sensor: pose must be a pair .*, got \[30\]"),
        ('vertex = "v3"', 'vertex = "v9"', r"task\.start\.vertex must be one of v1, .*, got 'v9'"),
        ('edges = ["e4", "e9"]', 'edges = ["e4", "e7"]', r"start\.edges must be edges at v3 \(e2, e4, e9\), got 'e7'"),
        ('edges = ["e4", "e9"]', 'edges = ["e4", "e4"]', r"task\.start\.edges must be two different edges"),
        ("[light]\ndistance = 100.0", "[light]\ndistance = 2.0", r"settings\[\d+\]\.light must be outside the object"),
        ("distance = 100.0\nblur", "distance = 1.0\nblur", r"settings\[\d+\]\.sensor must be outside the object"),
        ("[material]", "[material", r" must be valid TOML, got "),
    ],
)  # fmt: skip
def test_bad_scene_is_one_line_with_file_and_key(tmp_path, old, new, line):
    path = broken(tmp_path, old, new)
    with pytest.raises(InvalidInput, match=line) as error:
        scenes.load(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("nothing", f"scene must be a TOML file or one of {', '.join(scenes.names())}, got 'nothing'"),
        ("missing.toml", "missing.toml must be a readable file, got No such file"),
    ],
)
def test_unreadable_scene(name, line):
    with pytest.raises(InvalidInput, match=re.escape(line)):
        scenes.load(name)


def test_binary_file_is_refused(tmp_path):
    path = tmp_path / "x.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidInput, match="must be valid TOML"):
        scenes.load(path)


@pytest.mark.parametrize("value", [(float("nan"), 0), (0, float("inf")), (-1, 0), (181, 0), ("a", 0), (True, 0)])
def test_bad_pose(value):
    with pytest.raises(InvalidInput, match=r"must be .*, got "):
        Pose(*value)


def test_task1_is_the_papers(task1):
    assert len(task1.settings) == 16
    assert task1.settings[4].paper_ice == 0.070
    assert sum(setting.paper_real is None for setting in task1.settings) == 5
    assert task1.task.edges == ("e4", "e9", "e7", "e11")
    assert np.linalg.norm(task1.solid.vertex("v3") - task1.solid.vertex("v6")) == pytest.approx(np.hypot(12.5, 7.5))


def older(tmp_path, noise=""):
    """Task1 as older files say it, the level of darkness with the camera."""
    path = tmp_path / "older.toml"
    text = re.sub(r"dark_level = .*\n", "", TASK1).replace("exposure = 200.0", "exposure = 200.0\nblack_level = 20.0")
    path.write_text(text.replace("sigma = 2.4", f"sigma = 2.4\n{noise}"))
    return path


def test_the_dark_level_of_older_files(tmp_path, task1):
    """It stood with the camera; twice the same is taken, two different ones are refused."""
    assert task1.noise.dark_level == 20.0
    for noise in ("", "dark_level = 20.0"):
        assert scenes.load(older(tmp_path, noise)).noise == task1.noise
    with pytest.raises(InvalidInput, match=r"noise\.dark_level must be camera\.black_level \(20\.0\), got 3\.0"):
        scenes.load(older(tmp_path, "dark_level = 3.0"))


def test_block_is_closed_and_its_normals_point_outwards():
    solid = block((3.0, 2.0, 1.0))
    assert len(solid.edges) == 12
    assert all(len(edge.faces) == 2 for edge in solid.edges)
    assert np.allclose(solid.normals.sum(0), 0)
    assert (solid.normals @ solid.vertices.mean(0) < solid.offsets).all()  # margin: inside is inside
    assert solid.height_above(np.array([1.0, 1.0, 1.0])) == 0
    assert solid.height_above(np.array([1.0, 1.0, 4.0])) == 3
    volume = sum(
        o * np.linalg.norm(np.cross(*(solid.vertices[[f[1], f[3]]] - solid.vertices[f[0]])))
        for o, f in zip(solid.offsets, solid.faces, strict=True)
    )
    assert volume / 3 == pytest.approx(6.0)


def test_scene_is_frozen(task1):
    with pytest.raises(ValueError, match="frozen"):
        task1.noise.sigma = 1.0
