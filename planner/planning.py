"""Where to put sensor and light: the whole question, answered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from imaging.features.measurand import required_edges
from imaging.models import DEFAULT_MODEL, ModelName, variance_model
from imaging.pictures import Pictures
from planner.prediction import Prediction, minimised, predict
from planner.search.candidates import Candidate, candidates, trusted, untrusted
from planner.search.constraints import Constraints
from planner.search.design import DEFAULT_HOLD, Hold, Varied, Vary, check_vary
from planner.search.exhaustive import Found, Report, has_bound
from planner.search.grid import as_array, as_poses
from planner.search.lights import Alone, applies, shares_of, with_shares
from planner.search.local import Step, refine
from planner.search.objective import DEFAULT_OBJECTIVE, DEFAULT_OVER, Aim, Objective, Over
from planner.search.option import Option, Result, held, with_task
from planner.search.varying import vary_choice
from scenes import InvalidInput, Picture, Pose, Scene, several
from scenes.results import Shown, finite, poses

Search = Literal["exhaustive", "alternating"]
Shares = Literal["best", "given"]


def _rounded(pose: Pose) -> str:
    return f"({pose.polar_deg:.1f}, {pose.azimuth_deg:.1f})"


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """The best setting and how it was found.

    Attributes
    ----------
    scene : Scene
        The scene, its task with the required edges that the plan uses: ready to predict, render and measure.
    sensor : Pose
    light : Pose or tuple of Pose
        Of the light that is free, or of all that are. Continuous if refined, else on the grid.
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
    trace : tuple of Step
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
    """

    scene: Scene
    sensor: Pose
    light: Pose | tuple[Pose, ...]
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
    trace: tuple[Step, ...]
    partial_variance: float
    gap: float | None
    guarantee: str
    pairs: int
    evaluated: int
    candidates: tuple[Candidate, ...]
    set_aside: tuple[Candidate, ...]
    varied: Varied | None = None

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
        lights = " ".join(map(_rounded, several(self.light)))
        return f"{self.scene.name}: sensor {_rounded(self.sensor)}, light {lights}; {self.prediction.told}"


def plan(
    scene: Scene,
    objective: Objective = DEFAULT_OBJECTIVE,
    *,
    over: Over = DEFAULT_OVER,
    model: ModelName = DEFAULT_MODEL,
    search: Search = "exhaustive",
    edges: Literal["given", "best"] = "given",
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
        Whether to descend below the grid step.
    vary : tuple of {"analyser", "polarisation", "band"}
        What else is to be found beside the poses (`Plan.varied`): the angle of the analyser, that of the light's
        polarisation, each or no such polariser; one of the scene's ``lamps`` and ``filters``.
    hold : {"time", "white"}
        What is equal then: exposure time, so that polarisers and filters cost their light, or the grey level of a white
        diffuse surface, so that they cost exposure time.

    Raises
    ------
    InvalidInput
        If an argument is none of its choices, or no allowed setting can measure.

    Examples
    --------
    >>> import scenes
    >>> found = plan(scenes.load("task1"), step_deg=6)
    >>> found.prediction.status, found.gap >= 0, len(found.candidates)
    ('ok', True, 10)
    """
    aim = Aim.of(scene.quantities, objective, over)
    variance_model(model)
    _check("search", search, get_args(Search))
    _check("edges", edges, ("given", "best"))
    _check("shares", shares, get_args(Shares))
    if vary:
        check_vary(scene, vary, hold)
    constraints = constraints or Constraints()
    sensor, light = held(scene, constraints, sensor, light)
    tasks = required_edges(scene) if edges == "best" else ()
    worlds = [with_task(scene, task) for task in tasks] or [scene]
    options = [Option.of(world, model, step_deg, constraints, sensor, light) for world in worlds]
    found = [option.search(aim, search, start, report, shares == "best") for option in options]
    options = [option.with_lights(result.shared) for option, result in zip(options, found, strict=True)]
    best = min(range(len(found)), key=lambda k: found[k].variance)
    if not np.isfinite(found[best].variance):
        raise InvalidInput("constraints must leave a setting that can measure, got none")
    made = _finish(options, found, best, aim, refined)
    if not vary:
        return made
    others = tuple((c.sensor, c.light) for c in made.candidates)
    varied = vary_choice(
        made.scene, made.poses, others, vary, hold=hold, model=model, aim=aim, constraints=constraints,
        held=(sensor is not None, light is not None), report=report,
    )  # fmt: skip
    return replace(made, varied=varied)


def _check(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InvalidInput(f"{name} must be one of {', '.join(choices)}, got {value!r}")


def _finish(options: list[Option], results: list[Result], best: int, aim: Aim, refined: bool) -> Plan:
    option, result = options[best], results[best]
    scene, found, partial = option.scene, result.found, result.partial
    sensor, light, variance = result.sensor, result.light, result.variance
    choice, how = candidates(options, results, aim), (option.model, aim)
    on_grid = variance if scene.solid.is_convex else _closely(scene, sensor, light, *how)
    chosen = trusted(scene, (sensor, light), on_grid, choice, option.model)
    if chosen.set_aside:
        sensor, light = chosen.sensor, chosen.light
    if refined and option.free:
        starts = [(sensor, light, _closely(scene, sensor, light, *how) if chosen.set_aside else result.variance)]
        if not chosen.set_aside and (found is None or not has_bound(scene, option.model)):
            others = [c for c in choice[1:3] if c.edges == scene.required and np.isfinite(c.variance)]
            starts += [(np.array(list(c.sensor)), as_array(c.light), c.variance) for c in others]
        limits = option.step_deg, option.constraints
        descents = [refine(scene, *at, *how, *limits, sizes=(0.7,), known=known) for *at, known in starts]
        sensor, light, known = min(descents, key=lambda descent: descent[2])
        sensor, light, variance = refine(scene, sensor, light, *how, *limits, sizes=(0.1,), known=known)
        if untrusted(scene, sensor, light, option.model) > chosen.untrusted:
            sensor, light, variance = chosen.sensor, chosen.light, on_grid
    if not scene.solid.is_convex or chosen.set_aside:  # the search glances; what is told is from a close look
        variance = _closely(scene, sensor, light, *how)
    alone = _alone(option, result, aim, refined)
    if alone is not None and alone.value < variance:
        scene, sensor, light, variance = with_shares(scene, alone.shares), alone.sensor, alone.lights, alone.value
    elif alone is not None and max(shares_of(scene)) == 1:
        alone = alone._replace(value=variance)  # the plan is one light alone
    prediction = predict(scene, tuple(map(float, sensor)), as_poses(light), option.model)
    return Plan(
        scene=scene,
        sensor=Pose(*map(float, sensor)),
        light=as_poses(light),
        shares=shares_of(scene) if len(scene.lights) > 1 else (),
        alone=alone and alone.value,
        objective=aim.unit,
        over=aim.over,
        model=option.model,
        variance=float(variance),
        limiting=prediction.limiting or prediction.measurands[0].name,
        grid_sensor=Pose(*map(float, result.sensor)),
        grid_light=as_poses(result.light),
        grid_variance=float(on_grid),
        prediction=prediction,
        trace=partial.trace if partial else (),
        partial_variance=float(partial.variance) if partial else float("nan"),
        gap=partial.variance / result.variance - 1 if partial and found and not found.within_scale else None,
        guarantee=_guarantee(option, found),
        pairs=sum(r.found.pairs for r in results if r.found),
        evaluated=sum(r.found.evaluated for r in results if r.found),
        candidates=choice,
        set_aside=chosen.set_aside,
    )  # fmt: skip


def _alone(option: Option, result: Result, aim: Aim, refined: bool) -> Alone | None:
    """The best setting where one of several lights has all; None where that is not known."""
    best = result.shared and result.shared.alone
    if best is None or not refined:
        return best
    scene = with_shares(option.scene, best.shares)
    how = option.model, aim, option.step_deg, option.constraints
    sensor, lights, value = refine(scene, best.sensor, best.lights, *how, sizes=(0.7, 0.1))
    return Alone(value, best.shares, sensor, lights)


def _closely(scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str, aim: Aim) -> float:
    """What is minimised, of one picture looked at closely."""
    picture = Picture.of(scene, tuple(map(float, sensor)), as_poses(light))
    return float(minimised(variance_model(model)(Pictures.of(picture)), aim))


def _guarantee(option: Option, found: Found | None) -> str:
    if option.lights.shape[1] > 2 or len(option.scene.lights) > 1:
        return _of_lights(option, found)
    if found is None:
        return "none: a partial optimum, no neighbour of the sensor and none of the light is better"
    grid = f"{option.step_deg:g} degree grid" + " whose levels are within the sensor's scale" * found.within_scale
    return f"no pair of the {grid} is better; between its directions a better one may lie"


def _of_lights(option: Option, found: Found | None) -> str:
    """What is known where there are several lights."""
    if not applies(option.scene, option.model) or found is None:
        return "none: a partial optimum, no other place of the sensor or of one of the lights is better"
    return (
        f"no sensor and lights of the {option.step_deg:g} degree grid are better, shares in tenths, by the formula of"
        " long edges; between them better ones may lie"
    )
