"""The sharpest prediction: the locator's linear response on the noise-free image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from measure import status
from measure.corners import corner_response
from measure.distance import distance, prepare
from measure.lines import regression
from scenes import Scene


@dataclass(frozen=True)
class Propagated:
    """Predicted errors of one setting.

    Attributes
    ----------
    value_px : float
        Distance measured in the noise-free image, px.
    variance_px2 : float
        Variance of the distance, px^2; infinite where `status` says it cannot be measured.
    covariance : ndarray, shape (4, 4)
        Joint covariance of start (x, y) and end (x, y), px^2.
    response : ndarray, shape (height, width)
        Derivative of the distance by each pixel, px per grey level.
    status : str
    """

    value_px: float
    variance_px2: float
    covariance: np.ndarray
    response: np.ndarray
    status: str


def propagate(
    clean: np.ndarray,
    scene: Scene,
    sensor: Any,
    light: Any = None,
    locator: str = "gradient",
    threshold: float | None = None,
) -> Propagated:
    """Propagate pixel noise through edge points, lines and corners to the distance.

    On the noise-free image the offset of each edge point is linear in small noise, and so is all that follows. With g
    the derivative of the distance by the pixels, its variance is the sum of g^2 times each pixel's noise variance;
    neighbouring points share pixels, and so their correlation is in g.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
        Noise-free image, grey levels, not yet cut off at the end of the sensor's scale.
    scene, sensor, light, locator, threshold
        As for `measure.distance`.
    """
    noise = scene.noise.variance_at(clean).ravel()  # of each pixel: shot noise grows with light, saturation ends it
    clean = scene.noise.mean_at(clean)
    found = distance(clean, scene, sensor, light, locator, threshold)
    if str(found.status) not in status.MEASURED:
        shape = np.full((4, 4), np.inf), np.zeros(clean.shape)
        return Propagated(float("nan"), float("inf"), *shape, str(found.status))
    edges = prepare(scene, scene.check_pose("sensor", sensor), locator, threshold)
    responses, alongs = zip(*(_line_response(edge[1], clean) for edge in edges), strict=True)
    corners = [
        corner_response((edges[k][0], edges[k + 1][0]), np.array(alongs[k : k + 2]), found.corners[k // 2])
        @ np.vstack(responses[k : k + 2])
        for k in (0, 2)
    ]
    ends = np.vstack(corners)
    unit = (found.corners[1] - found.corners[0]) / float(found.value_px)
    g = np.concatenate([-unit, unit]) @ ends
    return Propagated(
        float(found.value_px),
        float(noise @ (g * g)),
        (noise * ends) @ ends.T,
        g.reshape(clean.shape),
        str(found.status),
    )


def _line_response(locator, clean: np.ndarray) -> tuple[np.ndarray, float]:
    """Derivative of (mean offset, slope) by the pixels, (2, pixels), and the points' mean place along the edge."""
    points, response = locator.linear_response(clean)
    keep = points.valid[0]
    along = points.along[0][: response.shape[0]][keep[: response.shape[0]]]
    response = sparse.csr_array(response)[np.flatnonzero(keep[: response.shape[0]])]
    return (response.T @ regression(along).T).T, float(along.mean())
