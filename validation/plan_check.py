"""Do the best settings of a plan stay the best in a picture? Each is rendered, and the picture tells its variance."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import measure
import planner
import render
from render import Quality
from scenes import InvalidInput, Picture, Pose, Scene, Setting, several, status
from validation import simulation
from validation.remeasured import GRADIENT, propagated

ESTIMATOR = GRADIENT.locator
FARTHEST = 1.25  # times the least variance that a picture told: what is dearer by the plan is not rendered unasked
_SAME = 7.5  # degrees; half of what keeps candidates apart, so at most one of them is the plan's own place


@dataclass(frozen=True)
class CheckedSetting:
    """A setting of the plan beside what its noise-free picture says.

    Attributes
    ----------
    sensor : Pose
    light : Pose or tuple of Pose
    edges : tuple of str
        Required edges.
    calibrated, propagated : float
        What the plan minimises, without and with the picture: the variance (not sigma) in the scene's unit squared or
        px^2, or what several make together; infinite where it cannot be measured.
    status : str
        The worst of the measurands in the noise-free picture, once their biases are taken off.
    without_formula : tuple of str
        Effects that were simulated there and that no formula of the planner knows.
    rank_before : int
        Place in the plan, from 1.
    rank_after : int or None
        Place by the picture: what is ``ok`` comes first, then by `minimised`; None where nothing can be measured.
    with_bias : float or None
        ``propagated`` with what the correction of each value's bias is not sure of, so that both are what a user gets;
        None where that was not looked at.
    reason : str
        What decided a status that is not ``ok``, with its number; empty where no more is known than the status says.
    """

    sensor: Pose
    light: Pose
    edges: tuple[str, ...]
    calibrated: float
    propagated: float
    status: str
    without_formula: tuple[str, ...]
    rank_before: int
    rank_after: int | None = None
    with_bias: float | None = None
    reason: str = ""

    @property
    def minimised(self) -> float:
        """What settings are compared by."""
        return self.propagated if self.with_bias is None else self.with_bias

    @property
    def ratio(self) -> float | None:
        """propagated / calibrated; None where one of them is infinite."""
        known = np.isfinite([self.propagated, self.calibrated]).all()
        return self.propagated / self.calibrated if known else None


@dataclass(frozen=True)
class PlanCheck:
    """The best settings of a plan, in the plan's order, measured.

    Attributes
    ----------
    settings : tuple of CheckedSetting
        The plan itself first.
    proposed : CheckedSetting or None
        The best by the picture; None where nothing can be measured.
    order_changed : bool or None
        Whether the pictures put the settings into another order; None where nothing can be measured.
    reason : str
        Why nothing can be measured.
    seconds : float
        What rendering and measuring took.
    left_out : int
        Settings that were not rendered, for no picture would put them first.
    """

    settings: tuple[CheckedSetting, ...]
    proposed: CheckedSetting | None
    order_changed: bool | None
    reason: str
    seconds: float
    left_out: int = 0

    @property
    def without_formula(self) -> tuple[str, ...]:
        """Effects of any of the settings that no formula of the planner knows."""
        return tuple(dict.fromkeys(name for row in self.settings for name in row.without_formula))


def check_plan(
    found: planner.Plan,
    count: int = 10,
    quality: Quality = Quality(),
    report: Callable[[str, int, int], None] = lambda *_: None,
    farthest: float = np.inf,
) -> PlanCheck:
    """Render the best settings of a plan and predict their variances from the noise-free pictures.

    As `ice validate` measures: by the estimator ``gradient``, which is not told where the light is.

    Parameters
    ----------
    found : Plan
    count : int
        How many settings at most: the plan's own, then its candidates from other places.
    quality : Quality
        Rays a pixel.
    report : callable, optional
        Called with what is done, how many are done, and of how many.
    farthest : float
        Settings are left out of which the plan says more than this times the least that an ``ok`` picture said.

    Raises
    ------
    InvalidInput
        If ``count`` is less than 1.
    """
    if count < 1:
        raise InvalidInput(f"check must be at least 1, got {count}")
    began, rows, reason = time.perf_counter(), [], ""
    settings = _best(found)[:count]
    try:
        measure.region_of_interest(found.scene, found.sensor, estimators=(ESTIMATOR,))  # measurable, before it costs
        for done, (variance, *setting) in enumerate(settings):
            if farthest < np.inf and variance > farthest * _least(rows):
                break
            report("settings", done, len(settings))
            rows.append(_checked(found, *setting, rank=done + 1, quality=quality))
        report("settings", len(settings), len(settings))
    except InvalidInput as error:
        rows, reason = [], str(error)
    checked, left = _judged(rows, reason, time.perf_counter() - began), len(settings) - len(rows)
    return replace(checked, left_out=left) if rows and left else checked


def _least(rows: list[CheckedSetting]) -> float:
    """The least that an ``ok`` picture told; infinite without one."""
    return min((row.minimised for row in rows if status.is_trusted(row.status)), default=np.inf)


def _best(found: planner.Plan) -> list[tuple[float, Pose, Pose, tuple[str, ...]]]:
    """The plan, and its candidates from other places, the best first, each with what is minimised."""
    here = found.variance, found.sensor, found.light, found.scene.required
    others = [(c.variance, c.sensor, c.light, c.edges) for c in found.candidates]
    return [here, *(other for other in others if not _same(here[1:], other[1:]))]


def _same(first: tuple, second: tuple) -> bool:
    """Whether sensors and lights stand nearly in the same place."""
    places = ((each[0], *several(each[1])) for each in (first, second))
    return all(_angle(a, b) < _SAME for a, b in zip(*places, strict=True))


def _angle(first: Pose, second: Pose) -> float:
    """Angle between two directions, degrees."""
    (p, a), (q, b) = np.radians(list(first)), np.radians(list(second))
    return float(np.degrees(np.arccos(np.clip(np.sin(p) * np.sin(q) * np.cos(a - b) + np.cos(p) * np.cos(q), -1, 1))))


def _checked(
    found: planner.Plan, sensor: Pose, light: Pose, edges: tuple[str, ...], rank: int, quality: Quality
) -> CheckedSetting:
    scene = _with_edges(found.scene, edges)
    picture = Picture.of(scene, sensor, light)
    image, measured = propagated(picture, quality)
    off = simulation.of_render(picture, GRADIENT, image, measured, simulation.How(quality))
    calibrated = planner.predict(scene, sensor, light, "calibrated").measurands
    aim = planner.Aim.of(scene.quantities, found.objective, found.over)
    in_object = found.objective == "object"
    joint = np.diag(measured.covariance if in_object else measured.covariance_image)
    doubt = off.u_bias if in_object else off.u_bias_image
    worst = status.worst(*off.status)
    m = off.status.index(worst)
    why = calibrated[m].why(worst, float(off.u_bias[m]), float(np.sqrt(measured.covariance[m, m])))
    return CheckedSetting(
        sensor=sensor,
        light=light,
        edges=edges,
        calibrated=float(aim(np.array([e.variance_object if in_object else e.variance_image for e in calibrated]))),
        propagated=float(aim(joint)),
        with_bias=float(aim(joint + doubt**2)),
        status=worst,
        reason=f"{calibrated[m].name}: {why}" if why else "",
        without_formula=without_formula(scene, sensor, light),
        rank_before=rank,
    )


def without_formula(scene: Scene, sensor: Pose, light: Pose) -> tuple[str, ...]:
    """Names of the effects that are simulated in a setting and that no formula of the planner knows.

    Examples
    --------
    >>> import scenes
    >>> without_formula(scenes.load("bracket"), Pose(45, 135), Pose(15, 0))
    ('interreflection',)
    """
    here = scene.model_copy(update={"settings": (Setting(sensor=sensor, light=light),)})
    return tuple(found.effect.name for found in render.effects(here) if found.on and not found.effect.has_formula)


def _with_edges(scene: Scene, edges: tuple[str, ...]) -> Scene:
    """The scene with the task that measures the same by other edges."""
    if edges == scene.required:
        return scene
    task = next(task for task in planner.required_edges(scene) if task.edges == edges)
    return scene.model_copy(update={"task": task})


def _judged(rows: list[CheckedSetting], reason: str, seconds: float) -> PlanCheck:
    """Places by the pictures: ``ok`` first, then what is doubtful, by variance; what cannot be measured has none."""
    order = sorted(range(len(rows)), key=lambda i: (np.isinf(rows[i].propagated), not status.is_trusted(rows[i].status),
                                                    rows[i].minimised))  # fmt: skip
    ranked = [
        replace(row, rank_after=None if np.isinf(row.propagated) else order.index(i) + 1) for i, row in enumerate(rows)
    ]
    proposed = next((row for row in ranked if row.rank_after == 1), None)
    if rows and proposed is None:
        reason = f"none of the {len(rows)} pictures can be measured ({', '.join(sorted({r.status for r in rows}))})"
    changed = None if proposed is None else order != sorted(order)
    return PlanCheck(tuple(ranked), proposed, changed, reason, seconds)
