"""What measures a circle or a curved surface from places around it: three numbers or four, by least squares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from measure.estimators.crossing import CrossingLocator
from measure.features.optics import Optics


@dataclass(frozen=True, eq=False)
class RimTool:
    """What measures a circle or a curved surface from one expected place.

    Attributes
    ----------
    locator : CrossingLocator
    design : ndarray, shape (m, p)
        Derivative of each place's offset by its p parameters, ideal px for the scene's unit.
    weights : ndarray, shape (m,)
        Of the places in the least squares: the length that each stands for, and where the light is known the squared
        contrast over the noise's variance; 0 where it is not taken.
    inward : ndarray, shape (m,)
        How far inside the rim or limb the zero crossing lies, for it is curved and its sides are uneven, ideal px.
    state : str
        ``ok``, ``clutter``, ``low_contrast`` or ``not_visible``, as far as is known before an image.
    optics : Optics
    """

    locator: CrossingLocator
    design: np.ndarray
    weights: np.ndarray
    inward: np.ndarray
    state: str
    optics: Optics

    @cached_property
    def response(self):
        """Derivative of the offsets by the locator's pixels at unit contrast, (m, P)."""
        return self.locator.unit_response()

    def fit(self, valid: np.ndarray) -> np.ndarray:
        """Least-squares maps (n, p, m) from offsets at the valid places (n, m) to the parameters."""
        weights = self.weights * valid
        gram = np.einsum("nm,mi,mj->nij", weights, self.design, self.design)
        scale = np.sqrt(np.einsum("nii->ni", gram))
        good = (scale > 0).all(-1)
        scale[~good], gram[~good] = 1.0, np.eye(self.design.shape[1])
        unit = gram / (scale[:, :, None] * scale[:, None, :])
        good &= np.linalg.eigvalsh(unit)[:, 0] > 1e-8
        unit[~good] = np.eye(self.design.shape[1])
        found = np.linalg.inv(unit) / (scale[:, :, None] * scale[:, None, :])
        found = np.einsum("nij,mj,nm->nim", found, self.design, weights)
        found[~good] = np.nan
        return found


def held(places: np.ndarray, optics: Optics) -> np.ndarray:
    """Places, those outside the image held at its border: they are not taken, but a kernel needs pixels."""
    margin = optics.window_px + 4 * optics.scale_px + 1
    return np.clip(np.nan_to_num(places), margin, np.maximum(np.array(optics.shape[::-1]) - 1 - margin, margin))
