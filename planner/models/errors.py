"""What every variance model answers: the errors of lines and centres, and of the measurand that depends on them.

A model finds how well the line of every edge is known, as a function V(A, B): the variance of A d + B theta, d the
line's displacement at the edge's first end (px) and theta its rotation (rad). `features.measurand` knows A and B.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.features.circles import Rim, rim
from planner.features.measurand import Measurand, measurand
from planner.imaging.pictures import Pictures
from scenes import Centre

LineVariance = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Errors:
    """Predicted errors for pictures of leading shape (...).

    Attributes
    ----------
    measurand : Measurand
        What is measured; its arrays have the sensors' leading shape.
    variance, variance_object : ndarray, shape (...)
        In the image (px^2, or degrees^2 of an angle) and in the object (cm^2, or degrees^2); infinite where it
        cannot be measured.
    line_variance : callable
        (A, B) of shape (..., E) to the variance of A d + B theta of each line, px^2.
    contrast : ndarray, shape (..., E)
        Root mean square contrast along each straight edge, grey levels.
    noise_variance : ndarray, shape (..., E)
        Mean variance of the noise along each straight edge, grey levels^2.
    centres : tuple of ndarray, shape (..., 2, 2)
        Covariance of each circle's centre, px^2, in the order of the task's features; infinite diagonal where it
        cannot be found.
    """

    measurand: Measurand
    variance: np.ndarray
    variance_object: np.ndarray
    line_variance: LineVariance
    contrast: np.ndarray
    noise_variance: np.ndarray
    centres: tuple[np.ndarray, ...]


def combined(
    pictures: Pictures,
    line_variance: LineVariance,
    contrast2: np.ndarray,
    noise_variance: np.ndarray | float,
    centre_covariance: Callable[[Rim], np.ndarray],
    *,
    fall_off: bool = True,
) -> Errors:
    """From the lines' and the centres' errors to the measurand's."""
    known = measurand(pictures)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        parts = line_variance(known.offset, known.tilt)
        usable = known.view.visible & np.isfinite(parts)
        variance = np.where(usable, parts, np.inf).sum(-1)
        centres = []
        for feature in pictures.scene.task.corners:
            if isinstance(feature, Centre):
                circle = rim(pictures, pictures.scene.solid.circle(feature.circle), fall_off=fall_off)
                covariance = centre_covariance(circle)
                moved = np.einsum("...i,...ij,...j->...", known.pull, covariance, known.pull)
                variance = variance + np.where(np.isfinite(moved), moved, np.inf)
                centres.append(covariance)
        variance = np.where(np.isfinite(variance) & np.isfinite(known.value), variance, np.inf)
        in_object = variance / known.scale**2
    in_object = np.where(np.isfinite(in_object), in_object, np.inf)
    noise = np.broadcast_to(noise_variance, contrast2.shape)
    return Errors(known, variance, in_object, line_variance, np.sqrt(contrast2), noise, tuple(centres))
