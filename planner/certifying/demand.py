"""What is asked of a station, U of each measurand within a part of its tolerance, and whether poses keep it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.features.measurand import measurands
from imaging.models import variance_model
from imaging.models.bias import MOST
from imaging.pictures import Pictures
from planner.budgeting.terms import stated
from planner.certifying.certificate import has_terms
from planner.certifying.inputs import InputTerms
from planner.ranks import quantity_ranks
from planner.uncertainty.budget import coverage_factor
from scenes import InvalidInput, Picture, Scene
from scenes.status import WORST_FIRST, is_trusted

_MODEL = 1 + MOST**2 / 3  # of the variance by noise: with it that of the largest bias of what is `ok`
_ROUNDING = 1e-7  # relative, of U^2: what a budget's central differences lose


@dataclass(frozen=True, eq=False)
class Demand:
    """U of all M measurands that a station may have, and what makes it.

    U^2 = k^2 (variance by noise, with the largest bias of what is `ok` + variance by inputs + what is the same of all
    poses), as `planner.budget` has it of an estimator with the ``calibrated`` model's variance, that of the gradient
    locator; what `measure.best_estimator` takes in such scenes scatters less. k is Student's factor at the least
    degrees of freedom of any input, which the effective ones are never below.

    Attributes
    ----------
    scene : Scene
    limits : ndarray, shape (M,)
        Largest U, the scene's unit.
    inputs : InputTerms
    steady : ndarray, shape (M,)
        Variances by rounding and temperature, the scene's unit squared.
    k : float
    """

    scene: Scene
    limits: np.ndarray
    inputs: InputTerms
    steady: np.ndarray
    k: float

    @classmethod
    def of(cls, picture: Picture, limits: np.ndarray, p: float) -> Demand:
        """Of a picture's scene.

        Raises
        ------
        InvalidInput
            If there are no bounds of such a scene.
        """
        scene = picture.scene
        _check(scene)
        inputs, values = InputTerms.of_scene(scene), measurands(Pictures.of(picture)).value_object
        rows = [stated(scene, scene.unit_of(quantity), value)
                for quantity, value in zip(scene.quantities, map(float, values), strict=True)]  # fmt: skip
        each = [[row.sensitivity**2 * row.told.u**2 for row in some] for some in rows]
        dof = [row.as_input.dof for some in rows for row in some if row.told.u > 0]
        k = coverage_factor(p, min([inputs.least_dof, *dof]))
        return cls(scene, limits, inputs, np.array([sum(some) for some in each]), k)

    def u2(self, noise: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """U^2 over its limit's square, (..., M), of variances by noise and by inputs: 1 is as much as may be."""
        return self.k**2 * (_MODEL * noise + inputs + self.steady) / self.limits**2

    def is_kept(self, u2: np.ndarray) -> np.ndarray:
        """Whether all is certainly within its limit, bool (...)."""
        return (u2 <= 1 - _ROUNDING).all(-1)

    def at(self, sensors: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`u2` at poses (n, 2), (n, 2), degrees, and the statuses there as indices in `WORST_FIRST`, (n, M) each.

        Whether neighbours bias a classic locator is not asked: the estimators of such scenes know them.
        """
        pictures = Pictures.of(self.scene, sensors, lights)
        evaluated = variance_model("calibrated")(pictures)
        polar, azimuth = (np.radians(np.repeat(sensors[:, k : k + 1], 2, 1)) for k in (0, 1))
        u2 = self.u2(evaluated.variances_object, self.inputs.of(polar, azimuth)[0])
        return u2, quantity_ranks(evaluated, np.zeros(evaluated.contrast.shape[-1], bool))

    def is_met(self, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Whether poses (n, 2), (n, 2), degrees, keep it and are to be trusted, bool (n,)."""
        u2, ranks = self.at(sensors, lights)
        return self.is_kept(u2) & is_trusted(np.array(WORST_FIRST)[ranks]).all(-1)


def _check(scene: Scene) -> None:
    if not has_terms(scene):
        raise InvalidInput(
            "scene must be of one matt convex part, distances of corners, one free point of light and a perspective "
            f"lens without distortion for a box, got {scene.name}"
        )
    if scene.uncertainty.fixed_pattern and (scene.noise.prnu > 0 or scene.noise.dsnu > 0):
        raise InvalidInput(
            "uncertainty.fixed_pattern must be false for a box where noise.prnu or noise.dsnu is above 0, got true"
        )
