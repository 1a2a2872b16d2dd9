"""The certificate of a plan: that no pose whatever is better by more than a share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from planner.certifying.cells import Boxes
from planner.certifying.on_grid import Proven
from planner.certifying.pulls import is_known
from planner.certifying.search import LIGHTS, SENSORS, Found, Search
from planner.constraints import WHOLE, Constraints, turn_of
from planner.planning import Plan
from planner.search.candidates import RayTraced, SettingUp
from planner.search.exhaustive import has_bound
from planner.search.grid import Grid, as_array, as_poses
from planner.search.local import refine
from planner.search.objective import Aim, Report, SearchProblem
from planner.search.pair_bounds import has_pair_bounds
from scenes import InvalidInput, Pose, Scene
from scenes.status import is_trusted

WITHIN = 0.01
MOST_PAIRS = 5_000_000  # of cells: some minutes
GRID_STEP = 1.0  # degrees, where a certificate is of the pairs of a grid
_MOST_EVALUATED = 50_000  # of them
_LEAST_TOLD = 0.1  # %
_CLOSELY = 3  # places beside a better one that are looked at closely


@dataclass(frozen=True)
class Certificate:
    """What is proved of all poses of sensor and light that a plan's constraints allow, or of those of a grid.

    Attributes
    ----------
    proved : bool
        Whether none is better than the plan by more than ``within`` of what it minimises.
    within : float
    better_by : float
        By which share of that none is better.
    least : float
        What no pose is below.
    pairs : int
        Pairs of cells of poses that were bounded, or pairs of the grid.
    within_scale : bool
        Whether this is of those poses alone whose levels the end of the scale does not cut off.
    grid_deg : float, optional
        Step of the grid whose pairs alone this is of, by what a glance says of them; None of all poses.
    """

    proved: bool
    within: float
    better_by: float
    least: float
    pairs: int
    within_scale: bool
    grid_deg: float | None = None

    @property
    def told(self) -> str:
        """In one sentence, without its end."""
        scale = " whose levels are within the sensor's scale" * self.within_scale
        if self.grid_deg is not None:
            part, grid = 100 * (1 - self.better_by), f"the {self.grid_deg:g} degree grid{scale}"
            if part < _LEAST_TOLD:
                return f"at a glance, of some pairs of {grid} nothing is known"
            return f"at a glance, no pair of {grid} has less than {part:.3g} % of this variance"
        part = f"{100 * (1 - self.better_by):.3g} %"
        return f"no pose{scale}, also between those of a grid, has less than {part} of this variance"


def certified(
    found: Plan,
    constraints: Constraints | None = None,
    *,
    within: float = WITHIN,
    most: int = MOST_PAIRS,
    step_deg: float = GRID_STEP,
    report: Report | None = None,
) -> Plan:
    """The plan, or a better one that is found on the way, with its certificate.

    Of a convex part all poses within the constraints' polar angles and azimuths are covered by cells of the sensor's
    and the light's poses, which are divided until a lower bound of what `predict` says in a pair of cells excludes it.
    Of one matt part under one free point of light, by the ``calibrated`` model, in the object. It is assumed that the
    variance of no edge is negative, and that rounding errors are below a relative 1e-9. Constraints on what the sensor
    sees, and forbidden regions, only leave out places that the certificate covers, too.

    Of other parts of plane faces under points of light of which one is free, glossy and hollow ones and such on a
    floor, it is of all pairs of a grid, by what a glance says of them: without the light that surfaces send to each
    other.

    Parameters
    ----------
    found : Plan
    constraints : Constraints, optional
        Those of the plan.
    within : float
        The share that is to be proved.
    most : int
        Pairs of cells after which it ends, unproved.
    step_deg : float
        Of the grid.

    Raises
    ------
    InvalidInput
        If the plan is of another kind.

    Examples
    --------
    >>> import planner, scenes
    >>> near = planner.Constraints(sensor_polar_deg=(25, 28), sensor_azimuth_deg=(10, 14), light_polar_deg=(10, 20))
    >>> found = planner.plan(scenes.load("task1"), constraints=near, step_deg=3)
    >>> certified(found, near).certificate.proved
    True
    """
    scene, limits = found.scene, (constraints or Constraints()).on_side_of(found.scene)
    check_certifiable(found, limits)
    if not 0 < within < 1:
        raise InvalidInput(f"within must be above 0 and below 1, got {within}")
    problem = SearchProblem(scene, found.model, Aim.of(scene.quantities, found.objective, found.over), limits)
    if not has_terms(scene):
        return _on_grid(problem, found, step_deg, within, report or (lambda *_: None))
    boxes = (
        Boxes.over(limits.sensor_polar_deg or WHOLE, _range(limits.sensor_azimuth_deg), SENSORS),
        Boxes.over(limits.light_polar_deg or WHOLE, _range(limits.light_azimuth_deg), LIGHTS),
    )
    start = Found(found.variance, *_setting(found))
    known = Search.of(problem, start, boxes, within, most).run(report or (lambda *_: None))
    better = _better(problem, found, known) if known.value < found.variance else found
    by = max(0.0, 1 - known.least / better.variance)
    told = Certificate(by <= within * (1 + 1e-9), within, by, float(known.least), known.pairs, known.within_scale)
    return replace(better, certificate=told)


def _on_grid(problem: SearchProblem, found: Plan, step_deg: float, within: float, report: Report) -> Plan:
    """The same of the pairs of a grid."""
    grid, start = Grid.of(problem.scene, problem.constraints, step_deg), _setting(found)
    known = Proven.of(problem, grid, start, within, _MOST_EVALUATED, report)
    better = found
    if known.sensor is not start[0]:
        end = refine(problem, (known.sensor, known.light), step_deg, known=known.value)
        better = _better(problem, found, Found(end.value, end.sensor, end.lights))
    value = float(problem.values(*(pose[None] for pose in _setting(better)))[0])
    by = max(0.0, 1 - known.least / value)
    told = Certificate(by <= within * (1 + 1e-9), within, by, known.least, known.pairs, known.within_scale, step_deg)
    return replace(better, certificate=told)


def _setting(found: Plan) -> tuple[np.ndarray, np.ndarray]:
    """Sensor (2,) and free lights (2 F,), degrees."""
    return np.array(list(found.sensor)), as_array(found.light)


def _better(problem: SearchProblem, found: Plan, known: Found) -> Plan:
    """The plan at the best place found, if that can be set up and is trusted as much."""
    untrusted = sum(not is_trusted(each.status) for each in found.prediction.measurands)
    for pair in islice(SettingUp(problem, (False, False)).offers(known.sensor, known.light), _CLOSELY):
        taken = RayTraced.of(problem, *pair)
        if taken.value < found.variance and taken.untrusted <= untrusted:
            told, limiting = taken.prediction, taken.prediction.limiting or taken.prediction.measurands[0].name
            place = Pose(*map(float, taken.sensor)), as_poses(taken.light)
            return replace(found, sensor=place[0], light=place[1], steady=True, variance=taken.value,
                           prediction=told, limiting=limiting)  # fmt: skip
    return found


def check_certifiable(found: Plan, limits: Constraints) -> None:
    """See that bounds are known for what a plan is of."""
    scene = found.scene
    if (found.model, found.objective) != ("calibrated", "object"):
        raise InvalidInput(
            f"model and objective must be calibrated and object for a certificate, got {found.model} and "
            f"{found.objective}"
        )
    if limits.same_mount:
        raise InvalidInput("same_mount must be left out for a certificate, got both")
    if not has_terms(scene) and not (has_pair_bounds(scene, found.model) and len(scene.free) == 1):
        raise InvalidInput(
            "scene must be of plane faces without print, straight edges among what is measured, and points of light of "
            f"which one is free for a certificate, got {scene.name}"
        )


def has_terms(scene: Scene) -> bool:
    """Whether bounds are known of a scene."""
    camera, noise = scene.camera, scene.noise
    lens = not camera.lens.bends and camera.blur_field is None and camera.perspective == 1
    plain = noise.colour is None and not noise.is_shared
    light = len(scene.free) == 1 and not any(scene.lights[0].offset)
    return bool(has_bound(scene, "calibrated") and lens and plain and light and is_known(scene))


def _range(azimuth: tuple[float, float] | None) -> tuple[float, float]:
    """Azimuths from one to another, growing."""
    if azimuth is None:
        return 0.0, 360.0
    return azimuth[0], azimuth[0] + turn_of(azimuth)
