"""A run is of what its files held: from every folder the same, and another once one of them has changed."""

import shutil
from importlib import resources

import pytest

import scenes
from scenes import InvalidInput
from validation.batch import job
from validation.batch.campaign import Campaign
from validation.batch.part_files import by_content, contents
from validation.batch.store import RunFile
from validation.batch.work import Rendering


def identity(path):
    return job._identity(Campaign.of(scenes.load(str(path))), 10, 1, "scalar_rgb", Rendering(), None)


@pytest.fixture
def wedge(tmp_path, monkeypatch):
    for name in ("wedge.toml", "wedge.stl"):
        with resources.as_file(resources.files("scenes") / "bundled" / name) as file:
            shutil.copy(file, tmp_path)
    (tmp_path / "beside").mkdir()
    monkeypatch.chdir(tmp_path)
    RunFile(tmp_path / "run", identity("wedge.toml")).close()
    return tmp_path


def changed(wedge):
    data = bytearray((wedge / "wedge.stl").read_bytes())
    data[0] ^= 1  # of its comment: the same part, but who knows
    (wedge / "wedge.stl").write_bytes(data)


def test_a_run_goes_on_from_every_folder(wedge, monkeypatch):
    monkeypatch.chdir(wedge / "beside")
    RunFile(wedge / "run", identity("../wedge.toml")).close()
    assert RunFile.reopen(wedge / "run").campaign().scenes[0].solid.vertices.shape == (6, 3)


def test_a_run_of_a_part_that_has_changed_is_refused(wedge):
    changed(wedge)
    with pytest.raises(InvalidInput, match=r"hold this run, .*object.file is \"content \w+ of wedge.stl\", not"):
        RunFile(wedge / "run", identity("wedge.toml"))


def test_a_report_of_a_part_that_has_changed_is_refused(wedge):
    changed(wedge)
    with pytest.raises(InvalidInput, match=r"wedge.stl must hold what .*run measured, got other content"):
        RunFile.reopen(wedge / "run").campaign()


def test_files_are_found_wherever_a_document_names_them(tmp_path):
    for name, text in (("part.stl", b"1"), ("print.png", b"2")):
        (tmp_path / name).write_bytes(text)
    document = {"scenes": [{"object": {"file": "part.stl"}, "textures": [{"file": "print.png"}, {"file": "none"}]}]}
    digests = contents(document, tmp_path)
    assert list(digests) == ["part.stl", "print.png", "none"]
    assert digests["none"] == ""
    assert digests["part.stl"] != digests["print.png"]
    told = by_content({"seed": 3, "campaign": document, "files": digests})
    (scene,) = told["campaign"]["scenes"]
    assert scene["object"]["file"] == f"content {digests['part.stl']} of part.stl"
    assert scene["textures"][1]["file"] == "content unknown of none"
    assert told["seed"] == 3


@pytest.mark.parametrize("module", ["simulation", "remeasured", "work", "photographs"])
def test_a_run_is_of_the_code_that_made_its_numbers(module, tmp_path, monkeypatch):
    before = job._code()
    (tmp_path / "changed.py").write_text("another = 1\n")
    monkeypatch.setattr(getattr(job, module), "__file__", str(tmp_path / "changed.py"))
    assert job._code() != before
