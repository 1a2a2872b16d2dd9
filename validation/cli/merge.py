"""``ice merge``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenes import InvalidInput
from validation.cli.batch import write_files
from validation.cli.common import Json, commands, say
from validation.cli.outputs import check_directory

commands = commands()


@commands.command("merge")
def merge_command(
    parts: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Run directories of `ice validate --shard`.")],
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Run directory of all of them.")],
    fresh: Annotated[bool, typer.Option("--fresh", help="Start anew even if it holds results.")] = False,
    as_json: Json = False,
) -> None:
    """Put the parts of a run together, and write the files that `ice validate` writes of all.

    Parts are of the same scene, options, seed and program, each of other settings. Variances, tables and verdict are
    those of a run on one machine. Exit status 1 if the measurements contradict the predictions.
    """
    check_directory("--out", out)
    if any(part.resolve() == out.resolve() for part in parts):
        raise InvalidInput(f"--out must be another directory than the parts', got {out}")
    from validation.batch.merged import merged
    from validation.batch.result import WAITING

    campaign, found = merged(parts, out, fresh)
    write_files(campaign, found, out)
    left = sum(reason == WAITING for reason in found.refused.values())
    lines = [f"{len(parts)} parts, {len(found.rows)} settings: {found.verdict.text}"]
    if left:
        lines.append(f"{left} settings are not yet worked on: their part is missing, or not finished.")
    lines.append(f"Files: {out} (report.html and all others of `ice validate`)")
    document = {"directory": str(out), "settings": len(found.rows), "left": left, "verdict": found.verdict.text}
    say(document, as_json, "\n".join(lines))
    raise typer.Exit(0 if found.verdict.agrees else 1)
