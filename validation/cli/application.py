"""The application: its own options, and the commands."""

from __future__ import annotations

from typing import Annotated

import typer

from scenes import plugins
from validation.cli import verbosity
from validation.cli.commands import Commands
from validation.versions import version

app = typer.Typer(cls=Commands, pretty_exceptions_enable=False, rich_markup_mode=None)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"ice {version()}")
        raise typer.Exit


@app.callback()
def _ice(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No progress. May stand anywhere.")] = False,
    verbose: Annotated[
        bool, typer.Option("-v", "--verbose", help="Say on standard error what is done. May stand anywhere.")
    ] = False,
    plugin: Annotated[
        list[str] | None,
        typer.Option("--plugin", metavar="MODULE", help="Module that adds kinds of lights, estimators, effects."),
    ] = None,
) -> None:
    """Predict how precisely an image will let you measure, and prove it by rendering and re-measuring.

    Exit status: 0 done; 1 contradicted, not measured or not finished; 2 bad input; 3 an error of this program.
    """
    verbosity.choose(quiet, verbose)
    plugins.load_installed()
    for name in plugin or []:
        plugins.load(name)
    verbosity.hush()
