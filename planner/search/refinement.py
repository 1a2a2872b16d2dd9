"""Below the grid: a continuous descent in the four angles of sensor and light."""

from __future__ import annotations

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import minimised
from planner.search.constraints import Constraints
from planner.search.exhaustive import cut_off
from planner.search.poses import by_light
from scenes import InvalidInput, Scene


def refine(
    scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str, objective: str, step_deg: float,
    constraints: Constraints | None = None, value=None, sizes: tuple[float, ...] = (0.7, 0.1),
    known: float = np.inf,
) -> tuple[np.ndarray, np.ndarray, float]:  # fmt: skip
    """Nelder-Mead from poses of a sensor and of all free lights.

    In tangent planes of the sphere, so that the poles are places like others.

    Parameters
    ----------
    sensor : ndarray, shape (2,)
    light : ndarray, shape (2 F,)
        Where to begin, degrees.
    step_deg : float
        What the sizes are parts of.
    value : callable, optional
        (sensor, light) to what is minimised; the variance when not given.
    sizes : tuple of float
        Of the simplices, one after the other: a fresh one, for the one before may have collapsed at a border.
    known : float
        What a search found at the beginning; it stands where rounding tells the other way whether a plane that is
        seen edge-on is seen, or a border kept.

    Returns
    -------
    sensor : ndarray, shape (2,)
    light : ndarray, shape (2 F,)
    variance : float
        Not more than at the beginning.

    Raises
    ------
    InvalidInput
        If the beginning is not allowed, or nothing can be measured there.
    """
    constraints = constraints or Constraints()
    if value is None:
        value = _variance(scene, sensor, light, model, objective)

    begin = np.concatenate([sensor, light]).reshape(-1, 2)

    def moved(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        places = [shifted(pose, step_deg * by) for pose, by in zip(begin, x.reshape(-1, 2), strict=True)]
        if constraints.same_mount:
            places[1:] = [places[0]] * (len(places) - 1)
        return places[0], np.concatenate([np.zeros(0), *places[1:]])

    def cost(x: np.ndarray) -> float:
        s, k = moved(x)
        return value(s, k) if constraints.allows(scene, s, k) else np.inf

    unit = cost(np.zeros(begin.size))
    unit = unit if np.isfinite(unit) else known
    if not np.isfinite(unit):
        raise InvalidInput(f"refinement must begin at a pose that is allowed and measurable, got {sensor}, {light}")
    from scipy.optimize import minimize  # slow to load, and rarely needed

    x, least = np.zeros(begin.size), 1.0
    for size in sizes:
        found = minimize(
            lambda x: min(cost(x) / unit, np.finfo(float).max) if x.any() else 1.0, x, method="Nelder-Mead",
            options={"initial_simplex": x + size * np.vstack([np.zeros(x.size), np.eye(x.size)]), "xatol": 1e-3,
                     "fatol": 1e-7, "maxfev": 250 if x.size <= 4 else 400},
        )  # fmt: skip
        if found.fun < least:
            x, least = found.x, found.fun
    return *moved(x), float(least * unit)


def _variance(scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str, objective: str):
    """The variance of one setting; infinite where levels are cut off, unless they are at the beginning."""

    def told(s: np.ndarray, k: np.ndarray) -> tuple[float, bool]:
        errors = variance_model(model)(Pictures.of(scene, s[None], by_light(k[None])))
        return float(minimised(errors, objective)[0]), bool(cut_off(errors, scene)[0])

    anyway = told(sensor, light)[1]

    def value(s: np.ndarray, k: np.ndarray) -> float:
        found, cut = told(s, k)
        return np.inf if cut and not anyway else found

    return value


def shifted(pose: np.ndarray, by_deg: np.ndarray) -> np.ndarray:
    """The pose moved on its sphere by two perpendicular angles (degrees)."""
    centre = direction(pose)
    helper = np.eye(3)[np.argmin(np.abs(centre))]
    one = np.cross(centre, helper)
    one /= np.linalg.norm(one)
    x, y, z = centre + np.tan(np.radians(by_deg[0])) * one + np.tan(np.radians(by_deg[1])) * np.cross(centre, one)
    return np.array([np.degrees(np.arctan2(np.hypot(x, y), z)), np.degrees(np.arctan2(y, x)) % 360])
