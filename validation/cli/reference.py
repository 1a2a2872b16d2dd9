"""The command line as a page, made from the application itself.

    python -m validation.cli.reference docs

writes ``docs/command-line.md`` anew.
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

import typer

from validation.cli.application import app
from validation.cli.commands import COMMANDS

_PAGE = "command-line.md"
_INTRODUCTION = """# The command line

This page is made from the program, by `python -m validation.cli.reference docs`; `ice COMMAND --help` prints the same.
`SCENE` is a bundled scene's name (`ice scenes` lists them) or the path of a TOML file
([the scene format](scene-format.md)); poses `P,A` are polar angle and azimuth in degrees. Every command takes `--json`
([what it prints](json.md)) and, anywhere, `-q` (no progress) and `-v` (say what is done). `ice --version` and
`ice --install-completion` are the program's own.

| exit status | |
|---|---|
| 0 | done |
| 1 | contradicted, not measured, or stopped before the end: the same command continues |
| 2 | bad input: one line "X must be ..., got ..." |
| 3 | an error of this program: one line, the traceback in a log file that it names |
"""


def page() -> str:
    """The reference page, Markdown: every command with its arguments and options."""
    whole: Any = typer.main.get_command(app)
    outer = typer.Context(whole, info_name="ice", terminal_width=1000, max_content_width=1000)
    table = ["| command | |", "|---|---|"]
    table += [f"| [`ice {name}`](#ice-{name}) | {about} |" for name, (_, about) in COMMANDS.items()]
    sections = (_section(whole.get_command(outer, name), name, outer) for name in COMMANDS)
    return "\n".join([_INTRODUCTION, *table, "", *sections])


def _section(command: Any, name: str, outer: typer.Context) -> str:
    """One command: usage, what it does, its parameters."""
    inner = typer.Context(command, info_name=name, parent=outer, terminal_width=1000, max_content_width=1000)
    usage = " ".join(command.get_usage(inner).removeprefix("Usage: ").split())
    records = [each.get_help_record(inner) for each in command.get_params(inner) if each.name != "help"]
    rows = [f"| `{_cell(names)}` | {_cell(about)} |" for names, about in filter(None, records)]
    return "\n".join(
        [f"## ice {name}", "", f"    {usage}", "", inspect.cleandoc(command.help), "", "| | |", "|---|---|", *rows, ""]
    )


def _cell(text: str) -> str:
    """Of a table in Markdown.

    >>> _cell("image|object [default:  object]")
    'image\\\\|object [default: object]'
    """
    return " ".join(text.split()).replace("|", "\\|")


def write(folder: Path) -> Path:
    """Write the page into a folder."""
    path = folder / _PAGE
    path.write_text(page())
    return path


if __name__ == "__main__":
    print(write(Path(sys.argv[1] if len(sys.argv) > 1 else "docs")))
