"""Where to put sensor and light: the whole question, answered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from imaging.features.measurand import required_edges
from imaging.models import DEFAULT_MODEL, ModelName, variance_model
from planner.constraints import Constraints
from planner.design import DEFAULT_HOLD, Hold, Varied, Vary, check_vary
from planner.prediction import Prediction
from planner.search.candidates import Candidate, RayTraced, Searched, SettingUp, candidates, trusted
from planner.search.exhaustive import has_bound
from planner.search.grid import Grid, as_array, as_poses
from planner.search.lights import Mixture, applies, shares_of, with_shares
from planner.search.local import SearchStep, refine
from planner.search.objective import (
    DEFAULT_OBJECTIVE,
    DEFAULT_OVER,
    Aim,
    Objective,
    Over,
    Report,
    SearchProblem,
    check_choice,
)
from planner.search.varying import Variation
from scenes import InvalidInput, Pose, Scene, several
from scenes.results import Shown, finite, poses

if TYPE_CHECKING:
    from planner.certifying.certificate import Certificate

Search = Literal["exhaustive", "alternating"]
Edges = Literal["given", "best"]
Shares = Literal["best", "given"]
_CLOSELY = 3  # settings beside an optimum that are looked at closely
COARSE_STEP = 10.0  # degrees; where every pair has to be evaluated


class NothingMeasuresAll(InvalidInput):
    """No allowed setting measures every quantity of a scene."""


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """The best setting and how it was found.

    Attributes
    ----------
    scene : Scene
        The scene, its task with the required edges that the plan uses: ready to predict, render and measure.
    sensor : Pose
    light : Pose or tuple of Pose
        Of the light that is free, or of all that are. To a tenth of a degree if refined, else on the grid or as held.
    steady : bool
        Whether all can be measured where sensor and light are 0.2 degrees off, too (or twice the uncertainty of their
        poses), with a variance not more than four times as large; True of a plan that is not refined: nobody asks.
    shares : tuple of float
        Of each light of several, of the sum of their intensities; the scene's intensities are made of them.
    alone : float or None
        Of two lights: the least of what is minimised where one of them has all; refined if the plan is.
    objective, over, model : str
    variance : float
        What was minimised: the scene's unit squared or px^2 (degrees^2 for an angle); of several measurands the squared
        ratio of standard deviations to tolerances, the largest or their weighted sum.
    limiting : str
        Name of the measurand that limits the plan: with the largest such ratio.
    grid_sensor, grid_light, grid_variance
        The best pair of the grid.
    prediction : Prediction
        At the poses, in both units.
    trace : tuple of SearchStep
        Of the alternating search.
    partial_variance : float
        Where the alternating search stopped.
    gap : float or None
        Optimality gap of the alternating search: its variance over the exhaustive one's, less 1; None without
        exhaustive search, and where that one passes over settings whose levels are cut off.
    guarantee : str
        What is known about the optimum.
    pairs, evaluated : int
        Pairs covered by the exhaustive search and how many were evaluated one by one.
    candidates : tuple of Candidate
        Up to ten clearly different settings, the best first; sensors or lights at least 15 degrees apart.
    set_aside : tuple of Candidate
        Those of less variance than the plan's own that were not taken, for a close look at them says that more of the
        measurands cannot be trusted there (`clutter`).
    varied : Varied, optional
        What other polarisers, another lamp or another filter gain, with poses of their own; all else is about the
        scene's own choice.
    certificate : Certificate, optional
        What is proved of all poses, also between those of a grid (`certified`).
    """

    scene: Scene
    sensor: Pose
    light: Pose | tuple[Pose, ...]
    steady: bool
    shares: tuple[float, ...]
    alone: float | None
    objective: str
    over: str
    model: str
    variance: float
    limiting: str
    grid_sensor: Pose
    grid_light: Pose | tuple[Pose, ...]
    grid_variance: float
    prediction: Prediction
    trace: tuple[SearchStep, ...]
    partial_variance: float
    gap: float | None
    guarantee: str
    pairs: int
    evaluated: int
    candidates: tuple[Candidate, ...]
    set_aside: tuple[Candidate, ...]
    varied: Varied | None = None
    certificate: Certificate | None = None

    @property
    def poses(self) -> tuple[Pose, Pose | tuple[Pose, ...]]:
        """Sensor and light, or lights."""
        return self.sensor, self.light

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a candidate, the best first: poses in degrees and variances; None where infinite."""
        names = ("variance", "variance_object", "variance_image")
        return [
            {"scene": self.scene.name, **poses(each.sensor, each.light)}
            | {"edges": " ".join(each.edges), "limiting": each.limiting}
            | {name: finite(getattr(each, name)) for name in names}
            for each in self.candidates
        ]

    def _line(self) -> str:
        lights = " ".join(pose.printed for pose in several(self.light))
        return f"{self.scene.name}: sensor {self.sensor.printed}, light {lights}; {self.prediction.told}"


def plan(
    scene: Scene,
    objective: Objective = DEFAULT_OBJECTIVE,
    *,
    over: Over = DEFAULT_OVER,
    model: ModelName = DEFAULT_MODEL,
    search: Search = "exhaustive",
    edges: Edges = "given",
    step_deg: float | None = None,
    constraints: Constraints | None = None,
    sensor: Any = None,
    light: Any = None,
    start: Any = (40, 41),
    shares: Shares = "best",
    refined: bool = True,
    report: Report | None = None,
    vary: tuple[Vary, ...] = (),
    hold: Hold = DEFAULT_HOLD,
) -> Plan:
    """Find the sensor and light poses of the least variance.

    Parameters
    ----------
    scene : Scene
    objective : {"object", "image"}
        Variance of the physical quantity, or of that in the image (the paper's, which rewards foreshortening).
    over : {"minimax", "sum"}
        Of several measurands the largest squared ratio of a standard deviation to its tolerance is minimised, or their
        weighted sum.
    model : {"calibrated", "paper"}
    search : {"exhaustive", "alternating"}
        All pairs, or the paper's search alone, which stops at a partial optimum.
    edges : {"given", "best"}
        The scene's required edges, or the best of all sets that measure the same (the paper's required edge list).
    step_deg : float, optional
        Grid step. By default 1 where a bound makes the exhaustive search fast (convex, diffuse, straight edges), else
        10 degrees with refinement from the three best settings.
    constraints : Constraints, optional
        By default the upper hemisphere, where the bodies of camera and light are clear of each other.
    sensor, light : Pose or pair, optional
        Hold one fixed.
    start : Pose or pair
        Where the alternating search's sensor begins.
    shares : {"best", "given"}
        Of two lights: search their shares of the sum of their intensities, or keep them; of more they stay.
    refined : bool
        Whether to descend below the grid step, to a setting that can be set up.
    vary : tuple of {"analyser", "polarisation", "band"}
        What else is to be found beside the poses (`Plan.varied`): the angle of the analyser, that of the light's
        polarisation, each or no such polariser; one of the scene's ``lamps`` and ``filters``.
    hold : {"time", "white"}
        What is equal then: exposure time, so that polarisers and filters cost their light, or the grey level of a white
        diffuse surface, so that they cost exposure time.

    Raises
    ------
    InvalidInput
        If an argument is none of its choices; `NothingMeasuresAll`, which is one, if no allowed setting measures all.

    Examples
    --------
    >>> import scenes
    >>> found = plan(scenes.load("task1"), step_deg=6)
    >>> found.prediction.status, found.gap >= 0, len(found.candidates)
    ('ok', True, 10)
    """
    aim = Aim.of(scene.quantities, objective, over)
    variance_model(model)
    for name, value, choices in (("search", search, Search), ("edges", edges, Edges), ("shares", shares, Shares)):
        check_choice(name, value, get_args(choices))
    if vary:
        check_vary(scene, vary, hold)
    report, limits = report or (lambda *_: None), (constraints or Constraints()).on_side_of(scene)
    tasks = required_edges(scene) if edges == "best" else ()
    searches = []
    for world in [scene.model_copy(update={"task": task}) for task in tasks] or [scene]:
        grid = Grid.of(world, limits, default_step(world, model) if step_deg is None else step_deg, sensor, light)
        searches.append(Searched.of(SearchProblem(world, model, aim, limits), grid, search, start, shares, report))
    best = min(searches, key=lambda each: each.variance)
    if not np.isfinite(best.variance):
        raise NothingMeasuresAll("constraints must leave a setting that can measure, got none")
    made = _finished(best, searches, refined)
    return replace(made, varied=_varied(made, best, vary, hold, report)) if vary else made


def _varied(made: Plan, best: Searched, vary: tuple[Vary, ...], hold: Hold, report: Report) -> Varied:
    """What polarisers, lamps and filters gain over a plan."""
    variation = Variation(replace(best.problem, scene=made.scene), vary, hold, best.grid.held)
    return variation.run(made.poses, tuple((each.sensor, each.light) for each in made.candidates), report)


def default_step(scene: Scene, model: str) -> float:
    """Of the grid, degrees: 1 where a bound excludes nearly all pairs, else every pair has to be evaluated."""
    return 1.0 if has_bound(scene, model) else COARSE_STEP


def _finished(best: Searched, searches: list[Searched], refined: bool) -> Plan:
    """The plan from the best search: its candidates, what can be trusted, what lies below the grid."""
    choice = candidates(searches)
    on_grid = RayTraced.of(best.problem, best.sensor, best.light)
    taken, set_aside = trusted(best.problem, on_grid, choice, on_grid.value)
    if refined and best.grid.free:
        proven = best.found is not None and has_bound(best.problem.scene, best.problem.model)
        taken = _refined(best, taken, () if set_aside or proven else choice[1:3])
    problem, taken, alone = _or_one_light(best, taken, refined)
    steady = True
    if refined and not all(best.grid.held):
        single = alone == taken.value
        taken, steady = _set_up(SettingUp(problem, best.grid.held), taken, choice)
        alone = taken.value if single else alone
    scene, prediction = problem.scene, taken.prediction
    return Plan(
        scene=scene,
        sensor=Pose(*map(float, taken.sensor)),
        light=as_poses(taken.light),
        steady=steady,
        shares=shares_of(scene) if len(scene.lights) > 1 else (),
        alone=alone,
        objective=problem.objective.unit,
        over=problem.objective.over,
        model=problem.model,
        variance=taken.value,
        limiting=prediction.limiting or prediction.measurands[0].name,
        grid_variance=on_grid.value,
        prediction=prediction,
        candidates=choice,
        set_aside=set_aside,
        **_found(best, searches),
    )


def _found(best: Searched, searches: list[Searched]) -> dict[str, Any]:
    """What a plan tells of its searches."""
    found, partial = best.found, best.partial
    return {
        "grid_sensor": Pose(*map(float, best.sensor)),
        "grid_light": as_poses(best.light),
        "trace": partial.trace if partial else (),
        "partial_variance": partial.variance if partial else float("nan"),
        "gap": partial.variance / best.variance - 1 if partial and found and not found.within_scale else None,
        "guarantee": _guarantee(best),
        "pairs": sum(each.found.pairs for each in searches if each.found),
        "evaluated": sum(each.found.evaluated for each in searches if each.found),
    }


def _refined(best: Searched, begin: RayTraced, others: tuple[Candidate, ...]) -> RayTraced:
    """The lowest end of local searches from the setting and others, unless a close look finds the setting better."""
    required, step = best.problem.scene.required, best.grid.step_deg
    starts = [(begin.sensor, begin.light, begin.value)]
    starts += [
        (np.array(list(c.sensor)), as_array(c.light), c.variance)
        for c in others
        if c.edges == required and np.isfinite(c.variance)
    ]
    ends = [refine(best.problem, pair, step, known=known) for *pair, known in starts]
    end = min(ends, key=lambda each: each.value)
    found = RayTraced.of(best.problem, end.sensor, end.lights)
    return min(begin, found, key=lambda each: each.rank)


def _set_up(setting_up: SettingUp, taken: RayTraced, others: tuple[Candidate, ...]) -> tuple[RayTraced, bool]:
    """The setting nearby that can be set up, else one of others; and whether there is any."""
    problem = setting_up.problem
    starts = [(taken.sensor, taken.light)]
    starts += [(np.array(list(c.sensor)), as_array(c.light)) for c in others if c.edges == problem.scene.required]
    for start in starts:
        for pair in islice(setting_up.offers(*start), _CLOSELY):
            found = RayTraced.of(problem, *pair)
            if found.untrusted <= taken.untrusted:
                return found, True
    return taken, False


def _or_one_light(best: Searched, taken: RayTraced, refined: bool) -> tuple[SearchProblem, RayTraced, float | None]:
    """The setting, or the best one where a single light of several has all; and what is minimised there, if known."""
    problem, alone = best.problem, best.alone
    if alone is None:
        return problem, taken, None
    single = replace(problem, scene=with_shares(problem.scene, alone.shares))
    if refined and best.grid.free:
        end = refine(single, (alone.sensor, alone.lights), best.grid.step_deg)
        alone = Mixture(end.value, alone.shares, end.sensor, end.lights)
    if alone.value < taken.value:
        taken = RayTraced.of(single, alone.sensor, alone.lights)
        return single, taken, taken.value
    return problem, taken, taken.value if max(shares_of(problem.scene)) == 1 else alone.value


def _guarantee(best: Searched) -> str:
    scene, found, step = best.problem.scene, best.found, best.grid.step_deg
    if best.grid.lights.shape[1] > 2 or len(scene.lights) > 1:
        if found is None or not applies(scene, best.problem.model):
            return "none: a partial optimum, no other place of the sensor or of one of the lights is better"
        return (
            f"no sensor and lights of the {step:g} degree grid are better, shares in tenths, by the formula of"
            " long edges; between them better ones may lie"
        )
    if found is None:
        return "none: a partial optimum, no neighbour of the sensor and none of the light is better"
    grid = f"{step:g} degree grid" + " whose levels are within the sensor's scale" * found.within_scale
    return f"no pair of the {grid} is better; between its directions a better one may lie"
