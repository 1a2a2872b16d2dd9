"""``ice cost``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.batch import campaign
from validation.cli.common import Json, SceneName, Seed, check_seed, commands, progress, warn_of_open
from validation.cli.outputs import check_directory
from validation.defaults import DEFAULT_SEED
from validation.report.terminal import console
from validation.strict_json import dumps

commands = commands()


@commands.command("cost")
def cost_command(
    scene: SceneName,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Where to write; default runs/SCENE-cost.")] = None,
    budget: Annotated[str, typer.Option(metavar="TIME", help="About how long it may take: 60s, 2min, ...")] = "2min",
    seed: Seed = DEFAULT_SEED,
    as_json: Json = False,
) -> None:
    """Measure what each parameter costs in time and gives in accuracy on this machine.

    Of a slow scene fewer samples are taken, and parameters are left out for which no time is left.

    Writes cost.json, and a CSV file and a plot of each parameter to DIR.
    """
    check_seed(seed)
    loaded = campaign.load(scene)
    warn_of_open(*loaded.scenes)
    directory = out or Path("runs") / f"{loaded.name}-cost"
    check_directory("--out", directory)
    from validation.cost.goal import seconds

    limit = seconds(budget)
    title = f"{loaded.name}: measuring what each parameter costs and gives, about {budget}"
    with progress(title, "parameters", at_once=True) as shown:
        from validation.cost.sweep import sweep

        found = sweep(loaded, seed, shown, limit)
    from validation.cost.table import tables, write_csv
    from validation.report import cost_figures

    directory.mkdir(parents=True, exist_ok=True)
    text = dumps(found.to_json())
    (directory / "cost.json").write_text(text, encoding="utf-8")
    write_csv(found, directory)
    cost_figures.draw(found, directory)
    if as_json:
        print(text)
    else:
        shown_on = console()
        shown_on.print(tables(found))
        shown_on.print(f"cost.json, CSV files and plots: {directory}", highlight=False)
