"""``ice new``, ``ice show`` and ``ice scenes``: scenes to begin with, and what is in them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import scenes
from scenes.results import picked
from scenes.status import legend
from scenes.view import units_meant
from validation.cli.common import Json, SceneName, commands, parse_pose, progress, say, scene_of
from validation.cli.outputs import check_file
from validation.report.terminal import console

if TYPE_CHECKING:
    from validation.first_look import FirstLook

commands = commands()

Part = Annotated[Path, typer.Argument(metavar="PART", help="STL, PLY, OBJ, GLB, 3MF or STEP file.")]
Output = Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE.toml", help="Default: PART.toml here.")]
Units = Annotated[
    str,
    typer.Option(help=f"Unit of the scene, and of the file's numbers where it says none: {', '.join(scenes.UNITS)}."),
]
Body = Annotated[
    str | None, typer.Option(metavar="BODY", help="Name or number of one of several bodies (STEP, GLB, 3MF).")
]
General = Annotated[
    str | None,
    typer.Option(
        metavar="CLASS", help="ISO 2768-1: f, m, c or v, of the lengths of a STEP file's dimensions without limits."
    ),
]
Picture = Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE.png", help="Draw them with their names.")]
Sensor = Annotated[str | None, typer.Option(metavar="P,A", help="Seen from there; else the first setting's sensor.")]


@commands.command("new")
def new_command(
    part: Part,
    output: Output = None,
    units: Units = "mm",
    body: Body = None,
    general: General = None,
    as_json: Json = False,
) -> None:
    """Write a commented scene of a part: camera, light, what could be measured, a setting. It runs as it is."""
    path = output or Path(f"{part.stem}.toml")
    check_file("--output", path, ".toml")
    if path.exists():
        raise scenes.InvalidInput(f"--output must be a new file, got {path}, which exists")
    with progress(f"{part}", "steps", at_once=True) as shown:
        from validation.new_scene import written  # the planner takes a second to load
        from validation.report.scene_table import sides

        which = int(body) if body and body.isdecimal() else body
        new = written(part, path, units, shown, which, general and general.removeprefix("ISO2768-"))
    made, look = new.scene, new.look
    asked = [] if look is None else look.facts
    size = np.ptp(made.solid.vertices, axis=0)
    facts = {
        "file": str(path),
        "scene": str(path),
        "size": size.tolist(),
        "features": {"edges": len(made.solid.sharp), "circles": len(made.solid.rims)},
        "edges": len(made.solid.sharp),
        "circles": len(made.solid.rims),
        "measurands": asked,
        "sensor": look and list(look.sensor),
        "light": look and list(look.light),
        "mended": made.solid.mended,
        "characteristics": new.characteristics,
    }
    text = "\n".join(
        [
            *(f"Mended: {each}" for each in made.solid.mended),
            f"{path}: {sides(size)} {made.units}, {facts['edges']} edges, {facts['circles']} circles",
            *_unit_hint(made),
            *_characteristics(new.characteristics),
            *(["What could be measured, as seen from the setting that is proposed:"] if asked else []),
            *(f"  {each['name']}: {each['status']}" for each in asked),
            *(f"  {line}" for line in _legend(look)),
            f"ice show {path} lists what can be named; "
            + (f"ice plan {path} finds better poses" if asked else "nothing to measure was found"),
        ]
    )
    say(facts, as_json, text)


def _unit_hint(made: scenes.Scene) -> list[str]:
    """That the numbers of a file that says no unit are likely in another one."""
    meant = " or ".join(units_meant(made.solid, made.units)) if getattr(made.object, "units", None) else ""
    return [f"Its numbers were taken for {made.units}, and it is small for that: --units {meant} perhaps"] * bool(meant)


def _characteristics(rows: list[dict[str, Any]]) -> list[str]:
    """A line for each dimension and tolerance of the part's file."""
    if not rows:
        return []
    return ["The file asks for:", *(f"  #{row['number']} {_said(row)}: {_outcome(row)}" for row in rows)]


def _said(row: dict[str, Any]) -> str:
    """A dimension with its limits, or a tolerance with its zone and datums."""
    unit = "degrees" if row["unit"] == "deg" else row["unit"]
    if row["zone"] is not None:
        words = [row["kind"], f"{'diameter ' * row['round_zone']}{row['zone']:.6g} {unit}", *row["modifiers"]]
        letters = [f"{one} {own}".strip() for one, own in zip(row["datums"], row["datum_modifiers"], strict=True)]
        return " ".join([*words, *([f"to {', '.join(letters)}"] if letters else [])])
    value = "" if row["value"] is None else f" {row['value']:.6g} {unit}"
    limits = "" if row["plus"] is None else f" +{abs(row['plus']):.6g} -{abs(row['minus']):.6g}"
    more = [part for part in (row["fit"], row["general"], row["note"]) if part]
    return " ".join([f"{row['kind']}{value}{limits}", *more])


def _outcome(row: dict[str, Any]) -> str:
    how = f"measured as {', '.join(row['measurands'])}" if row["measurands"] else "not measured"
    return f"{how}; {row['reason']}" if row["reason"] else how


def _legend(look: FirstLook | None) -> list[str]:
    """What is wrong with what could be measured, and what to do."""
    if look is None:
        return []
    named = zip(look.measurands, look.reasons, strict=True)
    return legend(look.statuses, [f"{each.name}: {reason}" if reason else "" for each, reason in named])


@commands.command("show")
def show_command(scene: SceneName, sensor: Sensor = None, output: Picture = None, as_json: Json = False) -> None:
    """List the vertices, edges and circles that a task can name, and draw them."""
    check_file("--output", output, ".png")
    pose = sensor and parse_pose("--sensor", sensor)
    loaded = scene_of(scene)
    from validation.report import scene_table

    pose = loaded.check_pose(
        "sensor", pose or (loaded.settings[0].sensor if loaded.settings else (35, 300)), "--sensor"
    )
    if output is not None:
        from validation.report.scene_figure import draw  # matplotlib takes half a second to load

        draw(loaded, pose, output)
    facts = {**scene_table.facts(loaded), "sensor": list(pose), "picture": output and str(output)}
    if as_json:
        say(facts, True, "")
        return
    console().print(scene_table.report(loaded), highlight=False)
    if output is not None:
        print(f"picture: {output}, from {pose}")


@commands.command("scenes")
def scenes_command(as_json: Json = False) -> None:
    """List the bundled scenes."""
    loaded = [scenes.load(name) for name in scenes.names()]
    facts = [
        {**picked(s, "name", "title", "units"), "settings": len(s.settings), "file": str(scenes.find(s.name))}
        for s in loaded
    ]
    lines = (f"{f['name']:<14} {f['settings']:>3} settings, {f['units']:<4} {f['title']}" for f in facts)
    say({"scenes": facts}, as_json, "\n".join(lines))
