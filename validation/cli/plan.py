"""``ice plan``."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import scenes
from validation.cli import plan_json
from validation.cli.common import Json, SceneName, check_left_out, check_number, commands, parse_poses, progress, say
from validation.cli.outputs import check_directory, check_file
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import planner
    from validation.plan_check import PlanCheck
    from validation.vary_check import VaryCheck

commands = commands()
_CHECKED, _MOST_CHECKED = 10, 1000
_QUICK_PIXELS = 1 << 20  # of a picture that is rendered in a second or so
_NOT_CAPABILITY = (
    "--over", "--search", "--model", "--edges", "--start", "--shares", "--tolerance", "--check", "--map", "--out",
    "--views", "--views-share", "--vary", "--hold", "--write",
)  # fmt: skip

Objective = Annotated[
    str, typer.Option(help="object (the scene's unit, squared), image (px^2), or capability (U over tolerance).")
]
Over = Annotated[str, typer.Option(help="Of several measurands: minimax (worst sigma / tolerance) or sum (weighted).")]
Search = Annotated[str, typer.Option(help="exhaustive or alternating (the paper's)")]
Model = Annotated[str, typer.Option(help="calibrated or paper")]
Edges = Annotated[str, typer.Option(help="given, or best of all sets that measure the same")]
Step = Annotated[
    float | None,
    typer.Option(
        help=(
            "Grid step, degrees; default 1 where a bound leaves out most pairs (a matt convex part, a point light), "
            "else 10 (5 for several pictures that need no ray tracing)."
        )
    ),
]
Pair = Annotated[str | None, typer.Option(metavar="P,A", help="Hold it fixed: polar angle and azimuth, degrees.")]
Shares = Annotated[str, typer.Option(help="Of several lights in their total: best, or given by the scene.")]
Start = Annotated[str, typer.Option(metavar="P,A", help="First sensor of the alternating search.")]
Range = Annotated[
    str | None,
    typer.Option(
        metavar="LOW,HIGH",
        help="Polar angles allowed, degrees; default 0,90, or 90,180 where the scene's first setting stands there.",
    ),
]
MinEdge = Annotated[float, typer.Option(help="Least usable length of a required edge, px.")]
MinClearance = Annotated[float, typer.Option(help="Least distance between required edges, px.")]
Azimuths = Annotated[str | None, typer.Option(metavar="FROM,TO", help="Azimuths allowed, degrees; 350,20 are 30.")]
Body = Annotated[
    float | None,
    typer.Option(metavar="RADIUS", help="Sphere that holds its body, scene's unit; default distance / 20, 0: none."),
]
Separation = Annotated[float, typer.Option(help="Least angle between sensor and light, degrees.")]
OutOfView = Annotated[bool, typer.Option("--light-out-of-view", help="Keep it out of the image.")]
SameMount = Annotated[bool, typer.Option("--same-mount", help="The light is mounted at the sensor.")]
ToleranceList = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=VALUE", help="Robust plan: roughness=0.2, noise=0.1, sensor_deg=2, ..."),
]
Vary = Annotated[
    str | None,
    typer.Option(metavar="LIST", help="Find these, too: analyser, polarisation, band (of the scene's lamps, filters)."),
]
HoldEqual = Annotated[
    str | None,
    typer.Option("--hold", metavar="WHAT", help="Equal with --vary: time (of exposure; default) or white (its level)."),
]
Check = Annotated[
    int | None,
    typer.Option(metavar="N", help="Render the best N settings and propose the best; 10, none of above a megapixel."),
]
NoCheck = Annotated[bool, typer.Option("--no-check", help="Render nothing.")]
Map = Annotated[Path | None, typer.Option("--map", metavar="FILE.png", help="Write the maps.")]
Write = Annotated[
    bool, typer.Option("--write", help="Put the poses into the scene's file, first of its settings; comments stay.")
]
Out = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Write plan.html (one page that shows the best setting) and all pictures."),
]
ViewCount = Annotated[
    int | None, typer.Option("--views", metavar="N", help="Plan 1 to N pictures that together measure best.")
]
ViewsShare = Annotated[str | None, typer.Option(help="With --views: sensor or light, the same in all pictures.")]


@commands.command("plan")
def plan_command(
    context: typer.Context,
    scene: SceneName,
    objective: Objective = "object",
    over: Over = "minimax",
    search: Search = "exhaustive",
    model: Model = "calibrated",
    edges: Edges = "given",
    step: Step = None,
    sensor: Pair = None,
    light: Pair = None,
    start: Start = "40,41",
    shares: Shares = "best",
    sensor_polar: Range = None,
    light_polar: Range = None,
    sensor_azimuth: Azimuths = None,
    light_azimuth: Azimuths = None,
    camera_body: Body = None,
    light_body: Body = None,
    min_edge: MinEdge = 0.0,
    min_clearance: MinClearance = 0.0,
    separation: Separation = 0.0,
    light_out_of_view: OutOfView = False,
    same_mount: SameMount = False,
    tolerance: ToleranceList = None,
    vary: Vary = None,
    hold: HoldEqual = None,
    check: Check = None,
    no_check: NoCheck = False,
    map_file: Map = None,
    out: Out = None,
    write: Write = False,
    views: ViewCount = None,
    views_share: ViewsShare = None,
    as_json: Json = False,
) -> None:
    """Find where sensor and light should stand, and render the best settings to see whether they are."""
    from validation.cli import plan_capability, plan_views

    _check_numbers(check, separation, camera_body, light_body, same_mount)
    check_file("--map", map_file, ".png")
    check_directory("--out", out)
    poses = _poses(sensor=sensor, light=light)
    first = parse_poses("--start", start)
    several = views is not None or views_share is not None
    if several:
        plan_views.check_options(context, views, views_share)
    target = _target(scene, edges, several) if write else None
    loaded = scenes.load(scene)
    import planner

    limits = planner.Constraints(
        sensor_polar_deg=_range("--sensor-polar", sensor_polar),
        light_polar_deg=_range("--light-polar", light_polar),
        sensor_azimuth_deg=_range("--sensor-azimuth", sensor_azimuth),
        light_azimuth_deg=_range("--light-azimuth", light_azimuth), camera_body=camera_body, light_body=light_body,
        min_edge_px=min_edge, min_clearance_px=min_clearance, min_separation_deg=separation,
        light_out_of_view=light_out_of_view, same_mount=same_mount,
    )  # fmt: skip
    where = {"step_deg": step, "constraints": limits} | poses
    if objective == "capability":
        check_left_out(context, "--objective capability", *_NOT_CAPABILITY)
        plan_capability.run(loaded, where, as_json)
        return
    count = 0 if no_check else _renders(loaded) if check is None else check
    where |= {"over": over, "model": model}
    if several:
        plan_views.run(loaded, views, objective, where | {"share": views_share}, bool(count), out, as_json)
        _say_unchecked(loaded, bool(count or no_check or as_json))
        return
    tolerances = _tolerances(tolerance or [], loaded)
    how = where | {"search": search, "edges": edges, "shares": shares, "start": first} | _varied(loaded, vary, hold)
    found, seconds = _plan(loaded, objective, how)
    safe = planner.robust(found, tolerances, limits) if tolerances else None
    checked = _check(found, count) if count else None
    scatter = _check_varied(found) if found.varied and count else None
    if target:
        _write(target, found, checked)
    pictures = _pictures(found, checked, scatter, map_file, out)
    _show(found, checked, safe, seconds, pictures, target, as_json, scatter)
    _say_unchecked(loaded, bool(count or no_check or as_json))
    if scatter and not scatter.agrees:
        raise typer.Exit(1)


def _check_numbers(check, separation: float, camera_body, light_body, same_mount: bool) -> None:
    check_number("--check", check, 1, _MOST_CHECKED)
    if not 0 <= separation <= 180:
        limit = "least 0" if separation < 0 else "most 180"
        raise scenes.InvalidInput(f"--separation: min_separation_deg must be at {limit}, got {separation:g}")
    check_number("--camera-body", camera_body, 0, 1e12)
    check_number("--light-body", light_body, 0, 1e12)
    if same_mount and separation > 0:
        raise scenes.InvalidInput(f"--separation must be left out with --same-mount, got {separation:g}")


def _target(scene: str, edges: str, several: bool) -> Path:
    """The file that gets the poses, seen to before anything is searched."""
    from validation.planned_scene import check_writable

    for option, is_given in (("--edges best", edges == "best"), ("--views", several)):
        if is_given:
            raise scenes.InvalidInput(f"--write must be left out with {option}, got both")
    return check_writable(scene)


def _write(target: Path, found: planner.Plan, checked: PlanCheck | None) -> None:
    from validation.planned_scene import write

    best = found if checked is None or checked.proposed is None else checked.proposed
    write(target, found, best.sensor, best.light)


def _say_unchecked(scene: scenes.Scene, said: bool) -> None:
    if not said:
        print(f"Not checked by rendering, which takes long for {_pixels(scene) / 1e6:.1f} megapixels: --check 1 does.")


def _varied(scene: scenes.Scene, vary: str | None, hold: str | None) -> dict:
    """What is varied beside the poses, checked before anything is searched."""
    from planner.search.design import DEFAULT_HOLD, check_vary

    if vary is None:
        if hold is not None:
            raise scenes.InvalidInput(f"--hold must be left out without --vary, got {hold!r}")
        return {}
    names, hold = tuple(part.strip() for part in vary.split(",")), hold or DEFAULT_HOLD
    try:
        check_vary(scene, names, hold)
    except scenes.InvalidInput as error:
        text = str(error)
        raise scenes.InvalidInput(f"--{text}" if text.startswith(("vary", "hold")) else text) from None
    return {"vary": names, "hold": hold}


def _renders(scene: scenes.Scene) -> int:
    """How many settings are rendered when nothing is said of it."""
    return _CHECKED if _pixels(scene) <= _QUICK_PIXELS else 0


def _pixels(scene: scenes.Scene) -> int:
    return scene.camera.width * scene.camera.height


def _poses(**texts: str | None) -> dict[str, scenes.Pose | tuple[scenes.Pose, ...] | None]:
    """Poses by name, from what the options of that name say."""
    return {name: parse_poses(f"--{name}", text) for name, text in texts.items()}


def _plan(scene: scenes.Scene, objective: str, how: dict) -> tuple[planner.Plan, float]:
    """The plan and the seconds that it took."""
    import planner

    began = time.perf_counter()
    also = f", {', '.join(how['vary'])}" if how.get("vary") else ""
    with progress(f"{scene.name}: searching places of sensor and light{also}", "steps", at_once=True) as shown:
        found = planner.plan(scene, objective, **how, report=shown)
    return found, time.perf_counter() - began


def _check(found: planner.Plan, count: int) -> PlanCheck:
    from validation.plan_check import check_plan

    with progress(f"{found.scene.name}: rendering and measuring the best {count}", "settings", at_once=True) as shown:
        return check_plan(found, count, report=shown)


def _check_varied(found: planner.Plan) -> VaryCheck:
    from validation.vary_check import check_varied

    with progress(
        f"{found.scene.name}: rendering and measuring with and without what was varied", "plans", at_once=True
    ) as shown:
        return check_varied(found, report=shown)


def _range(option: str, text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise scenes.InvalidInput(f"{option} must be two numbers LOW,HIGH (degrees), got {text!r}") from None
    return low, high


def _tolerances(texts: list[str], scene: scenes.Scene) -> planner.Tolerances | None:
    import planner
    from planner.robustness import check_robust

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
    if not values:
        return None
    tolerances = planner.Tolerances(**values)
    check_robust(scene, tolerances)
    return tolerances


def _pictures(
    found: planner.Plan, checked: PlanCheck | None, scatter: VaryCheck | None, map_file: Path | None, out: Path | None
) -> list[Path]:
    if map_file is None and out is None:
        return []
    from validation.report import plan_figures  # matplotlib takes half a second to load

    if out is None:
        return [plan_figures.map_picture(found, map_file)]
    return [*plan_figures.draw(found, out, map_file), _page(found, checked, scatter, out)]


def _page(found: planner.Plan, checked: PlanCheck | None, scatter: VaryCheck | None, out: Path) -> Path:
    """The setting that is proposed as one page; where pictures were checked, with biases as they are simulated."""
    from validation.report import page, station, vary_section

    scene, best, more = found.scene, checked.proposed if checked and checked.proposed else found, []
    if found.varied:
        scene, best = found.varied.best.scene, found.varied.best
        more = [vary_section.section(found.varied, scatter)]
    made = station.of_picture(scenes.Picture.of(scene, best.sensor, best.light), simulated=checked is not None)
    return page.write_station(made, found.scene.title or found.scene.name, out / "plan.html", more)


def _show(
    found: planner.Plan, checked: PlanCheck | None, safe: planner.Robust | None, seconds: float, pictures: list[Path],
    written: Path | None, as_json: bool, scatter: VaryCheck | None = None,
) -> None:  # fmt: skip
    """The plan, as JSON or as tables."""
    from validation.report import vary_table

    if as_json:
        varied = {"varied": vary_table.facts(found.varied, scatter)}
        files = {"pictures": pictures, "written": written}
        say(plan_json.facts(found, checked, safe, seconds) | plain(files) | varied, True, "")
        return
    from validation.report import plan_table

    shown_on = console()
    shown_on.print(plan_table.report(found, checked, safe, seconds), highlight=False)
    if found.varied:
        shown_on.print(vary_table.report(found, scatter, seconds), highlight=False)
    for path in pictures:
        shown_on.print(f"picture: {path}", highlight=False)
    if written:
        shown_on.print(f"The poses stand in {written} now.", highlight=False)
