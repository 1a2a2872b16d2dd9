"""``ice plan``."""

from __future__ import annotations

import dataclasses
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Group
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

import planner
import scenes
from validation.cli.common import Json, SceneName, app, parse_pose
from validation.report.table import console

Pair = Annotated[str | None, typer.Option(metavar="P,A", help="Hold it fixed: polar angle and azimuth, degrees.")]
Range = Annotated[str | None, typer.Option(metavar="LOW,HIGH", help="Polar angles allowed, degrees; default 0,90.")]


@app.command("plan")
def plan_command(
    scene: SceneName,
    objective: Annotated[str, typer.Option(help="object (cm^2) or image (px^2)")] = "object",
    search: Annotated[str, typer.Option(help="exhaustive or alternating (the paper's)")] = "exhaustive",
    model: Annotated[str, typer.Option(help="calibrated or paper")] = "calibrated",
    edges: Annotated[str, typer.Option(help="given, or best of all sets that measure the same")] = "given",
    step: Annotated[
        float | None, typer.Option(help="Grid step, degrees; default 1, or 10 for hollow or glossy.")
    ] = None,
    sensor: Pair = None,
    light: Pair = None,
    start: Annotated[str, typer.Option(metavar="P,A", help="First sensor of the alternating search.")] = "40,41",
    sensor_polar: Range = None,
    light_polar: Range = None,
    min_edge: Annotated[float, typer.Option(help="Least usable length of a required edge, px.")] = 0.0,
    min_clearance: Annotated[float, typer.Option(help="Least distance between required edges, px.")] = 0.0,
    separation: Annotated[float, typer.Option(help="Least angle between sensor and light, degrees.")] = 0.0,
    light_out_of_view: Annotated[bool, typer.Option("--light-out-of-view", help="Keep it out of the image.")] = False,
    same_mount: Annotated[bool, typer.Option("--same-mount", help="The light is mounted at the sensor.")] = False,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Robust plan: roughness=0.2, noise=0.1, sensor_deg=2, ..."),
    ] = None,
    map_file: Annotated[Path | None, typer.Option("--map", metavar="FILE.png", help="Write the maps.")] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write all pictures there.")] = None,
    as_json: Json = False,
) -> None:
    """Find where sensor and light should stand."""
    loaded = scenes.load(scene)
    limits = planner.Constraints(
        sensor_polar_deg=_range("--sensor-polar", sensor_polar),
        light_polar_deg=_range("--light-polar", light_polar),
        min_edge_px=min_edge,
        min_clearance_px=min_clearance,
        min_separation_deg=separation,
        light_out_of_view=light_out_of_view,
        same_mount=same_mount,
    )
    tolerances = _tolerances(tolerance or [])
    poses = {
        "sensor": sensor and parse_pose("--sensor", sensor),
        "light": light and parse_pose("--light", light),
        "start": parse_pose("--start", start),
    }
    began = time.perf_counter()
    with _progress(f"{loaded.name}: searching") as shown:
        found = planner.plan(
            loaded, objective, model=model, search=search, edges=edges, step_deg=step, constraints=limits, **poses,
            report=shown,
        )  # fmt: skip
    seconds = time.perf_counter() - began
    safe = planner.robust(found, tolerances, limits) if tolerances else None
    pictures = _pictures(found, map_file, out)
    if as_json:
        _print_json(found, safe, seconds, pictures)
    else:
        _print(found, safe, seconds, pictures)


@contextmanager
def _progress(title: str):
    """A bar of the sensors searched, on standard error, if that is a terminal."""
    errors = console(stderr=True)
    with Progress(console=errors, transient=True, disable=not errors.is_terminal) as bar:
        task = bar.add_task(title, total=None)
        yield lambda _what, done, total: bar.update(task, completed=done, total=total)


def _range(option: str, text: str | None) -> tuple[float, float]:
    if text is None:
        return 0.0, 90.0
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise scenes.InvalidInput(f"{option} must be two numbers LOW,HIGH (degrees), got {text!r}") from None
    return low, high


def _tolerances(texts: list[str]) -> planner.Tolerances | None:
    known = [field.name for field in dataclasses.fields(planner.Tolerances)]
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name not in known:
            raise scenes.InvalidInput(f"--tolerance must be one of {', '.join(known)} with =VALUE, got {text!r}")
        try:
            values[name] = float(value)
        except ValueError:
            raise scenes.InvalidInput(f"--tolerance {name} must be a number, got {value!r}") from None
    return planner.Tolerances(**values) if values else None


def _pictures(found: planner.Plan, map_file: Path | None, out: Path | None) -> list[Path]:
    if map_file is None and out is None:
        return []
    from validation.report import plan_figures  # matplotlib takes half a second to load

    paths = plan_figures.draw(found, out) if out else []
    if map_file:
        paths.append(plan_figures.map_picture(found, map_file))
    return paths


def _print_json(found: planner.Plan, safe: planner.Robust | None, seconds: float, pictures: list[Path]) -> None:
    import json

    p = found.prediction
    document = {
        "scene": found.scene.name,
        "objective": found.objective,
        "model": found.model,
        "sensor": list(found.sensor),
        "light": list(found.light),
        "edges": list(found.scene.task.edges),
        "variance": found.variance,
        "variance_object": p.variance_object,
        "variance_image": p.variance_image,
        "status": p.status,
        "grid": {"sensor": list(found.grid_sensor), "light": list(found.grid_light), "variance": found.grid_variance},
        "alternating": {
            "variance": found.partial_variance if found.trace else None,
            "gap": found.gap,
            "trace": [
                {"fixed": s.fixed, "at": list(s.fixed_pose), "found": s.found, "best": list(s.found_pose),
                 "variance": s.variance}
                for s in found.trace
            ],
        },
        "guarantee": found.guarantee,
        "pairs": found.pairs,
        "evaluated": found.evaluated,
        "candidates": [
            {**dataclasses.asdict(c), "sensor": list(c.sensor), "light": list(c.light)} for c in found.candidates
        ],
        "robust": None if safe is None else {
            **dataclasses.asdict(safe), "sensor": list(safe.sensor), "light": list(safe.light)
        },
        "pictures": [str(path) for path in pictures],
        "seconds": seconds,
    }  # fmt: skip
    print(json.dumps(document, indent=1))


def _print(found: planner.Plan, safe: planner.Robust | None, seconds: float, pictures: list[Path]) -> None:
    shown, p = console(), found.prediction
    units = ("cm", "px") if p.kind == "distance" else ("degrees", "degrees")
    shown.print(
        f"{found.scene.title or found.scene.name}\n"
        f"Best {found.objective} variance ({found.model} model), required edges {' '.join(found.scene.task.edges)}:\n"
        f"  sensor {_pose(found.sensor)}, light {_pose(found.light)}, {p.status}\n"
        f"  standard deviation {p.variance_object**0.5:.3g} {units[0]} of {p.value_object:.4g} {units[0]},"
        f" {p.variance_image**0.5:.3g} {units[1]} of {p.value_image:.4g} {units[1]} in the image\n"
        f"  {found.pairs} pairs in {seconds:.1f} s, {found.evaluated} of them evaluated one by one\n"
        f"  Guarantee: {found.guarantee}.",
        highlight=False,
    )
    if found.trace:
        shown.print(_trace(found, units))
    shown.print(_candidates(found, units))
    if safe:
        shown.print(_robust(safe))
    for path in pictures:
        shown.print(f"picture: {path}", highlight=False)


def _trace(found: planner.Plan, units: tuple[str, str]) -> Table:
    unit = units[0] if found.objective == "object" else units[1]
    gap = "" if found.gap is None else f", {100 * found.gap:.1f} % above the best"
    table = _table(f"\nAlternating search{gap}", "fixed", "", "found", "", f"variance, {unit}^2")
    for step in found.trace:
        row = step.fixed, _pose(step.fixed_pose), step.found, _pose(step.found_pose), f"{step.variance:.4g}"
        table.add_row(*row)
    return table


def _candidates(found: planner.Plan, units: tuple[str, str]) -> Table:
    names = (f"object, 1e-6 {units[0]}^2", f"image, 1e-6 {units[1]}^2")
    table = _table("\nClearly different settings, the best first", "sensor", "light", "edges", *names, "over best")
    best = found.candidates[0]
    for c in found.candidates:
        ratio = c.variance_object / best.variance_object
        if found.objective == "image":
            ratio = c.variance_image / best.variance_image
        values = f"{1e6 * c.variance_object:.4g}", f"{1e6 * c.variance_image:.4g}", f"{ratio:.3f}"
        table.add_row(_pose(c.sensor), _pose(c.light), " ".join(c.edges), *values)
    return table


def _robust(safe: planner.Robust) -> Group:
    against = f"{100 * (safe.worst / safe.plan_worst - 1):+.1f} % against" if safe.plan_worst < float("inf") else "not"
    text = (
        f"\nRobust plan: sensor {_pose(safe.sensor)}, light {_pose(safe.light)}: variance {safe.nominal:.4g}, at worst"
        f" {safe.worst:.4g} in {safe.cases} cases\n"
    )
    text += (
        f"  {against} the plan above" if against != "not" else "  (the plan above cannot be measured in its worst case)"
    )
    title = "\nHow the plan's optimum moves if one input is off"
    table = _table(title, "input", "factor", "variance there", "at the new best", "sensor, deg", "light, deg")
    for m in safe.moves:
        row = f"{m.factor:.3g}", f"{m.variance:.4f}", f"{m.best:.4f}", f"{m.sensor_deg:.2f}", f"{m.light_deg:.2f}"
        table.add_row(m.input, *row)
    return Group(Text(text), table) if safe.moves else Group(Text(text))


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1), title_style="bold")
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _pose(pose: scenes.Pose) -> str:
    return f"({pose.polar_deg:.1f}, {pose.azimuth_deg:.1f})"
