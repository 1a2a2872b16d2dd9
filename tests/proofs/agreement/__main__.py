"""``python -m tests.proofs.agreement``: the whole table, and exit status 1 if a claim is broken."""

from __future__ import annotations

import json
import sys
import time
from typing import Annotated

import typer

from scenes import InvalidInput
from tests.proofs.agreement import table
from tests.proofs.agreement.judgement import broken, judge
from tests.proofs.agreement.run import measure_all
from tests.proofs.agreement.settings import Place, groups, places


def main(
    seed: Annotated[int, typer.Option(help="Root of all random numbers, the random poses' too.")] = 1,
    renders: Annotated[int, typer.Option(min=2, help="Noisy pictures a setting.")] = 1000,
    poses: Annotated[int, typer.Option(min=0, help="Random poses of Task1.")] = 40,
    scenes: Annotated[str | None, typer.Option(metavar="LIST", help=f"Some of: {', '.join(groups())}.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = 2,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")] = False,
) -> None:
    """Compare predicted, propagated and reported variances with the scatter of many pictures, everywhere."""
    wanted = groups() if scenes is None else tuple(name.strip() for name in scenes.split(","))
    try:
        chosen = places(wanted, poses, seed)
    except InvalidInput as error:
        print(error, file=sys.stderr)
        raise typer.Exit(2) from None
    began = time.perf_counter()
    rows = measure_all(chosen, renders, seed, workers, _report)
    claims, seconds = judge(rows), time.perf_counter() - began
    if as_json:
        asked = {"seed": seed, "renders": renders, "poses": poses, "scenes": list(wanted)}
        print(json.dumps(asked | table.facts(rows, claims) | {"seconds": seconds}, indent=1))
    else:
        print(table.text(rows, claims))
        print(f"{len(chosen)} settings of {renders} pictures in {seconds:.0f} s.")
    raise typer.Exit(1 if broken(claims) else 0)


def _report(place: Place, done: int, total: int) -> None:
    print(f"{done} of {total}: {place.group} {place.sensor} {place.light}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    typer.run(main)
