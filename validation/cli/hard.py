"""``ice hard``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenes import InvalidInput
from validation.cli.common import Json, commands, progress, say
from validation.cli.outputs import check_file

commands = commands()


@commands.command("hard")
def hard_command(
    area: Annotated[str | None, typer.Option(help="reflectance, planner, fit, measure or render only.")] = None,
    precision: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Also draw where single precision is safe.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Answers beside references where numbers lose their digits; exit status 1 if one is wrong. A minute."""
    check_file("--precision", precision, ".png")
    from validation import hard  # all cases are made, and the references' library loads
    from validation.hard import table

    cases = hard.catalogue()
    areas = tuple(dict.fromkeys(case.area for case in cases))
    if area is not None and area not in areas:
        raise InvalidInput(f"--area must be one of {', '.join(areas)}, got {area!r}")
    wanted = [case for case in cases if area in (None, case.area)]
    rows = []
    with progress("hard cases", "cases", at_once=True) as report:
        for case in wanted:
            rows.append(hard.run(case))
            report("cases", len(rows), len(wanted))
    if precision is not None:
        from validation.report.precision_figure import draw

        draw(precision)
    found = table.facts(rows)
    say(found, as_json, table.text(rows))
    raise typer.Exit(1 if found["wrong"] else 0)
