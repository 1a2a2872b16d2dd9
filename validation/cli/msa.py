"""``ice msa``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import scenes
from scenes.status import is_trusted
from validation.cli.common import (
    Json,
    SceneName,
    check_number,
    commands,
    first_picture,
    parse_pose,
    parse_poses,
    progress,
    say,
    scene_of,
    taking,
)
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    from planner.uncertainty.msa import Guard, Study
    from validation.msa import Predicted

commands = commands()


@dataclass(frozen=True)
class Options:
    """What a study is asked for."""

    scene: SceneName
    sensor: Annotated[
        str | None, typer.Option(metavar="P,A", help="Polar angle and azimuth; the first setting's if left out.")
    ] = None
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Of the free light, or of each.")] = None
    study: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="A study that was made: columns operator, part and each measurand."),
    ] = None
    size: Annotated[
        str | None,
        typer.Option(metavar="O,P,R", help="Operators, parts, repeats of a study to be made. [default: 3,10,3]"),
    ] = None
    placed_once: Annotated[
        bool, typer.Option("--placed-once", help="A part stays in the fixture for all repeats of an operator.")
    ] = False
    cost_accepted: Annotated[
        float | None, typer.Option(metavar="COST", help="Of a bad part that is accepted: the guard band of least cost.")
    ] = None
    cost_rejected: Annotated[
        float | None, typer.Option(metavar="COST", help="Of a good part that is rejected, with --cost-accepted.")
    ] = None
    as_json: Json = False


@commands.command("msa")
@taking(Options)
def msa_command(given: Options) -> None:
    """Measurement system analysis before the station exists: %GRR, ndc, Cg, Cgk, and a study compared with them.

    Exit status 1 if a component of the study is larger than predicted beyond chance.
    """
    from planner.uncertainty.msa import check, too_large
    from validation import budgets, msa
    from validation.report import msa_table

    _check(given)
    poses = None if given.sensor is None else parse_pose("--sensor", given.sensor), parse_poses("--light", given.light)
    picture = first_picture(scene_of(given.scene), *poses)
    with progress("simulating the picture for its bias", "renders", at_once=True):
        found = budgets.budget_of(picture)
    told = msa.predicted(found, placed_once=given.placed_once)
    made = msa.read(given.study, tuple(each.name for each in told)) if given.study else {}
    checks = {each.name: check(made[each.name], each.components) for each in told if each.name in made}
    sizes = {each.name: made[each.name].values.shape if each.name in made else _size(given.size) for each in told}
    wrong = [each.name for each in told if is_trusted(each.status) and too_large(checks.get(each.name, ()))]
    guards = {each.name: _guard(each, given) for each in told}
    if given.as_json:
        rows = [
            _facts(each, sizes[each.name], made.get(each.name), checks.get(each.name, ()), guards[each.name])
            for each in told
        ]
        where = {"sensor": list(picture.sensor), "lights": [list(pose) for pose in picture.lights]}
        say(plain({"scene": picture.scene.name, **where, "measurands": rows}), True, "")
    else:
        console().print(msa_table.report(told, sizes, made, checks, guards), highlight=False)
    if wrong:
        raise typer.Exit(1)


def _check(given: Options) -> None:
    if given.size is not None and given.study is not None:
        raise scenes.InvalidInput("--size must be of a study to be made, got --study, too")
    _size(given.size)
    costs = given.cost_accepted, given.cost_rejected
    if (costs[0] is None) != (costs[1] is None):
        raise scenes.InvalidInput("--cost-accepted must be used with --cost-rejected, got one of them")
    for option, cost in (("--cost-accepted", costs[0]), ("--cost-rejected", costs[1])):
        check_number(option, cost, 1e-12, 1e12)


def _size(text: str | None) -> tuple[int, int, int]:
    from planner.uncertainty.msa import CUSTOMARY

    if text is None:
        return CUSTOMARY
    try:
        operators, parts, repeats = map(int, text.split(","))
    except ValueError:
        raise scenes.InvalidInput(f"--size must be three whole numbers O,P,R, got {text!r}") from None
    if not all(2 <= count <= 1000 for count in (operators, parts, repeats)):
        raise scenes.InvalidInput(f"--size must be of 2 to 1000 operators, parts and repeats, got {text!r}")
    return operators, parts, repeats


def _guard(each: Predicted, given: Options) -> Guard | None:
    """Of least cost; None without costs, tolerance or the parts' spread."""
    from planner.uncertainty.msa import cheapest_guard
    from planner.uncertainty.risks import Limits

    spread, zone = each.components.parts, each.tolerance
    if given.cost_accepted is None or given.cost_rejected is None or not spread or zone is None:
        return None
    costs, limits = (given.cost_accepted, given.cost_rejected), Limits.of(each.nominal, zone)
    return cheapest_guard(each.nominal, spread, each.u, limits, *costs)


def _facts(
    each: Predicted, size: tuple[int, int, int], study: Study | None, rows: tuple, guard: Guard | None
) -> dict[str, Any]:
    from planner.uncertainty.msa import found_by, smallest_study, too_large

    kept, named = each.components, ("operators", "parts", "repeats")
    least = smallest_study(kept)
    return {
        "name": each.name, "unit": each.unit, "status": each.status, **asdict(kept), "reproducibility": kept.appraisers,
        "grr": kept.grr, "grr_of_total": kept.grr_of_total, "constant": each.constant, "ndc": kept.ndc,
        "grr_of_tolerance": kept.grr_of(each.width) if each.width else None, "cg": each.cg, "cgk": each.cgk,
        "guard": None if guard is None else {"width": guard.width, "cost": guard.cost},
        "found_if_doubled": {**dict(zip(named, size, strict=True)), "components": found_by(kept, *size)},
        "smallest_study": None if least is None else dict(zip(named, least, strict=True)),
        "study": None if study is None else {
            "operators": study.values.shape[0], "parts": study.values.shape[1], "repeats": study.values.shape[2],
            "found": asdict(study.components), "components": [asdict(row) for row in rows],
            "too_large": list(too_large(rows)),
        },
    }  # fmt: skip
