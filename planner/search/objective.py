"""What a plan minimises, and over which settings: an objective, its constraints, its evaluation.

Fast evaluation takes microseconds a picture; the ray-traced one (`planner.predict`) also knows the light between faces,
places along circles, and bias.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Literal, get_args

import numpy as np

from imaging.models import variance_model
from imaging.models.errors import Errors
from imaging.pictures import Pictures
from planner.constraints import UNCONSTRAINED, Constraints
from planner.search.grid import by_light
from scenes import InvalidInput, Quantity, Scene
from scenes.errors import given

Objective = Literal["object", "image"]
Over = Literal["minimax", "sum"]
DEFAULT_OBJECTIVE: Objective = "object"
DEFAULT_OVER: Over = "minimax"
_PAIRS = 8192  # evaluated at a time, and ...
_TABLE = 20_000  # ... of a table of all sensors and lights

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Aim:
    """One number from the variances of M quantities.

    Of a single quantity it is its variance. Of several it is the largest, or the weighted sum, of the squared ratios of
    their standard deviations to their tolerances (half of each zone).

    Attributes
    ----------
    unit : {"object", "image"}
        Which variances count: those in the object or those in the image.
    over : {"minimax", "sum"}
    shares : ndarray, shape (M,)
        What each variance is multiplied with.
    """

    unit: Objective
    over: Over
    shares: np.ndarray

    @classmethod
    def of(cls, quantities: tuple[Quantity, ...], objective: str | Aim, over: str = DEFAULT_OVER) -> Aim:
        """What a scene's quantities make of an objective.

        Raises
        ------
        InvalidInput
            If there is no such objective; if there are several quantities and one has no tolerance, or their variances
            in the image are asked for, with which no tolerance compares.
        """
        if isinstance(objective, Aim):
            return objective
        check_choice("objective", objective, get_args(Objective))
        check_choice("over", over, get_args(Over))
        if len(quantities) == 1:
            return cls(objective, over, np.ones(1))
        if objective == "image":
            raise InvalidInput(f"objective must be object for {len(quantities)} measurands, got 'image'")
        for quantity in quantities:
            if quantity.tolerance is None:
                raise InvalidInput(
                    f"tolerance must be given for each of {len(quantities)} measurands that are planned together, got "
                    f"none for {quantity.name}"
                )
        weights = np.array([1.0 if over == "minimax" else quantity.weight for quantity in quantities])
        return cls(objective, over, weights / np.array([quantity.tolerance.half for quantity in quantities]) ** 2)

    def joined(self, parts: Iterable[np.ndarray]) -> np.ndarray:
        """One array from those of the quantities, already multiplied with their shares."""
        return reduce(np.maximum if self.over == "minimax" else np.add, parts)

    def __call__(self, variances: np.ndarray) -> np.ndarray:
        """What is minimised, from variances (..., M)."""
        parts = variances * self.shares
        return parts.max(-1) if self.over == "minimax" else parts.sum(-1)


@dataclass(frozen=True, eq=False)
class SearchProblem:
    """An objective over the poses of a scene's sensor and free lights.

    Attributes
    ----------
    scene : Scene
    model : {"calibrated", "paper", "bound"}
    objective : Aim
        What is minimised.
    constraints : Constraints
        Which settings are feasible.
    """

    scene: Scene
    model: str
    objective: Aim
    constraints: Constraints = UNCONSTRAINED

    @classmethod
    def of(cls, scene: Scene, model: str, objective: str | Aim, limits: Constraints | None = None) -> SearchProblem:
        """With the objective that the scene's quantities make of a word; without limits every pose is feasible."""
        return cls(scene, model, Aim.of(scene.quantities, objective), limits or UNCONSTRAINED)

    def errors(self, sensors: np.ndarray, lights: np.ndarray) -> Errors:
        """Fast evaluation of sensors (..., 2) and free lights (..., 2 F), broadcast; ray-traced of a single pair."""
        return variance_model(self.model)(Pictures.of(self.scene, sensors, by_light(lights)))

    def values(self, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """What is minimised of pairs (n, 2) and (n, 2 F), feasible or not, shape (n,)."""
        found = np.empty(len(sensors))
        for at in range(0, len(sensors), _PAIRS):
            part = slice(at, at + _PAIRS)
            found[part] = minimised(self.errors(sensors[part], lights[part]), self.objective)
        return found

    def feasible(self, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Which pairs, broadcast, keep the constraints on sensor and lights together; bool."""
        return self.constraints.pairs(self.scene, sensors, lights) if self.constraints.on_pairs else np.array(True)

    def feasible_values(self, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """`values`, infinite where not `feasible`."""
        return np.where(self.feasible(sensors, lights), self.values(sensors, lights), np.inf)

    def table(
        self, sensors: np.ndarray, lights: np.ndarray, report: Report
    ) -> Iterator[tuple[slice, Errors, np.ndarray]]:
        """Fast evaluation of all pairs of sensors (S, 2) and lights (L, 2 F), some sensors at a time.

        Yields which sensors, errors of shape (s, L, ...), and whether a pair is feasible.
        """
        size = max(1, _TABLE // max(len(lights), 1))
        for at in range(0, len(sensors), size):
            part = slice(at, at + size)
            both = sensors[part, None], lights[None]
            yield part, self.errors(*both), self.feasible(*both)
            report("evaluating pairs", min(at + size, len(sensors)), len(sensors))

    def cuts_off(self, sensor: np.ndarray, light: np.ndarray) -> bool:
        """Whether the end of the scale cuts off levels of an edge, sensor (2,) and free lights (2 F,)."""
        return bool(cut_off(self.errors(sensor[None], light[None]))[0])

    def values_from(self, sensor: np.ndarray, light: np.ndarray) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """What a local search from a setting minimises, of sensors (n, 2) and lights (n, 2 F): infinite where these do
        not keep the constraints, or where levels are cut off.

        The latter only if they are not cut off where it begins.
        """
        anyway = self.cuts_off(sensor, light)

        def values(s: np.ndarray, k: np.ndarray) -> np.ndarray:
            found, allowed = np.full(len(s), np.inf), self.constraints.allowed(self.scene, s, k)
            if allowed.any():
                errors = self.errors(s[allowed], k[allowed])
                cut = cut_off(errors) & ~anyway
                found[allowed] = np.where(cut, np.inf, minimised(errors, self.objective))
            return found

        return values

    def where_feasible(
        self, value: Callable[[np.ndarray, np.ndarray], float]
    ) -> Callable[[np.ndarray, np.ndarray], float]:
        """A function of sensor (2,) and free lights (2 F,), infinite where these do not keep the constraints."""
        return lambda s, k: value(s, k) if self.constraints.allows(self.scene, s, k) else np.inf


def minimised(errors: Errors, objective: str | Aim) -> np.ndarray:
    """The variance that an objective is about (degrees^2 for an angle), or what an aim makes of several.

    In the object what is not known of the part's place adds to the noise, unless it is known.
    """
    aim = Aim.of(errors.measurands.quantities, objective)
    return aim(errors.variances if aim.unit == "image" else errors.variances_object + errors.placed)


def cut_off(errors: Errors) -> np.ndarray:
    """In which pictures (...) the end of the scale has cut off levels of an edge.

    What is cut off scatters less, so that a plain minimum is led to where every measurement is biased.
    """
    return errors.cut_off.any(-1)


def check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    """See that an option is one of its choices."""
    if not isinstance(value, str) or value not in choices:
        raise InvalidInput(f"{name} must be one of {', '.join(choices)}, got {given(value)}")
