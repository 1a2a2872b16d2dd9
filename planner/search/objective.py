"""What a plan minimises: one variance, or those of several quantities over their tolerances."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from typing import Literal, get_args

import numpy as np

from scenes import InvalidInput, Quantity
from scenes.errors import given

Objective = Literal["object", "image"]
Over = Literal["minimax", "sum"]
DEFAULT_OBJECTIVE: Objective = "object"
DEFAULT_OVER: Over = "minimax"


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
        _check("objective", objective, get_args(Objective))
        _check("over", over, get_args(Over))
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


def _check(name: str, value: str, choices: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in choices:
        raise InvalidInput(f"{name} must be one of {', '.join(choices)}, got {given(value)}")
