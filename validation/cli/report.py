"""``ice report``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.cli.common import Json, commands, say
from validation.cli.outputs import check_directory

commands = commands()


@commands.command("report")
def report_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Run directory of `ice validate`.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Where to write; default: the run directory.")] = None,
    parquet: Annotated[bool, typer.Option("--parquet", help="Also table.parquet (needs the extra 'parquet').")] = False,
    as_json: Json = False,
) -> None:
    """Write report.html (one page, no network needed), report.md, table.csv and result.json of a run.

    A run that is not finished, or still going, is reported as far as it has come.
    """
    check_directory("--out", out)
    from validation.report.export import check_parquet

    if parquet:
        check_parquet()
    from validation.batch.result import collect
    from validation.batch.store import RunFile
    from validation.report import export
    from validation.report import page as report
    from validation.report.station import of_run

    store = RunFile.reopen(directory)
    try:
        campaign = store.campaign()
        found = collect(campaign, store)
        out = out or directory
        out.mkdir(parents=True, exist_ok=True)
        files = report.write(campaign, found, store, of_run(campaign, found, store), out)
        files += [export.write_csv(found, out / "table.csv"), export.write_json(found, out / "result.json")]
        if parquet:
            files.append(export.write_parquet(found, out / "table.parquet"))
    finally:
        store.close()
    names = [str(file) for file in files]
    say({"verdict": found.verdict.text, "files": names}, as_json, "\n".join([found.verdict.text, *names]))
