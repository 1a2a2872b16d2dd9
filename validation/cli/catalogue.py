"""``ice catalogue``."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from scenes import InvalidInput
from scenes.catalogue import load
from validation.cli.common import Json, commands, say
from validation.report import catalogue_table
from validation.report.terminal import console

commands = commands()
_CHECK = "check"


@commands.command("catalogue")
def catalogue_command(
    action: Annotated[str, typer.Argument(metavar="check", help="What to do with it: check.")],
    file: Annotated[str, typer.Argument(metavar="FILE", help="A catalogue (TOML, CSV), or sample: the bundled one.")],
    as_json: Json = False,
) -> None:
    """Say what a catalogue's entries contradict, each with its numbers, and what they lack for `ice design`.

    Exit status 1 if anything is contradictory.
    """
    if action != _CHECK:
        raise InvalidInput(f"catalogue must be followed by {_CHECK}, got {action!r}")
    found = load(file)
    wrong = found.contradictions()
    if as_json:
        lacking = [{"entry": each.told, "missing": list(each.missing)} for each in found.entries if each.missing]
        counts = {name: len(getattr(found, name)) for name in ("sensors", "lenses", "lights")}
        facts = {"catalogue": file, **counts, "contradictions": list(map(asdict, wrong)), "incomplete": lacking}
        say(facts, True, "")
    else:
        console().print(catalogue_table.report(found, wrong), highlight=False)
    if wrong:
        raise typer.Exit(1)
