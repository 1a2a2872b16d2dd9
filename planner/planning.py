"""Where to put sensor and light: the whole question, answered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from planner.features.measurand import required_edges
from planner.imaging.pictures import Pictures
from planner.models import DEFAULT_MODEL, ModelName, variance_model
from planner.prediction import Prediction, minimised, predict
from planner.search.aim import DEFAULT_OBJECTIVE, DEFAULT_OVER, Aim, Objective, Over
from planner.search.alternating import Partial, Step, alternate
from planner.search.candidates import Candidate, candidates, edges_of
from planner.search.choices import DEFAULT_HOLD, Hold, Vary, check_vary
from planner.search.constraints import Constraints
from planner.search.exhaustive import Found, Report, exhaustive, has_bound
from planner.search.refinement import refine
from planner.search.trusted import trusted, untrusted
from planner.search.varied import Varied
from planner.search.varying import vary_choice
from planner.search.viewing import ViewingSpace
from scenes import InvalidInput, Picture, Pose, Scene, Task

Search = Literal["exhaustive", "alternating"]
COARSE_STEP = 10.0  # degrees; where every pair has to be evaluated


@dataclass(frozen=True)
class Plan:
    """The best setting and how it was found.

    Attributes
    ----------
    scene : Scene
        The scene, its task with the required edges that the plan uses: ready to predict, render and measure.
    sensor, light : Pose
        Continuous if refined, else on the grid.
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
        exhaustive search.
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
    light: Pose
    objective: str
    over: str
    model: str
    variance: float
    limiting: str
    grid_sensor: Pose
    grid_light: Pose
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
    def poses(self) -> tuple[Pose, Pose]:
        """Sensor and light."""
        return self.sensor, self.light


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
    if vary:
        check_vary(scene, vary, hold)
    constraints = constraints or Constraints()
    sensor, light = _fixed(scene, constraints, sensor, light)
    tasks = required_edges(scene) if edges == "best" else ()
    worlds = [with_task(scene, task) for task in tasks] or [scene]
    options = [_Option.of(world, model, step_deg, constraints, sensor, light) for world in worlds]
    found = [option.search(aim, search, start, report) for option in options]
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


def with_task(scene: Scene, task: Task) -> Scene:
    """The scene with another task."""
    return scene.model_copy(update={"task": task})


def _keep(role: str, poses: np.ndarray, allowed: np.ndarray) -> None:
    """See that a pose that is held fixed is one that the constraints allow."""
    if not allowed.all():
        raise InvalidInput(f"{role} must keep the constraints, got {Pose(*map(float, poses[0]))}")


def _fixed(scene: Scene, constraints: Constraints, sensor: Any, light: Any) -> tuple[Any, Any]:
    """The poses that are held fixed, once they keep the constraints on pairs; on one mount the one says the other."""
    if constraints.same_mount:
        sensor, light = (light if sensor is None else sensor), (sensor if light is None else light)
    if sensor is not None and light is not None:
        poses = [scene.check_pose(*pair) for pair in (("sensor", sensor), ("light", light))]
        if not constraints.pairs(scene, *(np.array(list(pose)) for pose in poses)):
            raise InvalidInput(
                f"sensor and light must keep the constraints on both (mount, separation, bodies, view), got {poses[0]}"
                f" and {poses[1]}"
            )
    return sensor, light


def _check(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InvalidInput(f"{name} must be one of {', '.join(choices)}, got {value!r}")


@dataclass(frozen=True)
class _Result:
    """What searching one set of required edges gave."""

    sensor: np.ndarray
    light: np.ndarray
    variance: float
    partial: Partial | None
    found: Found | None


@dataclass(frozen=True, eq=False)
class _Option:
    """One set of required edges and where its sensor and light may stand."""

    scene: Scene
    model: str
    step_deg: float
    constraints: Constraints
    sensors: np.ndarray
    lights: np.ndarray
    free: bool

    @classmethod
    def of(cls, scene, model, step_deg, constraints, sensor, light) -> _Option:
        fast = has_bound(scene, model)
        step = (1.0 if fast else COARSE_STEP) if step_deg is None else step_deg
        sensors = ViewingSpace(step, constraints.sensor_polar_deg).poses
        lights = ViewingSpace(step, constraints.light_polar_deg).poses
        sensors, lights = sensors[constraints.sensors(scene, sensors)], lights[constraints.lights(lights)]
        if sensor is not None:
            sensors = np.array([list(scene.check_pose("sensor", sensor))])
            _keep("sensor", sensors, constraints.sensors(scene, sensors))
        if light is not None:
            lights = np.array([list(scene.check_pose("light", light))])
            _keep("light", lights, constraints.lights(lights))
        if not len(sensors) or not len(lights):
            raise InvalidInput("constraints must leave a pose for sensor and light, got none")
        return cls(scene, model, step, constraints, sensors, lights, sensor is None and light is None)

    def search(self, aim: Aim, search: str, start: Any, report: Report | None) -> _Result:
        partial = found = None
        plain = self.free and not self.constraints.coupled
        if plain:
            spaces = (_Allowed(self.step_deg, poses) for poses in (self.sensors, self.lights))
            begin, limits = np.array(list(Pose.of(start))), self.constraints
            partial = alternate(self.scene, *spaces, begin, self.model, aim, constraints=limits)
        if search == "exhaustive" or not plain:
            found = exhaustive(self.scene, self.sensors, self.lights, self.model, aim, self.constraints, report)
        best = found or partial
        return _Result(self.sensors[best.sensor], self.lights[best.light], best.variance, partial, found)


class _Allowed(ViewingSpace):
    """A viewing space of the allowed poses only."""

    def __init__(self, step_deg: float, poses: np.ndarray) -> None:
        super().__init__(step_deg)
        self.__dict__["poses"] = poses


def _finish(options: list[_Option], results: list[_Result], best: int, aim: Aim, refined: bool) -> Plan:
    option, result = options[best], results[best]
    scene, found, partial = option.scene, result.found, result.partial
    sensor, light, variance = result.sensor, result.light, result.variance
    choice, how = candidates(options, results, aim), (option.model, aim)
    on_grid = variance if scene.solid.is_convex else _closely(scene, sensor, light, *how)
    chosen = trusted(scene, (sensor, light), on_grid, choice, option.model)
    if chosen.set_aside:
        sensor, light = chosen.sensor, chosen.light
    if refined and option.free:
        starts = [(sensor, light)]
        if not chosen.set_aside and (found is None or not has_bound(scene, option.model)):
            others = [c for c in choice[1:3] if c.edges == edges_of(scene)]
            starts += [(np.array(list(c.sensor)), np.array(list(c.light))) for c in others]
        limits = option.step_deg, option.constraints
        descents = [refine(scene, *at, *how, *limits, sizes=(0.7,)) for at in starts]
        sensor, light, _ = min(descents, key=lambda descent: descent[2])
        sensor, light, variance = refine(scene, sensor, light, *how, *limits, sizes=(0.1,))
        if untrusted(scene, sensor, light, option.model) > chosen.untrusted:
            sensor, light, variance = chosen.sensor, chosen.light, on_grid
    if not scene.solid.is_convex or chosen.set_aside:  # the search glances; what is told is from a close look
        variance = _closely(scene, sensor, light, *how)
    prediction = predict(scene, tuple(map(float, sensor)), tuple(map(float, light)), option.model)
    return Plan(
        scene=scene,
        sensor=Pose(*map(float, sensor)),
        light=Pose(*map(float, light)),
        objective=aim.unit,
        over=aim.over,
        model=option.model,
        variance=float(variance),
        limiting=prediction.limiting or prediction.measurands[0].name,
        grid_sensor=Pose(*map(float, result.sensor)),
        grid_light=Pose(*map(float, result.light)),
        grid_variance=float(on_grid),
        prediction=prediction,
        trace=partial.trace if partial else (),
        partial_variance=float(partial.variance) if partial else float("nan"),
        gap=partial.variance / result.variance - 1 if partial and found else None,
        guarantee=_guarantee(option, found),
        pairs=sum(r.found.pairs for r in results if r.found),
        evaluated=sum(r.found.evaluated for r in results if r.found),
        candidates=choice,
        set_aside=chosen.set_aside,
    )  # fmt: skip


def _closely(scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str, aim: Aim) -> float:
    """What is minimised, of one picture looked at closely."""
    picture = Picture.of(scene, tuple(map(float, sensor)), tuple(map(float, light)))
    return float(minimised(variance_model(model)(Pictures.of(picture)), aim))


def _guarantee(option: _Option, found: Found | None) -> str:
    if found is None:
        return "none: a partial optimum, no neighbour of the sensor and none of the light is better"
    return f"no pair of the {option.step_deg:g} degree grid is better; between its directions a better one may lie"
