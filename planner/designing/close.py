"""A station of a catalogue's parts, looked at closely: what lies around its edges, and its whole budget."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from imaging.light.appearance import is_plain
from imaging.light.emitters import emitters
from imaging.models import variance_model
from imaging.models.bias import bias, cluttered
from imaging.pictures import Pictures
from planner.budgeting.budgets import shared_inputs
from planner.budgeting.features import Features
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import sources
from planner.budgeting.terms import terms
from planner.designing.evaluation import Problem, Rated
from planner.designing.stations import station
from planner.forecast import forecasts
from planner.uncertainty.budget import Budget
from planner.uncertainty.budget import budget as combined
from scenes import InvalidInput, Picture, Scene
from scenes.lights import GLANCE, SMOOTH
from scenes.status import CLUTTER, MEASURED, NOT_VISIBLE, OK

_NODES = {"dome": SMOOTH}  # each way, that stand for a light


@dataclass(frozen=True, eq=False)
class Close:
    """The budgets of all M quantities of a station.

    Attributes
    ----------
    budgets : tuple of Budget
        In the scene's unit, or degrees; () where a quantity cannot be measured.
    statuses : tuple of str
        Predicted: ``clutter`` is a bias that a render has to tell, as of all where more than one convex body is seen.
    ratio : float
        Largest U over what is allowed; infinite where a quantity cannot be measured.
    worst : int
        Of which quantity.
    noise : float
        The same ratio by pixel noise alone.
    """

    budgets: tuple[Budget, ...]
    statuses: tuple[str, ...]
    ratio: float
    worst: int
    noise: float = np.inf


def look(problem: Problem, rated: Rated) -> Close:
    """Look at a rated station closely, where it stands; few points stand for its light, which tells most of it."""
    nodes = _NODES.get(rated.settings.light.kind, GLANCE)
    scene = station(problem.scene, rated.settings)
    try:
        picture = Picture.of(scene, rated.sensor, rated.light)
    except InvalidInput:
        return Close((), (NOT_VISIBLE,) * len(problem.allowed), np.inf, 0)
    pictures = replace(Pictures.of(picture), closely=True, roughly=True, _known={})
    pictures.once("emitters", lambda: emitters(scene, pictures.lights, nodes))
    evaluated = variance_model("calibrated")(pictures)
    noise = evaluated.variances_object
    if not np.isfinite(noise).all():
        states = tuple("ok" if np.isfinite(v) else NOT_VISIBLE for v in noise)
        return Close((), states, np.inf, int(noise.argmax()))
    clutter, off = _biases(pictures, len(noise))
    told = forecasts(scene, evaluated, clutter, off)
    given = sources(scene)
    with np.errstate(all="ignore"):
        slopes = sensitivities(Features(pictures), given, biased=False)
    beside = terms(pictures.glanced, told, noise, biased=True)
    inputs, budgets = shared_inputs(scene, given), []
    for each, slope, rows in zip(told, np.nan_to_num(slopes), beside, strict=True):
        by_name = {source.name: float(c) for source, c in zip(given, slope, strict=True)}
        by_name |= {row.name: row.sensitivity for row in rows}
        whole = (*inputs, *(row.as_input for row in rows))
        budgets.append(combined(each.name, each.unit, each.value_object, whole, by_name, problem.wishes.p))
    ratios = np.array([each.U for each in budgets]) / problem.allowed
    measured = all(each.status in MEASURED for each in told) and np.isfinite(slopes).all()
    worst = int(ratios.argmax())
    ratio = float(ratios[worst]) if measured else np.inf
    alone = float((problem.wishes.coverage * np.sqrt(noise) / problem.allowed).max())
    return Close(tuple(budgets), tuple(_known(each.status, scene) for each in told), ratio, worst, alone)


def _biases(pictures: Pictures, count: int) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Which edges are cluttered, and biases of the quantities in image and object; not known where a render tells."""
    if not _is_told(pictures.scene):
        return np.array(False), (np.full(count, np.nan), np.full(count, np.nan))
    off = bias(pictures)
    return cluttered(pictures), (off.values, off.values_object)


def _is_told(scene: Scene) -> bool:
    """Whether formulas tell biases; else a render has to: they do not know how those move with light and surfaces."""
    return is_plain(scene) and not scene.textures


def _known(state: str, scene: Scene) -> str:
    """``clutter`` where a render has to tell the bias."""
    return state if state != OK or _is_told(scene) else CLUTTER
