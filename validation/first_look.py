"""From where a part shows most of what could be measured of it: a setting, and the measurands that are seen there."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

import planner
from imaging.light.between import is_exchanged
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.pictures import Pictures
from planner.forecast import Forecast
from scenes import Measurand, Pose, Scene
from scenes.status import GLANCED, OK, WORST_FIRST, is_trusted

_MOST, _ENOUGH = 6, 3  # measurands that are proposed; after so many no further setting is looked at
_CLOSELY = 3, 24  # settings, of which the best is taken: of a large part, of a small one
_TRIANGLES = 5_000  # about so many in all the settings that are looked at
_ASKED = 8  # measurands that are looked at closely
_CAPABLE = 1 / 8  # sigma over half the tolerance, below which nothing is gained any more
_ABOVE, _BELOW, _AZIMUTHS = (60, 40, 20), (160, 140, 120), range(10, 370, 45)
_LIGHTS = (1, 1), (-1, -1), (0, 2), (1, -3)  # steps of that grid beside the sensor, turned back at its ends
_PLACES = 6  # what a measurand is worth is told apart by, or rounding would choose between views that are alike
_HALF = 0.5  # what a view from below is worth, for the part lies on something


@dataclass(frozen=True)
class FirstLook:
    """A setting and what can be measured in it.

    Attributes
    ----------
    measurands : tuple of Measurand
        Of different sorts; at most six where nothing else is asked for.
    statuses : tuple of str
        What is predicted of each; those that are neither ``ok`` nor ``glanced`` are there only where none is. It is
        ``glanced`` in place of ``ok`` where faces send light to each other, which a first look takes roughly.
    sensor, light : Pose
    reasons : tuple of str
        What decided each status, with its number; empty for ``ok``.
    """

    measurands: tuple[Measurand, ...]
    statuses: tuple[str, ...]
    sensor: Pose
    light: Pose
    reasons: tuple[str, ...] = ()

    @property
    def facts(self) -> list[dict[str, str]]:
        """For JSON: name, kind and status of each."""
        rows = zip(self.measurands, self.statuses, strict=True)
        return [{"name": each.name, "kind": each.kind, "status": status} for each, status in rows]


def first_look(
    scene: Scene, candidates: tuple[Measurand, ...], report: Callable[[str, int, int], None], most: int = _MOST
) -> FirstLook:
    """Look from everywhere at all that could be measured, then closely from where most is seen.

    Parameters
    ----------
    scene : Scene
        Without measurands; with one free light.
    candidates : tuple of Measurand
        At least one, each with a tolerance.
    report : callable
        Called with what is done, how many steps are done, and of how many.
    most : int
        Measurands that are proposed.
    """
    looks = int(np.clip(_TRIANGLES // len(scene.solid.triangles), *_CLOSELY))
    report("looking from everywhere", 1, 2 + looks)
    sensors, lights, worth = _from_everywhere(scene.with_(measurands=candidates), most)
    best = None
    for step, number in enumerate(_apart(worth.sum(-1), looks), 2):
        report("looking closely", step, 2 + looks)
        seen = [m for m in np.argsort(-worth[number], kind="stable") if worth[number, m] > 0]
        some = _varied([candidates[m] for m in seen], max(_ASKED, most)) or candidates[:most]
        sensor, light = Pose.of(sensors[number]), Pose.of(lights[number])
        forecasts = planner.predict(scene.with_(measurands=some), sensor, light, roughly=True).measurands
        told = {m: min((forecasts[k] for k in rows), key=_rank) for m, rows in zip(some, _rows(some), strict=True)}
        good = [m for m in some if is_trusted(told[m].status)]
        if best is None or len(good) > best[0]:
            shown = tuple(_varied(good or some, most))
            statuses, reasons = (tuple(getattr(told[m], each) for m in shown) for each in ("status", "reason"))
            best = len(good), FirstLook(shown, statuses, sensor, light, reasons)
        if len(good) >= max(_ENOUGH, most // 2):
            break
    return _glanced(best[1]) if is_exchanged(scene) else best[1]


def _glanced(look: FirstLook) -> FirstLook:
    """A look that took light between faces roughly: a close one may find that it moves what is ``ok``."""
    return replace(look, statuses=tuple(GLANCED if each == OK else each for each in look.statuses))


def _from_everywhere(scene: Scene, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sensors and lights (N, 2) of a coarse grid, and what every measurand is worth in each picture, (N, M).

    From below only where from above less is seen than ``most``, and less than could be worth as much from below.
    """
    above = _from(scene, _ABOVE)
    if above[2].sum(-1).max() >= min(most, _HALF * above[2].shape[-1]):
        return above
    return tuple(np.concatenate(each) for each in zip(_from(scene, _BELOW), above, strict=True))


def _from(scene: Scene, polar: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same for some polar angles; lights turn back at the first and the last."""
    grid = np.array(list(itertools.product(polar, _AZIMUTHS)), float).reshape(len(polar), len(_AZIMUTHS), 2)
    row, column = np.indices(grid.shape[:2])
    within = [(row + i >= 0) & (row + i < len(polar)) for i, _ in _LIGHTS]
    beside = [(np.where(fits, row + i, row - i), column + k) for fits, (i, k) in zip(within, _LIGHTS, strict=True)]
    sensors = grid.reshape(-1, 2)
    lights = np.stack([grid[i, k % len(_AZIMUTHS)].reshape(-1, 2) for i, k in beside], 1)
    pictures = Pictures.of(scene, sensors[:, None], lights)
    variances = variance_model(DEFAULT_MODEL)(pictures).variances_object
    half = np.array([quantity.tolerance.half for quantity in scene.quantities])
    with np.errstate(divide="ignore", invalid="ignore"):
        worth = np.minimum(_CAPABLE * half / np.sqrt(variances), 1)
    worth = np.stack([np.nan_to_num(worth[..., rows]).min(-1) for rows in _rows(scene.measurands)], -1)
    worth = worth * np.where(sensors[:, 0] > 90, _HALF, 1.0)[:, None, None]
    shape = worth.shape[:-1]
    wide = np.broadcast_to(sensors[:, None], (*shape, 2)).reshape(-1, 2)
    return wide, lights.reshape(-1, 2), worth.reshape(-1, worth.shape[-1]).round(_PLACES)


def _rows(measurands: Sequence[Measurand]) -> list[list[int]]:
    """Numbers of the quantities of each, among those of all."""
    ends = np.cumsum([0, *(len(measurand.quantities) for measurand in measurands)])
    return [list(range(first, last)) for first, last in pairwise(ends)]


def _rank(forecast: Forecast) -> int:
    return WORST_FIRST.index(forecast.status)


def _apart(worth: np.ndarray, most: int) -> list[int]:
    """Numbers of the best pictures by what each is worth, (N,); no two of one sensor."""
    best = worth.reshape(-1, len(_LIGHTS))
    order = np.argsort(-best.max(1), kind="stable")[:most]
    return [int(sensor * len(_LIGHTS) + best[sensor].argmax()) for sensor in order]


def _varied(measurands: list[Measurand], most: int) -> list[Measurand]:
    """Some of them, one after the other of each kind."""
    kinds = defaultdict(list)
    for each in measurands:
        kinds[each.name.split()[0]].append(each)
    turns = itertools.zip_longest(*kinds.values())
    return [each for turn in turns for each in turn if each is not None][:most]
