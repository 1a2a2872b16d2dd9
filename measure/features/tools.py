"""What measures a circle or a curved surface from places around it: a locator there, and the least squares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from measure.estimators.crossing import CrossingLocator
from measure.features.optics import Optics
from measure.features.rim_fit import RimFit


@dataclass(frozen=True, eq=False, kw_only=True)
class RimTool(RimFit):
    """What measures a circle or a curved surface from one expected place.

    Attributes
    ----------
    locator : CrossingLocator
    places : ndarray, shape (m, 2)
        In the recorded image, px.
    clear : ndarray of bool, shape (m,), optional
        Which of them count by half at least, so that each by itself tells where the rim is; all where it is None.
    """

    locator: CrossingLocator
    places: np.ndarray
    clear: np.ndarray | None = None

    @property
    def surest(self) -> np.ndarray:
        """Numbers of the places that are clear."""
        return np.arange(len(self.weights)) if self.clear is None else np.flatnonzero(self.clear)

    @cached_property
    def response(self) -> sparse.csr_array:
        """Derivative of the offsets by the locator's pixels at unit contrast, (m, P)."""
        return self.locator.unit_response()


def held(places: np.ndarray, optics: Optics) -> np.ndarray:
    """Places, those outside the image held at its border: they are not taken, but a kernel needs pixels."""
    margin = optics.window_px + 4 * optics.scale_px + 1
    return np.clip(np.nan_to_num(places), margin, np.maximum(np.array(optics.shape[::-1]) - 1 - margin, margin))
