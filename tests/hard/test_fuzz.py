"""A small run of `tests.hard.fuzzing`; ``make fuzz`` makes 20,000 tries."""

import numpy as np
import pytest

import scenes
from scenes import InvalidInput
from tests.hard import fuzzing
from tests.hard.fuzzing.doors import DOORS
from validation import picture_file

pytestmark = pytest.mark.render


def test_88_tries(tmp_path, capfd):
    """Four at each door's place: no finding; every door refuses something, and some let something in."""
    before = fuzzing.peak_memory()
    found = fuzzing.run(88, seed=20261121, folder=tmp_path)
    capfd.readouterr()  # what the image libraries say of corrupted files
    assert not found.failures
    assert sum(found.outcomes.values()) == 88
    for door in {door.__name__ for door in DOORS}:
        assert found.outcomes[f"{door}: refused"] > 0
    answers = {door.split(":")[0] for door in found.outcomes if not door.endswith("refused")}
    assert answers >= {"comparison", "directory", "command", "lens"}
    assert fuzzing.peak_memory() < max(fuzzing.MOST_MEMORY, before + 1)


@pytest.mark.parametrize("number", [7541, 12221, 13120])
def test_what_20000_tries_once_found(number, tmp_path, capfd):
    """A mesh whose triangles all count as coplanar, twice, and an obstacle too small for its area to be a number."""
    found = fuzzing.run(number + 1, seed=1, folder=tmp_path, first=number)
    capfd.readouterr()
    assert not found.failures
    assert sum(found.outcomes.values()) == 1


@pytest.mark.parametrize("broken", [lambda *_: 1 / 0, lambda *_: (_ for _ in ()).throw(MemoryError("much"))])
def test_a_traceback_would_be_found(broken, tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(scenes, "load", broken)
    found = fuzzing.run(8, seed=1, folder=tmp_path)
    capfd.readouterr()
    assert len(found.failures) >= 5


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "must be valid TOML, got"),
        ("a = " + "9" * 5000, "must be valid TOML, got"),
        ("#" * (1 << 21), "must be at most 1048576 bytes long, got more"),
        ("a = \xff", "must be valid TOML, got"),
    ],
)
def test_hostile_scene_files(text, line, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InvalidInput, match=line):
        scenes.load(path)


def test_a_name_too_long_for_the_file_system():
    with pytest.raises(InvalidInput, match="scene must be a TOML file or one of"):
        scenes.load("a" * 5000)


def test_an_array_file_that_lies_about_its_size(tmp_path):
    """The header says 5e11 pixels; nothing of that size may be allocated."""
    path = tmp_path / "image.npy"
    np.save(path, np.zeros((400, 256)))
    path.write_bytes(path.read_bytes().replace(b"(400, 256)", b"(999999999, 512)"))
    with pytest.raises(InvalidInput, match="must be"):
        picture_file.read(path)


def test_a_picture_of_too_many_pixels(tmp_path):
    path = tmp_path / "image.pgm"
    path.write_bytes(b"P5 100000 100000 255\n")
    with pytest.raises(InvalidInput, match="must be an image of at most 40000000 pixels, got more"):
        picture_file.read(path)
