"""What U a station of a catalogue's parts reaches, as a search sees it: at a glance, from a few places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.budgeting.plans import systematic
from planner.budgeting.sources import sources
from planner.budgeting.terms import unbiased
from planner.constraints import Constraints
from planner.designing.aspects import Aspect, aspects
from planner.designing.optics import Focused, Settings, chosen, focused
from planner.designing.stations import station
from planner.designing.wishes import Wishes, allowed
from planner.prediction import glanced
from planner.search.grid import ViewingSpace, as_poses, by_light
from planner.search.objective import cut_off
from scenes import Picture, Pose, Scene
from scenes.catalogue import ListedLens, ListedLight, ListedSensor
from scenes.units import in_unit

STEP_DEG = 20.0  # between places of a free light
_APART_DEG = 10.0  # between it and the camera, one of which may stand behind the other
OWN_LIGHT = ListedLight(name="the scene's own light")
_IDEAL = ListedLight(name="a point bright enough", kind="spot", outer_diameter_mm=1.0, radiance=1e15)


@dataclass(frozen=True, eq=False)
class Problem:
    """A scene's requirements and what is wished of a station that meets them.

    Attributes
    ----------
    scene : Scene
    wishes : Wishes
    allowed : ndarray, shape (M,)
        Largest U of each quantity.
    aspects : tuple of Aspect
        From where it may be looked at.
    lights : ndarray, shape (L, 2) or (L, 2 F)
        Where a free light, or several, may stand, degrees.
    otherwise_um : float
        Blur of a lens without an MTF; NaN where it is not known.
    default_mm : float
        Distance of a light that is made for none.
    """

    scene: Scene
    wishes: Wishes
    allowed: np.ndarray
    aspects: tuple[Aspect, ...]
    lights: np.ndarray
    otherwise_um: float
    default_mm: float

    @classmethod
    def of(cls, scene: Scene, wishes: Wishes, poses: tuple[Pose, ...] = (), step_deg: float = STEP_DEG) -> Problem:
        """From the scene as it is; its own camera's blur stands for lenses without an MTF.

        Raises
        ------
        InvalidInput
            As of `allowed`.
        """
        limits = Constraints().on_side_of(scene)
        space = ViewingSpace(step_deg, limits.light_polar_deg).poses
        if len(scene.free) > 1:  # only the scene's own lights can be several: they stand where its settings say
            space = np.array([np.ravel([list(pose) for pose in each.lights]) for each in scene.settings])
        lights = [light.distance for light in scene.lights if not light.faces_sensor]
        default = in_unit(lights[0] if lights else scene.camera.distance, scene.units, "mm")
        return cls(
            scene, wishes, allowed(scene, wishes), aspects(scene, poses), space, _own_blur(scene, wishes), default
        )


def _own_blur(scene: Scene, wishes: Wishes) -> float:
    if wishes.lens_blur_um is not None:
        return wishes.lens_blur_um
    pitch = scene.camera.pixel_pitch_um
    return math.nan if pitch is None else scene.camera.blur_px * pitch


@dataclass(frozen=True, eq=False)
class Viewed:
    """A pair of sensor and lens before a part: what places in the image leave unsure.

    Attributes
    ----------
    aspect : Aspect
    focused : Focused
    systematic : ndarray, shape (M,)
        Variances, the scene's unit squared or degrees^2; infinite where a quantity is not seen.
    """

    aspect: Aspect
    focused: Focused
    systematic: np.ndarray


@dataclass(frozen=True, eq=False)
class Rated:
    """A station and its U, as a search sees it.

    Attributes
    ----------
    settings : Settings
    sensor : Pose
    light : Pose or tuple of Pose
    U : ndarray, shape (M,)
        The scene's unit, or degrees.
    ratio : float
        Largest U over what is allowed; 1 or less meets the requirements.
    worst : int
        Of which quantity.
    """

    settings: Settings
    sensor: Pose
    light: Pose | tuple[Pose, ...]
    U: np.ndarray
    ratio: float
    worst: int

    @property
    def names(self) -> tuple[str, str, str]:
        """Of camera, lens and light."""
        return self.settings.sensor.name, self.settings.lens.name, self.settings.light.name


def views(
    problem: Problem, sensor: ListedSensor, lens: ListedLens, *, of_rims: bool = True
) -> tuple[Viewed, ...] | str:
    """From where a pair sees all that is measured, the least unsure place first; or what keeps it from that.

    Without rims what is unsure is that of straight edges alone, half as dear: 0 of what depends on circles, and so a
    lower bound.
    """
    found, why = [], []
    for aspect in _nearest_turns(problem, sensor, lens):
        at = focused(sensor, lens, aspect, problem.wishes)
        if isinstance(at, str):
            why.append(at)
            continue
        settings = _set(problem, sensor, lens, _IDEAL, aspect, at)
        if isinstance(settings, str):
            why.append(settings)
            continue
        scene = station(problem.scene, settings)
        moved = systematic(scene, np.array(list(aspect.pose)), sources(scene), closely=False, of_rims=of_rims)
        found.append(Viewed(aspect, at, np.where(np.isfinite(moved), moved, np.inf if of_rims else 0.0)))
    if not found:
        return why[-1]
    return tuple(sorted(found, key=lambda each: floor(problem, each)))


def floor(problem: Problem, view: Viewed) -> float:
    """U over what is allowed that no light makes less."""
    return float(limit_ratio(problem, view.systematic).max())


def _nearest_turns(problem: Problem, sensor: ListedSensor, lens: ListedLens) -> tuple[Aspect, ...]:
    """Of each place, the turn of the camera from which a sensor sees most: the first of those that see as much."""
    half, best = np.array(sensor.size_mm) / 2, {}
    for aspect in problem.aspects:
        widest = float((aspect.aside.max(1) / half).max())
        if aspect.pose not in best or widest < best[aspect.pose][0] * (1 - 1e-9):
            best[aspect.pose] = widest, aspect
    return tuple(aspect for _, aspect in best.values())


def limit_ratio(problem: Problem, variances: np.ndarray) -> np.ndarray:
    """U over what is allowed, of variances (..., M)."""
    return problem.wishes.coverage * np.sqrt(variances) / problem.allowed


def rate(problem: Problem, sensor: ListedSensor, lens: ListedLens, light: ListedLight) -> Rated | str:
    """The best of the places of camera and light for three parts; or what keeps them from measuring."""
    seen = views(problem, sensor, lens)
    return seen if isinstance(seen, str) else rate_light(problem, sensor, lens, light, seen)


def rate_light(
    problem: Problem, sensor: ListedSensor, lens: ListedLens, light: ListedLight, seen: tuple[Viewed, ...]
) -> Rated | str:
    """The same with the views of the pair."""
    best, why = None, "visibility"
    for view in seen:
        if best is not None and floor(problem, view) >= best.ratio:
            break  # they come by what their places leave unsure
        settings = _set(problem, sensor, lens, light, view.aspect, view.focused)
        if isinstance(settings, str):
            why = settings
            continue
        found = _best_light(problem, settings, view)
        if found is not None and (best is None or found.ratio < best.ratio):
            best = found
    return why if best is None else best


def _set(
    problem: Problem, sensor: ListedSensor, lens: ListedLens, light: ListedLight, aspect: Aspect, at: Focused
) -> Settings | str:
    scale = problem.scene.locator.scale_px
    return chosen(sensor, lens, light, aspect, problem.wishes, scale, problem.otherwise_um, problem.default_mm, at)


def _best_light(problem: Problem, settings: Settings, view: Viewed) -> Rated | None:
    """Where a light stands best; None where nothing can be measured by it."""
    scene, sensor = station(problem.scene, settings), np.array(list(view.aspect.pose))
    lights = problem.lights if scene.free else np.zeros((1, 0))
    if scene.free and lights.shape[1] != 2 * len(scene.free):
        return None
    errors = variance_model("calibrated")(Pictures.of(scene, sensor[None], by_light(lights) if scene.free else ()))
    limits = Constraints(light_out_of_view=True, min_separation_deg=_APART_DEG)
    possible = limits.pairs(scene, sensor, lights) & ~cut_off(errors)
    noise = np.broadcast_to(errors.variances_object, (len(lights), len(problem.allowed)))
    ratios = np.where(possible, limit_ratio(problem, noise + view.systematic).max(-1), np.inf)
    i = int(ratios.argmin())
    if not np.isfinite(ratios[i]):
        return None
    light = as_poses(lights[i]) if scene.free else ()
    U = problem.wishes.coverage * np.sqrt(_beside(scene, view.aspect.pose, light, noise[i]) + view.systematic)
    worst = int((U / problem.allowed).argmax())
    return Rated(settings, view.aspect.pose, light, U, float(U[worst] / problem.allowed[worst]), worst)


def _beside(scene: Scene, sensor: Pose, light: Any, noise: np.ndarray) -> np.ndarray:
    """Variances by noise, fixed pattern, rounding and temperature, (M,)."""
    rows = unbiased(glanced(Picture.of(scene, sensor, light)), noise)
    return np.array([sum((each.sensitivity * each.told.u) ** 2 for each in some) for some in rows])
