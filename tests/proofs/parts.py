"""Random parts from a mesh file to measured values: plates and brackets with two holes, five requirements each.

The truth is the dimensions that a part is made with; every value has to lie within four standard deviations of it.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from typer.testing import CliRunner

import measure
import planner
import render
import scenes
from scenes import Scene
from scenes.measurands.measurands import Measurand
from tests.parts import Hole, prism, unevenly
from validation.cli.main import app

MOST = 4.0  # standard deviations


@dataclass(frozen=True)
class Part:
    """A part's mesh file and the dimensions that it was made with: of its upper face and of two holes in it."""

    path: Path
    size: tuple[float, float]
    height: float
    holes: tuple[Hole, Hole]


@dataclass(frozen=True)
class Measured:
    """One requirement: its name, the true value, the measured one, sigma (the scene's unit or degrees) and status."""

    name: str
    true: float
    value: float
    sigma: float
    status: str

    @property
    def away(self) -> float:
        """Standard deviations from the truth."""
        return (self.value - self.true) / self.sigma


def make(rng: np.random.Generator, folder: Path, number: int) -> Part:
    """A plate (even numbers) or a bracket with a step, in mm."""
    length, width, height = rng.uniform([60, 40, 6], [120, 80, 16])
    step = length if number % 2 == 0 else 0.65 * length
    rest = [] if number % 2 == 0 else [(length, 0.5 * height), (step, 0.5 * height)]
    profile = [(0, 0), (length, 0), *rest, (step, height), (0, height)]
    radius = rng.uniform(0.08, 0.12, 2) * min(step, width)
    middle = rng.uniform([0.2, 0.4], [0.3, 0.6]), rng.uniform([0.7, 0.4], [0.8, 0.6])
    holes = [
        Hole(step * x, width * y, r, unevenly(rng, 60), 0.0, height) for (x, y), r in zip(middle, radius, strict=True)
    ]
    path = folder / f"part{number}.stl"
    prism(profile, width, holes, seed=number).export(path)
    return Part(path, (step, width), height, tuple(holes))


def scene_of(part: Part) -> tuple[Scene, dict[str, float]]:
    """The scene that ``ice new`` writes of it, asked for five requirements on its upper face, and their true values."""
    path = part.path.with_suffix(".toml")
    CliRunner().invoke(app, ["new", str(part.path), "--units", "mm", "-o", str(path)])
    scene = scenes.load(path)
    step = part.size[0]
    left, right, front = (_edge(scene, part, line) for line in ((0.0, None), (step, None), (None, 0.0)))
    rims = [_rim(scene, part, hole) for hole in part.holes]
    one, other = part.holes
    asked = (
        ("bore", "diameter", rims[:1], 2 * one.radius),
        ("holes", "distance", rims, float(np.hypot(other.x - one.x, other.y - one.y))),
        ("length", "width", [left, right], step),
        ("square", "angle", [left, front], 90.0),
        ("place", "offset", [rims[1], left], other.x),
    )
    wanted = tuple(Measurand(name=name, kind=kind, features=tuple(features), tolerance=0.05)
                   for name, kind, features, _ in asked)  # fmt: skip
    asked_for = Scene.model_validate(scene.model_copy(update={"task": None, "measurands": wanted, "settings": ()}))
    return asked_for, {name: true for name, _, _, true in asked}


def _edge(scene: Scene, part: Part, line: tuple[float | None, float | None]) -> dict[str, str]:
    """The edge of the upper face on a line x = or y = in the drawing."""
    solid, axis = scene.solid, 0 if line[0] is not None else 1
    for edge in solid.sharp:
        ends = solid.vertices[list(edge.ends)]
        if np.allclose(ends[:, 2], part.height, atol=1e-4) and np.allclose(ends[:, axis], line[axis], atol=1e-4):
            return {"edge": edge.name}
    raise ValueError(f"no edge at {line}")


def _rim(scene: Scene, part: Part, hole: Hole) -> dict[str, str]:
    place = np.array([hole.x, hole.y, part.height])
    return {"circle": min(scene.solid.circles, key=lambda circle: float(np.linalg.norm(circle.centre - place))).name}


def measured(scene: Scene, true: dict[str, float], rng: np.random.Generator, step_deg: float) -> list[Measured]:
    """Plan, render one noisy image there, and measure it."""
    plan = planner.plan(scene, step_deg=step_deg, refined=False)
    image = render.expose(render.image(scene, plan.sensor, plan.light), scene.noise, rng, 1)[0]
    found = measure.measure(image, scene, plan.sensor, plan.light)
    return [
        Measured(name, true[name], float(value), float(s), str(state))
        for name, value, s, state in zip(found.names, found.value, found.sigma, found.status, strict=True)
    ]


def parts(
    count: Annotated[int, typer.Option(help="Parts.")] = 30,
    seed: Annotated[int, typer.Option()] = 1,
    step: Annotated[float, typer.Option(help="Of the planner's grid, degrees.")] = 30.0,
) -> None:
    """Random parts through ice new, plan, render, measure; exit status 1 if a value is further off than it may be."""
    rng, every = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            scene, true = scene_of(make(rng, Path(folder), number))
            found = measured(scene, true, rng, step)
            every += found
            told = ", ".join(f"{each.name} {each.away:+.2f} {each.status}" for each in found)
            print(f"{number:3d} {'plate' if number % 2 == 0 else 'bracket'}: {told}", flush=True)
    good = [each for each in every if each.status == "ok"]
    far = sum(not abs(each.away) < MOST for each in good)
    spread = np.sqrt(np.mean([each.away**2 for each in good]))
    print(f"{len(good)} of {len(every)} values ok; {far} of them more than {MOST:g} sigma away; rms {spread:.3f} sigma")
    raise typer.Exit(1 if far else 0)
