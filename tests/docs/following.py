"""Following a page as its reader would: its blocks, in order, in one folder."""

from __future__ import annotations

import contextlib
import doctest
import io
import re
import shlex
from pathlib import Path

from tests.commands import ice
from tests.docs.pages import Block, blocks

_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def follow(page: Path, folder: Path) -> int:
    """Run all blocks of a page; the number of those that were run.

    ``console``: commands and what they print (``...`` stands for anything). ``python``: one script, block by block.
    A caption says where the text of another block goes, "in place of `[table]` in FILE" or "at the end of FILE", or
    that the block before "prints" it.
    """
    names: dict[str, object] = {}
    printed = ""
    found = [block for block in blocks(page) if block.language in ("console", "python") or block.caption]
    for block in found:
        where = f"{page.name}:{block.line}"
        if block.language == "console":
            _console(block, folder, where)
        elif block.language == "python":
            printed = _python(block, folder, where, names)
        elif block.caption == "prints":
            assert doctest.OutputChecker().check_output(block.text, printed, _FLAGS), f"{where}: prints {printed}"
        else:
            _write(block, folder, where)
    return len(found)


def _console(block: Block, folder: Path, where: str) -> None:
    for part in re.split(r"^\$ ", block.text, flags=re.M)[1:]:
        command, _, wanted = part.partition("\n")
        program, *arguments = shlex.split(command)
        assert program == "ice", where
        done = ice(*arguments, cwd=folder)
        assert done.returncode == 0, f"{where}: {command}: {done.stdout}{done.stderr}"
        same = doctest.OutputChecker().check_output(wanted, done.stdout, _FLAGS)
        assert same or not wanted.strip(), f"{where}: {command} prints\n{done.stdout}"


def _python(block: Block, folder: Path, where: str, names: dict[str, object]) -> str:
    """What the block prints."""
    with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()) as out:
        exec(compile(block.text, where, "exec"), names)
    return out.getvalue()


def _write(block: Block, folder: Path, where: str) -> None:
    ending = re.fullmatch(r"at the end of (\S+)", block.caption)
    if ending:
        path = folder / ending[1]
        path.write_text(path.read_text() + "\n" + block.text)
        return
    table, name = re.fullmatch(r"in place of `\[+(\w+)\]+` in (\S+)", block.caption).groups()
    path, pattern = folder / name, re.compile(rf"(?:^\[+{table}\]+.*?(?=^\[|\Z))+", re.M | re.S)
    before = path.read_text()
    assert pattern.search(before), f"{where}: no [{table}] in {name}"
    path.write_text(pattern.sub(lambda _: block.text + "\n", before, count=1))
