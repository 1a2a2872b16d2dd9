"""What a notebook shows above the rows of a scene, a picture, a plan, a measurement, a budget or a run: its picture."""

from __future__ import annotations

import itertools
from functools import singledispatch
from typing import Any

import measure
import planner
from planner.budgeting.budgets import SceneBudget
from scenes import InvalidInput, Picture, Scene
from validation.batch.result import Validation
from validation.report import budget_figure, proof_figures, station_view, views_page
from validation.report.requirements import predicted

_NUMBER = itertools.count(1)  # keeps the identifiers of a notebook's pictures apart


@singledispatch
def drawn(found: Any) -> str:
    """HTML of the picture of a result; empty where there is none to draw."""
    return ""


@drawn.register
def _(found: Picture) -> str:
    if not found.lights:
        return ""
    try:
        asked = predicted(found) if found.scene.features else ()
        label = "; ".join(f"{each.number} {each.title}: {each.grade}" for each in asked)
        view = station_view.draw(
            found, asked, None, f"What is measured, drawn from the model. {label}", f"n{next(_NUMBER)}"
        )
    except InvalidInput:
        return ""
    return f'<div style="max-width: 30em">{view}</div>'


@drawn.register
def _(found: Scene) -> str:
    return drawn(Picture.of(found, found.settings[0].sensor, found.settings[0].lights)) if found.settings else ""


@drawn.register(planner.Prediction)
@drawn.register(measure.Measurements)
@drawn.register(measure.Measurement)
def _(found: Any) -> str:
    return drawn(found.picture)


@drawn.register
def _(found: planner.Plan) -> str:
    return drawn(Picture.of(found.scene, found.sensor, found.light))


@drawn.register
def _(found: planner.Views) -> str:
    """Where the pictures of the largest set are taken from, and each of them."""
    last = found.sets[-1]
    pictures = (drawn(Picture.of(found.scene, view.sensor, view.light)) for view in last.views)
    return f'<div style="max-width: 20em">{views_page.sky(last, f"n{next(_NUMBER)}")}</div>{"".join(pictures)}'


@drawn.register
def _(found: SceneBudget) -> str:
    return f'<div style="max-width: 30em">{budget_figure.drawn(found, f"n{next(_NUMBER)}")}</div>'


@drawn.register
def _(found: Validation) -> str:
    forest = proof_figures.forest(proof_figures.lines_of(found, {}), f"n{next(_NUMBER)}")
    return f'<div style="max-width: 30em">{forest}</div>'
