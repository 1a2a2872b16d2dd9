"""Files that somebody else has written: which are opened, how large and how deep they may be."""

import os

import pytest

from scenes import InvalidInput
from scenes.files import door
from scenes.files.door import Unreadable, check_bounded, opened, read_bytes, read_json, read_toml


@pytest.mark.parametrize(("read", "name", "most"), [(read_toml, "a.toml", 1 << 20), (read_json, "a.json", 1 << 26)])
def test_text_has_a_largest_size(tmp_path, read, name, most):
    """A document of 1 MiB, a result of 64; nothing of a longer one is read."""
    path = tmp_path / name
    path.touch()
    os.truncate(path, most + 1)
    with pytest.raises(InvalidInput, match=f"must be at most {most} bytes long, got more"):
        read(path)
    text = b"x = 1\n" if name == "a.toml" else b"[1.5]\n"
    path.write_bytes(text + b"\n" * ((1 << 20) - len(text)))
    assert read(path) == ({"x": 1} if name == "a.toml" else [1.5])


def test_a_file_that_grows_while_it_is_read_is_too_long(tmp_path, monkeypatch):
    path = tmp_path / "a.bin"
    path.write_bytes(b"12345")
    assert read_bytes(path, 5) == b"12345"
    with pytest.raises(InvalidInput, match="must be at most 4 bytes long, got more"):
        read_bytes(path, 4)
    monkeypatch.setattr(door.os, "fstat", lambda number: os.stat_result((0o100644, *[0] * 5, 3, 0, 0, 0)))
    with pytest.raises(InvalidInput, match="must be at most 4 bytes long, got more"):
        read_bytes(path, 4)


@pytest.mark.parametrize("kind", ["a named pipe", "a directory", "a device", "a socket"])
def test_what_is_no_file_is_not_waited_for(tmp_path, monkeypatch, kind):
    path = tmp_path / "a"
    if kind == "a named pipe":
        os.mkfifo(path)
    elif kind == "a directory":
        path.mkdir()
    elif kind == "a device":
        path.symlink_to(os.devnull)
    else:
        path.touch()
        monkeypatch.setattr(door.os, "fstat", lambda number: os.stat_result((door.stat.S_IFSOCK, *[0] * 9)))
    with pytest.raises(Unreadable, match=f"must be a readable file, got {kind}") as said, opened(path, 10):
        pass
    assert said.value.reason == kind


def test_a_name_that_none_can_have(tmp_path):
    with pytest.raises(Unreadable, match="got a null character in its name"):
        read_bytes(tmp_path / "a\0b", 10)
    with pytest.raises(Unreadable, match="got No such file"):
        read_bytes(tmp_path / "none", 10)


def nested(depth: int):
    """A number in so many lists and tables, each in the next."""
    found = 7
    for level in range(depth):
        found = [found] if level % 2 else {"a": 1, "b": found}
    return found


def test_a_document_is_at_most_32_levels_deep(tmp_path):
    check_bounded(nested(32))
    with pytest.raises(ValueError, match="more than 32 levels"):
        check_bounded(nested(33))
    (tmp_path / "a.json").write_text("[" * 100_000)
    with pytest.raises(InvalidInput, match=r"a\.json must be valid JSON, got more than 32 levels"):
        read_json(tmp_path / "a.json")


@pytest.mark.parametrize("number", [2**63 - 1, -(2**63), 0])
def test_whole_numbers_have_64_bits(number):
    check_bounded({"a": [{"b": number}], "c": "text"})
    for wrong in (2**63, -(2**63) - 1):
        with pytest.raises(ValueError, match="a whole number of 19 digits"):
            check_bounded({"a": [{"b": wrong}]})


@pytest.mark.parametrize("dot", [".", " . ", "\t."])
def test_a_key_has_at_most_32_parts(tmp_path, dot):
    """Each part and its dot counts: 31 before the last are few enough, however they are written."""
    parts = [f"a{i}" if i % 3 else f'"b {i}"' if i % 2 else f"'c {i}'" for i in range(33)]
    path = tmp_path / "a.toml"
    path.write_text(dot.join(parts[:32]) + " = 1")
    found, depth = read_toml(path), 0
    while isinstance(found, dict):
        (found,), depth = found.values(), depth + 1
    assert depth == 32
    path.write_text(dot.join(parts) + " = 1")
    with pytest.raises(InvalidInput, match=r"must be valid TOML, got a key of more than 32 parts"):
        read_toml(path)


@pytest.mark.parametrize(
    ("data", "match"),
    [(b"x = ", "must be valid TOML, got Invalid value"), (b"x = '\xff'", "must be valid TOML, got 'utf-8' codec")],
)
def test_no_toml(tmp_path, data, match):
    (tmp_path / "a.toml").write_bytes(data)
    with pytest.raises(InvalidInput, match=match):
        read_toml(tmp_path / "a.toml")


def test_lines_may_end_as_on_windows(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"x = 1\r\n[y]\r\nz = '''a\r\nb'''\r\n")
    assert read_toml(tmp_path / "a.toml") == {"x": 1, "y": {"z": "a\nb"}}
