"""How precisely each quantity of a scene will be measured in one picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.models.errors import Errors
from planner.ranks import quantity_ranks
from planner.reasons import reason
from scenes import Scene, Tolerance
from scenes.results import finite, picked, value
from scenes.status import CLUTTER, WORST_FIRST, unsure


@dataclass(frozen=True)
class Forecast:
    """What is predicted of one quantity.

    Attributes
    ----------
    name, kind : str
    unit : str
        Of the values in the object: the scene's unit, or "degrees". In the image they are px, or degrees.
    value_image, value_object : float
        The quantity itself, as the model projects it and in the object.
    variance_image, variance_object : float
        Variance (not sigma); infinite, with the reason in `status`, where it cannot be measured.
    bias_image, bias_object : float
        What the classic locators (``gradient``; ``canny`` nearly) find without noise, less the value; NaN where it is
        not known. Circles count as unbiased.
    nominal : float
        The scene's, or the object's own.
    tolerance : Tolerance or None
    status : str
        As of `Prediction`, from the edges and circles that the quantity needs.
    texture_variance_image, texture_variance_object : float or None
        Variance over parts by statistical textures, which does not average over pictures of one part; NaN where it is
        not known, None where there are no textures. The bias is that of the part that the seeds roll.
    """

    name: str
    kind: str
    unit: str
    value_image: float
    value_object: float
    variance_image: float
    variance_object: float
    bias_image: float
    bias_object: float
    nominal: float
    tolerance: Tolerance | None
    status: str
    texture_variance_image: float | None = None
    texture_variance_object: float | None = None
    reason: str = ""

    @property
    def ratio(self) -> float | None:
        """Standard deviation over half of the tolerance zone; None without a tolerance."""
        return None if self.tolerance is None else float(np.sqrt(self.variance_object)) / self.tolerance.half

    @property
    def told(self) -> str:
        """The quantity in one line: name, value +- one sigma, status."""
        return f"{self.name} {value(self.value_object, np.sqrt(self.variance_object), self.unit)}, {self.status}"

    def why(self, status: str, u_bias: float | None = None, sigma: float | None = None) -> str:
        """What decided a status that may be another than predicted, with its number; empty where that is not known.

        ``u_bias``, ``sigma``: standard uncertainties, in the object, of a bias that was taken off and by noise.
        """
        if status == CLUTTER and u_bias is not None:
            half = 0.0 if self.tolerance is None else self.tolerance.half
            return unsure(u_bias, np.sqrt(self.variance_object) if sigma is None else sigma, half, self.unit)
        return self.reason if status == self.status else ""

    def as_row(self) -> dict[str, Any]:
        """A record: value, standard deviations (not variances) in object and image; None where not known."""
        zone = self.tolerance
        return {
            **picked(self, "name", "kind", "unit"),
            "value": self.value_object,
            "sigma": finite(np.sqrt(self.variance_object)),
            "sigma_image": finite(np.sqrt(self.variance_image)),
            "bias": finite(self.bias_object),
            "nominal": self.nominal,
            "plus": zone and zone.plus,
            "minus": zone and zone.minus,
            "ratio": finite(self.ratio),
            "status": self.status,
        }


def forecasts(
    scene: Scene,
    evaluated: Errors,
    clutter: np.ndarray,
    biases: tuple[np.ndarray, np.ndarray],
    textures: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[Forecast, ...]:
    """One for each quantity of one picture, from the errors, the cluttered edges (E,), and biases in image and object.

    ``textures`` are the variances (M,) over parts in image and object; None without textures.
    """
    known = evaluated.measurands
    ranks = quantity_ranks(evaluated, clutter)
    found = []
    for m, quantity in enumerate(known.quantities):
        nominal = known.value_object[m] if quantity.nominal is None else quantity.nominal
        found.append(
            Forecast(
                name=quantity.name,
                kind=quantity.kind,
                unit=scene.unit_of(quantity),
                value_image=float(known.value[m]),
                value_object=float(known.value_object[m]),
                variance_image=float(evaluated.variances[m]),
                variance_object=float(evaluated.variances_object[m]),
                bias_image=float(biases[0][m]),
                bias_object=float(biases[1][m]),
                nominal=float(nominal),
                tolerance=quantity.tolerance,
                status=WORST_FIRST[ranks[m]],
                texture_variance_image=None if textures is None else float(textures[0][m]),
                texture_variance_object=None if textures is None else float(textures[1][m]),
                reason=reason(evaluated, clutter, float(biases[0][m]), m, WORST_FIRST[ranks[m]]),
            )
        )
    return tuple(found)


def worst(forecasts: tuple[Forecast, ...]) -> str:
    """The most serious of several statuses."""
    return min((each.status for each in forecasts), key=WORST_FIRST.index)


def mildest(states: Iterable[str]) -> str:
    """The least serious of several statuses.

    >>> mildest(["not_visible", "clutter"])
    'clutter'
    """
    return max(states, key=WORST_FIRST.index)
