"""``ice dossier``."""

from __future__ import annotations

import datetime
import hashlib
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from validation.cli.common import (
    MOST_WORKERS,
    Json,
    SceneName,
    Seed,
    check_number,
    check_seed,
    commands,
    continued,
    progress,
    say,
    taking,
    warn_of_open,
)
from validation.cli.outputs import check_directory
from validation.defaults import DEFAULT_SEED
from validation.strict_json import dumps

if TYPE_CHECKING:
    from validation.dossier import Dossier

commands = commands()
_MOST = 1_000_000


@dataclass(frozen=True)
class Options:
    """What a dossier is asked for."""

    scene: SceneName
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the dossier; default dossiers/SCENE.")] = (
        None
    )
    renders: Annotated[int, typer.Option(help="Noisy pictures a setting.")] = 1000
    stations: Annotated[int, typer.Option(help="Simulated stations, whose inputs are drawn.")] = 500
    tables: Annotated[int, typer.Option(help="True tables that the verdict is tried on.")] = 2000
    exposures: Annotated[int, typer.Option(help="Exposures of each negative control.")] = 300
    hard: Annotated[bool, typer.Option("--hard/--no-hard", help="Answer the hard cases, too: half a minute.")] = True
    seed: Seed = DEFAULT_SEED
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None
    fresh: Annotated[bool, typer.Option("--fresh", help="Start anew even if DIR holds a run.")] = False
    as_json: Json = False


@commands.command("dossier")
@taking(Options)
def dossier_command(given: Options) -> None:
    """The validation of this software for one scene, as an assessor reads it (ISO/IEC 17025, 7.11; ISO/TS 15530-4).

    Writes dossier.html (for print), dossier.json, scene.json, tables and SHA256SUMS to DIR: the same, byte by byte,
    from the same versions, inputs and seed; made.json says when and where. Exit status 1 if a claim is not shown.
    """
    started = time.perf_counter()
    _check(given)
    from validation.batch.campaign import load

    loaded = load(given.scene)
    warn_of_open(*loaded.scenes)
    name = loaded.name
    directory = given.out or Path("dossiers") / name
    check_directory("--out", directory)
    from validation.dossier import Size, make

    size = Size(given.renders, given.stations, given.tables, given.exposures, given.hard)
    with continued(False), progress(f"{name}: dossier", unit="done", at_once=True) as report:
        found = make(given.scene, directory, size, given.seed, given.workers, given.fresh, report)
    files = _write(found, directory, time.perf_counter() - started)
    if given.as_json:
        from validation.report.dossier_facts import facts

        say(facts(found), True, "")
    else:
        _show(found, files)
    raise typer.Exit(0 if found.holds else 1)


def _check(given: Options) -> None:
    check_number("--renders", given.renders, 20, _MOST)
    check_number("--stations", given.stations, 50, _MOST)
    check_number("--tables", given.tables, 100, _MOST)
    check_number("--exposures", given.exposures, 20, _MOST)
    check_number("--workers", given.workers, 1, MOST_WORKERS)
    check_seed(given.seed, "--seed")


def _write(found: Dossier, directory: Path, seconds: float) -> list[Path]:
    """All files of a dossier; those whose sums are listed."""
    from validation.dossier import inputs
    from validation.report import dossier_facts, dossier_page, export

    files = [dossier_page.write(found, directory)]
    for name, text in (
        ("dossier.json", dumps(dossier_facts.facts(found)) + "\n"), ("scene.json", inputs.record(found.scene)),
    ):  # fmt: skip
        (directory / name).write_text(text, encoding="utf-8")
        files.append(directory / name)
    files.append(export.write_csv(found.run, directory / "table.csv"))
    files.append(export.write_measurands(found.run, directory / "measurands.csv"))
    sums = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files]
    (directory / "SHA256SUMS").write_text("".join(sums), encoding="utf-8")
    made = {"date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"), "host": inputs.host(),
            "seconds": seconds, "command": found.again}  # fmt: skip
    (directory / "made.json").write_text(dumps(made) + "\n", encoding="utf-8")
    return files


def _show(found: Dossier, files: list[Path]) -> None:
    from validation.report.terminal import console

    terminal = console()
    for each in found.claims:
        word = {True: "holds", False: "DOES NOT HOLD", None: "not shown"}[each.holds]
        terminal.print(f"{each.name}: {word}", style="bold", highlight=False)
        terminal.print(f"  {each.says}\n  {each.command}", highlight=False, soft_wrap=True)
    terminal.print(f"Files: {', '.join(map(str, files))}", highlight=False, soft_wrap=True)
