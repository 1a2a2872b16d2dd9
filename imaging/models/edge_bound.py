"""The Cramer-Rao bound of each edge by itself, in closed form: used where the whole picture is not modelled."""

from __future__ import annotations

import numpy as np

from imaging.features.circles import fisher_circle
from imaging.features.locator import information_bound
from imaging.models.along import Along, integral
from imaging.models.errors import Errors, combined
from imaging.pictures import Pictures


def edge_bound(pictures: Pictures) -> Errors:
    """Information C^2 / (2 sqrt(pi) s_e s_n^2) per recorded px of each whole visible edge about its offset and tilt.

    s_n^2 is the mean of both sides' noise, which differs from the truth by second order in their difference.
    """
    along = Along.of(pictures, trimmed=False)
    nodes = along.nodes
    with np.errstate(divide="ignore", invalid="ignore"):
        density = information_bound(np.sqrt(along.squared), along.noise_variance, nodes.blur)
        density = density * nodes.along / np.square(nodes.across)
        total, first, second = (integral(density * nodes.t**power, nodes.length) for power in (0, 1, 2))
        mean = first / total

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        lever = b - a * (nodes.middle[..., 0] + mean)
        return a**2 / total + lever**2 / (second - first * mean)

    def found(circle) -> np.ndarray:
        density = information_bound(np.sqrt(circle.squared), circle.noise_variance, circle.blur)
        return fisher_circle(circle, density * circle.arc, None)

    noise = np.mean(along.noise_variance * np.ones(1), -1)
    return combined(pictures, line_variance, along.squared.mean(-1), noise, found, cut_off=along.cut_off)
