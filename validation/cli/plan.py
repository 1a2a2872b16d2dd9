"""``ice plan``."""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import scenes
from validation.cli import plan_json
from validation.cli.common import (
    Json,
    SceneName,
    check_left_out,
    check_number,
    commands,
    parse_poses,
    progress,
    say,
    scene_of,
    taking,
)
from validation.cli.outputs import check_directory, check_file
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import planner
    from validation.plan_check import CheckedSetting, PlanCheck
    from validation.vary_check import VaryCheck

commands = commands()
_CHECKED, _MOST_CHECKED = 10, 1000
_QUICK_PIXELS = 1 << 20  # of a picture that is rendered in a second or so
_NOT_CAPABILITY = (
    "--over", "--search", "--model", "--edges", "--start", "--shares", "--tolerance", "--check", "--map", "--out",
    "--views", "--views-share", "--together", "--vary", "--hold", "--write", "--certify", "--place-board",
)  # fmt: skip
_NOT_COVERAGE = tuple(each for each in _NOT_CAPABILITY if each != "--model")

Pair = Annotated[str | None, typer.Option(metavar="P,A", help="Hold it fixed: polar angle and azimuth, degrees.")]
Range = Annotated[
    str | None,
    typer.Option(
        metavar="LOW,HIGH",
        help="Polar angles allowed, degrees; default 0,90, or 90,180 where the scene's first setting stands there.",
    ),
]
Azimuths = Annotated[str | None, typer.Option(metavar="FROM,TO", help="Azimuths allowed, degrees; 350,20 are 30.")]
Body = Annotated[
    float | None,
    typer.Option(metavar="RADIUS", help="Sphere that holds its body, scene's unit; default distance / 20, 0: none."),
]


@dataclass(frozen=True)
class Options:
    """What a plan is asked for."""

    context: typer.Context
    scene: SceneName
    objective: Annotated[
        str, typer.Option(help="object (the scene's unit, squared), image (px^2), or capability (U over tolerance).")
    ] = "object"
    over: Annotated[
        str, typer.Option(help="Of several measurands: minimax (worst sigma / tolerance) or sum (weighted).")
    ] = "minimax"
    search: Annotated[str, typer.Option(help="exhaustive or alternating (the paper's)")] = "exhaustive"
    model: Annotated[str, typer.Option(help="calibrated or paper")] = "calibrated"
    edges: Annotated[str, typer.Option(help="given, or best of all sets that measure the same")] = "given"
    step: Annotated[
        float | None,
        typer.Option(
            help=(
                "Grid step, degrees; default 1 where a bound leaves out most pairs (a matt convex part, a point "
                "light), else 10 (5 for several pictures that need no ray tracing)."
            )
        ),
    ] = None
    sensor: Pair = None
    light: Pair = None
    start: Annotated[str, typer.Option(metavar="P,A", help="First sensor of the alternating search.")] = "40,41"
    shares: Annotated[str, typer.Option(help="Of several lights in their total: best, or given by the scene.")] = "best"
    sensor_polar: Range = None
    light_polar: Range = None
    sensor_azimuth: Azimuths = None
    light_azimuth: Azimuths = None
    camera_body: Body = None
    light_body: Body = None
    min_edge: Annotated[float, typer.Option(help="Least usable length of a required edge, px.")] = 0.0
    min_clearance: Annotated[float, typer.Option(help="Least distance between required edges, px.")] = 0.0
    separation: Annotated[float, typer.Option(help="Least angle between sensor and light, degrees.")] = 0.0
    light_out_of_view: Annotated[bool, typer.Option("--light-out-of-view", help="Keep it out of the image.")] = False
    same_mount: Annotated[bool, typer.Option("--same-mount", help="The light is mounted at the sensor.")] = False
    tolerance: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Robust plan: roughness=0.2, noise=0.1, sensor_deg=2, ..."),
    ] = None
    vary: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Find these, too, of each picture: analyser, polarisation, band (of the scene's lamps, filters).",
        ),
    ] = None
    hold: Annotated[
        str | None,
        typer.Option(metavar="WHAT", help="Equal with --vary: time (of exposure; default) or white (its level)."),
    ] = None
    certify: Annotated[
        bool,
        typer.Option(
            "--certify",
            help=(
                "Prove that no pose at all is better by over 1 % (a matt convex part, a point light); of other parts "
                "of plane faces, none of a 1 degree grid, or by how much."
            ),
        ),
    ] = False
    check: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Render the best N settings and propose the best; 10, none of above a megapixel."
        ),
    ] = None
    no_check: Annotated[bool, typer.Option("--no-check", help="Render nothing.")] = False
    map_file: Annotated[Path | None, typer.Option("--map", metavar="FILE.png", help="Write the maps.")] = None
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write plan.html (one page that shows the best setting) and all pictures."),
    ] = None
    write: Annotated[
        bool, typer.Option("--write", help="Put the poses into the scene's file, first of its settings; comments stay.")
    ] = False
    place_board: Annotated[
        bool,
        typer.Option("--place-board", help="Find where the scene's board should stand, and how large it should be."),
    ] = False
    views: Annotated[int | None, typer.Option(metavar="N", help="Plan 1 to N pictures that together measure best.")] = (
        None
    )
    coverage: Annotated[
        bool,
        typer.Option("--coverage", help="From where each can be measured, and the fewest pictures that measure all."),
    ] = False
    views_share: Annotated[
        str | None, typer.Option(help="With --views: sensor or light, the same in all pictures.")
    ] = None
    together: Annotated[
        str | None,
        typer.Option(
            metavar="SENSORS",
            help="With --views: adjust the pictures together; sensors' places are known, uncertain or unknown.",
        ),
    ] = None
    as_json: Json = False

    @property
    def several(self) -> bool:
        """Whether several pictures are planned."""
        return self.views is not None or self.views_share is not None or self.together is not None

    def constraints(self) -> planner.Constraints:
        """Where sensor and light may stand."""
        import planner

        return planner.Constraints(
            sensor_polar_deg=_range("--sensor-polar", self.sensor_polar),
            light_polar_deg=_range("--light-polar", self.light_polar),
            sensor_azimuth_deg=_range("--sensor-azimuth", self.sensor_azimuth),
            light_azimuth_deg=_range("--light-azimuth", self.light_azimuth), camera_body=self.camera_body,
            light_body=self.light_body, min_edge_px=self.min_edge, min_clearance_px=self.min_clearance,
            min_separation_deg=self.separation, light_out_of_view=self.light_out_of_view, same_mount=self.same_mount,
        )  # fmt: skip


@dataclass(frozen=True)
class Planned:
    """A plan of one picture, what rendering it says, what is robust, and the seconds that planning took."""

    plan: planner.Plan
    seconds: float
    checked: PlanCheck | None
    scatter: VaryCheck | None
    safe: planner.Robust | None

    @property
    def proposed(self) -> planner.Plan | CheckedSetting:
        """The best by the pictures, else the plan's own."""
        return self.checked.proposed if self.checked and self.checked.proposed else self.plan


@commands.command("plan")
@taking(Options)
def plan_command(given: Options) -> None:
    """Find where sensor and light should stand, and render the best settings to see whether they are."""
    import planner
    from validation.cli import plan_board, plan_bundle, plan_capability, plan_views

    _check_options(given)
    poses = {name: parse_poses(f"--{name}", getattr(given, name)) for name in ("sensor", "light")}
    first = parse_poses("--start", given.start)
    if given.together is not None:
        plan_bundle.check_options(given.context, given.views, given.together)
    elif given.several:
        plan_views.check_options(given.context, given.views, given.views_share)
    target = _target(given) if given.write else None
    scene = scene_of(given.scene)
    how = {"step_deg": given.step, "constraints": given.constraints()} | poses
    if given.objective == "capability":
        check_left_out(given.context, "--objective capability", *_NOT_CAPABILITY)
        plan_capability.run(scene, how, given.as_json)
        return
    count = 0 if given.no_check else _renders(scene) if given.check is None else given.check
    if given.coverage:
        check_left_out(given.context, "--coverage", *_NOT_COVERAGE)
        found, seconds = _coverage(scene, how | {"model": given.model})
        _say_coverage(found, seconds, given.as_json)
        raise typer.Exit(1 if found.lost else 0)
    how |= {"over": given.over, "model": given.model}
    if given.place_board:
        plan_board.run(scene, given, how, target)
        return
    if given.together is not None:
        plan_bundle.run(scene, given, how)
    if given.several:
        plan_views.run(scene, given, how | _varied(scene, given.vary, given.hold), checked=bool(count))
        _say_unchecked(scene, given, count)
        return
    try:
        made = _planned(scene, given, how | {"start": first}, count)
    except planner.NothingMeasuresAll:
        _say_several(scene, how, given.as_json)
        raise
    if target:
        _write(target, made)
    _show(made, _pictures(made, given), target, given.as_json)
    _say_unchecked(scene, given, count)
    if made.scatter and not made.scatter.agrees:
        raise typer.Exit(1)


def _coverage(scene: scenes.Scene, how: dict) -> tuple[planner.Coverage, float]:
    """Who can see what, and the seconds that it took to find out."""
    import planner

    began, wanted = time.perf_counter(), ("model", "step_deg", "constraints", "sensor", "light")
    with progress(f"{scene.name}: who can see what", "steps", at_once=True) as shown:
        found = planner.coverage(scene, **{name: how[name] for name in wanted}, report=shown)
    return found, time.perf_counter() - began


def _say_coverage(found: planner.Coverage, seconds: float, as_json: bool) -> None:
    from validation.report import coverage_table

    if as_json:
        say(plain(coverage_table.facts(found, seconds)), True, "")
    else:
        console().print(coverage_table.report(found, seconds), highlight=False)


def _say_several(scene: scenes.Scene, how: dict, as_json: bool) -> None:
    """Where no one picture measures all: the pictures that do; the command ends with 1 then."""
    if len(scene.free) > 1:
        return
    found, seconds = _coverage(scene, how)
    if found.shots:
        _say_coverage(found, seconds, as_json)
        raise typer.Exit(1)


def _check_options(given: Options) -> None:
    """See that numbers are in their ranges, and that files can be written."""
    check_number("--check", given.check, 1, _MOST_CHECKED)
    if not 0 <= given.separation <= 180:
        limit = "least 0" if given.separation < 0 else "most 180"
        raise scenes.InvalidInput(f"--separation: min_separation_deg must be at {limit}, got {given.separation:g}")
    check_number("--camera-body", given.camera_body, 0, 1e12)
    check_number("--light-body", given.light_body, 0, 1e12)
    if given.same_mount and given.separation > 0:
        raise scenes.InvalidInput(f"--separation must be left out with --same-mount, got {given.separation:g}")
    for option in ("views", "views_share", "together", "coverage", "sensor", "light", "vary") if given.certify else ():
        if getattr(given, option):
            name = option.replace("_", "-")
            raise scenes.InvalidInput(f"--certify must be left out with --{name}, got both")
    check_file("--map", given.map_file, ".png")
    check_directory("--out", given.out)


def _planned(scene: scenes.Scene, given: Options, how: dict, count: int) -> Planned:
    """Search, see what stays robust, and render ``count`` settings."""
    import planner

    tolerances = _tolerances(given.tolerance or [], scene)
    how |= {"search": given.search, "edges": given.edges, "shares": given.shares}
    found, seconds = _plan(scene, given.objective, how | _varied(scene, given.vary, given.hold))
    if given.certify:
        found = _certified(found, how["constraints"], given.step)
    safe = planner.robust(found, tolerances, how["constraints"]) if tolerances else None
    checked = _check(found, count, asked=given.check is not None) if count else None
    scatter = _check_varied(found) if found.varied and count else None
    return Planned(found, seconds, checked, scatter, safe)


def _target(given: Options) -> Path:
    """The file that gets the poses, seen to before anything is searched."""
    from validation.planned_scene import check_writable

    for option, is_given in (("--edges best", given.edges == "best"), ("--views", given.several)):
        if is_given:
            raise scenes.InvalidInput(f"--write must be left out with {option}, got both")
    return check_writable(given.scene)


def _write(target: Path, made: Planned) -> None:
    from validation.planned_scene import write

    write(target, made.plan, made.proposed.sensor, made.proposed.light)


def _say_unchecked(scene: scenes.Scene, given: Options, count: int) -> None:
    if not (count or given.no_check or given.as_json):
        print(f"Not checked by rendering, which takes long for {_pixels(scene) / 1e6:.1f} megapixels: --check 1 does.")


def _varied(scene: scenes.Scene, vary: str | None, hold: str | None) -> dict:
    """What is varied beside the poses, checked before anything is searched."""
    from planner.design import DEFAULT_HOLD, check_vary

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


def _plan(scene: scenes.Scene, objective: str, how: dict) -> tuple[planner.Plan, float]:
    """The plan and the seconds that it took."""
    import planner

    began = time.perf_counter()
    also = f", {', '.join(how['vary'])}" if how.get("vary") else ""
    with progress(f"{scene.name}: searching places of sensor and light{also}", "steps", at_once=True) as shown:
        found = planner.plan(scene, objective, **how, report=shown)
    return found, time.perf_counter() - began


def _certified(found: planner.Plan, limits: planner.Constraints, step: float | None) -> planner.Plan:
    import planner
    from planner.certifying.certificate import GRID_STEP

    with progress(f"{found.scene.name}: excluding all poses that would be better", "steps", at_once=True) as shown:
        return planner.certified(found, limits, step_deg=GRID_STEP if step is None else step, report=shown)


def _check(found: planner.Plan, count: int, asked: bool) -> PlanCheck:
    """Of settings whose number was not asked for, those alone that a picture might put first."""
    from validation.plan_check import FARTHEST, check_plan

    with progress(f"{found.scene.name}: rendering and measuring the best {count}", "settings", at_once=True) as shown:
        return check_plan(found, count, report=shown, farthest=math.inf if asked else FARTHEST)


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


def _pictures(made: Planned, given: Options) -> list[Path]:
    if given.map_file is None and given.out is None:
        return []
    from validation.report import plan_figures  # matplotlib takes half a second to load

    if given.out is None:
        return [plan_figures.map_picture(made.plan, given.map_file)]
    return [*plan_figures.draw(made.plan, given.out, given.map_file), _page(made, given.out)]


def _page(made: Planned, out: Path) -> Path:
    """The setting that is proposed as one page; where pictures were checked, with biases as they are simulated."""
    from validation.report import page, station, vary_section

    found, scene, best, more = made.plan, made.plan.scene, made.proposed, []
    if found.varied:
        scene, best = found.varied.best.scene, found.varied.best
        more = [vary_section.section(found.varied, made.scatter)]
    shown = station.of_picture(scenes.Picture.of(scene, best.sensor, best.light), simulated=made.checked is not None)
    return page.write_station(shown, found.scene.title or found.scene.name, out / "plan.html", more)


def _show(made: Planned, pictures: list[Path], written: Path | None, as_json: bool) -> None:
    """The plan, as JSON or as tables."""
    from validation.report import vary_table

    found, told = made.plan, (made.plan, made.checked, made.safe, made.seconds)
    if as_json:
        files, varied = {"pictures": pictures, "written": written}, vary_table.facts(found.varied, made.scatter)
        say(plan_json.facts(*told) | plain(files) | {"varied": varied}, True, "")
        return
    from validation.report import plan_table

    shown_on = console()
    shown_on.print(plan_table.report(*told), highlight=False)
    if found.varied:
        shown_on.print(vary_table.report(found, made.scatter, made.seconds), highlight=False)
    for path in pictures:
        shown_on.print(f"picture: {path}", highlight=False)
    if written:
        shown_on.print(f"The poses stand in {written} now.", highlight=False)
