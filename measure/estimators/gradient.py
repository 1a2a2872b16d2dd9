"""Edge points at the zero crossing of the Gaussian second derivative across the edge."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy import sparse

from measure.estimators.crossing import CrossingLocator, in_rows, reached
from measure.estimators.kinds import EstimatorKind
from measure.estimators.separate import SeparateEstimator, by_points, calipers_for, thinned
from measure.estimators.windows import places_across, second_derivatives, slope_to_contrast
from measure.features.calipers import Caliper
from measure.features.layout import Layout
from measure.features.optics import Optics


def gradient_locator(optics: Optics, caliper: Caliper) -> CrossingLocator:
    """Prepare the locator of a straight edge."""
    places, normals, gain = caliper.curve()
    return gradient_along(optics, caliper.positions, places, normals, gain, caliper.blur(caliper.positions))


def gradient_along(
    optics: Optics, positions: np.ndarray, places: np.ndarray, normals: np.ndarray,
    gain: np.ndarray | float = 1.0, blur: np.ndarray | float | None = None, signs: np.ndarray | None = None,
) -> CrossingLocator:  # fmt: skip
    """Prepare the locator of a recorded curve given by places (m, 2) on it and unit normals (m, 2) there.

    ``gain`` (m,) and ``blur`` (m,) are 1 and the optics' where not given; ``signs`` as in `CrossingLocator`.
    """
    offsets, across, toward = places_across(places, normals, optics.window_px)
    pixels, kernel = reached(second_derivative(across, toward, optics.scale_px, optics.shape))
    blur = optics.blur_at(places) if blur is None else blur
    per_slope, one = slope_to_contrast(optics.scale_px, blur), np.ones(len(places))
    nothing = np.zeros((len(places), 0)), np.zeros((0, pixels.size))
    return CrossingLocator(
        positions, offsets, pixels, kernel, per_slope * one, gain * one, *nothing, signs, optics=optics, places=places,
        normals=normals,
    )  # fmt: skip


def second_derivative(
    places: np.ndarray, normals: np.ndarray, scale: float, shape: tuple[int, int]
) -> sparse.csr_array:
    """Rows that take the Gaussian second derivative of an image at places (M, 2) along unit normals (M, 2), px."""
    return in_rows(*second_derivatives(places, normals, scale), shape)


def _prepared(layout: Layout, threshold: float) -> SeparateEstimator:
    optics = layout.optics
    calipers = tuple(thinned(caliper, optics.scale_px) for caliper in calipers_for(layout, 4))
    return SeparateEstimator(calipers, by_points(optics, calipers, partial(gradient_locator, optics)))


GRADIENT = EstimatorKind(_prepared, capture_px=1.5, exact_px=0.006, bias_predicted=True, local=True, separate=True)
