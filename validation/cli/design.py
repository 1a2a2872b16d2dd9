"""``ice design``."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import scenes
from scenes import catalogue
from scenes.status import is_trusted
from validation.cli.common import Json, SceneName, check_number, commands, progress, say, scene_of, taking
from validation.cli.outputs import check_file
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    from planner.designing.outcome import Design, Offer
    from planner.designing.wishes import Wishes
    from validation.designed import StationProof

commands = commands()
_MOST = 1e9
_SEVERAL, _MANY = 2, 8  # processes, where there are as many cores; pieces of work that are worth beginning them


@dataclass(frozen=True)
class Options:
    """What a design is asked for."""

    scene: SceneName
    catalogue: Annotated[
        str, typer.Option(metavar="FILE", help="Catalogue (TOML, CSV), or sample: the bundled one, which is no offer.")
    ]
    k: Annotated[float | None, typer.Option("--k", help="U is to be at most T / K, T half of the zone; default 4.")] = (
        None
    )
    false_acceptance: Annotated[
        float | None, typer.Option(metavar="P", help="In its place: most parts that are bad and accepted (JCGM 106).")
    ] = None
    budget: Annotated[float | None, typer.Option(help="Most that camera, lens and light may cost together.")] = None
    nearest: Annotated[float | None, typer.Option(metavar="MM", help="Least working distance, mm.")] = None
    farthest: Annotated[float | None, typer.Option(metavar="MM", help="Greatest working distance, mm.")] = None
    speed: Annotated[float | None, typer.Option(metavar="MM/S", help="Of the part while it is exposed.")] = None
    rate: Annotated[float | None, typer.Option(metavar="HZ", help="Parts a second.")] = None
    motion: Annotated[float | None, typer.Option(metavar="PX", help="Most that it moves; default 1 px.")] = None
    blur: Annotated[
        float | None, typer.Option(metavar="PX", help="Largest blur over the depth (1 sigma); default 2 px.")
    ] = None
    lens_blur: Annotated[
        float | None,
        typer.Option(metavar="UM", help="Of lenses without an MTF, beside diffraction; default: the scene's."),
    ] = None
    own_light: Annotated[
        bool, typer.Option("--own-light", help="Keep the scene's own lights; their brightness counts as enough.")
    ] = False
    renders: Annotated[
        int, typer.Option(metavar="N", help="Prove the station: simulate its biases, and measure N noisy pictures.")
    ] = 0
    prove: Annotated[int, typer.Option(metavar="N", help="So many stations of the front, with --renders.")] = 1
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw cost against U (.png, .svg).")] = None
    write: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Write the station as a scene.")] = None
    as_json: Json = False


@commands.command("design")
@taking(Options)
def design_command(given: Options) -> None:
    """Which camera, lens and light to buy for the tolerances of a scene, at the least cost; and what less U costs.

    Exit status 1 if nothing meets the tolerances, or rendering contradicts it.
    """
    from planner.designing.evaluation import Problem
    from planner.designing.search import design
    from validation import designed

    check_number("--renders", given.renders, 0, 1_000_000)
    check_number("--prove", given.prove, 1, 100)
    if given.prove > 1 and not given.renders:
        raise scenes.InvalidInput(f"--renders must be given with --prove, got {given.renders}")
    check_file("--picture", given.picture, ".png", ".svg")
    check_file("--write", given.write, ".toml")
    wishes = _wishes(given)
    scene, parts = scene_of(given.scene), catalogue.load(given.catalogue)
    began, problem = time.perf_counter(), Problem.of(scene, wishes)
    with progress(f"{scene.name}: searching the catalogue", "so far", at_once=True) as shown, _mapped() as mapped:
        found = design(problem, parts, report=shown, mapped=mapped, own_light=given.own_light)
    seconds, proofs = time.perf_counter() - began, ()
    if given.renders:
        with progress(f"{scene.name}: rendering the station", "images", at_once=True) as shown:
            found, proofs = designed.proven(found, given.renders, shown, given.prove)
    if given.write is not None:
        designed.write(found, given.scene, given.write)
    if given.picture is not None:
        from validation.report import design_figure

        design_figure.draw(found, parts.currency, given.picture)
    _show(found, parts, proofs, seconds, given)
    if not found.reached or (proofs and sum(each.holds for each in proofs) < given.prove):
        raise typer.Exit(1)


def _wishes(given: Options) -> Wishes:
    from planner.designing.wishes import Wishes

    for name in ("k", "budget", "nearest", "farthest", "speed", "rate", "motion", "blur", "lens_blur"):
        check_number(f"--{name.replace('_', '-')}", getattr(given, name), 0, _MOST)
    if given.k is not None and given.false_acceptance is not None:
        raise scenes.InvalidInput(f"--k must be left out with --false-acceptance, got {given.k:g}")
    said = {
        "k": given.k, "false_acceptance": given.false_acceptance, "budget": given.budget, "nearest_mm": given.nearest,
        "farthest_mm": given.farthest, "speed_mm_s": given.speed, "rate_hz": given.rate, "motion_px": given.motion,
        "blur_px": given.blur, "lens_blur_um": given.lens_blur,
    }  # fmt: skip
    return Wishes(**{name: value for name, value in said.items() if value is not None})


@contextmanager
def _mapped() -> Iterator[Callable[..., Any]]:
    """`map` over two processes, which are begun when there is work for them."""
    from validation.batch import pool

    with ExitStack() as stack:
        crews: list[Any] = []

        def mapped(function: Callable[..., Any], items: Sequence[Any]) -> Iterable[Any]:
            many = _SEVERAL if crews else _MANY
            if len(items) < many or pool.cores() < _SEVERAL:
                return map(function, items)
            if not crews:
                crews.append(stack.enter_context(pool.local(_SEVERAL)))
            return crews[0].executor.map(function, items)

        yield mapped


def _show(
    found: Design, parts: catalogue.Catalogue, proofs: tuple[StationProof, ...], seconds: float, given: Options
) -> None:
    if given.as_json:
        say(facts(found, parts, proofs, seconds), True, "")
        return
    from validation.report import design_table

    shown_on = console()
    shown_on.print(design_table.report(found, parts.currency, proofs, seconds), highlight=False)
    if parts.is_sample:
        shown_on.print("The bundled catalogue is a sample, no offer.", highlight=False)
    for path in (given.picture, given.write):
        if path is not None:
            shown_on.print(f"written: {path}", highlight=False)


def facts(found: Design, parts: catalogue.Catalogue, proofs: tuple[StationProof, ...], seconds: float) -> dict:
    """Everything for JSON."""
    searched, wishes = found.searched, found.problem.wishes
    return plain({
        "scene": found.problem.scene.name, "catalogue": parts.title, "is_sample": parts.is_sample,
        "cost": parts.currency or "price" if found.priced else "megapixels",
        "k": wishes.k if wishes.false_acceptance is None else None, "false_acceptance": wishes.false_acceptance,
        "reached": found.reached, "signed": _signed(found, proofs), "best": found.best and _offer(found, found.best),
        "front": [_offer(found, each) for each in found.front],
        "searched": {
            "sensors": searched.sensors, "lenses": searched.lenses, "lights": searched.lights,
            "combinations": searched.combinations, "left_out": searched.left_out, "pairs": searched.pairs,
            "pairs_left_out": searched.pairs_left_out, "views": searched.views, "rated": searched.rated,
            "close": searched.close, "complete": searched.complete,
        },
        "proofs": [
            {"names": list(each.offer.rated.names), "told": each.offer.ratio, "ratio": each.ratio,
             "statuses": list(each.budget.statuses), "holds": each.holds, "verdict": each.run and each.run.verdict.text}
            for each in proofs
        ],
        "seconds": seconds,
    })  # fmt: skip


def _signed(found: Design, proofs: tuple[StationProof, ...]) -> bool:
    """Whether all values of the best may be signed: by its proof, or as predicted."""
    if proofs:
        return any(each.holds and each.offer is found.best for each in proofs)
    close = found.best and found.best.close
    return bool(close) and all(map(is_trusted, close.statuses))


def _offer(found: Design, offer: Offer) -> dict:
    from validation.report import design_words

    settings, rated, close = offer.rated.settings, offer.rated, offer.close
    names, units = zip(*((q.name, found.problem.scene.unit_of(q)) for q in found.problem.scene.quantities), strict=True)
    return {
        "cost": offer.cost, "camera": rated.names[0], "lens": rated.names[1], "lights": [rated.names[2]],
        "sensor": list(rated.sensor), "light": scenes.pairs(rated.light) if rated.light else [],
        "roll_deg": settings.aspect.roll_deg, "distance_mm": settings.distance_mm, "light_mm": settings.light_mm,
        "f_number": settings.f_number, "exposure_s": settings.exposure_s, "pixel_mm": settings.pixel_mm,
        "blur_px": settings.blur_px, "u_over_t": design_words.u_over_t(found, offer),
        "ratio": offer.ratio if math.isfinite(offer.ratio) else None,
        "limited_by": [{"source": name, "share": share} for name, share in design_words.limits(offer)],
        "limiting": design_words.limiting(found, offer),
        "measurands": [
            {"name": name, "unit": unit, "U": each.U, "allowed": float(most), "status": state}
            for name, unit, each, most, state in zip(
                names, units, close.budgets, found.problem.allowed, close.statuses, strict=True)
        ] if close and close.budgets else [],
    }  # fmt: skip
